//! docs/formats.md: its examples go through the commands, and every key of every format stands there.
//!
//! Long: one page, section by section.
//!
//! Which keys there are is asked of the readers: they name those that they know to whoever gives one that they do not.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use cslam_host_sim::sigmf;
use serde_json::{Value, json};
use tempfile::TempDir;

const PAGE: &str = include_str!("../../docs/formats.md");
/// A key that no format has.
const NONE: &str = "no_such_key";

/// A part of the page, from its heading to the next one of the same level.
fn section(heading: &str) -> &'static str {
    let (_, rest) = PAGE
        .split_once(&format!("\n## {heading}\n"))
        .unwrap_or_else(|| panic!("no section {heading}"));
    rest.split_once("\n## ").map_or(rest, |(part, _)| part)
}

/// The fenced examples of a part in a language.
fn examples(part: &'static str, language: &str) -> Vec<&'static str> {
    part.split(&format!("```{language}\n"))
        .skip(1)
        .map(|rest| rest.split_once("```").expect("the end of an example").0)
        .collect()
}

/// The keys that the tables of a part list.
fn listed(part: &str) -> BTreeSet<String> {
    let (mut keys, mut in_table) = (BTreeSet::new(), false);
    for line in part.lines() {
        in_table =
            line.starts_with("| key | type | unit | frame | range |") || in_table && line.starts_with('|');
        if in_table && !line.starts_with("| key |") {
            let cell = line
                .trim_start_matches('|')
                .split(" |")
                .next()
                .unwrap_or_default();
            keys.extend(cell.split('`').skip(1).step_by(2).map(str::to_owned));
        }
    }
    keys
}

fn cslam(at: &TempDir, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .current_dir(at.path())
        .args(arguments)
        .output()
        .expect("the binary runs")
}

/// What a command prints that takes what it is given.
fn good(at: &TempDir, arguments: &[&str]) -> String {
    let output = cslam(at, arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).expect("text")
}

/// The keys that a refusal of [`NONE`] names.
fn known(at: &TempDir, arguments: &[&str]) -> BTreeSet<String> {
    let output = cslam(at, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    let (_, rest) = said
        .split_once(NONE)
        .unwrap_or_else(|| panic!("{said} does not name the key"));
    let (_, names) = rest.split_once("expected ").expect("what is expected");
    let names = names.split(" (").next().unwrap_or_default();
    assert!(!names.contains("..."), "the list is cut short: {names}");
    let is_name = |name: &&str| !["one", "of", "or"].contains(name) && !name.is_empty();
    names
        .split([' ', ',', '`', '\n'])
        .filter(is_name)
        .map(str::to_owned)
        .collect()
}

/// Writes a JSON value with [`NONE`] in the object at `pointer`.
fn with_none(at: &TempDir, file: &str, value: &Value, pointer: &str) {
    let mut value = value.clone();
    value.pointer_mut(pointer).expect("an object")[NONE] = json!(0);
    write(at, file, value.to_string());
}

fn write(at: &TempDir, file: &str, content: impl AsRef<[u8]>) {
    fs::write(at.path().join(file), content).expect("written");
}

fn parse(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn directory() -> TempDir {
    tempfile::tempdir().expect("a directory")
}

#[test]
fn the_configuration_is_what_the_command_prints_and_reads() {
    let at = directory();
    let [shown] = examples(section("Configuration"), "toml")[..] else {
        panic!("one example");
    };
    assert!(
        good(&at, &["config"]) == shown,
        "the page differs from `cslam config`: print it there anew"
    );
    write(&at, "c.toml", shown);
    assert_eq!(good(&at, &["config", "--check", "c.toml"]), "");
    for command in ["fly", "record"] {
        let read = good(&at, &[command, "--config", "c.toml", "--print-config"]);
        assert_eq!(read, good(&at, &[command, "--print-config"]));
    }
    write(&at, "c.toml", shown.replace("mast_m = 1.5 ", "mast = 1.5 "));
    let refused = cslam(&at, &["config", "--check", "c.toml"]);
    let said = String::from_utf8_lossy(&refused.stderr);
    let line = 1 + shown
        .lines()
        .position(|l| l.starts_with("mast_m"))
        .expect("the key");
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(
        said.contains(&format!("c.toml:{line}: unknown field `mast`")),
        "{said}"
    );
}

#[test]
fn the_scene_is_traced_into_the_path_list() {
    let at = directory();
    let part = section("Scenes");
    let [scene] = examples(part, "json")[..] else {
        panic!("one example");
    };
    let trace = [
        "trace",
        "--scene",
        "yard.json",
        "--tx",
        "0,0,10",
        "--rx",
        "40,0,10",
    ];
    assert!(part.contains(&format!("`cslam {}`", trace.join(" "))));
    write(&at, "yard.json", scene);
    let traced = parse(&good(&at, &trace));
    let shown = parse(examples(section("Path lists"), "json")[0]);
    assert_near(&traced, &shown, "");
    let mut keys = BTreeSet::new();
    for pointer in ["", "/material", "/materials/gravel", "/faces/0"] {
        with_none(&at, "yard.json", &parse(scene), pointer);
        keys.append(&mut known(&at, &trace));
    }
    assert_eq!(listed(part), keys);
}

/// The same but for the digits that were left out.
fn assert_near(full: &Value, short: &Value, place: &str) {
    match (full, short) {
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{place}: {full} and {short}");
            a.iter()
                .for_each(|(key, value)| assert_near(value, &b[key], &format!("{place}.{key}")));
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}");
            a.iter().zip(b).for_each(|(a, b)| assert_near(a, b, place));
        }
        _ => {
            let [a, b] = [full, short].map(|v| v.as_f64().expect("a number"));
            assert!((a - b).abs() <= 1e-6 * a.abs().max(1e-9), "{place}: {a} and {b}");
        }
    }
}

#[test]
fn the_path_list_is_solved_classified_flown_and_synthesised() {
    let at = directory();
    let part = section("Path lists");
    let link = examples(part, "json")[0];
    let list = ["--paths", "yard.jsonl"];
    write(&at, "yard.jsonl", link);
    let solved = good(&at, &[&["solve", "--json"][..], &list].concat());
    let points: Vec<Value> = solved.lines().map(parse).collect();
    assert_eq!(points.len(), 3, "{solved}");
    assert_eq!(points[1]["verdict"], "ok", "{solved}");
    let classified = good(&at, &[&["classify", "--json"][..], &list].concat());
    assert_eq!(parse(&classified)["state"], 1, "{classified}");
    good(&at, &[&["fly"][..], &list].concat());
    good(&at, &[&["synth", "--out", "sweep"][..], &list].concat());
    // What an estimator writes of the samples is a path list too, its keys among those of the page.
    let estimated = good(&at, &["estimate", "--json", "sweep.sigmf-meta"]);
    write(&at, "estimated.jsonl", &estimated);
    good(&at, &["solve", "--paths", "estimated.jsonl"]);
    let estimated = parse(&estimated);
    let mut written: BTreeSet<String> = names(&estimated);
    written.append(&mut names(&estimated["paths"][0]));
    assert!(
        written.contains("covariance") && written.is_subset(&listed(part)),
        "{written:?}"
    );
    let mut keys = BTreeSet::new();
    for pointer in ["", "/paths/0"] {
        with_none(&at, "wrong.jsonl", &parse(link), pointer);
        keys.append(&mut known(&at, &["solve", "--paths", "wrong.jsonl"]));
    }
    assert_eq!(listed(part), keys);
}

fn names(object: &Value) -> BTreeSet<String> {
    object.as_object().expect("an object").keys().cloned().collect()
}

#[test]
fn the_samples_have_an_exponent_of_each_beam() {
    let at = directory();
    let part = section("Recordings of samples");
    let [meta] = examples(part, "json")[..] else {
        panic!("one example");
    };
    write(&at, "s.sigmf-meta", meta);
    write(&at, "s.sigmf-data", vec![0_u8; 2 * 65536]);
    let link = parse(&good(&at, &["estimate", "--json", "s.sigmf-meta"]));
    assert_eq!(link["beams"], 2, "{link}");
    let read = sigmf::read(&at.path().join("s")).expect("sound");
    let exponents: Vec<_> = read
        .blocks
        .iter()
        .map(|block| (block.beam, block.exponent))
        .collect();
    assert_eq!(exponents, [(12, -31), (13, -30)]);
    let mut keys = BTreeSet::new();
    for pointer in ["", "/global", "/global/core:extensions/0", "/captures/0"] {
        with_none(&at, "s.sigmf-meta", &parse(meta), pointer);
        keys.append(&mut known(&at, &["estimate", "s.sigmf-meta"]));
    }
    assert_eq!(listed(part), keys);
}

#[test]
fn the_recorded_flight_is_replayed() {
    let at = directory();
    let part = section("Recorded flights");
    let [description, beacons, estimated] = examples(part, "json")[..] else {
        panic!("three examples");
    };
    let [magnetometer, timing, sweeps, barometer, truth] = examples(part, "csv")[..] else {
        panic!("five examples");
    };
    write(&at, "imu.bin", "");
    write(&at, "flight.json", description);
    write(&at, "beacons.jsonl", beacons);
    write(&at, "estimated_paths.jsonl", estimated);
    write(&at, "truth.csv", truth);
    write(&at, "magnetometer.csv", magnetometer);
    write(&at, "timing.csv", timing);
    write(&at, "sweeps.csv", sweeps);
    let counts = parse(&good(&at, &["replay", ".", "--json"]));
    assert_eq!(
        (&counts["sweeps"], &counts["estimated_paths"]),
        (&json!(1), &json!(1)),
        "{counts}"
    );
    // Version 3 is the same with a barometer.
    let mut described = parse(description);
    described["version"] = json!(3);
    let crc32 = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(barometer.as_bytes());
    let entry = json!({"name": "barometer.csv", "records": 2, "bytes": barometer.len(), "crc32": crc32});
    described["files"].as_array_mut().expect("a list").push(entry);
    write(&at, "barometer.csv", barometer);
    write(&at, "flight.json", described.to_string());
    let counts = parse(&good(&at, &["replay", ".", "--json"]));
    assert_eq!(
        (&counts["barometer_samples"], &counts["sweeps"]),
        (&json!(2), &json!(1)),
        "{counts}"
    );
    let mut keys: BTreeSet<String> = [magnetometer, timing, sweeps, barometer, truth]
        .iter()
        .flat_map(|table| table.lines().next().expect("a header").split(','))
        .map(str::to_owned)
        .collect();
    let described = parse(description);
    for pointer in [
        "",
        "/files/0",
        "/magnetic_field",
        "/scene_as",
        "/scene_as/placement",
        "/scene_as/surfaces",
        "/estimated",
    ] {
        with_none(&at, "flight.json", &described, pointer);
        keys.append(&mut known(&at, &["replay", "."]));
    }
    for (file, line, entry, pointers) in [
        (
            "estimated_paths.jsonl",
            estimated,
            "/estimated/file",
            &[
                "",
                "/paths/0",
                "/paths/0/range_rate",
                "/sighted",
                "/sighted/bearing",
            ][..],
        ),
        ("beacons.jsonl", beacons, "/files/4", &["", "/beacon"]),
    ] {
        for pointer in pointers {
            with_none(&at, file, &parse(line), pointer);
            let bytes = fs::read(at.path().join(file)).expect("written");
            let mut described = described.clone();
            let entry = described.pointer_mut(entry).expect("the example has it");
            entry["bytes"] = bytes.len().into();
            entry["crc32"] = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC)
                .checksum(&bytes)
                .into();
            write(&at, "flight.json", described.to_string());
            keys.append(&mut known(&at, &["replay", "."]));
        }
    }
    assert_eq!(listed(part), keys);
    // A recording of this program's has no other columns.
    let record = [
        "record",
        "--world",
        "ideal",
        "--duration",
        "1",
        "--no-samples",
        "--out",
        "recorded",
    ];
    good(&at, &record);
    for (file, table) in [
        ("magnetometer.csv", magnetometer),
        ("barometer.csv", barometer),
        ("truth.csv", truth),
    ] {
        let recorded = fs::read_to_string(at.path().join("recorded").join(file)).expect("text");
        assert_eq!(recorded.lines().next(), table.lines().next(), "{file}");
    }
}

#[test]
fn the_header_of_a_float_model_is_quantised() {
    let at = directory();
    let part = section("Models");
    let [header] = examples(part, "json")[..] else {
        panic!("one example");
    };
    // The page has no tensors: those of the model that comes with the program, which it is the header of.
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/geometric.safetensors");
    let shipped = fs::read(shipped).expect("the model");
    let (length, rest) = shipped.split_first_chunk().expect("a length");
    let tensors = &rest[usize::try_from(u64::from_le_bytes(*length)).expect("short")..];
    let model = |header: &Value| {
        let header = header.to_string();
        [
            &(header.len() as u64).to_le_bytes()[..],
            header.as_bytes(),
            tensors,
        ]
        .concat()
    };
    let shown = parse(header);
    write(&at, "mine.safetensors", model(&shown));
    let set = ["--set", "validation", "--rate", "0.0002", "--shards", "1"];
    good(&at, &[&["dataset", "--out", "data"][..], &set].concat());
    let quantize = [
        "quantize",
        "mine.safetensors",
        "--calibration",
        "data",
        "--out",
        "mine.lscn",
    ];
    good(&at, &quantize);
    write(&at, "yard.jsonl", examples(section("Path lists"), "json")[0]);
    good(
        &at,
        &["classify", "--paths", "yard.jsonl", "--model", "mine.lscn"],
    );
    let mut wrong = shown.clone();
    wrong["__metadata__"][NONE] = json!("0");
    write(&at, "mine.safetensors", model(&wrong));
    let mut keys = known(&at, &quantize);
    assert!(keys.contains("input_scale"), "{keys:?}");
    keys.append(&mut names(&shown));
    keys.append(&mut names(&shown["f1.weight"]));
    assert_eq!(listed(part), keys);
}

#[test]
fn the_report_has_the_keys_that_a_flight_writes() {
    let at = directory();
    let part = section("Reports");
    let [shown] = examples(part, "json")[..] else {
        panic!("one example");
    };
    // A directory with the page's report in it is one of an older flight, and is replaced.
    fs::create_dir(at.path().join("out")).expect("a directory");
    write(&at, "out/report.json", shown);
    let (_, command) = part.split_once("`cslam fly").expect("the command");
    let (command, _) = command.split_once('`').expect("its end");
    let arguments: Vec<&str> = std::iter::once("fly").chain(command.split_whitespace()).collect();
    good(&at, &arguments);
    let written = fs::read_to_string(at.path().join("out/report.json")).expect("written");
    let keys = |text: &str| {
        let mut keys = BTreeSet::new();
        keys_below(&parse(text), "", &mut keys);
        keys
    };
    assert_eq!(keys(shown), keys(&written));
    let every = keys(&written)
        .iter()
        .map(|key| key.rsplit('.').next().unwrap_or_default().to_owned())
        .collect();
    assert_eq!(listed(part), every);
}

/// Keys of objects in objects, with dots; of what is counted by reason or kind, the counter alone.
fn keys_below(value: &Value, place: &str, keys: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (name, value) in object {
                let key = format!("{place}.{name}");
                if !["verdicts", "counters", "accepted_kinds"].contains(&name.as_str()) {
                    keys_below(value, &key, keys);
                }
                keys.insert(key);
            }
        }
        Value::Array(values) => values.iter().for_each(|value| keys_below(value, place, keys)),
        _ => {}
    }
}
