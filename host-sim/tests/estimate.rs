//! `cslam estimate` as a user meets it: paths -> synth -> estimate -> the same paths, and one line for a bad recording.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction, Rotation, World};
use cslam_host_sim::paths::{Link, LinkPath};
use cslam_host_sim::{sigmf, statistics};
use serde_json::Value;

fn cslam(args: &[&str]) -> Output {
    cslam_on(args, "2")
}

fn cslam_on(args: &[&str], threads: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(args)
        .env("RAYON_NUM_THREADS", threads)
        .output()
        .expect("the binary runs")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain name")
}

fn done(output: Output) -> String {
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    String::from_utf8(output.stdout).expect("text")
}

fn refused(args: &[&str]) -> String {
    let output = cslam(args);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    assert!(output.stdout.is_empty());
    message
}

/// Links of the outdoor reference with two paths or more, all at least 4 m apart: nothing a beam could blend.
fn links(count: usize) -> Vec<Link> {
    let clear = |a: &LinkPath, b: &LinkPath| (a.delay_s - b.delay_s).abs() * SPEED_OF_LIGHT_M_PER_S > 4.0;
    let sound = |l: &&Link| {
        let p = &l.paths;
        p.len() >= 2 && (0..p.len()).all(|i| (0..i).all(|k| clear(&p[i], &p[k])))
    };
    let all = cslam_host_sim::path_flight::bundled().expect("sound");
    let taken: Vec<Link> = all.iter().filter(sound).take(count).cloned().collect();
    assert_eq!(taken.len(), count);
    taken
}

fn arrival(path: &LinkPath) -> Direction<World, f64> {
    Direction::from_zenith_azimuth(path.aoa_zenith_rad, path.aoa_azimuth_rad).expect("angles")
}

/// Writes links and records them; the names of the recordings.
fn record(folder: &Path, links: &[Link], more: &[&str]) -> Vec<PathBuf> {
    let file = folder.join("links.jsonl");
    let lines: Vec<String> = links
        .iter()
        .map(|l| serde_json::to_string(l).expect("JSON"))
        .collect();
    fs::write(&file, lines.join("\n")).expect("written");
    let out = folder.join("sweep");
    done(cslam(
        &[&["synth", "--paths", text(&file), "--out", text(&out)], more].concat(),
    ));
    match links.len() {
        1 => vec![out.with_extension("sigmf-meta")],
        n => (0..n)
            .map(|i| folder.join(format!("sweep-{i:04}.sigmf-meta")))
            .collect(),
    }
}

fn estimate(recordings: &[PathBuf], more: &[&str]) -> Vec<Value> {
    let mut args = vec!["estimate", "--json"];
    args.extend(recordings.iter().map(|r| text(r)));
    args.extend(more);
    let out = done(cslam(&args));
    let lines = out.lines().map(|l| serde_json::from_str(l).expect("JSON"));
    lines.collect()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

/// Estimated path next to a true one: its errors in m and rad, and in its own standard deviations of range.
fn errors(line: &Value, truth: &LinkPath) -> Option<[f64; 3]> {
    let of = |p: &Value| {
        let u = Direction::<World, f64>::from_zenith_azimuth(
            number(p, "aoa_zenith_rad"),
            number(p, "aoa_azimuth_rad"),
        )
        .expect("angles");
        let m = (number(p, "delay_s") - truth.delay_s) * SPEED_OF_LIGHT_M_PER_S;
        let sigma = p["covariance"][0][0].as_f64().expect("variance").sqrt();
        [m.abs(), u.angle_to_rad(&arrival(truth)), m.abs() / sigma]
    };
    let all = line["paths"].as_array().expect("paths").iter().map(of);
    all.filter(|e| e[0] < 1.0 && e[1] < 0.1)
        .min_by(|a, b| a[1].total_cmp(&b[1]))
}

#[test]
fn paths_come_back_as_they_went_in() {
    let folder = tempfile::tempdir().expect("folder");
    let links = links(4);
    let recordings = record(folder.path(), &links, &["--impairments", "none", "--seed", "3"]);
    let lines = estimate(&recordings, &[]);
    assert_eq!(lines.len(), 4);
    let (mut range_m, mut angle_rad, mut departures) = (Vec::new(), Vec::new(), Vec::new());
    for ((line, link), name) in lines.iter().zip(&links).zip(&recordings) {
        assert_eq!(line["recording"].as_str(), Some(text(name)));
        assert_eq!(
            (
                line["frame"].as_str(),
                line["mode"].as_str(),
                line["beams"].as_u64()
            ),
            (Some("world"), Some("best"), Some(72))
        );
        assert_eq!(
            serde_json::from_value::<[f64; 3]>(line["tx"].clone()).expect("tx"),
            link.tx
        );
        assert_eq!(
            serde_json::from_value::<[f64; 3]>(line["rx"].clone()).expect("rx"),
            link.rx
        );
        let found = line["paths"].as_array().expect("paths");
        assert_eq!(found.len(), link.paths.len(), "{line}");
        for (index, truth) in link.paths.iter().enumerate() {
            let [m, rad, _] = errors(line, truth).unwrap_or_else(|| panic!("path {index} of {line}"));
            range_m.push(m);
            angle_rad.push(rad);
        }
        // Strongest first by the received power.
        let strongest = errors(&serde_json::json!({ "paths": [found[0]] }), &link.paths[0]);
        assert!(strongest.is_some_and(|e| e[0] < 0.01), "{line}");
        let departure = Direction::<World, f64>::from_zenith_azimuth(
            number(&found[0], "aod_zenith_rad"),
            number(&found[0], "aod_azimuth_rad"),
        )
        .expect("angles");
        let truth = Direction::from_zenith_azimuth(
            link.paths[0].aod_zenith_rad.expect("angle"),
            link.paths[0].aod_azimuth_rad.expect("angle"),
        )
        .expect("angles");
        departures.push(departure.angle_to_rad(&truth).to_degrees());
        let (beam, snr_db) = (number(&found[0], "beam"), number(&found[0], "snr_db"));
        assert!(beam < 72.0 && (10.0..70.0).contains(&snr_db), "{line}");
    }
    let [m, rad] = [&range_m, &angle_rad].map(|e| statistics::median(e).expect("paths"));
    assert!(m < 0.005 && rad < 0.05_f64.to_radians(), "{m} m, {rad} rad");
    let worst = statistics::quantile(&departures, 1.0).expect("paths");
    assert!(worst < 1.0, "angle of departure {departures:?}");
}

#[test]
fn angles_are_those_of_the_world_and_of_the_body() {
    let folder = tempfile::tempdir().expect("folder");
    let config = folder.path().join("channel.toml");
    // Yaw of 150 degrees and a roll, GMT turned by 40 degrees.
    let attitude = Rotation::<Body, World, f64>::from_yaw_pitch_roll(2.618, 0.1, -0.2).expect("angles");
    let q = nalgebra::UnitQuaternion::from_matrix(attitude.matrix());
    fs::write(
        &config,
        format!(
            "[world]\nprofile = \"budget\"\n[world.channel.motion]\nuav_quaternion_wb = [{}, {}, {}, {}]\ngmt_heading_deg = 40.0\n[world.channel.impairments]\nfree_array_phase = true\n\
             uav_element_phase_rms_deg = 0.0\nuav_axis_rms_deg = 0.0\nuav_array_delay_rms_ps = 0.0\n\
             gmt_element_phase_rms_deg = 0.0\ngmt_element_delay_rms_ps = 0.0\n",
            q.w, q.i, q.j, q.k
        ),
    )
    .expect("written");
    let link = &links(1)[0];
    let recordings = record(
        folder.path(),
        std::slice::from_ref(link),
        &["--config", text(&config)],
    );
    let line = &estimate(&recordings, &["--gmt-heading-deg", "40"])[0];
    let truth = &link.paths[0];
    let [m, rad, sigmas] = errors(line, truth).expect("found");
    assert!(
        m < 0.01 && rad < 2e-3 && sigmas < 5.0,
        "{m} m, {rad} rad, {sigmas} sigma"
    );
    let found = &line["paths"][0];
    let body = Direction::<Body, f64>::from_zenith_azimuth(
        number(found, "aoa_body_zenith_rad"),
        number(found, "aoa_body_azimuth_rad"),
    )
    .expect("angles");
    assert!(attitude.apply(body).angle_to_rad(&arrival(truth)) < 2e-3);
    assert!((body.azimuth_rad() - number(found, "aoa_azimuth_rad")).abs() > 0.5);
    let departure = number(found, "aod_azimuth_rad") - truth.aod_azimuth_rad.expect("angle");
    assert!(departure.abs() < 0.02, "{departure}");

    // Without an attitude there are body angles only, and the solver says why it cannot use them.
    let meta: String = fs::read_to_string(&recordings[0]).expect("metadata");
    let mut meta: Value = serde_json::from_str(&meta).expect("JSON");
    let global = meta["global"].as_object_mut().expect("global");
    global.remove("cslam:uav_quaternion_wb").expect("attitude");
    fs::write(&recordings[0], meta.to_string()).expect("written");
    let line = &estimate(&recordings, &[])[0];
    let blind = &line["paths"][0];
    assert_eq!(line["frame"].as_str(), Some("body"));
    for angle in ["zenith", "azimuth"] {
        let body = number(blind, &format!("aoa_body_{angle}_rad"));
        assert_eq!(number(blind, &format!("aoa_{angle}_rad")), body);
        assert_eq!(body, number(found, &format!("aoa_body_{angle}_rad")));
    }
    let file = folder.path().join("estimate.jsonl");
    fs::write(&file, line.to_string()).expect("written");
    assert!(refused(&["solve", "--paths", text(&file)]).contains("`frame` is \"body\""));
}

#[test]
fn estimates_lead_the_solver_to_the_walls() {
    let folder = tempfile::tempdir().expect("folder");
    let links = links(12);
    let recordings = record(folder.path(), &links, &["--impairments", "none"]);
    let mut args = vec!["estimate", "--json"];
    args.extend(recordings.iter().map(|r| text(r)));
    let one = done(cslam_on(&args, "1"));
    assert_eq!(
        one,
        done(cslam_on(&args, "2")),
        "the same for any number of threads"
    );
    let file = folder.path().join("estimate.jsonl");
    fs::write(&file, one).expect("written");
    let solved = |file: &Path| -> Vec<(u64, [f64; 3])> {
        // A path whose departure no beam could tell has only the ground to prove it wrong.
        let out = done(cslam(&[
            "solve",
            "--json",
            "--ground",
            "0",
            "--paths",
            text(file),
        ]));
        let lines = out
            .lines()
            .map(|l| serde_json::from_str::<Value>(l).expect("JSON"));
        let point = |l: Value| {
            let point = serde_json::from_value(l["point"].clone()).ok()?;
            Some((l["link"].as_u64().expect("index"), point))
        };
        lines.filter_map(point).collect()
    };
    // Every point that the true paths lead to, and no other.
    let (truth, found) = (solved(&folder.path().join("links.jsonl")), solved(&file));
    assert!(truth.len() >= 4, "{truth:?}");
    assert_eq!(found.len(), truth.len(), "{found:?} {truth:?}");
    for (link, point) in &truth {
        let distance = |p: &[f64; 3]| (0..3).map(|i| (p[i] - point[i]).powi(2)).sum::<f64>().sqrt();
        let near = found.iter().any(|(l, p)| l == link && distance(p) < 0.05);
        assert!(near, "link {link}: {point:?} is not in {found:?}");
    }
}

#[test]
fn paper_mode_and_lost_beams_are_estimated_too() {
    let folder = tempfile::tempdir().expect("folder");
    let config = folder.path().join("channel.toml");
    fs::write(
        &config,
        "[world.channel.impairments]\ndropped_beams = [0, 1, 2, 70]\n",
    )
    .expect("written");
    let link = &links(1)[0];
    let recordings = record(
        folder.path(),
        std::slice::from_ref(link),
        &["--config", text(&config)],
    );
    let line = &estimate(&recordings, &["--mode", "paper"])[0];
    assert_eq!(
        (line["mode"].as_str(), line["beams"].as_u64()),
        (Some("paper"), Some(68))
    );
    let [m, rad, _] = errors(line, &link.paths[0]).expect("found");
    assert!(m < 0.7 && rad < 3_f64.to_radians(), "{m} m, {rad} rad");
    let table = done(cslam(&["estimate", text(&recordings[0])]));
    assert!(
        table.contains("paths in 68 of 72 beams, angles in world axes"),
        "{table}"
    );
    assert!(
        table.contains("c tau m") && table.lines().count() >= 3 + link.paths.len(),
        "{table}"
    );
}

#[test]
fn a_bad_recording_is_one_line_and_exit_two() {
    let folder = tempfile::tempdir().expect("folder");
    let link = &links(1)[0];
    let good = record(folder.path(), std::slice::from_ref(link), &[]).remove(0);
    let meta: Value = serde_json::from_str(&fs::read_to_string(&good).expect("text")).expect("JSON");
    let data = fs::read(good.with_extension("sigmf-data")).expect("data");
    let bad = folder.path().join("bad.sigmf-meta");
    let check = |expected: &str, data: &[u8], damage: &dyn Fn(&mut Value)| {
        let mut meta = meta.clone();
        damage(&mut meta);
        fs::write(&bad, meta.to_string()).expect("written");
        fs::write(bad.with_extension("sigmf-data"), data).expect("written");
        // Named among several, whatever order they end in.
        let message = refused(&["estimate", text(&good), text(&bad)]);
        assert!(
            message.contains("bad.sigmf-") && message.contains(expected),
            "{message}"
        );
    };
    check("is cut short", &data[..data.len() - 65_536], &|_| ());
    check("`core:num_channels` is 16, expected 32", &data, &|m| {
        m["global"]["core:num_channels"] = 16.into();
    });
    check("expected \"zc409-273\"", &data, &|m| {
        m["global"]["cslam:waveform"] = "zc409-1".into()
    });
    check("`cslam:beam` 5 appears twice", &data, &|m| {
        m["captures"][9]["cslam:beam"] = 5.into()
    });
    check("missing field `cslam:beam`", &data, &|m| {
        m["captures"][9].as_object_mut().map(|c| c.remove("cslam:beam"));
    });
    check("`captures` is empty", &[], &|m| {
        m["captures"] = Value::Array(Vec::new())
    });
    check("expected \"gmt-72\"", &data[..3 * 65_536], &|m| {
        m["global"]["cslam:codebook"] = "bsm-raster".into();
        m["captures"].as_array_mut().expect("captures").truncate(3);
    });
    assert!(
        refused(&["estimate", text(&folder.path().join("absent"))])
            .contains("absent.sigmf-meta: cannot be read")
    );
    assert!(refused(&["estimate", text(&good), "--gmt-heading-deg", "nan"]).contains("finite"));
    assert_eq!(sigmf::read(&good).expect("the good one").blocks.len(), 72);
}
