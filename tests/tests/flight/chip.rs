//! The flight on the emulated chip.

use std::sync::OnceLock;

use cslam_tests::emulated_board;

/// What a run left.
pub(crate) struct Flown {
    /// A line a sweep.
    pub(crate) lines: String,
    /// Counts, and whatever else was said.
    pub(crate) log: String,
}

/// Flies the recording with so many states: one run for all tests.
pub(crate) fn flown(states: usize) -> &'static Flown {
    static RUNS: [OnceLock<Flown>; 2] = [OnceLock::new(), OnceLock::new()];
    RUNS[usize::from(states == 58)].get_or_init(|| fly(states))
}

fn fly(states: usize) -> Flown {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (recording, lines) = (folder.path().join("recording"), folder.path().join("lines"));
    std::fs::write(&recording, super::recording()).expect("writable");
    let output = emulated_board("run", "checks-an500")
        .args(["--", "flight", &states.to_string()])
        .args([&recording, &lines])
        .env("CSLAM_ICOUNT", "10")
        .output()
        .expect("cargo starts");
    let log = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(
        output.status.success(),
        "the run ended with {}:\n{log}",
        output.status
    );
    Flown {
        lines: std::fs::read_to_string(&lines).expect("lines"),
        log,
    }
}
