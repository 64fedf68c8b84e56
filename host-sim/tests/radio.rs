//! Another radio by the table `[radio]`, as a user meets it: flown, recorded, kept and refused.

mod common;

use std::fs;
use std::path::Path;

use common::{good, refused, report, same};
use serde_json::Value;

/// 28 GHz, another root, arrays further in.
const RADIO: &str =
    "[radio.waveform]\ncarrier_hz = 28e9\nroot = 136\n\n[radio.uav_arrays]\nradius_m = 0.15\n";
const FLIGHT: [&str; 8] = [
    "--world", "budget", "--scene", "street", "--seed", "3", "--steps", "14",
];

fn told(at: &Path, name: &str, text: &str) {
    fs::write(at.join(name), text).expect("writable");
}

fn json(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).expect("written")).expect("JSON")
}

#[test]
fn another_radio_flies_and_its_recordings_say_which() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    told(at, "radio.toml", RADIO);
    let with = ["--config", "radio.toml"];
    good(
        at,
        &[
            &["fly", "--out", "direct", "--keep-paths", "kept"],
            &FLIGHT[..],
            &with,
        ]
        .concat(),
    );
    good(
        at,
        &[&["record", "--out", "recorded"], &FLIGHT[..], &with].concat(),
    );
    let flown = report(&at.join("direct"));
    assert!(
        flown["trajectory"]["position_rmse_m"].as_f64() < Some(0.5),
        "{}",
        flown["trajectory"]
    );
    for recording in ["recorded", "kept"] {
        let said = &json(&at.join(recording).join("flight.json"))["radio"];
        assert_eq!(said["waveform"]["root"], 136);
        assert_eq!(said["uav_arrays"]["radius_m"], 0.15);
        // What a recording says of its radio counts: nobody need say it again, but may.
        for options in [&[][..], &with] {
            good(
                at,
                &[&["fly", "--recording", recording, "--out", "again"], options].concat(),
            );
            same(&at.join("direct"), &at.join("again"), recording);
        }
    }
    let meta = json(&at.join("recorded").join("sweep-0003.sigmf-meta"));
    assert_eq!(meta["global"]["cslam:waveform"], "zc409-136");
    assert_eq!(meta["captures"][0]["core:frequency"], 28e9);
    let said = good(at, &["estimate", "recorded/sweep-0003"]);
    assert!(!said.contains("no path"), "{said}");
    told(at, "other.toml", "radio.waveform.root = 5\n");
    let fly = ["fly", "--recording", "recorded", "--out", "no"];
    let said = refused(at, &[&fly[..], &["--config", "other.toml"]].concat());
    assert!(said.contains("[radio] of the configuration is another"), "{said}");
    // A sweep of another radio is none of this flight.
    let file = at.join("recorded").join("sweep-0003.sigmf-meta");
    let mut other = meta;
    other["global"]["cslam:radio"]["uav_arrays"]["radius_m"] = 0.2.into();
    fs::write(&file, other.to_string()).expect("writable");
    let said = refused(at, &fly);
    assert!(
        said.contains("cslam:radio is another than the flight's"),
        "{said}"
    );
}

#[test]
fn the_default_radio_is_not_mentioned_and_what_cannot_work_is() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    told(at, "same.toml", "[radio.waveform]\ncarrier_hz = 30e9\n");
    good(
        at,
        &[
            "record",
            "--steps",
            "1",
            "--out",
            "recorded",
            "--config",
            "same.toml",
        ],
    );
    let at_all = fs::read_to_string(at.join("recorded").join("flight.json")).expect("written");
    let meta = fs::read_to_string(at.join("recorded").join("sweep-0000.sigmf-meta")).expect("written");
    assert!(!at_all.contains("radio") && !meta.contains("cslam:radio"));
    told(
        at,
        "wrong.toml",
        "[radio.uav_arrays]\nspacing_wavelengths = 0.7\n",
    );
    let said = refused(at, &["fly", "--config", "wrong.toml"]);
    assert!(
        said.contains("wrong.toml:2: radio.uav_arrays.spacing_wavelengths expected above 0 and at most 0.5"),
        "{said}"
    );
    good(at, &["key", "new", "uav.key", "--uav", "4"]);
    told(at, "radio.toml", RADIO);
    good(at, &["key", "image", "uav.key", "default.bin"]);
    good(
        at,
        &["key", "image", "uav.key", "other.bin", "--config", "radio.toml"],
    );
    let [default, other] = ["default.bin", "other.bin"].map(|name| fs::read(at.join(name)).expect("written"));
    assert_eq!(default.len(), other.len());
    assert_ne!(default, other);
    told(at, "rate.toml", "[radio.waveform]\nsample_rate_hz = 122.88e6\n");
    let said = refused(
        at,
        &["key", "image", "uav.key", "no.bin", "--config", "rate.toml"],
    );
    assert!(
        said.contains("radio.waveform.sample_rate_hz a board's settings"),
        "{said}"
    );
    assert!(!at.join("no.bin").exists());
}
