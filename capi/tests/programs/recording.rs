//! A recorded sweep, and what the command says of it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::{built, printed};

/// A recording of a traced link in a folder of its own.
pub(crate) struct Recorded {
    _folder: tempfile::TempDir,
    /// NAME.sigmf-meta.
    pub(crate) meta: PathBuf,
}

/// The command, as its users have it.
pub(crate) fn cslam() -> Command {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let program = BUILT.get_or_init(|| {
        // With the features that the Python package asks for: so nothing is built twice, see `RELEASE` of cslam-tests.
        let files = built(&[
            "--package=cslam-host-sim",
            "--package=cslam-python",
            "--bin=cslam",
        ]);
        let program = files.into_iter().find(|file| file.ends_with("cslam"));
        program.expect("cslam among what cargo built")
    });
    Command::new(program)
}

impl Recorded {
    /// Traces a link and lets the front end hear it.
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (links, name) = (folder.path().join("link.jsonl"), folder.path().join("sweep"));
        printed(
            cslam()
                .args([
                    "--quiet",
                    "trace",
                    "--scene=outdoor",
                    "--tx=0,0,1.5",
                    "--rx=56,2,6",
                    "--out",
                ])
                .arg(&links),
        );
        printed(
            cslam()
                .args(["--quiet", "synth", "--paths"])
                .arg(&links)
                .arg("--out")
                .arg(name),
        );
        let meta = folder.path().join("sweep.sigmf-meta");
        let text = std::fs::read_to_string(&meta).expect("metadata");
        let exponents: std::collections::BTreeSet<_> = text
            .lines()
            .filter(|line| line.contains("cslam:exponent"))
            .collect();
        assert!(
            exponents.len() > 3,
            "a recording whose beams have exponents of their own"
        );
        Self {
            _folder: folder,
            meta,
        }
    }

    /// What the command prints of its paths.
    pub(crate) fn by_the_command(&self) -> String {
        let lines = printed(cslam().args(["estimate", "--csv"]).arg(&self.meta));
        assert!(lines.lines().count() > 2, "{lines}");
        lines
    }

    pub(crate) fn meta(&self) -> &Path {
        &self.meta
    }
}
