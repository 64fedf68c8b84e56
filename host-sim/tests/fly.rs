//! `cslam fly` as a user meets it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use cslam_core::telemetry::{HealthCounters, Key};

fn fly(directory: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .current_dir(directory)
        .args(args)
        .output()
        .expect("the binary runs")
}

fn report(directory: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(directory.join("report.json")).expect("written")).expect("JSON")
}

/// Number of vertices a PLY header promises, checked against the lines that follow.
fn vertices(file: &Path) -> u64 {
    let text = fs::read_to_string(file).expect("text");
    let (header, body) = text.split_once("end_header\n").expect("a header");
    let count = header
        .lines()
        .find_map(|l| l.strip_prefix("element vertex "))
        .expect("a count");
    let count: u64 = count.parse().expect("a number");
    assert_eq!(body.lines().count() as u64, count, "{}", file.display());
    count
}

/// Every health counter that there is, as the report has it in both of its forms.
fn health(out: &Path) -> [u32; HealthCounters::NAMES.len()] {
    let page = fs::read_to_string(out.join("report.html")).expect("written");
    let report = report(out);
    HealthCounters::NAMES.map(|name| {
        let count = &report["health"][name];
        let words = name.replace('_', " ");
        let row = format!("<tr><th scope=\"row\">{words}</th><td>{count}</td></tr>");
        assert!(page.contains(&row), "the page has no row {row}");
        count
            .as_u64()
            .and_then(|count| count.try_into().ok())
            .expect(name)
    })
}

#[test]
fn a_path_list_flies_and_writes_everything() {
    let directory = tempfile::tempdir().expect("a directory");
    let output = fly(directory.path(), &["fly", "--paths", "bundled"]);
    let stdout = String::from_utf8(output.stdout).expect("text");
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert!(output.status.success(), "{stderr}");
    assert!(stdout.contains("accepted reflection points"), "{stdout}");
    let out = directory.path().join("out");
    let report = report(&out);
    assert_eq!(report["sweeps"], 1000);
    assert_eq!(report["measurements"], 1700);
    assert_eq!(report["map"]["points"], vertices(&out.join("map.ply")));
    assert!(vertices(&out.join("map_truth.ply")) > 100);
    let packets = fs::metadata(out.join("packets.bin")).expect("written").len();
    assert_eq!(report["telemetry"]["bytes"], packets);
    let accepted = report["map"]["accepted"].as_u64().expect("a number");
    let refused: u64 = report["verdicts"]
        .as_object()
        .expect("reasons")
        .values()
        .filter_map(|n| n.as_u64())
        .sum();
    assert_eq!(accepted + refused, 1700, "every path has one fate");
    let wrote = stderr
        .lines()
        .find_map(|l| l.strip_prefix("wrote "))
        .expect("what was written");
    let (names, _) = wrote.split_once(" to ").expect("where to");
    assert!(names.contains("flight.mcap") && names.contains("report.html"));
    assert!(names.split(", ").all(|name| out.join(name).is_file()), "{names}");
    assert_eq!(vertices(&out.join("points.ply")), accepted);
    // The ground hears of every measurement, and gets every point.
    let packets = fs::read(out.join("packets.bin")).expect("written");
    let heard = cslam_host_sim::evaluation::downlink::decode(&packets, 1, &Key::TEST);
    assert_eq!((heard.points.len() as u64, heard.refused.len()), (accepted, 0));
    assert_eq!(
        heard.links.iter().map(|link| link.outcomes.len()).sum::<usize>(),
        1700
    );
    let counters = heard.health.expect("it closes the stream").counters;
    assert_eq!(health(&out), counters.to_array());
    assert_eq!(u64::from(counters.map_points), vertices(&out.join("map.ply")));
    let bytes_per_point = report["telemetry"]["bytes_per_point"].as_f64().expect("known");
    assert!(
        bytes_per_point > 4.0 && bytes_per_point < 8.0,
        "{bytes_per_point} bytes a point"
    );
    let rmse_m = report["map"]["point_rmse_m"].as_f64().expect("known");
    assert!(
        rmse_m > 0.05 && rmse_m < 0.3,
        "the budget's errors show, and no more: {rmse_m} m"
    );
}

#[test]
fn the_seed_decides_every_byte() {
    let directory = tempfile::tempdir().expect("a directory");
    let run = |out: &str, seed: &str| {
        assert!(
            fly(
                directory.path(),
                &[
                    "fly", "--paths", "bundled", "--out", out, "--seed", seed, "--steps", "300"
                ]
            )
            .status
            .success()
        );
        let read = |name: &str| fs::read(directory.path().join(out).join(name)).expect("written");
        (read("packets.bin"), read("map.ply"), read("map_truth.ply"))
    };
    let (a, b, c) = (run("a", "7"), run("b", "7"), run("c", "8"));
    assert!(a == b);
    assert!(a.0 != c.0 && a.1 != c.1 && a.2 == c.2);
}

#[test]
fn without_errors_points_are_exact_and_the_paper_maps_the_strongest_path_only() {
    let directory = tempfile::tempdir().expect("a directory");
    let zero = "[path_errors]\nc_tau_m = 0.0\naoa_deg = 0.0\nposition_m = 0.0\naod_deg = 0.5\n";
    fs::write(directory.path().join("zero.toml"), zero).expect("writable");
    let run = |mode: &str| {
        let output = fly(
            directory.path(),
            &[
                "fly",
                "--paths",
                "bundled",
                "--config",
                "zero.toml",
                "--mode",
                mode,
                "--json",
                "--out",
                mode,
            ],
        );
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let stdout: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        assert_eq!(stdout, report(&directory.path().join(mode)));
        stdout
    };
    let (best, paper) = (run("best"), run("paper"));
    assert!(best["map"]["point_median_m"].as_f64().expect("known") < 1e-3);
    assert!(
        paper["map"]["accepted"].as_u64().expect("a number") > 10,
        "{paper}"
    );
    // Its network looks at all paths of a link, and maps the strongest alone.
    let points_beside_the_strongest = |mode: &str| {
        let packets = fs::read(directory.path().join(mode).join("packets.bin")).expect("written");
        let heard = cslam_host_sim::evaluation::downlink::decode(&packets, 1, &Key::TEST);
        let others = heard
            .links
            .iter()
            .flat_map(|link| link.outcomes.iter().skip(usize::from(link.first_path == 0)));
        others.filter(|outcome| outcome.is_point()).count()
    };
    assert_eq!(points_beside_the_strongest("paper"), 0);
    assert!(points_beside_the_strongest("best") > 50);
    assert_eq!(paper["measurements"], best["measurements"]);
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let directory = tempfile::tempdir().expect("a directory");
    fs::write(
        directory.path().join("typo.toml"),
        "[path_errors]\naoa_degrees = 1.0\n",
    )
    .expect("writable");
    fs::write(
        directory.path().join("negative.toml"),
        "[path_errors]\naoa_deg = -1.0\n",
    )
    .expect("writable");
    fs::write(
        directory.path().join("wall.toml"),
        "[[world.propagation.movers.given]]\nkind = \"car\"\nfrom_m = [5, 5]\nto_m = [115, 115]\nspeed_m_per_s = 8\n",
    )
    .expect("writable");
    fs::write(directory.path().join("empty.jsonl"), "").expect("writable");
    fs::write(directory.path().join("file"), "").expect("writable");
    for (args, expected) in [
        (
            ["--config", "typo.toml"],
            "typo.toml:2: unknown field `aoa_degrees`",
        ),
        (
            ["--config", "negative.toml"],
            "negative.toml:2: path_errors.aoa_deg is -1, expected a number of at least 0",
        ),
        (
            ["--config", "wall.toml"],
            "world.propagation.movers.given[0] goes through a wall or out of the scene between (5, 5) and (115, 115)",
        ),
        (["--paths", "empty.jsonl"], "nothing to fly"),
        (["--paths", "absent.jsonl"], "absent.jsonl: cannot be read"),
        (["--out", "file/below"], "cannot be made a directory"),
        (["--scene", "nowhere"], "nowhere"),
    ] {
        let output = fly(directory.path(), &[&["fly"], &args[..]].concat());
        let stderr = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
        assert!(stderr.contains(expected), "{stderr}");
    }
}

#[test]
fn without_a_word_it_flies_outdoors_in_the_real_world_from_raw_samples() {
    let directory = tempfile::tempdir().expect("a directory");
    let output = fly(directory.path(), &["fly", "--steps", "2"]);
    assert!(output.status.success());
    let report = report(&directory.path().join("out"));
    assert_eq!(
        (&report["sweeps"], &report["scene"], &report["world"]),
        (&2.into(), &"outdoor".into(), &"real".into())
    );
    let out = directory.path().join("out");
    let packets = fs::read(out.join("packets.bin")).expect("written");
    let heard = cslam_host_sim::evaluation::downlink::decode(&packets, 1, &Key::TEST);
    let counters = heard.health.expect("it closes the stream").counters;
    assert!(counters.imu_samples > 500 && counters.sweeps == 2, "{counters:?}");
    assert_eq!(health(&out), counters.to_array());
}

/// Nothing on board can show such a lie, but whoever set the GMT up: by default a simulated flight knows where that was.
#[test]
fn a_beacon_that_lies_from_the_start_is_held_against_the_place_of_set_up() {
    let directory = tempfile::tempdir().expect("a directory");
    let lie =
        "[[world.sensors.faults.beacon]]\nstart_s = 0.0\nduration_s = 1e9\noffset_m = [12.0, 16.0, 0.0]\n";
    let error_m = |setup: &str| {
        fs::write(directory.path().join("c.toml"), format!("{lie}{setup}")).expect("writable");
        let output = fly(
            directory.path(),
            &[
                "fly", "--world", "budget", "--steps", "24", "--config", "c.toml", "--out", "out",
            ],
        );
        assert!(output.status.success());
        let report = report(&directory.path().join("out"));
        report["trajectory"]["position_rmse_m"].as_f64().expect("poses")
    };
    let (known, not_known) = (
        error_m(""),
        error_m("[receiver.gmt_setup]\nwithin_m = 100000.0\n"),
    );
    assert!(known < 5.0 && not_known > 15.0, "{known} m, {not_known} m");
}

/// Twenty seconds from raw samples: the start, and the first walls.
#[test]
fn a_flight_from_raw_samples_finds_its_pose_and_repeats_bit_for_bit() {
    let directory = tempfile::tempdir().expect("a directory");
    let run = |out: &str, more: &[&str]| {
        let args = [
            &[
                "fly", "--world", "budget", "--scene", "outdoor", "--seed", "3", "--steps", "42", "--out",
                out,
            ],
            more,
        ]
        .concat();
        let output = fly(directory.path(), &args);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        report(&directory.path().join(out))
    };
    let best = run("best", &[]);
    assert_eq!((&best["sweeps"], &best["scene"]), (&42.into(), &"outdoor".into()));
    let figure =
        |report: &serde_json::Value, part: &str, key: &str| report[part][key].as_f64().expect("known");
    // It printed .066 m, .46 deg, .14 ns, 129 points, all of the right order, .027 m off the walls, and .59 of the first-order paths:
    // a receiver that is broken in any part is beyond one of these.
    assert!(figure(&best, "trajectory", "position_rmse_m") < 0.15);
    assert!(figure(&best, "trajectory", "attitude_rmse_deg") < 0.8);
    assert!(figure(&best, "clock", "rmse_ns") < 0.4);
    assert!(figure(&best, "map", "accepted") >= 120.0);
    assert!(figure(&best, "map", "precision") > 0.97);
    assert!(figure(&best, "map", "surface_rmse_m") < 0.07);
    assert!(figure(&best, "map", "recall_first_order") > 0.45);
    // The same seed, the same bytes; and the paper's way through all stages is another flight.
    run("again", &[]);
    let read = |out: &str, name: &str| fs::read(directory.path().join(out).join(name)).expect("written");
    for name in ["packets.bin", "map.ply", "trajectory.tum", "flight.mcap"] {
        assert!(read("best", name) == read("again", name), "{name}");
    }
    let paper = run("paper", &["--mode", "paper"]);
    assert_eq!(paper["mode"], "paper");
    assert!(read("best", "trajectory.tum") != read("paper", "trajectory.tum"));
}

/// The paper's calibration does not know when it has drifted. If its own pose judged its fixes, it would refuse those that could
/// bring it back after the first outage; its network judges them.
#[test]
fn a_drifted_calibration_takes_the_fixes_that_bring_it_back() {
    let directory = tempfile::tempdir().expect("a directory");
    let args = [
        "fly",
        "--world",
        "budget",
        "--localization",
        "baseline",
        "--seed",
        "1",
        "--steps",
        "70",
        "--out",
        "baseline",
    ];
    let output = fly(directory.path(), &args);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let report = report(&directory.path().join("baseline"));
    let used = report["link_state"]["los_used"].as_u64().expect("a number");
    let median_m = report["trajectory"]["position_median_m"].as_f64().expect("known");
    assert!(used >= 22 && median_m < 1.0, "{used} fixes, {median_m} m");
}

/// Heights of a flight's points, m.
fn heights_m(points: &Path) -> Vec<f64> {
    let text = fs::read_to_string(points).expect("written");
    let (_, rows) = text.split_once("end_header\n").expect("a header");
    let height = |row: &str| row.split(' ').nth(2).and_then(|z| z.parse().ok());
    rows.lines().map(|row| height(row).expect("x y z")).collect()
}

#[test]
fn a_scene_that_is_raised_is_flown_as_it_was() {
    let directory = tempfile::tempdir().expect("a directory");
    let flown = |name: &str, config: &str| {
        let file = format!("{name}.toml");
        fs::write(directory.path().join(&file), config).expect("writable");
        let args = [
            "fly", "--world", "budget", "--seed", "3", "--steps", "40", "--config", &file, "--out", name,
        ];
        let output = fly(directory.path(), &args);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        heights_m(&directory.path().join(name).join("points.ply"))
    };
    let raised = "[world.scene.placement]\nmoved_m = [0.0, 0.0, 10.0]\n";
    let below = format!("{raised}[receiver]\nground_z_m = 0.0\n");
    let [as_it_is, raised, below] =
        [("flat", ""), ("raised", raised), ("below", below.as_str())].map(|(name, text)| flown(name, text));
    let [all, of_raised] = [as_it_is.len(), raised.len()].map(|count| count as f64);
    assert!(
        all > 20.0 && (of_raised - all).abs() <= 0.05 * all,
        "{all} {of_raised}"
    );
    // Ground that is told ten metres too low costs the points of its own reflections, and hardly any other: nothing else hangs on it.
    let off_ground = |heights_m: &[f64], ground_m: f64| {
        let off = heights_m
            .iter()
            .filter(|height| (**height - ground_m).abs() > 0.5);
        off.count() as f64
    };
    let (on_walls, of_below) = (off_ground(&as_it_is, 0.0), off_ground(&below, 10.0));
    assert!(below.len() < as_it_is.len(), "{all} {}", below.len());
    assert!(
        on_walls > 20.0 && of_below > 0.9 * on_walls,
        "{on_walls} {of_below}"
    );
}
