//! A station ends cleanly whenever it is told to.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::process::ExitStatusExt;
use std::process::Stdio;

use rustix::process::Signal;

use crate::station::{TEST_KEY, cslam, signal};

/// Starts a recording station, sends SIGTERM once `ready` has seen what it wants of its output, and says how it ended.
fn terminated(folder: &str, after_output: bool) -> std::process::ExitStatus {
    let arguments = [&TEST_KEY[..], &["--http", "127.0.0.1:0", "--record", folder]].concat();
    let mut child = cslam(&arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    if after_output {
        let mut line = String::new();
        let stdout = child.stdout.take().expect("piped");
        BufReader::new(stdout).read_line(&mut line).expect("text");
        assert!(line.starts_with("http://"), "{line}");
    }
    signal(&child, Signal::TERM);
    child.wait().expect("it ends")
}

#[test]
fn a_signal_at_any_moment_is_a_clean_end() {
    for k in 0..40 {
        let directory = tempfile::tempdir().expect("a directory");
        let to = directory.path().join("flight");
        let after_output = k % 2 == 1;
        let status = terminated(&to.display().to_string(), after_output);
        if status.signal() == Some(15) {
            // Before its first instruction a process has the system's handler; then nothing has begun either.
            assert!(!after_output && !to.exists(), "run {k}: killed by the signal");
            continue;
        }
        assert_eq!(status.code(), Some(0), "run {k}");
        if to.exists() {
            let mcap = fs::read(to.join("ground.mcap")).expect("recorded");
            assert!(mcap::Summary::read(&mcap).expect("sound").is_some(), "run {k}");
            assert!(to.join("map.ply").exists(), "run {k}");
        }
        assert!(to.exists() || !after_output, "run {k}");
    }
}
