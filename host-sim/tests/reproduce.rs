//! `cslam reproduce points`, `link`, `maps` and `training` at reduced counts: what they print holds what the documentation
//! says, the same whatever the thread count, and bad input is named.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn cslam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .arg("reproduce")
        .args(arguments)
        .output()
        .expect("the program starts")
}

fn text(output: &Output) -> String {
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout.clone()).expect("text")
}

fn lines(output: &Output) -> Vec<Value> {
    let parse = |line: &str| serde_json::from_str(line).expect("JSON");
    text(output).lines().map(parse).collect()
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} of {row}"))
}

#[test]
fn points_reach_the_asked_errors() {
    let run = |threads| {
        cslam(&[
            "points",
            "--states",
            "60",
            "--seed",
            "3",
            "--json",
            "--threads",
            threads,
        ])
    };
    let (one, two) = (text(&run("1")), run("2"));
    assert_eq!(one, text(&two), "threads make no difference");
    let rows = lines(&two);
    assert_eq!(rows.len(), 4 + 3 * 5);
    for row in &rows[..4] {
        assert!(row["points"] == 60 && number(row, "rmse_m") < 1e-3, "{row}");
    }
    let of = |what: &str| {
        let found = rows
            .iter()
            .find(|row| row["what"].as_str().is_some_and(|w| w.starts_with(what)));
        found.unwrap_or_else(|| panic!("no row {what}"))
    };
    let best = of("best, by truth: found");
    assert!(number(best, "points") >= 57.0, "{best}");
    assert!(
        number(best, "median_m") < 0.02 && number(best, "rmse_m") < 0.25,
        "{best}"
    );
    let mapped = of("best, by truth: in the map");
    assert!(
        number(mapped, "points") >= 30.0 && number(mapped, "rmse_m") < 0.1,
        "{mapped}"
    );
    let paper = of("paper, by truth: found");
    assert!(number(paper, "median_m") > 5.0 * number(best, "median_m"));
    let interpolated = of("paper-interpolated, by truth: found");
    assert!(number(interpolated, "median_m") < number(paper, "median_m"));
    // What the receiver believes holds what the truth would have kept from it.
    let believed = of("best, by receiver: in the map");
    assert!(
        number(believed, "points") > number(mapped, "points") && number(believed, "wrong_order") >= 0.0,
        "{believed}"
    );
    assert!(mapped["wrong_order"].is_null(), "{mapped}");
    let wrong = of("paper, by receiver: in the map");
    assert!(
        number(wrong, "wrong_order") > 0.0
            && number(wrong, "far") > number(of("paper, by truth: in the map"), "far"),
        "{wrong}"
    );
}

#[test]
fn patterns_and_costs_are_printed_and_drawn() {
    let directory = tempfile::tempdir().expect("temporary");
    let file = |name: &str| directory.path().join(name);
    let drawn = |name: &str, words: &[&str]| {
        let text = std::fs::read_to_string(file(name)).expect("written");
        assert!(words.iter().all(|word| text.contains(word)) && text.trim_end().ends_with("</svg>"));
    };
    let pattern = file("deep/pattern.svg");
    let out = pattern.to_str().expect("text");
    let rows = lines(&cslam(&["pattern", "--out", out, "--json"]));
    let of = |table: &str| rows.iter().filter(|row| row["table"] == table).count();
    assert_eq!([of("transmit beam"), of("coverage"), of("squint")], [12, 10, 5]);
    drawn("deep/pattern.svg", &["array 4", "beam squint", "gain dBi"]);
    assert!(text(&cslam(&["pattern", "--out", out])).contains("plot:"));

    let costs = file("cost.svg");
    let out = costs.to_str().expect("text");
    let rows = lines(&cslam(&["complexity", "--states", "50", "--out", out, "--json"]));
    assert_eq!(rows.len(), 2 + 4 + 4 + 3);
    let vector = rows
        .iter()
        .find(|row| row["solver"] == "closed, vector form")
        .expect("ours");
    assert!(vector["failed"] == 0 && number(vector, "evaluations") == 1.0);
    drawn("cost.svg", &["bisection along the ray", "log10 of ns per point"]);
}

#[test]
fn the_link_is_told_whole() {
    let report = lines(&cslam(&["link", "--json"])).remove(0);
    let paths = report["link"]["paths"].as_array().expect("paths");
    assert!(
        paths.len() >= 20 && paths[0]["order"] == 1,
        "a first-order link with many paths"
    );
    assert!(paths.iter().all(|path| path["order"] != 0), "no line of sight");
    let best = &report["results"][0];
    let found: Vec<&Value> = best["paths"].as_array().expect("estimates").iter().collect();
    let first_order = |estimate: &&&Value| {
        let truth = estimate["truth"].as_u64();
        truth.is_some_and(|truth| paths[truth as usize - 1]["order"] == 1)
    };
    let right: Vec<&&Value> = found.iter().filter(first_order).collect();
    assert!(right.len() >= 2, "both walls are heard");
    let nearest = right
        .iter()
        .map(|e| number(e, "error_m"))
        .fold(f64::INFINITY, f64::min);
    assert!(nearest < 0.05, "{nearest}");
    let tables = text(&cslam(&["link"]));
    for word in [
        "estimate, best",
        "estimate, paper",
        "link state, best",
        "not published",
    ] {
        assert!(tables.contains(word), "{word}");
    }
}

#[test]
fn maps_are_written_and_lie_on_the_walls() {
    let directory = tempfile::tempdir().expect("temporary");
    let out = directory.path().to_str().expect("text");
    let arguments = [
        "maps",
        "--scene",
        "indoor",
        "--duration",
        "12",
        "--out",
        out,
        "--json",
    ];
    let rows = lines(&cslam(&arguments));
    assert_eq!(rows.len(), 3, "best, paper, paper with delays between taps");
    let best = &rows[0];
    assert!(best["mode"] == "best" && number(best, "points") >= 10.0, "{best}");
    assert!(number(best, "precision_first_order") >= 0.95, "{best}");
    assert!(
        number(best, "surface_rmse_m") < 0.1 && number(best, "point_median_m") < 0.1,
        "{best}"
    );
    for name in ["indoor-best", "indoor-paper", "indoor-truth"] {
        let file = |end: &str| {
            std::fs::read_to_string(directory.path().join(format!("{name}.{end}"))).expect("written")
        };
        assert!(
            file("ply").starts_with("ply\n") && file("svg").trim_end().ends_with("</svg>"),
            "{name}"
        );
    }
    let cloud = std::fs::read_to_string(directory.path().join("indoor-best.ply")).expect("written");
    assert!(cloud.contains(&format!("element vertex {}\n", best["points"])));
}

#[test]
fn training_curves_are_printed_and_drawn() {
    let directory = tempfile::tempdir().expect("temporary");
    let file = directory.path().join("curves.svg");
    let out = file.to_str().expect("text");
    let rows = lines(&cslam(&[
        "training", "--rate", "0.0005", "--epochs", "3", "--out", out, "--json",
    ]));
    assert_eq!(rows.len(), 3);
    assert_eq!(rows.iter().filter(|row| row["best"] == true).count(), 1);
    assert!(number(&rows[2], "training_loss") < number(&rows[0], "training_loss"));
    assert!(std::fs::read_to_string(&file).expect("written").contains("K = 9"));
}

#[test]
fn bad_input_is_named() {
    let refused = |arguments: &[&str], words: &[&str]| {
        let output = cslam(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    refused(&["link", "--tx", "1,2"], &["--tx", "x,y,z"]);
    refused(&["link", "--scene", "nowhere"], &["nowhere"]);
    refused(&["training", "--rate", "0"], &["--rate"]);
    refused(&["points", "--states", "0"], &["--states"]);
    refused(&["complexity", "--states", "0"], &["--states"]);
    refused(&["pattern", "--out", "/dev/null/pattern.svg"], &["/dev/null"]);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    refused(&["maps", "--out", file.to_str().expect("text")], &["Cargo.toml"]);
}

#[test]
fn flights_to_report_are_not_flown_beside_others() {
    for what in [&["flights"][..], &["attacks", "jamming"]] {
        let output = cslam(&[what, &["--first-seed", "199"]].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{what:?}: {said}");
        assert!(
            said.contains("seed 201 is flown to report only") && said.lines().count() == 1,
            "{what:?}: {said}"
        );
    }
}
