//! `cslam fly --keep-paths` as a user meets it: kept paths fly like the samples that they were estimated from.

mod common;

use std::fs;
use std::path::Path;

use common::{cslam, good, refused, report, same};
use serde_json::Value;

/// Flies a few sweeps with these options into `direct`, and keeps their paths in `kept`.
fn keep(at: &Path, options: &[&str]) {
    let args = ["fly", "--seed", "4", "--keep-paths", "kept", "--out", "direct"];
    good(at, &[&args[..], options].concat());
}

fn direct_and_kept(options: &[&str], receiver: &[&str]) {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    keep(at, &[options, receiver].concat());
    let again = ["fly", "--recording", "kept", "--out", "flown"];
    good(at, &[&again[..], receiver].concat());
    let what = format!("{options:?} {receiver:?}");
    same(&at.join("direct"), &at.join("flown"), &what);
    let [direct, flown] = ["direct", "flown"].map(|out| report(&at.join(out)));
    for key in [
        "mode", "scene", "world", "seed", "sweeps", "verdicts", "health", "map", "counters",
    ] {
        assert_eq!(direct[key], flown[key], "{what}: {key}");
    }
    // A flight in which nothing happens would be the same too.
    assert!(
        direct["measurements"].as_u64() > Some(10),
        "{what}: nothing was heard"
    );
    let names = fs::read_dir(at.join("kept")).expect("kept");
    let samples = names.filter(|name| {
        let name = name.as_ref().expect("an entry").file_name();
        name.to_string_lossy().contains("sigmf")
    });
    assert_eq!(samples.count(), 0);
}

#[test]
fn kept_paths_of_the_budget_world_fly_the_same() {
    direct_and_kept(&["--world", "budget", "--scene", "outdoor", "--steps", "24"], &[]);
    direct_and_kept(&["--world", "budget", "--scene", "indoor", "--steps", "24"], &[]);
}

#[test]
fn kept_paths_of_the_real_world_fly_the_same() {
    direct_and_kept(&["--world", "real", "--scene", "street", "--steps", "24"], &[]);
}

#[test]
fn kept_paths_fly_the_same_in_other_stages() {
    let options = ["--world", "budget", "--scene", "outdoor", "--steps", "16"];
    for receiver in [
        &["--mode", "paper"][..],
        &["--estimator", "paper-interpolated", "--departures", "parabola"],
        &["--departures", "beams", "--link-state", "rules"],
    ] {
        direct_and_kept(&options, receiver);
    }
}

#[test]
fn what_kept_paths_cannot_tell_is_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    keep(at, &["--steps", "8"]);
    let fly = ["fly", "--recording", "kept", "--out", "no"];
    let said = refused(at, &[&fly[..], &["--mode", "paper"]].concat());
    assert!(
        said.contains("estimated by best, not by paper") && said.contains("--estimator best"),
        "{said}"
    );
    let said = refused(at, &[&fly[..], &["--departures", "pick"]].concat());
    assert!(
        said.contains("bearings were read by fit") && said.contains("--departures fit"),
        "{said}"
    );
    good(at, &[&fly[..], &["--departures", "beams"]].concat());
    let again = [&fly[..], &["--keep-paths", "again"]].concat();
    assert_eq!(cslam(at, &again).status.code(), Some(2));
    // A directory with something else in it costs no flight.
    fs::create_dir(at.join("mine")).expect("writable");
    fs::write(at.join("mine").join("letter.txt"), "dear").expect("writable");
    let said = refused(at, &["fly", "--keep-paths", "mine"]);
    assert!(said.contains("letter.txt"), "{said}");
    // Every file is read back.
    good(at, &["replay", "kept", "--out", "copy"]);
    for name in ["estimated_paths.jsonl", "flight.json", "imu.bin"] {
        let [a, b] = ["kept", "copy"].map(|out| fs::read(at.join(out).join(name)).expect("written"));
        assert!(a == b, "{name}");
    }
}

#[test]
fn damaged_paths_are_refused_with_file_and_line_or_counted() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    keep(at, &["--steps", "8"]);
    let file = at.join("kept").join("estimated_paths.jsonl");
    let whole = fs::read_to_string(&file).expect("kept");
    let fly = ["fly", "--recording", "kept", "--out", "flown"];
    let keep_going = [&fly[..], &["--keep-going"]].concat();

    fs::write(&file, &whole[..whole.len() / 2]).expect("writable");
    let said = refused(at, &fly);
    assert!(
        said.contains("estimated_paths.jsonl") && said.contains("cut short"),
        "{said}"
    );
    let lines: Vec<&str> = whole.lines().collect();
    let damaged: Vec<String> = lines
        .iter()
        .enumerate()
        .map(|(sweep, line)| {
            if sweep == 3 {
                line.replace("\"beams\":72", "\"beams\":7x")
            } else {
                (*line).to_owned()
            }
        })
        .collect();
    fs::write(&file, damaged.join("\n") + "\n").expect("writable");
    let said = refused(at, &fly);
    assert!(said.contains("changed: CRC-32"), "{said}");
    let said = good(at, &keep_going);
    assert!(
        said.contains("left out: ") && said.contains("estimated_paths.jsonl"),
        "{said}"
    );
    let counted = report(&at.join("flown"));
    assert_eq!(counted["counters"]["recording damaged: estimated_paths.jsonl"], 1);
    assert_eq!(counted["sweeps"], 7);

    // A line that is gone takes none of the others with it.
    let without = [&lines[..3], &lines[4..]].concat().join("\n") + "\n";
    fs::write(&file, without).expect("writable");
    good(at, &keep_going);
    let again = report(&at.join("flown"));
    assert_eq!(again["counters"]["recording damaged: estimated_paths.jsonl"], 1);
    assert_eq!(again["health"], counted["health"]);

    fs::remove_file(&file).expect("kept");
    let said = refused(at, &fly);
    assert!(said.contains("estimated_paths.jsonl"), "{said}");
}

#[test]
fn paths_are_left_out_as_planned() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    keep(at, &["--scene", "outdoor", "--steps", "24"]);
    let fly = |out: &str, extra: &[&str]| {
        let args = ["fly", "--recording", "kept", "--out", out];
        let said = good(at, &[&args[..], extra].concat());
        (report(&at.join(out)), said)
    };
    // All of them kept, and an outage when nothing is heard: nothing changes.
    fly("whole", &["--path-share", "1", "--path-seed", "9"]);
    same(&at.join("direct"), &at.join("whole"), "a share of one");
    fly("after", &["--without-sight", "100..200"]);
    same(&at.join("direct"), &at.join("after"), "an outage after the end");

    let (whole, _) = fly("whole", &[]);
    let (outage, said) = fly(
        "outage",
        &["--without-sight", "6..9", "--without-sight", "10..11"],
    );
    let cut = outage["counters"]["lines of sight left out"]
        .as_u64()
        .expect("counted");
    // Sweeps 11 to 16, 19 and 20, as far as their line of sight was heard.
    assert!((1..=8).contains(&cut), "{cut}");
    assert!(
        said.contains(&format!("lines of sight left out: {cut}")),
        "{said}"
    );
    let measured = |report: &Value| report["measurements"].as_u64().expect("counted");
    assert_eq!(measured(&outage) + cut, measured(&whole));

    let half = ["--path-share", "0.5", "--path-seed", "3"];
    let (thin, _) = fly("thin", &half);
    let left_out = thin["counters"]["paths left out by --path-share"].as_u64();
    assert_eq!(measured(&thin) + left_out.expect("counted"), measured(&whole));
    fly("again", &half);
    same(&at.join("thin"), &at.join("again"), "the same draw");

    for (args, expected) in [
        (&["--path-share", "1.5"][..], "expected 0 to 1"),
        (&["--without-sight", "9..6"], "expected FROM..TO"),
    ] {
        let fly = ["fly", "--recording", "kept", "--out", "no"];
        let output = cslam(at, &[&fly[..], args].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(2) && said.contains(expected),
            "{args:?}: {said}"
        );
    }
    for name in ["truth.csv", "truth_paths.jsonl"] {
        fs::remove_file(at.join("kept").join(name)).expect("kept");
    }
    let blind = [
        "fly",
        "--recording",
        "kept",
        "--without-sight",
        "6..9",
        "--out",
        "no",
    ];
    let said = refused(at, &blind);
    assert!(said.contains("truth_paths.jsonl"), "{said}");
}
