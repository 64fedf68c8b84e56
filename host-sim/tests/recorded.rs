//! `cslam fly --recording` as a user meets it: a recorded flight flies like the one that was recorded.

mod common;

use std::fs;

use common::{cslam, good, refused, report, same};

/// Records and flies `steps` sweeps of a scene in a world, and flies the recording.
fn direct_and_recorded(scene: &str, world: &str, steps: &str) {
    direct_and_recorded_with(scene, world, steps, "");
}

/// The same with a configuration.
fn direct_and_recorded_with(scene: &str, world: &str, steps: &str, config: &str) {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    fs::write(at.join("c.toml"), config).expect("written");
    let options = [
        "--scene", scene, "--seed", "3", "--steps", steps, "--world", world, "--config", "c.toml",
    ];
    good(at, &[&["record", "--out", "rec"][..], &options].concat());
    good(at, &[&["fly", "--out", "direct"][..], &options].concat());
    good(at, &["fly", "--recording", "rec", "--out", "flown"]);
    let what = format!("{scene}, {world}");
    same(&at.join("direct"), &at.join("flown"), &what);
    let [direct, flown] = ["direct", "flown"].map(|out| report(&at.join(out)));
    for key in [
        "mode", "scene", "world", "seed", "sweeps", "verdicts", "health", "map",
    ] {
        assert_eq!(direct[key], flown[key], "{what}: {key}");
    }
    assert_eq!(direct["world"], world);
    // A flight in which nothing happens would be the same too.
    let poses = direct["trajectory"]["poses"].as_u64();
    assert!(
        world == "real" || scene != "outdoor" || poses > Some(10),
        "{what}: no poses"
    );
    assert!(
        direct["measurements"].as_u64() > Some(10),
        "{what}: nothing was heard"
    );
}

#[test]
fn a_recorded_flight_of_the_ideal_world_flies_the_same() {
    for scene in ["outdoor", "street", "indoor", "city:1"] {
        direct_and_recorded(scene, "ideal", "16");
    }
}

#[test]
fn a_recorded_flight_of_the_budget_world_flies_the_same() {
    for scene in ["outdoor", "street", "indoor", "city:1"] {
        direct_and_recorded(scene, "budget", "16");
    }
}

#[test]
fn a_recorded_flight_of_the_real_world_flies_the_same() {
    for scene in ["outdoor", "street", "indoor", "city:1"] {
        direct_and_recorded(scene, "real", "12");
    }
}

#[test]
fn pilots_are_recorded_and_a_recording_without_them_loses_the_rates_alone() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    // Late in this flight the receiver has no line of sight that it takes: there it goes by how fast paths grow.
    let options = [
        "--scene", "street", "--seed", "4", "--steps", "32", "--world", "budget",
    ];
    good(at, &[&["record", "--out", "rec"][..], &options].concat());
    good(at, &[&["fly", "--out", "direct"][..], &options].concat());
    let fly = ["fly", "--recording", "rec", "--out"];
    let unread = ["unread", "--localization", "filter-no-range-rates"];
    good(at, &[&fly[..], &["flown"]].concat());
    good(at, &[&fly[..], &unread].concat());
    same(&at.join("direct"), &at.join("flown"), "with pilots");
    let made = |out: &str, name: &str| fs::read(at.join(out).join(name)).expect("written");
    let trajectory = "trajectory.tum";
    assert!(
        made("flown", trajectory) != made("unread", trajectory),
        "no rate tells anything in this flight"
    );
    // The same samples in a recording that says nothing of pilots.
    let file = at.join("rec").join("flight.json");
    let text = fs::read_to_string(&file).expect("recorded");
    assert_eq!(text.matches("\"pilots\": true,").count(), 1, "{text}");
    fs::write(&file, text.replace("\"pilots\": true,", "")).expect("writable");
    good(at, &[&fly[..], &["without"]].concat());
    for name in [trajectory, "map.ply"] {
        assert!(made("without", name) == made("unread", name), "{name} differs");
    }
    let blocks = |out: &str| report(&at.join(out))["health"]["blocks"].as_u64();
    let [with, without] = [blocks("flown"), blocks("without")].map(|count| count.expect("counted"));
    assert_eq!(with - without, 32 * 24);
}

#[test]
fn a_recorded_flight_through_a_moved_scene_flies_the_same_and_is_held_against_the_moved_walls() {
    let config = "[world.scene]\nplacement = { moved_m = [40.0, -90.0, 12.0], turned_deg = 65.0 }\n\
                  surfaces = { ground_relief_rms_m = 0.1 }\n";
    direct_and_recorded_with("outdoor", "budget", "16", config);
}

#[test]
fn a_barometer_is_recorded_and_changes_nothing_that_the_receiver_makes() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let barometer = "[world.sensors.barometer]\nrate_hz = 25\nnoise_m = 0.08\nweather_m = 0.4\n";
    fs::write(at.join("c.toml"), barometer).expect("written");
    // The default world has a barometer already.
    let options = [
        "--world", "budget", "--scene", "outdoor", "--seed", "3", "--steps", "16",
    ];
    good(at, &[&["fly", "--out", "without"][..], &options].concat());
    good(
        at,
        &[&["fly", "--out", "with", "--config", "c.toml"][..], &options].concat(),
    );
    same(&at.join("without"), &at.join("with"), "with a barometer");
    let record = ["record", "--no-samples", "--config", "c.toml", "--out", "rec"];
    good(at, &[&record[..], &options].concat());
    let text = fs::read_to_string(at.join("rec").join("barometer.csv")).expect("recorded");
    assert!(text.lines().count() > 150, "{}", text.lines().count());
}

#[test]
fn a_flight_whose_events_are_lost_doubled_and_late_flies_the_same_from_its_recording() {
    let config = "[[world.sensors.faults.transport]]\nevents = [\"sweep\"]\nlost = 0.1\ndoubled = 0.1\nlate = 0.2\n\
                  late_by_s = 0.6\n[[world.sensors.faults.transport]]\nevents = [\"imu\", \"beacon\", \"timing\", \
                  \"magnetometer\", \"barometer\"]\nlost = 0.02\ndoubled = 0.02\nlate = 0.05\nlate_by_s = 0.03\n";
    direct_and_recorded_with("outdoor", "ideal", "24", config);
    // Kept paths are a sweep a line.
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    fs::write(at.join("c.toml"), config).expect("written");
    let said = refused(
        at,
        &[
            "fly",
            "--config",
            "c.toml",
            "--steps",
            "4",
            "--keep-paths",
            "kept",
            "--out",
            "o",
        ],
    );
    assert!(said.contains("world.sensors.faults.transport"), "{said}");
    // The order belongs to the recording.
    let record = [
        "record",
        "--config",
        "c.toml",
        "--steps",
        "4",
        "--no-samples",
        "--out",
        "rec",
    ];
    good(at, &record);
    good(at, &["replay", "rec", "--out", "again"]);
    let names = ["arrivals.bin", "imu.bin", "sweeps.csv", "flight.json"];
    for name in names {
        let [a, b] = ["rec", "again"].map(|of| fs::read(at.join(of).join(name)).expect("written"));
        assert!(a == b, "{name}");
    }
    let arrivals = at.join("rec").join("arrivals.bin");
    let mut bytes = fs::read(&arrivals).expect("recorded");
    let last = bytes.len() - 1;
    bytes[last] = 9;
    fs::write(&arrivals, &bytes).expect("writable");
    let said = refused(at, &["replay", "rec"]);
    assert!(
        said.contains("arrivals.bin") && said.contains("changed"),
        "{said}"
    );
    fs::remove_file(&arrivals).expect("there");
    assert!(refused(at, &["replay", "rec"]).contains("arrivals.bin"));
}

#[test]
fn a_recording_flies_without_its_truth_and_what_is_damaged_is_told() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let record = ["record", "--world", "budget", "--seed", "3", "--steps", "20"];
    good(at, &[&record[..], &["--out", "rec"]].concat());
    good(at, &["fly", "--recording", "rec", "--out", "whole"]);
    let whole = report(&at.join("whole"));
    assert!(whole["map"]["points"].as_u64() > Some(0), "{whole}");
    assert!(whole["trajectory"]["position_rmse_m"].as_f64() < Some(1.0));

    for name in ["truth.csv", "truth_paths.jsonl"] {
        fs::remove_file(at.join("rec").join(name)).expect("recorded");
    }
    good(at, &["fly", "--recording", "rec", "--out", "blind"]);
    same(&at.join("whole"), &at.join("blind"), "without truth");
    let blind = report(&at.join("blind"));
    assert!(blind["trajectory"]["position_rmse_m"].is_null() && blind["map"]["precision"].is_null());
    assert_eq!(blind["map"]["points"], whole["map"]["points"]);

    let samples = at.join("rec").join("sweep-0007.sigmf-data");
    let bytes = fs::read(&samples).expect("recorded");
    fs::write(&samples, &bytes[..bytes.len() / 2]).expect("writable");
    let said = refused(at, &["fly", "--recording", "rec", "--out", "no"]);
    assert!(
        said.contains("sweep-0007.sigmf-data") && said.contains("cut short"),
        "{said}"
    );
    assert!(!at.join("no").join("report.json").exists());
    let said = good(
        at,
        &["fly", "--recording", "rec", "--keep-going", "--out", "rest"],
    );
    assert!(
        said.contains("left out: ") && said.contains("sweep-0007.sigmf-data"),
        "{said}"
    );
    let rest = report(&at.join("rest"));
    assert_eq!(rest["counters"]["recording damaged: sweeps"], 1);
    assert_eq!(rest["sweeps"], 20);

    let imu = at.join("rec").join("imu.bin");
    let mut bytes = fs::read(&imu).expect("recorded");
    bytes.swap(28 * 2000 + 3, 28 * 2000 + 4);
    fs::write(&imu, &bytes).expect("writable");
    let said = refused(at, &["fly", "--recording", "rec", "--out", "no"]);
    assert!(said.contains("imu.bin") && said.contains("changed"), "{said}");
    fs::remove_file(at.join("rec").join("flight.json")).expect("recorded");
    let said = refused(at, &["fly", "--recording", "rec", "--keep-going", "--out", "no"]);
    assert!(said.contains("flight.json"), "{said}");
}

#[test]
fn what_cannot_be_flown_is_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    good(at, &["record", "--steps", "2", "--no-samples", "--out", "rec"]);
    let said = refused(at, &["fly", "--recording", "rec"]);
    assert!(said.contains("has no samples to fly"), "{said}");
    let said = refused(at, &["fly", "--recording", "nowhere"]);
    assert!(said.contains("nowhere"), "{said}");
    assert_eq!(
        cslam(at, &["fly", "--recording", "rec", "--world", "real"])
            .status
            .code(),
        Some(2)
    );
    assert_eq!(cslam(at, &["fly", "--keep-going"]).status.code(), Some(2));
}
