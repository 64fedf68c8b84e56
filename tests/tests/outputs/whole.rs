//! Files are whole and reproducible.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use cslam_host_sim::flight_files::ply::Encoding;
use cslam_host_sim::flight_files::{Export, Outputs};
use cslam_host_sim::scene::Scene;

use crate::{cut, synthetic, write};

fn scene() -> Scene {
    Scene::load("outdoor").expect("built in")
}

/// Number of vertices a binary or ASCII PLY promises, checked against what follows.
fn vertices(file: &Path) -> usize {
    let bytes = fs::read(file).expect("written");
    let mark = b"end_header\n";
    let header_end = bytes
        .windows(mark.len())
        .position(|w| w == mark)
        .expect("a header")
        + mark.len();
    let header = String::from_utf8(bytes[..header_end].to_vec()).expect("text");
    let count = header
        .lines()
        .find_map(|l| l.strip_prefix("element vertex "))
        .expect("a count");
    let count: usize = count.parse().expect("a number");
    let body = &bytes[header_end..];
    if header.contains("format ascii") {
        assert_eq!(
            body.iter().filter(|b| **b == b'\n').count(),
            count,
            "{}",
            file.display()
        );
    } else {
        let stride = 4 * header.lines().filter(|l| l.starts_with("property ")).count();
        assert_eq!(body.len(), count * stride, "{}", file.display());
    }
    count
}

/// Messages of a recording by topic.
fn messages(file: &Path) -> BTreeMap<String, usize> {
    let bytes = fs::read(file).expect("written");
    assert!(
        mcap::Summary::read(&bytes).expect("sound").is_some(),
        "a whole recording has its index"
    );
    let mut counts = BTreeMap::new();
    let mut last_ns = 0;
    for message in mcap::MessageStream::new(&bytes).expect("a recording") {
        let message = message.expect("sound");
        assert!(message.log_time >= last_ns, "messages come in the order of time");
        last_ns = message.log_time;
        *counts.entry(message.channel.topic.clone()).or_default() += 1;
    }
    counts
}

#[test]
fn a_flight_cut_anywhere_leaves_whole_files() {
    let scene = scene();
    let log = synthetic::fly(&scene, 12.0, 4);
    assert_eq!(log.sweeps.len(), 24);
    let directory = tempfile::tempdir().expect("a directory");
    for sweeps in [0, 1, 2, 7, 23, 24] {
        let mut log = cut(&log, sweeps);
        let out = directory.path();
        let report = write(&mut log, &scene, out, Encoding::Binary);
        assert_eq!((report.sweeps, report.interrupted), (sweeps, sweeps < 24));
        let exports = [Export::Npz, Export::Ros2, Export::Animation].map(Export::name);
        for name in Outputs::NAMES.into_iter().chain(exports) {
            assert!(
                out.join(name).is_file() && !out.join(format!("{name}.part")).exists(),
                "{name}"
            );
        }
        let read = |name: &str| fs::read_to_string(out.join(name)).expect("text");
        let json: serde_json::Value = serde_json::from_str(&read("report.json")).expect("JSON");
        assert_eq!(json["sweeps"], sweeps);
        assert_eq!(json["map"]["points"], vertices(&out.join("map.ply")));
        assert_eq!(vertices(&out.join("points.ply")), log.points.len());
        vertices(&out.join("map_truth.ply"));
        for name in ["trajectory.tum", "truth.tum"] {
            let lines: Vec<String> = read(name)
                .lines()
                .filter(|l| !l.starts_with('#'))
                .map(str::to_owned)
                .collect();
            assert_eq!(lines.len(), log.poses.len(), "{name}");
            assert!(
                lines
                    .iter()
                    .all(|l| l.split(' ').filter_map(|n| n.parse::<f64>().ok()).count() == 8)
            );
        }
        let topics = messages(&out.join("flight.mcap"));
        assert_eq!(topics.get("/link_state").copied().unwrap_or(0), sweeps);
        assert_eq!(topics.get("/pose").copied().unwrap_or(0), log.poses.len());
        assert_eq!((topics["/scene"], topics["/map"]), (1, 1));
        let page = read("report.html");
        assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
        assert_eq!(page.contains("ended early"), sweeps < 24);
        let (drawn, _) = page.split_once("<script>").expect("the script comes last");
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"), "{sweeps}");
    }
}

#[test]
fn the_page_asks_nobody() {
    let scene = scene();
    let mut log = synthetic::fly(&scene, 3.0, 4);
    log.header.scene = "</script><b>&\"".into();
    let directory = tempfile::tempdir().expect("a directory");
    write(&mut log, &scene, directory.path(), Encoding::Ascii);
    let page = fs::read_to_string(directory.path().join("report.html")).expect("text");
    for word in ["http://", "https://", "src=", "@import", "url(", "fetch(", "<b>"] {
        assert!(!page.contains(word), "{word}");
    }
    // One for the data, one for the script: a scene's name ends neither.
    assert_eq!(page.matches("</script").count(), 2);
}

#[test]
fn the_same_flight_gives_the_same_bytes() {
    let scene = scene();
    let directory = tempfile::tempdir().expect("a directory");
    let fly = |name: &str, seed: u64| {
        let out = directory.path().join(name);
        fs::create_dir(&out).expect("writable");
        write(
            &mut synthetic::fly(&scene, 20.0, seed),
            &scene,
            &out,
            Encoding::Binary,
        );
        Outputs::NAMES.map(|file| fs::read(out.join(file)).expect("written"))
    };
    let (a, b, c) = (fly("a", 3), fly("b", 3), fly("c", 5));
    for (index, name) in Outputs::NAMES.iter().enumerate() {
        assert!(a[index] == b[index], "{name}");
        assert!(a[index] != c[index] || *name == "packets.bin", "{name}");
    }
}
