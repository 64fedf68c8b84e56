//! Another program writes a recorded flight from docs/formats.md alone, and it flies: the receiver finds the world that the program
//! made up.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Sweeps, beams and beam squint symbols that the script writes.
const SWEEPS: u64 = 40;
const BEAMS: u64 = 72;
const SYMBOLS: u64 = 33;

/// What the health packet counts that must not happen to what was written well.
const FAULTS: [&str; 13] = [
    "beacons_refused",
    "blocks_damaged",
    "blocks_late",
    "blocks_lost",
    "blocks_overrun",
    "blocks_repeated",
    "clock_steps",
    "contrary",
    "imu_damaged",
    "imu_lost",
    "invalid",
    "starts_refused",
    "timing_refused",
];

/// A number of a report, or of an object in it.
fn number(of: &Value, key: &str) -> f64 {
    of[key].as_f64().unwrap_or_else(|| panic!("no {key} in {of}"))
}

fn cslam(at: &Path, arguments: &[&str]) -> String {
    cslam_tests::printed(cslam_tests::cslam().current_dir(at).args(arguments))
}

#[test]
fn a_flight_written_in_python_from_the_page_alone_is_flown() {
    let directory = tempfile::tempdir().expect("a directory");
    let (at, root) = (directory.path(), cslam_tests::root());
    let mut python = Command::new(root.join("target/verify-python/bin/python"));
    let script = root.join("tests/tools/write_recording.py");
    cslam_tests::printed(python.current_dir(at).arg(script).arg("recorded"));

    let counts: Value = serde_json::from_str(&cslam(at, &["replay", "recorded", "--json"])).expect("JSON");
    assert_eq!(counts["sweeps"], SWEEPS, "{counts}");
    assert_eq!(counts["beam_blocks"], SWEEPS * BEAMS, "{counts}");
    assert_eq!(counts["squint_blocks"], SWEEPS * SYMBOLS, "{counts}");
    // The script's world is in no scene of ours, and was drawn by no seed of ours.
    assert!(counts["scene"].is_null() && counts["seed"].is_null(), "{counts}");

    let scene = ["--scene", "recorded/scene.json"];
    // This GMT stands still, which confirms no surface: every path is taken alone.
    let alone = ["--mapped", "first-order"];
    let fly = ["fly", "--recording", "recorded", "--out", "flown"];
    cslam(at, &[&fly[..], &scene, &alone].concat());
    let report = std::fs::read_to_string(at.join("flown/report.json")).expect("written");
    let report: Value = serde_json::from_str(&report).expect("JSON");

    assert_eq!((&report["scene"], &report["seed"]), (&scene[1].into(), &0.into()));
    assert_eq!(report["counters"], serde_json::json!({}), "something was damaged");
    let health = &report["health"];
    assert_eq!(health["blocks"], SWEEPS * (BEAMS + SYMBOLS), "{health}");
    for fault in FAULTS {
        assert_eq!(health[fault], 0, "{fault} in {health}");
    }

    let (trajectory, clock) = (&report["trajectory"], &report["clock"]);
    assert!(number(trajectory, "poses") > 150.0, "{trajectory}");
    assert!(number(trajectory, "position_p95_m") < 0.3, "{trajectory}");
    assert!(number(trajectory, "position_max_m") < 0.6, "{trajectory}");
    assert!(number(trajectory, "attitude_rmse_deg") < 0.5, "{trajectory}");
    assert!(number(clock, "rmse_ns") < 1.5, "{clock}");

    // The wall, where the script has it; of paths taken alone one in ten is of two reflections.
    let map = &report["map"];
    assert!(number(map, "points") >= 10.0, "{map}");
    assert!(number(map, "accepted_surface_rmse_m") < 0.1, "{map}");
    assert!(number(map, "precision") >= 0.9, "{map}");

    let link = &report["link_state"];
    assert_eq!(link["los_visible"], SWEEPS, "{link}");
    assert!(number(link, "los_used") > 15.0, "{link}");
    assert!(number(link, "accuracy") > 0.8, "{link}");
}
