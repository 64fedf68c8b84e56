//! `cslam fly --smooth` as a user meets it: the best trajectory after a flight, beside the flight on board.

mod common;

use std::fs;
use std::path::Path;

use common::{good, refused, report, same};
use serde_json::Value;

const FILES: [&str; 3] = [
    "map_smoothed.ply",
    "points_smoothed.ply",
    "trajectory_smoothed.tum",
];

/// Times and places of a trajectory.
fn trajectory(file: &Path) -> Vec<[f64; 4]> {
    let text = fs::read_to_string(file).expect("written");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let mut numbers = line.split(' ').map(|number| number.parse().expect("a number"));
            std::array::from_fn(|_| numbers.next().expect("four and more"))
        })
        .collect()
}

fn number(report: &Value, keys: [&str; 2]) -> f64 {
    report[keys[0]][keys[1]]
        .as_f64()
        .unwrap_or_else(|| panic!("no {keys:?}"))
}

#[test]
fn a_smoothed_flight_is_nearer_to_the_truth_and_on_board_nothing_changes() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let fly = [
        "fly", "--world", "budget", "--scene", "outdoor", "--seed", "1", "--steps", "100",
    ];
    good(
        at,
        &[&fly[..], &["--keep-paths", "kept", "--out", "flown"]].concat(),
    );
    good(at, &["fly", "--recording", "kept", "--out", "plain"]);
    let again = ["fly", "--recording", "kept", "--out", "smoothed", "--smooth"];
    good(at, &again);
    // The receiver that is listened to is the same to the last byte.
    same(&at.join("plain"), &at.join("smoothed"), "smoothed");
    let [plain, both] = ["plain", "smoothed"].map(|out| report(&at.join(out)));
    assert_eq!(plain["trajectory"], both["trajectory"]);
    assert_eq!(plain["map"], both["map"]);
    same(&at.join("flown"), &at.join("smoothed"), "from samples");
    assert!(plain["smoothed"].is_null());
    for name in FILES {
        assert!(
            !at.join("plain").join(name).exists() && at.join("smoothed").join(name).exists(),
            "{name}"
        );
    }
    let smoothed = &both["smoothed"];
    for (keys, share) in [
        (["trajectory", "position_rmse_m"], 0.7),
        (["trajectory", "attitude_rmse_deg"], 0.8),
        (["trajectory", "velocity_rmse_m_per_s"], 0.8),
        (["clock", "rmse_ns"], 0.8),
    ] {
        let (on_board, after) = (number(&both, keys), number(smoothed, keys));
        println!("{keys:?}: {on_board} on board, {after} smoothed");
        assert!(after < share * on_board, "{keys:?}: {after} after {on_board}");
    }
    for of in ["position_nees", "velocity_nees", "attitude_nees", "clock_nees"] {
        let nees = number(smoothed, ["consistency", of]);
        println!("{of} {nees}");
        assert!((0.05..3.0).contains(&nees), "{of}: {nees}");
    }
    let map = &smoothed["map"];
    assert!(number(smoothed, ["map", "accepted"]) > 0.5 * number(&both, ["map", "accepted"]));
    assert!(map["surface_rmse_m"].as_f64() < Some(0.1), "{map}");
    // The same poses, and the last one as it was: nothing came after it.
    let [on_board, after] =
        ["trajectory.tum", "trajectory_smoothed.tum"].map(|name| trajectory(&at.join("smoothed").join(name)));
    let times = |poses: &[[f64; 4]]| poses.iter().map(|pose| pose[0]).collect::<Vec<_>>();
    assert_eq!(times(&on_board), times(&after));
    assert_eq!(on_board.last(), after.last());
    let middle = on_board.len() / 2;
    assert_ne!(on_board[middle], after[middle]);
    // A flight without it replaces what it left.
    good(at, &["fly", "--recording", "kept", "--out", "smoothed"]);
    assert!(FILES.iter().all(|name| !at.join("smoothed").join(name).exists()));
}

#[test]
fn what_has_no_filter_is_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let fly = ["fly", "--steps", "2", "--smooth", "--localization", "baseline"];
    let said = refused(directory.path(), &fly);
    assert!(said.contains("--smooth") && said.contains("filter"), "{said}");
}
