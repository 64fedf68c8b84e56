//! Float networks go to Python and come from there: the safetensors library and NumPy find the same logits.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use cslam_host_sim::link_state::float_model::FloatModel;
use cslam_host_sim::link_state::quantise::{Quantised, largest_activations};
use serde_json::Value;

/// What the script prints: rows of inputs and their logits.
fn script(verb: &str, file: &Path, input: &str) -> Vec<(Vec<f32>, Vec<f64>)> {
    let root = cslam_tests::root();
    let mut child = Command::new(root.join("target/verify-python/bin/python"))
        .arg(root.join("tests/tools/float_model.py"))
        .args([Path::new(verb), file])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("`cargo verify` sets Python up");
    let mut stdin = child.stdin.take().expect("piped");
    stdin.write_all(input.as_bytes()).expect("taken");
    drop(stdin);
    let output = child.wait_with_output().expect("ends");
    assert!(output.status.success(), "the script says why");
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let numbers = |row: &Value| -> Vec<f64> {
        let row = row.as_array().expect("a row").iter();
        row.map(|x| x.as_f64().expect("a number")).collect()
    };
    let all = |key: &str| printed[key].as_array().expect("rows").iter().map(numbers);
    all("rows")
        .zip(all("logits"))
        .map(|(row, logits)| (row.into_iter().map(|x| x as f32).collect(), logits))
        .collect()
}

fn same_logits(model: &FloatModel, rows: &[(Vec<f32>, Vec<f64>)]) {
    assert_eq!(rows.len(), 40);
    for (row, logits) in rows {
        for (ours, theirs) in model.logits(row).iter().zip(logits) {
            assert!(
                (f64::from(*ours) - theirs).abs() < 1e-4 * (1.0 + theirs.abs()),
                "{ours} {theirs}"
            );
        }
    }
}

#[test]
fn a_network_from_python_is_read_and_quantised() {
    let directory = tempfile::tempdir().expect("a directory");
    let file: PathBuf = directory.path().join("network.safetensors");
    let rows = script("write", &file, "");
    let model = FloatModel::read(&file).expect("sound");
    assert_eq!(
        (model.inputs().join(","), model.temperature()),
        ("a,b,c,d,e".into(), 1.5)
    );
    same_logits(&model, &rows);
    let largest = largest_activations(&model, rows.iter().map(|(row, _)| row.as_slice()));
    let quantised = Quantised::new(&model, &largest).expect("fits");
    assert!(quantised.to_file().expect("sound").model().is_ok());
}

#[test]
fn python_reads_what_we_write() {
    let directory = tempfile::tempdir().expect("a directory");
    let (theirs, ours) = (
        directory.path().join("theirs.safetensors"),
        directory.path().join("ours.safetensors"),
    );
    let rows = script("write", &theirs, "");
    let model = FloatModel::read(&theirs).expect("sound");
    std::fs::write(&ours, model.to_bytes()).expect("written");
    let inputs: Vec<&Vec<f32>> = rows.iter().map(|(row, _)| row).collect();
    let read = script("read", &ours, &serde_json::to_string(&inputs).expect("JSON"));
    same_logits(&model, &read);
}
