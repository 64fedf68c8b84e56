//! `cslam dataset`, `campaign --samples`, `train` and `classify` as a user meets them.

mod classify;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cslam_host_sim::link_state::dataset;
use cslam_host_sim::link_state::float_model::FloatModel;
use cslam_host_sim::paths;
use serde_json::Value;

fn cslam(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(args)
        .output()
        .expect("the binary runs")
}

/// Standard output of a run that must succeed.
fn good(args: &[&str]) -> String {
    let output = cslam(args);
    assert!(
        output.status.success(),
        "{args:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("text")
}

/// The one line that a bad run ends with.
fn bad(args: &[&str]) -> String {
    let output = cslam(args);
    let message = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// Every file below a directory with its bytes.
fn files(directory: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut waiting = vec![directory.to_owned()];
    while let Some(place) = waiting.pop() {
        for entry in fs::read_dir(place).expect("a directory") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                let name = path.strip_prefix(directory).expect("below").to_owned();
                found.push((name, fs::read(&path).expect("readable")));
            }
        }
    }
    found.sort();
    found
}

const SMALL: [&str; 8] = [
    "--scene",
    "indoor:1",
    "--transmitters",
    "5",
    "--rate",
    "0.2",
    "--permittivity",
    "2,20",
];

fn make(out: &Path, more: &[&str]) -> String {
    good(&[&["dataset", "--out", text(out)], &SMALL[..], more].concat())
}

#[test]
fn shards_made_one_by_one_are_the_bytes_of_one_run() {
    let directory = tempfile::tempdir().expect("temporary");
    let [whole, pieces] = ["whole", "pieces"].map(|name| directory.path().join(name));
    let printed = make(&whole, &["--shards", "3", "--threads", "2"]);
    assert!(printed.contains("with a path"), "{printed}");
    for shard in ["2/3", "0/3", "1/3"] {
        make(&pieces, &["--shard", shard, "--threads", "1"]);
    }
    let (all, again) = (files(&whole), files(&pieces));
    assert_eq!(all.len(), 1 + 3 * 11, "a description and eleven columns a shard");
    assert!(all == again, "the bytes differ");
    // Shards are parts of one set whatever their number.
    let other = directory.path().join("other");
    make(&other, &["--shards", "1"]);
    let links = |place: &Path| dataset::read(place).expect("sound").1;
    assert_eq!(links(&whole), links(&other));
}

#[test]
fn counts_are_those_of_the_links() {
    let directory = tempfile::tempdir().expect("temporary");
    let out = directory.path().join("set");
    let counts: Value = serde_json::from_str(&make(&out, &["--json"])).expect("JSON");
    let (description, links) = dataset::read(&out).expect("sound");
    assert_eq!(counts["links"], links.len());
    assert_eq!(counts["outages"], links.len() - links.heard());
    assert_eq!(description.transmitters_m.len(), 5);
    let orders =
        ["line_of_sight", "first_order", "higher_order"].map(|k| counts[k].as_u64().expect("a number"));
    assert_eq!(orders.iter().sum::<u64>() as usize, links.heard());
    assert!(orders.iter().all(|n| *n > 0), "{orders:?}");
}

#[test]
fn faults_of_data_sets_are_named() {
    let directory = tempfile::tempdir().expect("temporary");
    let out = directory.path().join("set");
    let with = |more: &[&str]| bad(&[&["dataset", "--out", text(&out), "--scene", "indoor"], more].concat());
    assert!(with(&["--shard", "3/3"]).contains("--shard 3/3: expected I/N"));
    assert!(with(&["--rate", "0"]).contains("rate must be above 0"));
    assert!(with(&["--permittivity", "2"]).contains("LEAST,MOST"));
    make(&out, &["--shard", "0/2"]);
    let other = bad(&[
        &["dataset", "--out", text(&out), "--seed", "2", "--shard", "1/2"],
        &SMALL[..],
    ]
    .concat());
    assert!(other.contains("another data set"), "{other}");
    let model = directory.path().join("m.safetensors");
    let train = |place: &Path| {
        bad(&[
            "train",
            "--train",
            text(place),
            "--validation",
            text(place),
            "--out",
            text(&model),
        ])
    };
    assert!(
        train(&out).contains("shard-0001-of-0002: is missing"),
        "{}",
        train(&out)
    );
    assert!(train(directory.path()).contains("dataset.json"));
    let column = out.join("shard-0000-of-0002").join("order.npy");
    make(&out, &["--shard", "1/2"]);
    fs::write(&column, b"not numpy").expect("written");
    assert!(
        train(&out).contains("order.npy: expected a NumPy file"),
        "{}",
        train(&out)
    );
}

#[test]
fn a_network_is_not_trained_on_a_scene_that_is_reported() {
    let directory = tempfile::tempdir().expect("temporary");
    let set = directory.path().join("set");
    make(&set, &["--shards", "1"]);
    let description = set.join("dataset.json");
    let told = fs::read_to_string(&description)
        .expect("written")
        .replace("indoor:1", "outdoor");
    fs::write(&description, told).expect("written");
    let model = directory.path().join("m.safetensors");
    let sets = [
        "train",
        "--train",
        text(&set),
        "--validation",
        text(&set),
        "--out",
        text(&model),
        "--epochs",
        "1",
    ];
    let said = bad(&sets);
    assert!(
        said.contains("outdoor is flown to report") && said.contains("--any-scene"),
        "{said}"
    );
    assert!(!model.exists());
    good(&[&sets[..], &["--any-scene"]].concat());
}

#[test]
fn training_gives_the_same_bytes_for_any_number_of_threads() {
    let directory = tempfile::tempdir().expect("temporary");
    let set = directory.path().join("set");
    make(&set, &[]);
    let train = |name: &str, more: &[&str]| {
        let out = directory.path().join(name);
        let start = [
            "train",
            "--epochs",
            "2",
            "--train",
            text(&set),
            "--validation",
            text(&set),
            "--out",
            text(&out),
        ];
        let printed = good(&[&start, more].concat());
        (out, printed)
    };
    let (one, printed) = train("one.safetensors", &["--threads", "1", "--json"]);
    let report: Value = serde_json::from_str(&printed).expect("JSON");
    assert_eq!(report["epochs"].as_array().expect("a list").len(), 2);
    assert!(report["temperature"].as_f64().expect("a number") > 0.0);
    let bytes = |file: &Path| fs::read(file).expect("written");
    assert_eq!(
        bytes(&one),
        bytes(&train("two.safetensors", &["--threads", "3"]).0)
    );
    let without = FloatModel::read(&train("without.safetensors", &["--no-aod"]).0).expect("sound");
    assert_eq!(
        without.inputs().len() + 6,
        FloatModel::read(&one).expect("sound").inputs().len()
    );
    let paper =
        FloatModel::read(&train("paper.safetensors", &["--kind", "paper", "--k", "3"]).0).expect("sound");
    assert_eq!(paper.inputs().len(), 9);
    let curves = fs::read_to_string(one.with_extension("svg")).expect("curves");
    assert!(curves.starts_with("<svg"));
}

#[test]
fn trees_are_trained_on_flights_and_fly() {
    let directory = tempfile::tempdir().expect("a directory");
    let place = |name: &str| directory.path().join(name);
    let (samples, model, out) = (place("samples"), place("mine.lscn"), place("out"));
    good(
        &[
            &[
                "campaign", "--quiet", "--world", "budget", "--steps", "30", "--seeds", "1", "1",
            ][..],
            &["--scenes", "city:101", "city:201", "city:21", "--any-seed"],
            &["--out", text(&place("flown")), "--samples", text(&samples)],
        ]
        .concat(),
    );
    let of = |city: &str| samples.join(format!("budget.best.city-{city}.1"));
    let [training, validation, reported] = ["101", "201", "21"].map(of);
    let on = |scene: &Path, then: fn(&[&str]) -> String| {
        then(
            &[
                &["train", "--kind", "trees", "--rounds", "5", "--json"][..],
                &[
                    "--train",
                    text(scene),
                    "--validation",
                    text(&validation),
                    "--out",
                    text(&model),
                ],
            ]
            .concat(),
        )
    };
    let report: Value = serde_json::from_str(&on(&training, good)).expect("JSON");
    assert!(
        report["training_samples"].as_u64().expect("a number") > 50,
        "{report}"
    );
    assert!(
        report["training"]["right"].as_f64().expect("a share") > 0.7,
        "{report}"
    );
    assert_eq!(report["bytes"], fs::metadata(&model).expect("written").len());
    // A scene that is flown to report is none to train on.
    let message = on(&reported, bad);
    assert!(message.contains("city:21"), "{message}");

    let fly = |then: fn(&[&str]) -> String| {
        let stage = ["--link-state-model", text(&model), "--out", text(&out)];
        then(&[&["fly", "--quiet", "--steps", "6"][..], &stage].concat())
    };
    fly(good);
    let flown = fs::read(out.join("report.json")).expect("written");
    let flown: Value = serde_json::from_slice(&flown).expect("JSON");
    assert!(flown["link_state"]["measured"]["paths"].is_u64());
    // A network is no tree.
    fs::write(&model, cslam_core::link_state::models::geometric_file()).expect("written");
    let message = fly(bad);
    assert!(
        message.contains("mine.lscn") && message.contains("no known kind"),
        "{message}"
    );
}
