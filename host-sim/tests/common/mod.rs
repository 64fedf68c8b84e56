//! `cslam` as a user runs it.
#![allow(dead_code, reason = "each test takes what it needs")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs the command in a directory.
pub(crate) fn cslam(directory: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .current_dir(directory)
        .args(args)
        .output()
        .expect("the binary runs")
}

/// What a command says that succeeds.
pub(crate) fn good(directory: &Path, args: &[&str]) -> String {
    let output = cslam(directory, args);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {said}");
    said
}

/// What a refused command says: one line.
pub(crate) fn refused(directory: &Path, args: &[&str]) -> String {
    let output = cslam(directory, args);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    said
}

/// The report in a directory of results.
pub(crate) fn report(directory: &Path) -> Value {
    serde_json::from_slice(&fs::read(directory.join("report.json")).expect("written")).expect("JSON")
}

/// What the receiver made of a flight, without any truth.
const ITS_OWN: [&str; 3] = ["packets.bin", "trajectory.tum", "map.ply"];

/// What the receiver made of a flight is the same to the last byte.
pub(crate) fn same(a: &Path, b: &Path, what: &str) {
    for name in ITS_OWN {
        let [a, b] = [a, b].map(|at| fs::read(at.join(name)).expect("written"));
        assert!(a == b, "{what}: {name} differs");
    }
}
