//! `cslam quantize` as a user meets it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use cslam_core::link_state::{Kind, models};
use cslam_host_sim::link_state::model_file::ModelFile;
use serde_json::Value;

fn cslam(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(args)
        .output()
        .expect("the binary runs")
}

fn good(args: &[&str]) -> String {
    let output = cslam(args);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("text")
}

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

#[test]
fn a_float_network_becomes_a_model_that_flies() {
    let directory = tempfile::tempdir().expect("temporary");
    let (data, out) = (directory.path().join("data"), directory.path().join("m.lscn"));
    let (data, out) = (text(&data), text(&out));
    good(&[
        "dataset",
        "--set",
        "validation",
        "--rate",
        "0.0002",
        "--out",
        data,
        "--shards",
        "1",
    ]);
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/geometric.safetensors");
    let shipped = text(&shipped);

    let json = good(&["quantize", shipped, "--calibration", data, "--out", out, "--json"]);
    let report: Value = serde_json::from_str(&json).expect("JSON");
    let number = |key: &str| report[key].as_f64().expect("a number");
    assert!(number("samples") > 1000.0, "{report}");
    assert!(number("float_accuracy") > 0.9 && number("agreement") > 0.99 && number("agreement") < 1.0);
    assert!(
        (number("int8_accuracy") - number("float_accuracy")).abs() <= 0.002,
        "{report}"
    );
    let layers = report["layers"].as_array().expect("layers");
    assert_eq!(layers.len(), 3);
    assert!(
        layers
            .iter()
            .all(|l| l["sqnr_db"].as_f64().is_some_and(|db| db > 30.0)),
        "{report}"
    );

    let file = ModelFile::read(Path::new(out)).expect("a model");
    let (model, flown) = (file.model().expect("sound"), models::geometric().expect("sound"));
    assert_eq!((model.kind(), model.shape()), (Kind::Geometric, flown.shape()));
    assert_eq!(model.temperature(), flown.temperature());
    assert!(model.input_scales().eq(flown.input_scales()) && model.input_names().eq(flown.input_names()));
    let first = fs::read(out).expect("written");
    let table = good(&["quantize", shipped, "--calibration", data, "--out", out]);
    assert!(
        table.contains("23x48") && table.contains("int8 - float"),
        "{table}"
    );
    assert_eq!(fs::read(out).expect("written"), first, "the same bytes again");
}

#[test]
fn faults_are_named() {
    let directory = tempfile::tempdir().expect("temporary");
    let wrong = directory.path().join("m.safetensors");
    fs::write(&wrong, b"no model").expect("written");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/geometric.safetensors");
    let with = |model: &Path| {
        bad(&[
            "quantize",
            text(model),
            "--calibration",
            text(directory.path()),
            "--out",
            "x",
        ])
    };
    assert!(with(&wrong).contains("m.safetensors"));
    assert!(with(&directory.path().join("absent")).contains("cannot be read"));
    assert!(with(&shipped).contains("dataset.json"));
}
