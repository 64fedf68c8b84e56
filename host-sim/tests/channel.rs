//! `cslam fly --channel` as a user meets it: links along a route, of whatever ray tracer, are heard, flown and mapped.

mod common;

use std::fs;
use std::path::Path;

use common::{good, report, same};
use serde_json::Value;

/// Thirty-six seconds of a flight outdoors: from thirty on a surface is confirmed, whatever noise is drawn.
fn traced(directory: &Path) -> String {
    let args = [
        "trace",
        "--scene",
        "outdoor",
        "--flight",
        "1",
        "--duration",
        "36",
        "--out",
        "route.jsonl",
    ];
    good(directory, &args);
    fs::read_to_string(directory.join("route.jsonl")).expect("written")
}

#[test]
fn links_along_a_route_are_flown_and_mapped() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    assert_eq!(traced(at).lines().count(), 72);
    let fly = |out: &str, more: &[&str]| {
        good(
            at,
            &[&["fly", "--channel", "route.jsonl", "--out", out], more].concat(),
        );
        report(&at.join(out))
    };
    // In thirty-six seconds of the default world hardly a surface is confirmed.
    let flown = fly("flown", &["--world", "budget", "--scene", "outdoor"]);
    // The UAV rests 3 s and hovers 3 s at the first place.
    assert_eq!(flown["sweeps"], 12 + 72);
    assert_eq!(flown["scene"], "route.jsonl");
    let points = flown["map"]["points"].as_u64().expect("counted");
    let of_correct_surface = flown["map"]["precision_by_faces"]
        .as_f64()
        .expect("a scene to compare with");
    let position_m = flown["trajectory"]["position_rmse_m"]
        .as_f64()
        .expect("a trajectory");
    println!("{points} points, {of_correct_surface} of a correct surface, position {position_m} m");
    assert!(points > 10 && of_correct_surface > 0.9 && position_m < 1.0);
    // Without a scene there is nothing to compare the map with; the flight is the same.
    let alone = fly("alone", &["--world", "budget"]);
    assert_eq!(alone["map"]["points"], flown["map"]["points"]);
    assert!(alone["map"]["precision_by_faces"].is_null());
    same(&at.join("flown"), &at.join("alone"), "with and without a scene");
    let other = fly("other", &["--seed", "2", "--steps", "8"]);
    assert_eq!(other["sweeps"], 8);
}

#[test]
fn a_recording_of_a_flight_along_links_flies_as_the_flight_itself() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    traced(at);
    // In thirty-six seconds of the default world hardly a surface is confirmed.
    let options = [
        "--channel",
        "route.jsonl",
        "--scene",
        "outdoor",
        "--world",
        "budget",
    ];
    good(at, &[&["fly", "--out", "direct"], &options[..]].concat());
    good(at, &[&["record", "--out", "recorded"], &options[..]].concat());
    good(at, &["fly", "--recording", "recorded", "--out", "flown"]);
    same(&at.join("direct"), &at.join("flown"), "from a recording");
    let [mut direct, mut flown] = ["direct", "flown"].map(|out| report(&at.join(out)));
    let of_map = &direct["map"];
    assert!(of_map["accepted"].as_u64() > Some(10), "nothing was mapped");
    assert!(
        of_map["precision_by_faces"].is_number(),
        "no scene to compare with"
    );
    // The flight is called by its links, the recording by the scene that it names; and none is computed as fast as another.
    assert_eq!([&direct["scene"], &flown["scene"]], ["route.jsonl", "outdoor"]);
    let mut taken = |key: &str| {
        [&mut direct, &mut flown].map(|told| {
            told.as_object_mut()
                .expect("a report")
                .remove(key)
                .expect("a key")
        })
    };
    for key in ["scene", "elapsed_s"] {
        taken(key);
    }
    // Between the lines of the recorded truth, 10 ms apart, the true pose is interpolated: an arc is off its chord by less than 0.1 mm.
    for key in ["trajectory", "clock", "consistency"] {
        let [direct, flown] = taken(key);
        for (name, value) in direct.as_object().expect("figures") {
            let [a, b] = [value, &flown[name]].map(|value| value.as_f64().expect("a figure"));
            assert!((a - b).abs() <= 1e-4 * a.abs(), "{key}.{name}: {a} {b}");
        }
    }
    assert_eq!(direct, flown);

    // Nobody needs to know a scene.
    let alone = [
        "record",
        "--no-samples",
        "--channel",
        "route.jsonl",
        "--out",
        "alone",
    ];
    good(at, &alone);
    let told = fs::read_to_string(at.join("alone").join("flight.json")).expect("written");
    let told: Value = serde_json::from_str(&told).expect("JSON");
    assert!(
        told["scene"].is_null() && told["duration_s"].as_f64() > Some(16.0),
        "{told}"
    );
    for (args, expected) in [
        (&["--channel", "nowhere.jsonl"][..], "nowhere.jsonl"),
        (
            &["--channel", "route.jsonl", "--scene", "nowhere.json"],
            "nowhere.json",
        ),
    ] {
        let said = common::refused(at, &[&["record", "--out", "none"], args].concat());
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn a_world_of_many_errors_sends_its_words_over_given_links() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    traced(at);
    let args = ["fly", "--channel", "route.jsonl", "--steps", "20", "--out", "out"];
    good(at, &args);
    let told = report(&at.join("out"));
    assert_eq!(told["world"], "real");
    assert!(told["measurements"].as_u64() > Some(10), "nothing was heard");
}

#[test]
fn links_that_cannot_be_flown_are_refused_by_file_and_link() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let whole = traced(at);
    let lines: Vec<Value> = whole
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let refused = |change: &dyn Fn(&mut Vec<Value>), expected: &[&str]| {
        let mut lines = lines.clone();
        change(&mut lines);
        let text: Vec<String> = lines.iter().map(Value::to_string).collect();
        fs::write(at.join("bad.jsonl"), text.join("\n")).expect("written");
        let said = common::refused(at, &["fly", "--channel", "bad.jsonl", "--out", "none"]);
        for text in [&["bad.jsonl"], expected].concat() {
            assert!(said.contains(text), "{text}: {said}");
        }
        assert!(!at.join("none").exists(), "something was written");
    };
    refused(&|lines| lines.truncate(1), &["1 links, expected two or more"]);
    refused(
        &|lines| {
            lines.remove(9);
        },
        &["link 10 (from 1)", "`time_s` is 5.5, expected 5.000"],
    );
    refused(
        &|lines| {
            lines[4].as_object_mut().expect("a link").remove("time_s");
        },
        &["some links have a `time_s`"],
    );
    refused(
        &|lines| {
            for (number, line) in lines.iter_mut().enumerate() {
                line["time_s"] = (20.0 * number as f64).into();
            }
        },
        &["20 s apart, expected 0.1 to 5"],
    );
    refused(
        &|lines| {
            lines[3]["paths"][0]
                .as_object_mut()
                .expect("a path")
                .remove("gain");
        },
        &["link 4 (from 1): path 1 (from 1): `gain` is missing"],
    );
    refused(
        &|lines| {
            let path = lines[3]["paths"][0].as_object_mut().expect("a path");
            path.remove("aod_zenith_rad");
            path.remove("aod_azimuth_rad");
        },
        &["link 4 (from 1): path 1 (from 1): the angle of departure is missing"],
    );
    refused(
        &|lines| lines[2]["measured"] = true.into(),
        &["link 3 (from 1)", "--paths"],
    );
    refused(
        &|lines| lines[20]["rx"][2] = 90.0.into(),
        &["m/s^2 of acceleration, expected up to 6.5"],
    );
}
