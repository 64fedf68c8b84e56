//! `cslam record` and `cslam replay` as a user meets them.

mod common;

use std::fs;
use std::path::Path;

use common::cslam;

fn record(directory: &Path, out: &str, extra: &[&str]) {
    let args = [
        "record",
        "--scene",
        "street",
        "--duration",
        "3",
        "--seed",
        "5",
        "--out",
        out,
    ];
    let output = cslam(directory, &[&args[..], extra].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// Names and contents of a directory, in order.
fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(directory)
        .expect("a directory")
        .map(|entry| entry.expect("an entry").path())
        .map(|file| {
            let name = file.file_name().expect("a name").to_string_lossy().into_owned();
            (name, fs::read(&file).expect("readable"))
        })
        .collect();
    files.sort();
    files
}

#[test]
fn a_recorded_flight_is_the_same_again_and_replays_to_the_same_bytes() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    record(at, "a", &[]);
    record(at, "b", &[]);
    let recorded = files(&at.join("a"));
    assert!(recorded == files(&at.join("b")), "the seed decides every byte");

    let output = cslam(at, &["replay", "a", "--out", "c", "--json"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let counts: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        (counts["sweeps"].as_u64(), counts["beam_blocks"].as_u64()),
        (Some(6), Some(6 * 72))
    );
    assert_eq!(counts["squint_blocks"], 6 * 33);
    assert_eq!(counts["pilot_blocks"], 6 * 24);
    let imu = counts["imu_samples"].as_u64().expect("a number");
    assert!((2990..=3001).contains(&imu), "{imu}");

    let without_truth: Vec<_> = recorded
        .into_iter()
        .filter(|(name, _)| !name.starts_with("truth"))
        .collect();
    assert!(
        without_truth == files(&at.join("c")),
        "a replay is what was recorded"
    );
}

#[test]
fn what_the_receiver_is_given_holds_no_truth() {
    let directory = tempfile::tempdir().expect("a directory");
    record(directory.path(), "a", &[]);
    let meta = fs::read_to_string(directory.path().join("a/sweep-0000.sigmf-meta")).expect("written");
    assert!(
        !meta.contains("uav_position") && !meta.contains("quaternion"),
        "{meta}"
    );
    // A replay does not need the truth.
    for name in ["truth.csv", "truth_paths.jsonl"] {
        fs::remove_file(directory.path().join("a").join(name)).expect("written");
    }
    assert!(cslam(directory.path(), &["replay", "a"]).status.success());
}

#[test]
fn damaged_recordings_are_refused_with_the_reason() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    record(at, "good", &[]);
    let cut = |name: &str| {
        let file = at.join("bad").join(name);
        let bytes = fs::read(&file).expect("written");
        fs::write(&file, &bytes[..bytes.len() / 2]).expect("writable");
    };
    for name in [
        "imu.bin",
        "timing.csv",
        "beacons.jsonl",
        "flight.json",
        "sweep-0003.sigmf-data",
        "sweep-0001.sigmf-meta",
        "pilots-0002.sigmf-data",
    ] {
        let _ = fs::remove_dir_all(at.join("bad"));
        fs::create_dir(at.join("bad")).expect("writable");
        for (file, bytes) in files(&at.join("good")) {
            fs::write(at.join("bad").join(file), bytes).expect("writable");
        }
        cut(name);
        let output = cslam(at, &["replay", "bad"]);
        let stderr = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{name}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{name}: {stderr}");
        assert!(stderr.contains(name), "{name}: {stderr}");
    }
}

#[test]
fn without_samples_a_recording_is_small() {
    let directory = tempfile::tempdir().expect("a directory");
    record(directory.path(), "a", &["--no-samples"]);
    assert!(
        files(&directory.path().join("a"))
            .iter()
            .all(|(name, _)| !name.contains("sigmf"))
    );
    let output = cslam(directory.path(), &["replay", "a", "--json"]);
    let counts: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        (counts["sweeps"].as_u64(), counts["beam_blocks"].as_u64()),
        (Some(6), Some(0))
    );
}
