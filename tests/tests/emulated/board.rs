//! Builds the image, runs it in QEMU, feeds it, and collects what comes back.

use std::fs::{self, File};
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cslam_tests::{emulated_board, root};
use tempfile::TempDir;

use crate::ring_file::RingFile;

/// Longest run, however busy the machine is. An idle one takes under a second.
pub(crate) const PATIENCE: Duration = Duration::from_secs(300);

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// By itself, with this code.
    Code(i32),
    /// It was ended.
    TimedOut,
}

/// What a run left behind.
pub(crate) struct Run {
    pub(crate) exit: Exit,
    /// Decoded log, and what the emulator itself had to say.
    pub(crate) log: String,
    pub(crate) uart1: Vec<u8>,
}

/// A running board. Dropping it ends it.
pub(crate) struct Board {
    child: Child,
    started: Instant,
    patience: Duration,
    folder: TempDir,
}

impl Board {
    /// Starts an image with arguments for its program, for so long at most; `prepare` makes its PSRAM what it is before it runs.
    pub(crate) fn start(
        image: &str,
        patience: Duration,
        arguments: &[&str],
        prepare: impl FnOnce(&RingFile),
    ) -> Self {
        let image = build(image);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let psram = folder.path().join("psram");
        prepare(&RingFile::make(&psram));
        let log = File::create(folder.path().join("log")).expect("a log file");
        let child = Command::new(runner())
            .arg("mps2-an500")
            .arg(image)
            .args(arguments)
            .current_dir(folder.path())
            .env("CSLAM_RING_FILE", &psram)
            .env("CSLAM_UART1_FILE", folder.path().join("uart1"))
            .env("CSLAM_TIMEOUT_S", patience.as_secs().to_string())
            .stdin(Stdio::null())
            .stdout(log.try_clone().expect("a second handle"))
            .stderr(log)
            // A group of its own, so that emulator and decoder can be ended together, and nothing else with them.
            .process_group(0)
            .spawn()
            .expect("the runner script starts");
        Self {
            child,
            started: Instant::now(),
            patience,
            folder,
        }
    }

    /// Waits for the end of the run.
    pub(crate) fn wait(mut self) -> Run {
        // The script keeps the limit; this one is for the script.
        let limit = self.patience + PATIENCE;
        let exit = loop {
            if let Some(status) = self.child.try_wait().expect("a child of ours") {
                break match status.code() {
                    Some(124) | None => Exit::TimedOut,
                    Some(code) => Exit::Code(code),
                };
            }
            if self.started.elapsed() > limit {
                self.end();
                break Exit::TimedOut;
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let log = self.log();
        if exit == Exit::Code(127) {
            panic!("{}", log.trim());
        }
        let uart1 = fs::read(self.folder.path().join("uart1")).unwrap_or_default();
        Run { exit, log, uart1 }
    }

    /// Process group of the script, the emulator and the decoder.
    pub(crate) fn group(&self) -> u32 {
        self.child.id()
    }

    /// Waits until the emulator has made the file for UART1.
    pub(crate) fn wait_for_emulator(&self) {
        let uart1 = self.folder.path().join("uart1");
        while !uart1.exists() {
            assert!(
                self.started.elapsed() < self.patience,
                "no emulator: {}",
                self.log()
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn log(&self) -> String {
        let bytes = fs::read(self.folder.path().join("log")).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Ends emulator and decoder, if they still run.
    fn end(&mut self) {
        // The child is ours and not yet waited for, so the number of its group is no one else's.
        if let Ok(None) = self.child.try_wait() {
            let kill = format!("kill -KILL -- -{}", self.child.id());
            let _ = Command::new("bash").args(["-c", &kill]).status();
            let _ = self.child.wait();
            // The others of the group are not ours to wait for; they are gone when init has done so.
            let asked = Instant::now();
            while runs(self.child.id()) && asked.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_millis(5));
            }
        }
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.end();
    }
}

/// Whether any process of a group is left, apart from dead ones that nobody has waited for.
pub(crate) fn runs(group: u32) -> bool {
    let processes = fs::read_dir("/proc").expect("a Linux host").flatten();
    processes
        .filter_map(|process| fs::read_to_string(process.path().join("stat")).ok())
        .any(|stat| {
            // pid (name) state parent group ...; the name may hold anything.
            let mut words = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
            let state = words.next();
            words.nth(1) == Some(&group.to_string()) && !matches!(state, Some("Z" | "X"))
        })
}

/// The script that runs an image.
pub(crate) fn runner() -> PathBuf {
    root().join("checks/tools/qemu-run.sh")
}

/// Builds an image for the board: cargo decides whether there is anything to do, so it is never stale.
pub(crate) fn build(name: &str) -> PathBuf {
    let output = emulated_board("build", name)
        .args(["--message-format", "json-render-diagnostics"])
        .stderr(Stdio::inherit())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "the image for the board does not build");
    let text = String::from_utf8(output.stdout).expect("cargo writes UTF-8");
    let messages = text
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let executable = messages
        .filter_map(|message| message["executable"].as_str().map(PathBuf::from))
        .next_back();
    executable.expect("cargo names the executable")
}
