//! `cslam classify` on reference lists and measurements.

use super::*;

fn fixture() -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/outdoor_a.jsonl.gz");
    text(&file).to_owned()
}

fn lines(output: &str) -> Vec<Value> {
    output
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

#[test]
fn every_link_of_the_reference_list_is_classified() {
    let links = cslam_host_sim::path_flight::bundled().expect("sound");
    let best = lines(&good(&["classify", "--json", "--paths", &fixture()]));
    assert_eq!(best.len(), links.len());
    let [mut heard, mut right, mut accepted, mut first] = [0.0; 4];
    for (index, (line, link)) in best.iter().zip(&links).enumerate() {
        assert_eq!(line["link"], index);
        let paths = line["paths"].as_array().expect("a list");
        assert_eq!(paths.len(), link.paths.len());
        let Some(strongest) = link.paths.first() else {
            assert_eq!(
                (&line["state"], &line["probabilities"]),
                (&Value::from(0), &Value::Null),
                "an outage"
            );
            continue;
        };
        heard += 1.0;
        let truth = strongest.order.expect("known").min(2) + 1;
        right += f64::from(u8::from(line["state"] == truth));
        let sum: f64 = line["probabilities"]
            .as_array()
            .expect("three")
            .iter()
            .filter_map(Value::as_f64)
            .sum();
        assert!((sum - 1.0).abs() < 1e-5);
        assert_eq!(paths[0]["first_order"], line["probabilities"][1]);
        for (path, truth) in paths.iter().zip(&link.paths) {
            let is_accepted = path["accepted"] == true;
            accepted += f64::from(u8::from(is_accepted));
            first += f64::from(u8::from(is_accepted && truth.order == Some(1)));
            assert!(!is_accepted || path["first_order"].as_f64().expect("a number") >= 0.8);
        }
    }
    assert!(right / heard > 0.98, "{right} of {heard} links");
    assert!(
        accepted > 300.0 && first / accepted > 0.95,
        "{first} of {accepted} accepted paths"
    );
}

#[test]
fn measurements_without_departure_gain_and_truth_are_classified() {
    let directory = tempfile::tempdir().expect("temporary");
    let file = directory.path().join("measured.jsonl");
    let mut links = cslam_host_sim::path_flight::bundled().expect("sound");
    links.iter_mut().flat_map(|l| &mut l.paths).for_each(|p| {
        (p.gain, p.aod_zenith_rad, p.aod_azimuth_rad) = (None, None, None);
        (p.first_vertex, p.last_vertex) = (None, None);
    });
    let write = |links: &[paths::Link]| {
        let lines: Vec<String> = links
            .iter()
            .map(|l| serde_json::to_string(l).expect("JSON"))
            .collect();
        fs::write(&file, lines.join("\n")).expect("written");
    };
    write(&links);
    let output = lines(&good(&["classify", "--json", "--paths", text(&file)]));
    let (mut heard, mut right) = (0.0, 0.0);
    for (line, link) in output.iter().zip(&links) {
        if let Some(path) = link.paths.first() {
            heard += 1.0;
            right += f64::from(u8::from(line["state"] == path.order.expect("known").min(2) + 1));
        }
    }
    assert!(right / heard > 0.75, "{right} of {heard}");
    // The same as with the angles of departure and not used.
    let mut with = cslam_host_sim::path_flight::bundled().expect("sound");
    with.iter_mut()
        .flat_map(|l| &mut l.paths)
        .for_each(|p| p.gain = None);
    write(&with);
    assert_eq!(
        lines(&good(&[
            "classify",
            "--json",
            "--ignore-aod",
            "--paths",
            text(&file)
        ])),
        output
    );
}

#[test]
fn the_papers_mode_tells_of_the_strongest_path_only() {
    let output = lines(&good(&[
        "classify",
        "--mode",
        "paper",
        "--json",
        "--paths",
        &fixture(),
    ]));
    for line in &output {
        let paths = line["paths"].as_array().expect("a list");
        assert!(
            paths
                .iter()
                .skip(1)
                .all(|p| p["first_order"].is_null() && p["accepted"] == false)
        );
        if let Some(first) = paths.first() {
            assert!(first["accepted"] == false || line["state"] == 2);
        }
    }
    let table = good(&["classify", "--mode", "paper", "--paths", &fixture()]);
    assert!(table.contains("links with a path classified rightly"), "{table}");
}

#[test]
fn faults_of_classification_are_named() {
    let directory = tempfile::tempdir().expect("temporary");
    let file = directory.path().join("m.lscn");
    fs::write(&file, b"no model").expect("written");
    let with = |more: &[&str]| bad(&[&["classify", "--paths", &fixture()], more].concat());
    assert!(with(&["--model", text(&file)]).contains("m.lscn"));
    assert!(with(&["--bounds", "1,2,3"]).contains("six numbers"));
    assert!(with(&["--range-sigma-m=-1"]).contains("at least 0"));
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/models/paper-k9.lscn");
    assert!(with(&["--model", text(&shipped)]).contains("--model: a Paper model"));
}
