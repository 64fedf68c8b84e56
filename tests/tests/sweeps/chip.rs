//! Runs of the emulated chip over recordings.

use std::fs;

use cslam_tests::{emulated_board, printed};

use crate::recordings::Recording;

/// What a run left behind.
pub(crate) struct Run {
    /// What the estimator made of the recording.
    pub(crate) lines: String,
    /// What the board printed: instructions by sweep and stage, when they were counted.
    pub(crate) log: String,
}

/// Runs a recording through the estimator of a mode; `icount` as the runner's `CSLAM_ICOUNT`.
pub(crate) fn run(mode: &str, recording: &Recording, icount: Option<&str>) -> Run {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [samples, lines] = ["samples", "lines"].map(|name| folder.path().join(name));
    fs::write(&samples, &recording.bytes).expect("a file");
    let mut command = emulated_board("run", "sweeps-an500");
    command.args(["--", mode]).args([&samples, &lines]);
    match icount {
        Some(icount) => command.env("CSLAM_ICOUNT", icount),
        None => command.env_remove("CSLAM_ICOUNT"),
    };
    let log = printed(&mut command);
    Run {
        lines: fs::read_to_string(&lines).expect("the chip's lines"),
        log,
    }
}
