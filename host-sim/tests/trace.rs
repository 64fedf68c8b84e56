//! `cslam trace` and `cslam bench` as a user meets them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cslam_host_sim::paths;

fn fixture(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name);
    path.to_str().expect("text").to_owned()
}

fn cslam(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(args)
        .output()
        .expect("the binary runs")
}

fn trace(args: &[&str]) -> Output {
    cslam(&[&["trace"], args].concat())
}

/// Standard output of a run that must succeed.
fn good(args: &[&str]) -> String {
    let output = trace(args);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("text")
}

/// The one line that a bad run ends with.
fn bad(args: &[&str]) -> String {
    let output = trace(args);
    let message = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(output.stdout.is_empty(), "nothing was traced");
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

/// The end points of the reference links of one transmitter, as files.
fn end_points(directory: &Path) -> [PathBuf; 2] {
    let links = paths::read(Path::new(&fixture("outdoor_a.jsonl.gz"))).expect("sound");
    let line = |p: &[f64; 3]| format!("{},{},{}\n", p[0], p[1], p[2]);
    let mut transmitters: Vec<String> = links.iter().map(|l| line(&l.tx)).collect();
    transmitters.dedup();
    let receivers: String = links[..200].iter().map(|l| line(&l.rx)).collect();
    let files = ["tx.csv", "rx.csv"].map(|name| directory.join(name));
    fs::write(&files[0], format!("# GMT\n\n{}", transmitters.concat())).expect("written");
    fs::write(&files[1], receivers).expect("written");
    files
}

#[test]
fn every_link_has_its_line_whatever_the_threads() {
    let directory = tempfile::tempdir().expect("a directory");
    let [tx, rx] = end_points(directory.path());
    let run = |threads: &str, out: &Path| {
        let [tx, rx, out] = [&tx, &rx, out].map(|p| p.to_str().expect("text"));
        let text = good(&[
            "--scene",
            "outdoor_a",
            "--tx",
            tx,
            "--rx",
            rx,
            "--threads",
            threads,
            "--out",
            out,
        ]);
        assert!(text.is_empty(), "links go to the file");
        fs::read(out).expect("written")
    };
    let [one, two] = ["1", "2"].map(|n| run(n, &directory.path().join(n)));
    assert!(one == two, "1 and 2 threads differ");
    let links = paths::parse(Path::new("out"), std::str::from_utf8(&one).expect("text")).expect("sound");
    let reference = paths::read(Path::new(&fixture("outdoor_a.jsonl.gz"))).expect("sound");
    assert_eq!(links.len(), reference.len());
    for (link, expected) in links.iter().zip(&reference) {
        assert_eq!((link.tx, link.rx), (expected.tx, expected.rx));
        assert_eq!(link.paths.len(), expected.paths.len());
        assert!(
            link.paths
                .iter()
                .all(|p| p.gain.is_some() && p.aod_zenith_rad.is_some())
        );
    }
    assert!(links.iter().any(|l| l.paths.is_empty()) && links.iter().any(|l| l.paths.len() > 5));
}

#[test]
fn vertices_are_given_when_asked_for_and_read_over_otherwise() {
    let ends = ["--scene", "indoor", "--tx=3,10,1.2", "--rx", "25,10.2,1.5"];
    let plain = good(&ends);
    let full = good(&[&ends[..], &["--vertices"]].concat());
    let read = |text: &str| paths::parse(Path::new("out"), text).expect("sound");
    assert_eq!(read(&plain), read(&full));
    let value: serde_json::Value = serde_json::from_str(&full).expect("JSON");
    let third = value["paths"]
        .as_array()
        .expect("paths")
        .iter()
        .find(|p| p["order"] == 3)
        .expect("third order");
    let vertices = third["vertices"].as_array().expect("vertices");
    assert_eq!(vertices.len(), 3);
    assert_eq!(
        (&vertices[0], &vertices[2]),
        (&third["first_vertex"], &third["last_vertex"])
    );
    assert_eq!(third["faces"].as_array().expect("faces").len(), 3);
    let los = good(&[&ends[..], &["--max-order", "0"]].concat());
    assert_eq!(read(&los)[0].paths.len(), 1);
}

#[test]
fn a_check_tells_right_from_wrong() {
    let [scene, list] = ["indoor_scene.json", "indoor.jsonl.gz"].map(fixture);
    let text = good(&["--scene", &scene, "--check", &list, "--json"]);
    let verdict: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(
        (&verdict["passes"], &verdict["confirmed"]["matched"]),
        (&true.into(), &212.into())
    );
    assert!(good(&["--scene", &scene, "--check", &list]).contains("reference, confirmed"));
    let wrong = trace(&["--scene", "street", "--check", &list]);
    assert_eq!(wrong.status.code(), Some(1));
}

#[test]
fn diffracted_paths_say_their_kind_and_edge_and_read_back() {
    // Behind a house: nothing arrives without diffraction.
    let list = fixture("outdoor_a_diffraction.jsonl.gz");
    let links = paths::read(Path::new(&list)).expect("sound");
    let place = |p: [f64; 3]| format!("{},{},{}", p[0], p[1], p[2]);
    let mut kinds = std::collections::BTreeMap::new();
    for link in &links {
        let (tx, rx) = (place(link.tx), place(link.rx));
        let ends = ["--scene", "outdoor_a", "--tx", &tx, "--rx", &rx];
        let plain = good(&ends);
        assert!(!plain.contains("kind"));
        let text = good(&[&ends[..], &["--diffraction"]].concat());
        let read = paths::parse(Path::new("out"), &text).expect("sound").remove(0);
        let specular = paths::parse(Path::new("out"), &plain).expect("sound").remove(0);
        let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let mut reflected = 0;
        for (path, json) in read.paths.iter().zip(value["paths"].as_array().expect("paths")) {
            let kind = path.kind.expect("every path says its kind");
            *kinds.entry(kind.to_string()).or_insert(0) += 1;
            assert_eq!(json["kind"], kind.to_string());
            assert_eq!(path.edge_point.is_some(), kind.edge().is_some());
            assert_eq!(kind.interactions().len(), usize::from(path.order.expect("order")));
            if let Some(at) = kind.edge() {
                let vertex = if at == 0 {
                    path.first_vertex
                } else {
                    path.last_vertex
                };
                assert_eq!(path.edge_point, vertex);
            } else {
                let mut without = path.clone();
                without.kind = None;
                assert_eq!(without, specular.paths[reflected]);
                reflected += 1;
            }
        }
        assert_eq!(reflected, specular.paths.len());
    }
    for kind in ["LOS", "R", "RR", "D", "RD", "DR"] {
        assert!(kinds.contains_key(kind), "{kinds:?}");
    }
    let check = ["--scene", "outdoor_a", "--check", &list, "--diffraction"];
    let verdict: serde_json::Value =
        serde_json::from_str(&good(&[&check[..], &["--json"]].concat())).expect("JSON");
    assert_eq!(verdict["passes"], true);
    assert!(good(&check).contains("kinds D, RD and DR above -155 dB"));
    let wrong = trace(&["--scene", "street", "--check", &list, "--diffraction"]);
    assert_eq!(wrong.status.code(), Some(1));
    let output = trace(&[
        "--scene",
        "street",
        "--tx",
        "1,1,1",
        "--rx",
        "2,2,2",
        "--diffraction",
        "--least-gain=3",
    ]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn scattered_paths_are_the_same_for_a_seed_and_read_back() {
    let ends = [
        "--scene",
        "outdoor_a",
        "--tx=93.847903,108.226018,2",
        "--rx=93.237798,80.558383,10.0208",
    ];
    let run =
        |seed: &str| good(&[&ends[..], &["--diffraction", "--diffuse", "--diffuse-seed", seed]].concat());
    let (one, other) = (run("1"), run("2"));
    assert_eq!(one, run("1"));
    let scattered = |text: &str| -> Vec<f64> {
        let link = paths::parse(Path::new("out"), text).expect("sound").remove(0);
        let of_kind = |name: &str| {
            link.paths
                .iter()
                .filter(|p| p.kind.expect("kind").to_string() == name)
                .count()
        };
        assert!(of_kind("D") + of_kind("RD") > 0 && of_kind("S") > 100);
        let tiles = link
            .paths
            .iter()
            .filter(|p| p.kind.is_some_and(|k| k.to_string() == "S"));
        tiles.map(|path| path.gain_db().expect("gain")).collect()
    };
    let total_db = |gains_db: &[f64]| {
        10.0 * gains_db
            .iter()
            .map(|db| 10_f64.powf(0.1 * db))
            .sum::<f64>()
            .log10()
    };
    let [one, other] = [&one, &other].map(|text| total_db(&scattered(text)));
    // The reference list has -104.607 dB here.
    assert!(
        (one + 104.607).abs() < 0.3 && (one - other).abs() < 1e-9,
        "{one} {other}"
    );
    for wrong in [["--diffuse", "--scattering=1.5"], ["--diffuse", "--lobe=0"]] {
        assert_eq!(trace(&[&ends[..], &wrong].concat()).status.code(), Some(2));
    }
}

#[test]
fn bad_input_ends_with_code_2_and_one_line() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("points.csv");
    let name = file.to_str().expect("text");
    fs::write(&file, "1,2,3\n\n# next\n4,5\n").expect("written");
    let ends = ["--tx", "1,1,1", "--rx", "2,2,2"];
    let with = |scene: &str| bad(&[&["--scene", scene], &ends[..]].concat());
    assert!(with("nowhere").contains("scene nowhere: expected one of outdoor"));
    assert!(with("missing.json").contains("missing.json: cannot be read"));
    let message = bad(&["--scene", "street", "--tx", name, "--rx", "1,1,1"]);
    assert!(
        message.contains("points.csv:4: expected x,y,z in metres, found \"4,5\""),
        "{message}"
    );
    let message = bad(&["--scene", "street", "--tx", "1,nan,2", "--rx", "1,1,1"]);
    assert!(
        message.contains("--tx 1,nan,2: expected x,y,z in metres"),
        "{message}"
    );
    let message = bad(&["--scene", "street", "--tx", "1,20,2", "--rx", "1,20,2"]);
    assert!(message.contains("stand at 1,20,2"), "{message}");
    fs::write(&file, "# none\n").expect("written");
    assert!(bad(&["--scene", "street", "--tx", "1,1,1", "--rx", name]).contains("has no point"));
    let message = bad(&[
        "--scene",
        "street",
        "--tx",
        "1,20,2",
        "--rx",
        "9,20,2",
        "--out",
        "/nonexistent/x",
    ]);
    assert!(message.contains("/nonexistent/x: cannot be written"), "{message}");

    let crossed = directory.path().join("crossed.json");
    let faces = "[{\"vertices\":[[0,0,0],[1,1,0],[1,0,0],[0,1.5,0]]}]";
    fs::write(
        &crossed,
        format!(
            "{{\"name\":\"t\",\"units\":\"metre\",\"frequency_hz\":3e10,\"material\":{{\"relative_permittivity\":15,\
             \"conductivity_S_per_m\":0.015,\"model\":\"half-space\"}},\"faces\":{faces}}}"
        ),
    )
    .expect("written");
    let message = with(crossed.to_str().expect("text"));
    assert!(
        message.contains("crossed.json: face 0: intersects itself: edges 0 and 2 meet"),
        "{message}"
    );
    let of_adobe = faces.replace(
        "[{\"vertices\":[[0,0,0],[1,1,0],[1,0,0],[0,1.5,0]]",
        "[{\"material\":\"adobe\",\"vertices\":[[0,0,0],[1,0,0],[0,1,0]]",
    );
    let text = fs::read_to_string(&crossed)
        .expect("readable")
        .replace(faces, &of_adobe);
    fs::write(&crossed, text).expect("written");
    let message = with(crossed.to_str().expect("text"));
    assert!(
        message.contains("crossed.json: face 0: material \"adobe\" is not known, expected one of"),
        "{message}"
    );
    // Options that clap refuses also end with code 2.
    for args in [["--max-order", "9"], ["--threads", "0"]] {
        let output = trace(&[&["--scene", "street"], &ends[..], &args[..]].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
    }
}

#[test]
fn a_scene_is_moved_turned_and_made_uneven_by_options() {
    let street = ["--scene", "street", "--max-order", "1"];
    let paths = |args: &[&str]| -> Vec<serde_json::Value> {
        let line = good(&[&street, args].concat());
        let link: serde_json::Value = serde_json::from_str(&line).expect("a link");
        link["paths"].as_array().expect("paths").clone()
    };
    let here = paths(&["--tx", "9,20,2", "--rx", "50,18,5"]);
    // A quarter turn: x becomes y, y becomes -x.
    let there = paths(&[
        "--moved",
        "-100,30,7",
        "--turned",
        "90",
        "--tx",
        "-120,39,9",
        "--rx",
        "-118,80,12",
    ]);
    assert_eq!(here.len(), there.len());
    let number = |path: &serde_json::Value, key: &str| path[key].as_f64().expect("a number");
    for (here, there) in here.iter().zip(&there) {
        assert!((number(here, "delay_s") - number(there, "delay_s")).abs() < 1e-19);
        let turn = number(there, "aoa_azimuth_rad") - number(here, "aoa_azimuth_rad");
        assert!((turn - std::f64::consts::FRAC_PI_2).sin().abs() < 1e-9, "{turn}");
    }
    let ends = ["--tx", "9,20,2", "--rx", "50,18,5"];
    let heights = |args: &[&str]| -> Vec<f64> {
        let paths = paths(&[&ends[..], args].concat());
        let bounced = paths.iter().filter(|path| path["order"] == 1);
        bounced
            .map(|path| path["last_vertex"][2].as_f64().expect("a number"))
            .collect()
    };
    // The ground's point leaves z = 0; another seed is another ground.
    let grounds = [
        &["--relief", "0.1"][..],
        &["--relief", "0.1", "--surface-seed", "8"],
        &[],
    ]
    .map(|args| heights(args).into_iter().fold(f64::INFINITY, f64::min));
    assert!(
        grounds[0] != 0.0 && grounds[1] != 0.0 && grounds[0] != grounds[1] && grounds[2] == 0.0,
        "{grounds:?}"
    );
    assert_ne!(paths(&[&ends[..], &["--panels"]].concat()), here);
}

#[test]
fn who_stands_in_a_wall_is_told() {
    let output = trace(&["--scene", "outdoor_a", "--tx", "75,40,2", "--rx", "1,1,2"]);
    assert!(output.status.success());
    let note = String::from_utf8(output.stderr).expect("text");
    assert!(note.contains("1 of 1 transmitters lie inside a solid"), "{note}");
}
