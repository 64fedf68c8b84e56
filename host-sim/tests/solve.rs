//! `cslam solve` as a user meets it: figures on the reference paths, and one line for bad input.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cslam_core::reflection::{Form, Gates};
use cslam_host_sim::measurement::Sigmas;
use cslam_host_sim::paths;
use cslam_host_sim::solve::{Comparison, Settings, excess_m, solve_all};
use cslam_host_sim::statistics::rms;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn cslam(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(args)
        .output()
        .expect("the binary runs")
}

fn compare(name: &str, form: Form, gates: Gates<f32>) -> Comparison {
    let links = paths::read(&fixture(name)).expect("sound");
    let settings = Settings {
        form,
        gates,
        sigmas: Sigmas::default(),
        use_aod: true,
    };
    let mut comparison = Comparison::default();
    for solved in solve_all(&links, &settings) {
        comparison.add(&links, &solved);
    }
    comparison
}

#[test]
fn reference_points_are_met_within_a_millimetre_in_f32() {
    for name in ["outdoor_a.jsonl.gz", "indoor.jsonl.gz"] {
        let comparison = compare(name, Form::Vector, Gates::open());
        let errors = &comparison.errors_above_1m_excess_m;
        assert_eq!(
            errors.len(),
            comparison.first_order_above_1m_excess,
            "{name}: every one is solved"
        );
        let rms_m = rms(errors).expect("many");
        assert!(rms_m <= 1e-3, "{name}: {rms_m} m");
    }
}

#[test]
fn no_line_of_sight_path_becomes_a_point_whatever_the_gates() {
    for name in ["outdoor_a.jsonl.gz", "indoor.jsonl.gz"] {
        for gates in [Gates::open(), Gates::default()] {
            let comparison = compare(name, Form::Vector, gates);
            let los: usize = comparison.verdicts.values().map(|n| n[0]).sum();
            assert!(los > 0);
            assert_eq!(comparison.verdicts["line of sight"][0], los, "{name}");
        }
    }
}

#[test]
fn most_higher_order_paths_are_caught_by_their_departure() {
    let (all, caught) = compare("outdoor_a.jsonl.gz", Form::Vector, Gates::default()).higher_order_caught();
    assert!(caught * 100 >= all * 85, "{caught} of {all}");
    let first: [usize; 5] = compare("outdoor_a.jsonl.gz", Form::Vector, Gates::default()).verdicts["higher order: angle of departure disagrees"];
    assert_eq!(first[1], 0, "no first-order path has a wrong departure");
}

#[test]
fn every_path_leads_to_one_json_line_with_its_indices() {
    let file = fixture("indoor.jsonl.gz");
    let output = cslam(&["solve", "--json", "--paths", file.to_str().expect("text")]);
    assert!(output.status.success());
    let links = paths::read(&file).expect("sound");
    let mut lines = std::str::from_utf8(&output.stdout).expect("text").lines();
    for (i, link) in links.iter().enumerate() {
        for (j, path) in link.paths.iter().enumerate() {
            let line: serde_json::Value = serde_json::from_str(lines.next().expect("a line")).expect("JSON");
            assert_eq!(
                (line["link"].as_u64(), line["path"].as_u64()),
                (Some(i as u64), Some(j as u64))
            );
            assert_eq!(line["form"], "vector");
            let ok = line["verdict"] == "ok";
            assert_eq!(line["point"].is_array(), ok, "{line}");
            assert_eq!(line["sigma_m"].is_number(), ok, "{line}");
            assert!(!(ok && excess_m(link, path) < 1e-3), "{line}");
        }
    }
    assert_eq!(lines.next(), None);
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| {
        let file = directory.path().join(name);
        std::fs::write(&file, text).expect("writable");
        file
    };
    let good = r#"{"tx":[0,0,2],"rx":[10,0,2],"paths":[]}"#;
    let broken = write("broken.jsonl", &format!("{good}\n{good}\n{{\"tx\":[0,0]}}\n"));
    let not_gzip = write("plain.jsonl.gz", good);
    let missing = directory.path().join("missing.jsonl");
    for (file, extra, expected) in [
        (
            &broken,
            "--json",
            "broken.jsonl:3: not a link of the paths format",
        ),
        (&not_gzip, "--json", "plain.jsonl.gz: is not gzipped text"),
        (&missing, "--json", "missing.jsonl: cannot be read"),
        (
            &broken,
            "--range-sigma-m=-1",
            "standard deviation c_tau_m is -1, expected a number of at least 0",
        ),
        (&broken, "--bounds=0,0,0,1,1", "--bounds wants six numbers"),
    ] {
        if extra.starts_with("--bounds") || extra.starts_with("--range") {
            std::fs::write(file, good).expect("writable");
        }
        let output = cslam(&["solve", extra, "--paths", file.to_str().expect("text")]);
        let stderr = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{expected}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
        assert!(stderr.contains(expected), "{stderr}");
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn impossible_measurements_get_a_reason_each() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("paths.jsonl");
    let path = |delay: &str, zenith: &str| {
        format!(
            r#"{{"tx":[0,0,2],"rx":[30,0,2],"paths":[{{"delay_s":{delay},"aoa_zenith_rad":{zenith},"aoa_azimuth_rad":1}}]}}"#
        )
    };
    let lines = [
        path("-1e-7", "1"),
        path("1e-8", "1"),
        path("2e-7", "9"),
        path("1e300", "1"),
        path("2e-7", "1.4"),
    ];
    std::fs::write(&file, lines.join("\n")).expect("writable");
    let output = cslam(&["solve", "--json", "--paths", file.to_str().expect("text")]);
    assert!(output.status.success());
    let verdicts: Vec<String> = std::str::from_utf8(&output.stdout)
        .expect("text")
        .lines()
        .map(|l| {
            serde_json::from_str::<serde_json::Value>(l).expect("JSON")["verdict"]
                .as_str()
                .expect("text")
                .into()
        })
        .collect();
    assert_eq!(
        verdicts,
        [
            "input: the delay is zero or negative",
            "input: the delay is shorter than the straight way from GMT to UAV",
            "input: an angle lies outside its range",
            "input: a number is not finite",
            "ok",
        ]
    );
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let file = fixture("outdoor_a.jsonl.gz");
    let mut child = Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(["solve", "--json", "--paths", file.to_str().expect("text")])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the binary runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), output.stderr.is_empty()), (Some(0), true));
}
