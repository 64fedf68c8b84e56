//! Own measured paths as a user meets them: what the file says is what `solve`, `classify` and `fly --paths` use.

mod refused;

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use cslam_core::geometry::{Body, Direction, Matrix3, Rotation, World};
use cslam_host_sim::paths::Link;
use cslam_host_sim::random::Stream;
use serde_json::{Value, json};

const SPEED_OF_LIGHT_M_PER_S: f64 = 299_792_458.0;
/// Standard deviations of the measurements below: length, m, arrival and departure, rad.
const RANGE_SIGMA_M: f64 = 0.02;
const ANGLE_SIGMA_RAD: f64 = 0.001;
const DEPARTURE_SIGMA_RAD: f64 = 0.02;

fn cslam(directory: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .current_dir(directory)
        .args(args)
        .output()
        .expect("the binary runs")
}

fn good(directory: &Path, args: &[&str]) -> Output {
    let output = cslam(directory, args);
    assert!(
        output.status.success(),
        "{args:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// The one line of a command that was given bad input.
fn refused(directory: &Path, args: &[&str]) -> String {
    let output = cslam(directory, args);
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{args:?}: {stderr}");
    assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
    stderr
}

fn lines(output: &Output) -> Vec<Value> {
    let text = std::str::from_utf8(&output.stdout).expect("text");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

/// Links of the bundled list with an error of the size that their covariance says, heard at odd times by a turned UAV.
fn measured() -> Vec<Link> {
    let mut stream = Stream::new(11, 0);
    let mut links = cslam_host_sim::path_flight::bundled().expect("sound");
    links.truncate(300);
    for (index, link) in links.iter_mut().enumerate() {
        link.time_s = Some(2.0 + 0.375 * index as f64);
        let half = 0.05 * index as f64;
        link.uav_quaternion_wb = Some([half.cos(), 0.0, 0.0, half.sin()]);
        for path in &mut link.paths {
            path.delay_s += RANGE_SIGMA_M * stream.normal() / SPEED_OF_LIGHT_M_PER_S;
            path.aoa_zenith_rad += ANGLE_SIGMA_RAD * stream.normal();
            (path.order, path.first_vertex, path.last_vertex) = (None, None, None);
            let angle = ANGLE_SIGMA_RAD * ANGLE_SIGMA_RAD;
            path.covariance = Some([
                [RANGE_SIGMA_M * RANGE_SIGMA_M, 0.0, 0.0],
                [0.0, angle, 0.0],
                [0.0, 0.0, angle],
            ]);
            path.aod_sigma_rad = Some(DEPARTURE_SIGMA_RAD);
        }
    }
    links
}

fn write(file: &Path, links: &[Link]) {
    let lines: Vec<String> = links
        .iter()
        .map(|link| serde_json::to_string(link).expect("JSON"))
        .collect();
    fs::write(file, lines.join("\n")).expect("writable");
}

/// Rows of `points.ply`: time and place.
fn points(out: &Path) -> Vec<(f32, [f32; 3])> {
    let text = fs::read_to_string(out.join("points.ply")).expect("written");
    let (_, body) = text.split_once("end_header\n").expect("a header");
    body.lines()
        .map(|row| {
            let numbers: Vec<f32> = row
                .split(' ')
                .map(|cell| cell.parse().expect("a number"))
                .collect();
            (numbers[5], [numbers[0], numbers[1], numbers[2]])
        })
        .collect()
}

/// A column of a solved line.
fn place(line: &Value) -> Option<[f32; 3]> {
    let point = line["point"].as_array()?;
    Some(std::array::from_fn(|i| {
        point[i].as_f64().expect("a number") as f32
    }))
}

#[test]
fn a_measured_flight_is_its_lines_solved_and_classified_with_their_times() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let links = measured();
    write(&at.join("mine.jsonl"), &links);
    for (out, seed) in [("a", "1"), ("b", "9")] {
        good(
            at,
            &["fly", "--paths", "mine.jsonl", "--out", out, "--seed", seed],
        );
    }
    let flown = points(&at.join("a"));
    assert_eq!(flown, points(&at.join("b")), "no error is drawn");

    // What the network takes for one reflection, and whose point is known to half a metre: the gate of a flight.
    let classified = lines(&good(
        at,
        &["classify", "--json", "--ground", "0", "--paths", "mine.jsonl"],
    ));
    let solved = lines(&good(
        at,
        &["solve", "--json", "--open-gates", "--paths", "mine.jsonl"],
    ));
    let mut expected = Vec::new();
    for line in &solved {
        let [link, path] = ["link", "path"].map(|key| line[key].as_u64().expect("an index") as usize);
        let accepted = classified[link]["paths"][path]["accepted"] == true;
        if accepted && line["sigma_m"].as_f64().expect("solved") <= 0.5 {
            let time_s = links[link].time_s.expect("given") as f32;
            expected.push((time_s, place(line).expect("solved")));
        }
    }
    assert!(expected.len() > 50, "{} points", expected.len());
    assert_eq!(flown, expected);

    // The network says what every link is, and the ground hears when.
    let report: Value =
        serde_json::from_slice(&fs::read(at.join("a/report.json")).expect("written")).expect("JSON");
    assert_eq!(report["flight_s"], 0.375 * 300.0);
    assert!(
        report["verdicts"]["not one reflection"].as_u64() > Some(0),
        "{report}"
    );
    let packets = fs::read(at.join("a/packets.bin")).expect("written");
    let heard = cslam_host_sim::evaluation::downlink::decode(&packets, 1, &cslam_core::telemetry::Key::TEST);
    // One of the links has more paths than fit one report.
    let reports: Vec<_> = heard.links.iter().filter(|link| link.first_path == 0).collect();
    assert_eq!(reports.len(), links.len(), "outages are reported too");
    for (link, line) in reports.into_iter().zip(&classified) {
        let time_s = links[link.sweep as usize].time_s.expect("given");
        assert_eq!(link.time_ns, (time_s * 1e9) as u64);
        assert_eq!(
            u64::from(link.state as u8),
            line["state"].as_u64().expect("a state")
        );
    }
    // The poses are the list's.
    let poses = fs::read_to_string(at.join("a/truth.tum")).expect("written");
    let third: Vec<f64> = poses
        .lines()
        .nth(3)
        .expect("a pose a link")
        .split(' ')
        .map(|cell| cell.parse().expect("a number"))
        .collect();
    assert!(
        (third[0] - 2.75).abs() < 1e-9 && (third[6] - 0.1_f64.sin()).abs() < 1e-6,
        "{third:?}"
    );
}

#[test]
fn a_list_that_says_measured_gets_no_errors() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let mut links = measured();
    links
        .iter_mut()
        .flat_map(|l| &mut l.paths)
        .for_each(|p| p.covariance = None);
    let flown = |links: &[Link]| {
        write(&at.join("mine.jsonl"), links);
        ["1", "9"].map(|seed| {
            good(at, &["fly", "--paths", "mine.jsonl", "--seed", seed]);
            points(&at.join("out"))
        })
    };
    let [one, nine] = flown(&links);
    assert_ne!(one, nine, "a list that says nothing is taken for traced");
    links[0].measured = true;
    let [one, nine] = flown(&links);
    assert_eq!(one, nine);
    assert!(one.len() > 50, "{} points", one.len());
}

#[test]
fn the_error_of_a_point_follows_from_the_covariance() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let sigmas = |factor: f64| {
        let mut links = measured();
        links.iter_mut().flat_map(|l| &mut l.paths).for_each(|path| {
            path.covariance = path
                .covariance
                .map(|rows| rows.map(|row| row.map(|c| c * factor)));
        });
        write(&at.join("mine.jsonl"), &links);
        let args = [
            "solve",
            "--json",
            "--open-gates",
            "--position-sigma-m",
            "0",
            "--paths",
            "mine.jsonl",
        ];
        let solved: BTreeMap<_, _> = lines(&good(at, &args))
            .iter()
            .filter_map(|line| {
                let index = (line["link"].as_u64()?, line["path"].as_u64()?);
                Some((index, line["sigma_m"].as_f64()?))
            })
            .collect();
        assert!(solved.len() > 200, "{}", solved.len());
        solved
    };
    let (once, ninefold) = (sigmas(1.0), sigmas(9.0));
    for (index, sigma_m) in &once {
        let ratio = ninefold[index] / sigma_m;
        assert!((ratio - 3.0).abs() < 1e-3, "{index:?}: {ratio}");
    }
}

/// A path off a wall 20 m beside both ends, 40 m apart: its point is known in closed form, and so is its error.
#[test]
fn a_line_written_by_hand_has_the_point_and_the_sigma_of_the_book() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    // Length 40 sqrt(2) m, arrival at 45 degrees.
    let length_m = 40.0 * 2.0_f64.sqrt();
    let line = |angle_variance: f64, departure_rad: f64, departure_sigma_rad: f64| {
        json!({"tx": [0, 0, 10], "rx": [40, 0, 10], "measured": true, "paths": [{
            "delay_s": length_m / SPEED_OF_LIGHT_M_PER_S,
            "aoa_zenith_rad": FRAC_PI_2, "aoa_azimuth_rad": 0.75 * PI,
            "aod_zenith_rad": FRAC_PI_2, "aod_azimuth_rad": departure_rad, "aod_sigma_rad": departure_sigma_rad,
            "covariance": [[0, 0, 0], [0, angle_variance, 0], [0, 0, angle_variance]],
        }]})
    };
    let solve = |line: Value| {
        fs::write(at.join("one.jsonl"), line.to_string()).expect("writable");
        let args = [
            "solve",
            "--json",
            "--position-sigma-m",
            "0",
            "--paths",
            "one.jsonl",
        ];
        lines(&good(at, &args)).remove(0)
    };
    let solved = solve(line(1e-6, 0.25 * PI, 0.01));
    let point = place(&solved).expect("a point");
    for (found, true_m) in point.iter().zip([20.0, 20.0, 10.0]) {
        assert!((found - true_m).abs() < 1e-4, "{point:?}");
    }
    // On the ellipse of constant length with semi-axes a = 20 sqrt(2) and b = 20 the point at its top moves along x alone, by
    // d dphi / cos 45 deg for an angle in the plane; out of the plane the point turns about the axis between the ends by
    // d dtheta. Both with d = 20 sqrt(2) m and 1 mrad: sqrt(2 + 1) d mrad.
    let expected_m = 3.0_f64.sqrt() * 20.0 * 2.0_f64.sqrt() * 1e-3;
    let sigma_m = solved["sigma_m"].as_f64().expect("a number");
    assert!(
        (sigma_m - expected_m).abs() < 1e-3 * expected_m,
        "{sigma_m} against {expected_m}"
    );
    // Three degrees off: refused where the departure is known to half a degree, taken where to two; the two degrees of the
    // budget are not asked.
    let off = 0.25 * PI + 3.0_f64.to_radians();
    let verdict = |sigma_deg: f64| solve(line(1e-6, off, sigma_deg.to_radians()))["verdict"].clone();
    assert_eq!(verdict(0.5), "higher order: angle of departure disagrees");
    assert_eq!(verdict(2.0), "ok");
}

#[test]
fn angles_in_body_axes_are_turned_by_the_attitude_of_their_line() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let mut links = measured();
    links.truncate(60);
    // Errors that differ along the tangents, so that a covariance that is not turned shows.
    links.iter_mut().enumerate().for_each(|(index, link)| {
        link.uav_quaternion_wb = Some([0.9, 0.1, -0.2, 0.02 * index as f64]);
        link.paths.iter_mut().for_each(|path| {
            path.covariance = Some([[4e-4, 1e-5, 0.0], [1e-5, 4e-6, 1e-6], [0.0, 1e-6, 1e-6]]);
        });
    });
    write(&at.join("world.jsonl"), &links);
    // The same seen from the body.
    let in_body = |link: &Link| {
        let mut link = link.clone();
        let attitude = Rotation::<Body, World, f64>::from_quaternion(link.uav_quaternion_wb.expect("given"));
        let attitude = attitude.expect("a unit").inverse();
        for path in &mut link.paths {
            let aoa = Direction::<World, f64>::from_zenith_azimuth(path.aoa_zenith_rad, path.aoa_azimuth_rad);
            let aoa = aoa.expect("valid");
            let seen: Direction<Body, f64> = attitude.apply(aoa);
            // Both tangent pairs span one plane: e_body = turn e_world.
            let (w1, w2) = aoa.tangents();
            let (w1, w2) = (attitude.apply_vector(&w1), attitude.apply_vector(&w2));
            let (b1, b2) = seen.tangents();
            let mut lift = Matrix3::<f64>::identity();
            (lift.m22, lift.m23, lift.m32, lift.m33) = (b1.dot(&w1), b1.dot(&w2), b2.dot(&w1), b2.dot(&w2));
            let rows = path.covariance.expect("given");
            let turned = lift * Matrix3::from_fn(|i, j| rows[i][j]) * lift.transpose();
            path.covariance = Some(std::array::from_fn(|i| std::array::from_fn(|j| turned[(i, j)])));
            (path.aoa_zenith_rad, path.aoa_azimuth_rad) = (seen.zenith_rad(), seen.azimuth_rad());
        }
        let mut line = serde_json::to_value(&link).expect("JSON");
        line["frame"] = "body".into();
        line
    };
    let body: Vec<Value> = links.iter().map(in_body).collect();
    let text = |lines: &[Value]| lines.iter().map(Value::to_string).collect::<Vec<_>>().join("\n");
    fs::write(at.join("body.jsonl"), text(&body)).expect("writable");
    let solve = |file: &str| lines(&good(at, &["solve", "--json", "--paths", file]));
    let (world, body_solved) = (solve("world.jsonl"), solve("body.jsonl"));
    let mut found = 0;
    for (a, b) in world.iter().zip(&body_solved) {
        assert_eq!(a["verdict"], b["verdict"]);
        if let (Some(a_m), Some(b_m)) = (place(a), place(b)) {
            found += 1;
            let apart = (0..3).map(|i| (a_m[i] - b_m[i]).abs()).fold(0.0, f32::max);
            assert!(apart < 1e-2, "{a} {b}");
            let [a, b] = [a, b].map(|line| line["sigma_m"].as_f64().expect("a number"));
            assert!((a - b).abs() < 2e-3 * a, "{a} {b}");
        }
    }
    assert!(found > 10, "{found} points");
    let mut without = body.clone();
    without[0]
        .as_object_mut()
        .expect("a line")
        .remove("uav_quaternion_wb");
    fs::write(at.join("without.jsonl"), text(&without)).expect("writable");
    let error = refused(at, &["solve", "--paths", "without.jsonl"]);
    assert!(
        error.contains("without.jsonl:1: `frame` is \"body\"") && error.contains("uav_quaternion_wb"),
        "{error}"
    );
}

/// The example of docs/formats.md, "Your own measured paths": what stands there is what is printed, and the flight has the two points.
#[test]
fn the_example_of_the_docs_is_solved_classified_and_flown_as_it_says() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let page = include_str!("../../../docs/formats.md");
    let (_, rest) = page.split_once("<<'END'\n").expect("the list");
    let (list, rest) = rest.split_once("END\n").expect("its end");
    fs::write(at.join("mine.jsonl"), list).expect("writable");
    for command in ["solve", "classify"] {
        let (_, printed) = rest
            .split_once(&format!("`cslam {command} --paths mine.jsonl`"))
            .expect("the command");
        let printed = printed
            .split("```")
            .nth(1)
            .expect("its output")
            .trim_start_matches('\n');
        let output = good(at, &[command, "--paths", "mine.jsonl"]);
        let stdout = String::from_utf8(output.stdout).expect("text");
        assert!(stdout.starts_with(printed), "{stdout}");
    }
    good(at, &["fly", "--paths", "mine.jsonl"]);
    let flown = points(&at.join("out"));
    let solved = lines(&good(at, &["solve", "--json", "--paths", "mine.jsonl"]));
    let solved: Vec<_> = solved.iter().filter_map(place).collect();
    assert_eq!(flown, [(1.5, solved[0]), (2.25, solved[1])]);
}
