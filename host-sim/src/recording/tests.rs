//! A recording gives back what was recorded, and refuses what was damaged.

mod damage;
mod pilots;

use std::fs;
use std::path::Path;

use nalgebra::Vector3;

use super::truth::TruthTrack;
use super::{
    Damage, EVENT_FILES, MANIFEST, Manifest, check_truth, read, read_with, sweep_base, write, write_events,
};
use crate::flight::{FlightConfig, FlightPlan};
use crate::scene::Scene;
use crate::sensors::{BarometerConfig, Event, SensedFlight, SensorsConfig, Stamped};

/// With a barometer: every file is there.
fn flight() -> SensedFlight {
    with_barometer(BarometerConfig::real())
}

fn with_barometer(barometer: BarometerConfig) -> SensedFlight {
    let sensors = SensorsConfig {
        barometer,
        ..SensorsConfig::default()
    };
    let scene = Scene::load("street").expect("built in");
    let config = FlightConfig {
        duration_s: 8.0,
        ..FlightConfig::default()
    };
    let plan = FlightPlan::plan(&scene, &config, 5).expect("room");
    SensedFlight::new(plan, sensors, 5).expect("the default is valid")
}

fn record(directory: &Path, flight: &SensedFlight) -> anyhow::Result<Manifest> {
    let sweeps = flight.plan().sweeps();
    write(
        directory,
        Manifest::of(Some("street"), None, flight, sweeps),
        flight,
        sweeps,
    )
}

fn recorded() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    record(directory.path(), &flight()).expect("recorded");
    directory
}

fn refusal(directory: &Path) -> String {
    read(directory).expect_err("must be refused").to_string()
}

#[test]
fn replayed_events_are_the_events_flown_and_recorded_again_the_bytes_are_the_same() {
    let (flight, directory) = (flight(), recorded());
    let recording = read(directory.path()).expect("sound");
    let flown: Vec<_> = flight.events().collect();
    assert_eq!(recording.events(), flown);
    assert_eq!(recording.manifest().seed, Some(5));
    let again = tempfile::tempdir().expect("a directory");
    let events = recording.events().iter().copied();
    write_events(again.path(), recording.manifest().clone(), events).expect("recorded");
    for name in EVENT_FILES.into_iter().chain([MANIFEST]) {
        let bytes = |d: &Path| fs::read(d.join(name)).expect("recorded");
        assert!(bytes(directory.path()) == bytes(again.path()), "{name}");
    }
}

#[test]
fn without_a_barometer_a_recording_is_of_the_version_before() {
    let directory = tempfile::tempdir().expect("a directory");
    let flight = with_barometer(BarometerConfig::default());
    let manifest = record(directory.path(), &flight).expect("recorded");
    let names: Vec<_> = manifest.files.iter().map(|entry| entry.name.as_str()).collect();
    assert_eq!((manifest.version, names), (2, EVENT_FILES[..5].to_vec()));
    assert!(!directory.path().join(EVENT_FILES[5]).exists());
    let recording = read(directory.path()).expect("sound");
    assert_eq!(recording.events(), flight.events().collect::<Vec<_>>());
    // The other files are the same bytes with one.
    let with = recorded();
    for name in &EVENT_FILES[..5] {
        let bytes = |d: &Path| fs::read(d.join(name)).expect("recorded");
        assert!(bytes(directory.path()) == bytes(with.path()), "{name}");
    }
    let text = fs::read_to_string(with.path().join(EVENT_FILES[5])).expect("recorded");
    // The clock that stamps decides whether the last one is before the end.
    assert!((8 * 25..=1 + 8 * 25).contains(&text.lines().count()));
}

/// With events that are lost, doubled and late, of every kind.
fn disordered() -> SensedFlight {
    let every = "\"imu\", \"magnetometer\", \"timing\", \"sweep\", \"beacon\", \"barometer\"";
    let faults =
        format!("[[transport]]\nevents = [{every}]\nlost = 0.1\ndoubled = 0.1\nlate = 0.2\nlate_by_s = 0.7");
    let sensors = SensorsConfig {
        faults: toml::from_str(&faults).expect("valid"),
        ..flight().config().clone()
    };
    SensedFlight::new(flight().plan().clone(), sensors, 5).expect("valid")
}

#[test]
fn events_out_of_their_order_are_given_back_in_the_order_in_which_they_arrived() {
    let (flight, directory) = (disordered(), tempfile::tempdir().expect("a directory"));
    let manifest = record(directory.path(), &flight).expect("recorded");
    let flown: Vec<_> = flight.events().collect();
    assert!(!flown.is_sorted_by_key(|stamped| stamped.uav_time_ns));
    assert_eq!(read(directory.path()).expect("sound").events(), flown);
    let entry = manifest.arrivals.expect("an order");
    assert_eq!(
        (entry.records, entry.bytes),
        (flown.len() as u64, flown.len() as u64)
    );
    // Without the order its stamps fall, and that is said.
    let file = directory.path().join(MANIFEST);
    let text = fs::read_to_string(&file).expect("recorded");
    let mut ordered: Manifest = serde_json::from_str(&text).expect("own output");
    ordered.arrivals = None;
    fs::write(&file, serde_json::to_string(&ordered).expect("serialisable")).expect("writable");
    assert!(refusal(directory.path()).contains("is earlier than the one before it"));
    // An order that fits no events is refused, and counted when damage is.
    for (bytes, reason) in [
        (vec![7; 3], "byte 0 is 7, expected 0 to 5"),
        (
            vec![3; 40],
            "wants another event of sweeps.csv, which has none left",
        ),
        (vec![0; 10], "events of imu.bin too few"),
    ] {
        ordered.arrivals = Some(super::arrivals::entry("arrivals.bin", bytes.len() as u64, &bytes));
        fs::write(directory.path().join("arrivals.bin"), &bytes).expect("writable");
        fs::write(&file, serde_json::to_string(&ordered).expect("serialisable")).expect("writable");
        let error = refusal(directory.path());
        assert!(
            error.contains("arrivals.bin") && error.contains(reason),
            "{error}"
        );
        let mut damage = Damage::counted();
        let recording = read_with(directory.path(), &mut damage).expect("counted");
        assert_eq!(recording.events().len(), flown.len());
        assert!(damage.gaps().contains_key("arrivals.bin"));
    }
    // In order, nothing of it is there.
    assert_eq!(
        Manifest::of(Some("street"), None, &self::flight(), 1).arrivals,
        None
    );
}

#[test]
fn the_truth_is_recorded_beside_and_never_needed() {
    let directory = recorded();
    let text = fs::read_to_string(directory.path().join("truth.csv")).expect("recorded");
    let line = text
        .lines()
        .find(|l| l.starts_with("2.5,4,"))
        .expect("sweep 4 at 2.5 s");
    let x: Vec<f64> = line
        .split(',')
        .skip(2)
        .map(|f| f.parse().expect("a number"))
        .collect();
    let truth = flight().sweep_truth(4);
    assert_eq!(Vector3::new(x[0], x[1], x[2]), truth.uav.position_m);
    assert_eq!(Vector3::new(x[13], x[14], x[15]), truth.gmt_position_m);
    assert_eq!(
        (x[16], x[17], x.len()),
        (truth.clock_offset_s, truth.clock_drift, 18)
    );
    fs::remove_file(directory.path().join("truth.csv")).expect("there");
    assert!(read(directory.path()).is_ok());
}

#[test]
fn truth_that_does_not_parse_is_named() {
    let directory = recorded();
    assert_eq!(check_truth(directory.path()), Ok(()));
    let file = directory.path().join("truth.csv");
    let text = fs::read_to_string(&file).expect("recorded");
    let first = text.lines().nth(1).expect("a line");
    let with_x = |x: &str| {
        let columns: Vec<&str> = first.split(',').collect();
        [&columns[..2], &[x], &columns[3..]].concat().join(",")
    };
    let (letter, infinite) = (with_x("1O"), with_x("1e999"));
    for (from, to, expected) in [
        ("time_s,", "time,", "truth.csv:1: expected the columns time_s,"),
        (first, "0.0,0,1", "truth.csv:2: has 3 columns, expected 20"),
        (
            first,
            letter.as_str(),
            "truth.csv:2: x_m: expected a number, found",
        ),
        (
            first,
            infinite.as_str(),
            "truth.csv:2: x_m: expected a number, found",
        ),
        (
            "\n0.01,,",
            "\n0.01,first,",
            ": sweep: expected the number of a sweep, found \"first\"",
        ),
        (
            "\n0.02,",
            "\n0.001,",
            ": time_s is 0.001, earlier than the line before it",
        ),
    ] {
        fs::write(&file, text.replacen(from, to, 1)).expect("writable");
        let error = check_truth(directory.path()).expect_err(to).to_string();
        assert!(error.contains(expected), "{error} instead of {expected}");
    }
    fs::remove_file(&file).expect("there");
    fs::write(
        directory.path().join(super::truth::TRUTH_PATHS),
        "{\"tx\":[0,0,0]}\n",
    )
    .expect("writable");
    let error = check_truth(directory.path()).expect_err("no paths").to_string();
    assert!(
        error.contains("truth_paths.jsonl:1: not a link of the paths format: missing field"),
        "{error}"
    );
}

#[test]
fn a_recording_that_nobody_simulated_has_no_scene_and_no_seed() {
    let directory = recorded();
    let file = directory.path().join(MANIFEST);
    let text = fs::read_to_string(&file).expect("recorded");
    let is_of_a_world = |line: &&str| line.contains("\"scene\":") || line.contains("\"seed\":");
    let lines: Vec<&str> = text.lines().filter(|line| !is_of_a_world(line)).collect();
    assert_eq!(lines.len() + 2, text.lines().count());
    fs::write(&file, lines.join("\n")).expect("writable");
    let recording = read(directory.path()).expect("sound");
    let manifest = recording.manifest();
    assert_eq!((&manifest.scene, manifest.seed), (&None, None));
    // Nor has it when it is written again.
    let again = tempfile::tempdir().expect("a directory");
    let events = recording.events().iter().copied();
    write_events(again.path(), manifest.clone(), events).expect("recorded");
    let written = fs::read_to_string(again.path().join(MANIFEST)).expect("recorded");
    assert_eq!(written.trim_end(), lines.join("\n"));
}

#[test]
fn truth_is_known_between_its_lines() {
    let (flight, directory) = (flight(), recorded());
    let track = TruthTrack::read(directory.path()).expect("sound").expect("there");
    for (uav_s, place_m, angle_rad) in [
        (2.5_f64, 1e-9_f64, 1e-9_f64),
        (4.1234567, 1e-5, 1e-4),
        (7.777, 1e-5, 1e-4),
    ] {
        let gmt_s = 2.0 * uav_s - flight.clock().reading_s(uav_s);
        let (told, truth) = (track.at(uav_s), flight.truth(gmt_s));
        let off = (Vector3::from(told.position_m) - truth.uav.position_m).norm();
        assert!(off < place_m, "{off} m at {uav_s} s");
        let dot: f64 = told
            .quaternion_wb
            .iter()
            .zip(truth.uav.quaternion_wb())
            .map(|(a, b)| a * b)
            .sum();
        assert!(
            2.0 * libm::acos(dot.abs().min(1.0)) < angle_rad.max(1e-7),
            "{uav_s} s"
        );
        assert!((told.clock_offset_s - truth.clock_offset_s).abs() < 1e-12);
    }
    // Before the first and after the last line theirs.
    assert_eq!(track.at(-5.0), track.at(-1.0));
    assert_eq!(track.at(50.0), track.at(60.0));
}

fn file_of(directory: &tempfile::TempDir, rank: usize) -> std::path::PathBuf {
    directory.path().join(EVENT_FILES[rank])
}

#[test]
fn events_come_in_order_and_hold_no_truth() {
    let flight = flight();
    let events: Vec<_> = flight.events().collect();
    let key = |k: usize| (events[k].uav_time_ns, events[k].event.rank());
    assert!((1..events.len()).all(|k| key(k - 1) <= key(k)));
    let count = |rank| events.iter().filter(|e| e.event.rank() == rank).count();
    // 8 s: the last ticks fall just before or after the end, as the clock's offset decides.
    assert!((7999..=8000).contains(&count(0)) && (399..=400).contains(&count(1)));
    assert!((10..=16).contains(&count(2)) && count(3) == 16 && count(4) == 15);
    for stamped in &events {
        if let Event::Beacon(beacon) = stamped.event {
            let truth = flight.sweep_truth(beacon.sweep);
            let error = (Vector3::from(beacon.position_m) - truth.gmt_position_m).norm();
            assert!(error > 1e-5 && error < 0.15, "{error}");
            let behind_s = stamped.uav_time_ns as f64 * 1e-9 - truth.time_s - 1e-3 - truth.clock_offset_s;
            assert!(behind_s.abs() < 2e-9, "{behind_s}");
        }
    }
    // Every sensor still speaks of the same flight: an ideal suite differs from this one by its errors only.
    let ideal = SensedFlight::new(flight.plan().clone(), SensorsConfig::ideal(), 5).expect("valid");
    let at_rest = ideal.events().find_map(|s| match s.event {
        Event::Imu(sample) => Some(sample),
        _ => None,
    });
    assert_eq!(
        at_rest.map(|s| (s.acceleration, s.rate)),
        Some(([0, 0, 8192], [0; 3]))
    );
}
