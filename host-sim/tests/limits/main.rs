//! What a user may hand the program by mistake or by malice, command by command: exit code 2 and one line that names the file, its
//! line or key, and what was expected.

use std::fs;
use std::path::Path;
use std::process::Command;

use cslam_host_sim::input::limits;

/// The page for users has the limits in force.
#[test]
fn the_page_lists_every_limit() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/formats.md"))
        .expect("the page");
    for (name, limit) in [
        ("path list", limits::PATH_LIST),
        ("scene (", limits::SCENE),
        ("points", limits::POINTS),
        ("configuration", limits::CONFIGURATION),
        ("samples (`.sigmf-meta`)", limits::SAMPLES_METADATA),
        ("recorded flight: `flight.json`", limits::FLIGHT_DESCRIPTION),
        ("recorded flight: the files", limits::FLIGHT_EVENTS),
        (
            "recorded flight: `estimated_paths.jsonl`",
            limits::ESTIMATED_PATHS,
        ),
        ("packets", limits::PACKETS),
        ("key", limits::KEY),
        ("model that flies", limits::MODEL),
        ("float model", limits::FLOAT_MODEL),
        ("data set: `dataset.json`", limits::DATASET_DESCRIPTION),
        ("data set: a column", limits::DATASET_COLUMN),
    ] {
        let row = page.lines().find(|line| line.starts_with(&format!("| {name}")));
        let row = row.unwrap_or_else(|| panic!("no row of {name}"));
        assert!(row.contains(&format!("| {}", limit.bytes)), "{row}");
        if limit.packed_bytes != limit.bytes {
            assert!(row.contains(&format!(" {} packed", limit.packed_bytes)), "{row}");
        }
        if limit.line_bytes as u64 != limit.bytes {
            assert!(row.contains(&format!("| {} |", limit.line_bytes)), "{row}");
        }
    }
    for text in [
        format!("{} paths a link", limits::LINK_PATHS),
        format!(
            "{} faces, {} vertices, {} vertices a face",
            limits::SCENE_FACES,
            limits::SCENE_VERTICES,
            limits::FACE_VERTICES
        ),
        format!("{} points", limits::POINT_COUNT),
        format!("{} s |", limits::FLIGHT_S),
        format!("{} shards", limits::DATASET_SHARDS),
        format!("{} links in all", limits::DATASET_LINKS),
        format!("within {} dB", limits::SNR_DB),
    ] {
        assert!(page.contains(&text), "{text}");
    }
}

/// Runs the command in a directory and gives the one line of its refusal.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the binary runs");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{arguments:?}: {message}");
    message
}

/// An input file, the arguments that read it, and what the refusal must say.
type Case<'a> = (&'a str, String, &'a [&'a str], &'a str);

fn all_refused(cases: &[Case<'_>]) {
    let folder = tempfile::tempdir().expect("a directory");
    for (name, content, arguments, expected) in cases {
        fs::write(folder.path().join(name), content).expect("written");
        let message = refused(folder.path(), arguments);
        assert!(message.contains(expected), "{message} instead of {expected}");
    }
}

const LINK: &str = r#"{"tx":[0,0,2],"rx":[30,0,9],"paths":[{"delay_s":1.1e-7,"aoa_zenith_rad":1.4,"aoa_azimuth_rad":3.1,"aod_zenith_rad":1.5,"aod_azimuth_rad":0.1,"gain":[1e-5,0]}]}"#;

#[test]
fn path_lists() {
    let solve: &[&str] = &["solve", "--paths", "p.jsonl"];
    let classify: &[&str] = &["classify", "--paths", "p.jsonl"];
    let fly: &[&str] = &["fly", "--paths", "p.jsonl"];
    let path = r#"{"delay_s":1e-7,"aoa_zenith_rad":1.4,"aoa_azimuth_rad":3.1}"#;
    let paths = vec![path; limits::LINK_PATHS + 1].join(",");
    let crowd = format!(r#"{{"tx":[0,0,2],"rx":[30,0,9],"paths":[{paths}]}}"#);
    for command in [solve, classify, fly] {
        all_refused(&[
            (
                "p.jsonl",
                format!("{LINK}\n{}", LINK.replace("gain", "gian")),
                command,
                "p.jsonl:2: not a link of the paths format: unknown field `gian`, expected one of `order`",
            ),
            (
                "p.jsonl",
                LINK.replace("\"rx\"", "\"tr\""),
                command,
                "p.jsonl:1: not a link of the paths format: unknown field `tr`",
            ),
            (
                "p.jsonl",
                crowd.clone(),
                command,
                "p.jsonl:1: `paths` has 1025 paths, expected at most 1024",
            ),
            (
                "p.jsonl",
                format!("{LINK}\n{}{LINK}", " ".repeat(limits::PATH_LIST.line_bytes)),
                command,
                "p.jsonl:2: has 1048",
            ),
        ]);
    }
}

#[test]
fn a_list_that_unpacks_to_gigabytes_is_refused() {
    use std::io::Write;
    let folder = tempfile::tempdir().expect("a directory");
    let file = fs::File::create(folder.path().join("bomb.jsonl.gz")).expect("a file");
    let mut encoder = flate2::write::GzEncoder::new(file, flate2::Compression::best());
    let block = vec![b' '; 1 << 20];
    for _ in 0..=limits::PATH_LIST.bytes >> 20 {
        encoder.write_all(&block).expect("written");
    }
    encoder.finish().expect("written");
    let message = refused(folder.path(), &["solve", "--paths", "bomb.jsonl.gz"]);
    assert!(
        message.contains("bomb.jsonl.gz: unpacks to more than 268435456 bytes"),
        "{message}"
    );
}

fn face(vertices: usize) -> String {
    // Every second one on an inner circle: nothing but the number of vertices decides what this costs.
    let corner = |i: usize| {
        let (angle, radius) = (
            std::f64::consts::TAU * i as f64 / vertices as f64,
            50.0 + (i % 2) as f64,
        );
        [radius * angle.cos(), radius * angle.sin()]
    };
    let corners: Vec<String> = (0..vertices)
        .map(corner)
        .map(|[x, y]| format!("[{x},{y},0]"))
        .collect();
    format!(
        "{{\"name\":\"t\",\"units\":\"metre\",\"frequency_hz\":3e10,\"material\":{{\"relative_permittivity\":15,\
         \"conductivity_S_per_m\":0.015,\"model\":\"half-space\"}},\n\"faces\":[{{\"vertices\":[{}]}}]}}",
        corners.join(",")
    )
}

#[test]
fn scenes() {
    let trace = |file: &'static str| -> [&'static str; 7] {
        ["trace", "--scene", file, "--tx", "0,0,2", "--rx", "5,5,5"]
    };
    let (json, obj, ply) = (trace("s.json"), trace("s.obj"), trace("s.ply"));
    let mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    let polygon = |count: usize| (0..count).map(|i| format!(" {}", 1 + i % 3)).collect::<String>();
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uint int vertex_indices\nend_header\n";
    all_refused(&[
        (
            "s.json",
            face(100_000),
            &json,
            "s.json: face 0: has 100000 vertices, at most 1024 are read",
        ),
        (
            "s.json",
            face(4).replace("units", "unit"),
            &json,
            "s.json:1: not a scene: unknown field `unit`",
        ),
        (
            "s.json",
            face(4).replace("\"vertices\"", "\"normals\":[0,0,1],\"vertices\""),
            &json,
            "s.json:2: not a scene: unknown field `normals`",
        ),
        (
            "s.json",
            face(4).replace("\"model\"", "\"density\":1,\"model\""),
            &json,
            "s.json:1: not a scene: unknown field `density`",
        ),
        (
            "s.obj",
            format!("{mesh}f{}\n", polygon(100_000)),
            &obj,
            "s.obj:4: not an OBJ mesh: a face has 100000 vertices, expected 3 to 1024",
        ),
        (
            "s.obj",
            format!("{mesh}F 1 2 3\n"),
            &obj,
            "s.obj:4: not an OBJ mesh: unknown statement \"F\"",
        ),
        (
            "s.obj",
            format!("{mesh}\nf 1 2 4\n"),
            &obj,
            "s.obj:5: not an OBJ mesh: a face names vertex 4, there are 3 before it",
        ),
        (
            "s.obj",
            mesh.replace("1 1 0", "1 one 0"),
            &obj,
            "s.obj:3: not an OBJ mesh: expected v x y z",
        ),
        (
            "s.ply",
            format!("{header}0 0 0 1 0 0 1 1 0\n100000{}\n", polygon(100_000)),
            &ply,
            "s.ply: not a PLY mesh: face 0: vertex_indices: a face has 100000 vertices, at most 1024 are read",
        ),
        (
            "s.ply",
            header.replace("face 1", "face 9999999"),
            &ply,
            "s.ply: not a PLY mesh: element face: 9999999 in it",
        ),
    ]);
}

#[test]
fn scenes_of_what_makes_no_sense() {
    let trace: &[&str] = &["trace", "--scene", "s.json", "--tx", "0,0,2", "--rx", "5,5,5"];
    let fly: &[&str] = &["fly", "--scene", "s.json", "--out", "x"];
    let record: &[&str] = &["record", "--scene", "s.json", "--out", "x"];
    let materials = |values: &str| {
        face(4).replace(
            "\"faces\"",
            &format!("\"materials\":{{\"m\":{{{values}}}}},\"faces\""),
        )
    };
    let no_face = format!("{}[]}}", face(4).split_once("[{").expect("faces").0);
    for command in [trace, fly, record] {
        all_refused(&[
            (
                "s.json",
                materials("\"name\":\"brick\",\"rms_height_m\":-0.001"),
                command,
                "s.json: materials: \"m\": expected rms_height_m >= 0",
            ),
            (
                "s.json",
                face(4).replace("\"vertices\"", "\"material\":\"adobe\",\"vertices\""),
                command,
                "s.json: face 0: material \"adobe\" is not known, expected one of",
            ),
            (
                "s.json",
                materials("\"name\":\"adobe\""),
                command,
                "s.json: materials: \"m\": name: material \"adobe\" is not known, expected one of",
            ),
            (
                "s.json",
                no_face.clone(),
                command,
                "s.json: a scene needs at least one face",
            ),
        ]);
    }
    let options = |options: &[&'static str]| -> Vec<&'static str> {
        let command = ["trace", "--scene", "street", "--tx", "9,20,2", "--rx", "50,20,5"];
        [&command[..], options].concat()
    };
    for (more, expected) in [
        (
            &["--relief", "-0.1"][..],
            "surfaces.ground_relief_rms_m is -0.1, expected 0 to 1",
        ),
        (
            &["--turned", "nan"],
            "placement.turned_deg is NaN, expected -360 to 360",
        ),
        (
            &["--moved", "1e6,0,0"],
            "placement.moved_m holds 1000000, expected",
        ),
    ] {
        all_refused(&[("unused", String::new(), &options(more), expected)]);
    }
}

#[test]
fn points() {
    let arguments: &[&str] = &[
        "trace",
        "--scene",
        "outdoor_a",
        "--tx",
        "60,60,2",
        "--rx",
        "p.txt",
    ];
    all_refused(&[
        (
            "p.txt",
            "1,2,3\n1,2\n".into(),
            arguments,
            "p.txt:2: expected x,y,z in metres, found \"1,2\"",
        ),
        (
            "p.txt",
            format!("1,2,3\n#{}\n", "-".repeat(2000)),
            arguments,
            "p.txt:2: has 2001 bytes, expected a line of at most 1024",
        ),
        (
            "p.txt",
            "1,2,3\n".repeat(limits::POINT_COUNT + 1),
            arguments,
            "p.txt:1000001: expected at most 1000000 points",
        ),
        (
            "p.txt",
            " ".repeat(limits::POINTS.bytes as usize + 1),
            arguments,
            "p.txt: has more than 67108864 bytes",
        ),
    ]);
}

#[test]
fn configurations() {
    let fly: &[&str] = &["fly", "--config", "c.toml"];
    let record: &[&str] = &["record", "--config", "c.toml"];
    let synth: &[&str] = &[
        "synth",
        "--paths",
        "none.jsonl",
        "--out",
        "x",
        "--config",
        "c.toml",
    ];
    let check: &[&str] = &["config", "--check", "c.toml"];
    let image: &[&str] = &["key", "image", "uav.key", "x.bin", "--config", "c.toml"];
    all_refused(&[
        (
            "c.toml",
            "[board]\nmount = [1, 2, -3]\n".into(),
            image,
            "c.toml:2: board.mount: [1, 2, -3] is no rotation",
        ),
        (
            "c.toml",
            "[receiver]\n[receiver.filter.gates]\nlost_m = 0\n".into(),
            check,
            "c.toml:3: receiver.filter.gates.lost_m is 0, expected a number above 0",
        ),
        (
            "c.toml",
            "[world.flight]\n\nduration = 3\n".into(),
            fly,
            "c.toml:3: unknown field `duration`",
        ),
        (
            "c.toml",
            "[world.flight]\nduration_s = 1e6\n".into(),
            fly,
            "c.toml:2: world.flight.duration_s is 1000000",
        ),
        // Whichever world it is whose figures are changed.
        (
            "c.toml",
            "[world]\nprofile = \"budget\"\nmaterials = \"drawn\"\n".into(),
            fly,
            "c.toml:3: unknown field `materials`, expected one of `profile`",
        ),
        (
            "c.toml",
            "[world.scene.surfaces]\nrelief = 0.1\n".into(),
            &["fly", "--world", "budget", "--config", "c.toml"],
            "c.toml:2: unknown field `relief`, expected one of `surface_seed`",
        ),
        (
            "c.toml",
            "[world]\nprofile = \"ideal\"\n[world.scene.surfaces]\nground_relief_rms_m = -0.15\n".into(),
            record,
            "c.toml:4: world.scene.surfaces.ground_relief_rms_m is -0.15, expected 0 to 1",
        ),
        (
            "c.toml",
            "[world.scene.placement]\nmoved_m = [0, 1e6, 0]\n".into(),
            fly,
            "c.toml:2: world.scene.placement.moved_m holds 1000000, expected",
        ),
        (
            "c.toml",
            "[world]\nprofile = \"paper\"\n".into(),
            fly,
            "c.toml:2: world.profile: unknown variant `paper`",
        ),
        (
            "c.toml",
            "[path_errors]\naoa_deg = -1\n".into(),
            fly,
            "c.toml:2: path_errors.aoa_deg is -1",
        ),
        (
            "c.toml",
            "[world.sensors.imu]\nrate = 3\n".into(),
            record,
            "c.toml:2: unknown field `rate`",
        ),
        (
            "c.toml",
            "[world.channel.front_end]\nadc_bits = 99\n".into(),
            record,
            "c.toml:2: world.channel.front_end.adc_bits is 99",
        ),
        (
            "c.toml",
            "[world.channel.front_end]\nadc_bit = 12\n".into(),
            synth,
            "c.toml:2: unknown field `adc_bit`",
        ),
        (
            "c.toml",
            "#".repeat(limits::CONFIGURATION.bytes as usize + 1),
            fly,
            "c.toml: has more than 1048576 bytes",
        ),
    ]);
}

#[test]
fn synthesis_of_what_makes_no_sense() {
    let plain: &[&str] = &["synth", "--paths", "p.jsonl", "--out", "x"];
    let loud: &[&str] = &["synth", "--paths", "p.jsonl", "--out", "x", "--snr-offset", "400"];
    all_refused(&[
        (
            "p.jsonl",
            LINK.replace("1.1e-7", "-1e-9"),
            plain,
            "p.jsonl: link 0, path 0: `delay_s` is -0.000000001, expected 0 to 0.001",
        ),
        (
            "p.jsonl",
            LINK.replace("1.1e-7", "3.0"),
            plain,
            "p.jsonl: link 0, path 0: `delay_s` is 3, expected 0 to 0.001",
        ),
        (
            "p.jsonl",
            LINK.replace("[1e-5,0]", "[1e5,0]"),
            plain,
            "path 0: `gain` has the magnitude 100000, expected up to 1",
        ),
        (
            "p.jsonl",
            LINK.replace("\"gain\"", "\"snr_db\":400,\"gain\""),
            plain,
            "p.jsonl:1: path 0: `snr_db` is 400, expected -200 to 200",
        ),
        (
            "p.jsonl",
            LINK.replace("1.4", "7.0"),
            plain,
            "p.jsonl: link 0, path 0: angle of arrival",
        ),
        (
            "p.jsonl",
            LINK.into(),
            loud,
            "--snr-offset 400: front_end.snr_offset_db is 400, expected -100 to 100",
        ),
    ]);
}

#[test]
fn models_keys_and_packets() {
    let classify: &[&str] = &["classify", "--paths", "p.jsonl", "--model", "m.lscn"];
    let quantize: &[&str] = &[
        "quantize",
        "m.safetensors",
        "--calibration",
        "none",
        "--out",
        "q.lscn",
    ];
    let packets: &[&str] = &["reproduce", "telemetry", "bytes", "--packets", "packets.bin"];
    let folder = tempfile::tempdir().expect("a directory");
    fs::write(folder.path().join("p.jsonl"), LINK).expect("written");
    // Files of nothing but a length: what is too long is not read.
    for (name, limit, arguments) in [
        ("m.lscn", limits::MODEL, classify),
        ("m.safetensors", limits::FLOAT_MODEL, quantize),
        ("packets.bin", limits::PACKETS, packets),
        ("uav.key", limits::KEY, &["key", "check", "uav.key"]),
    ] {
        let file = fs::File::create(folder.path().join(name)).expect("a file");
        file.set_len(limit.bytes + 1).expect("a sparse file");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            file.set_permissions(fs::Permissions::from_mode(0o600))
                .expect("ours");
        }
        let message = refused(folder.path(), arguments);
        assert!(
            message.contains(&format!("{name}: has more than {} bytes", limit.bytes)),
            "{message}"
        );
    }
}

#[test]
fn data_sets() {
    let folder = tempfile::tempdir().expect("a directory");
    let directory = folder.path().join("set");
    fs::create_dir(&directory).expect("a directory");
    let description = |shards: u64, more: &str| {
        format!(
            "{{\"version\":1,\"protocol\":{{\"scene\":\"outdoor\",\"set\":\"train\",\"transmitters\":1,\"step_m\":1.0,\"rate\":1.0,\
             \"permittivity\":null,\"seed\":1{more}}},\n\"shards\":{shards},\"transmitters_m\":[]}}"
        )
    };
    let train: &[&str] = &["train", "--train", "set", "--validation", "set", "--out", "m"];
    for (text, expected) in [
        (
            description(10_000, ""),
            "dataset.json: shards: expected 1 to 9999, found 10000",
        ),
        (
            description(1, ",\"rates\":1"),
            "dataset.json:1: not the description of a data set: unknown field `rates`",
        ),
        (description(1, ""), "shard-0000-of-0001: is missing"),
    ] {
        fs::write(directory.join("dataset.json"), text).expect("written");
        let message = refused(folder.path(), train);
        assert!(message.contains(expected), "{message}");
    }
    let shard = directory.join("shard-0000-of-0001");
    fs::create_dir(&shard).expect("a directory");
    let column = fs::File::create(shard.join("tx_m.npy")).expect("a file");
    column
        .set_len(limits::DATASET_COLUMN.bytes + 1)
        .expect("a sparse file");
    let index = cslam_host_sim::npy::encode::<u64>(&[], None);
    fs::write(shard.join("index.npy"), index).expect("written");
    let message = refused(folder.path(), train);
    assert!(message.contains("has more than 2147483648 bytes"), "{message}");
}

#[test]
fn a_recorded_flight_with_a_truth_that_does_not_parse() {
    let folder = tempfile::tempdir().expect("a directory");
    let record = [
        "record",
        "--scene",
        "street",
        "--duration",
        "4",
        "--no-samples",
        "--out",
        "f",
    ];
    let recorded = Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(record)
        .current_dir(folder.path())
        .output()
        .expect("the binary runs");
    assert!(
        recorded.status.success(),
        "{}",
        String::from_utf8_lossy(&recorded.stderr)
    );
    let file = folder.path().join("f/truth.csv");
    let text = fs::read_to_string(&file).expect("recorded");
    fs::write(&file, text.replace("\n1,", "\nNaN,")).expect("written");
    let message = refused(folder.path(), &["replay", "f"]);
    assert!(
        message.contains("truth.csv:") && message.contains("time_s: expected a number, found \"NaN\""),
        "{message}"
    );
    fs::write(&file, text).expect("written");
    fs::write(folder.path().join("f/truth_paths.jsonl"), "[]\n").expect("written");
    let message = refused(folder.path(), &["replay", "f"]);
    assert!(
        message.contains("truth_paths.jsonl:1: not a link of the paths format"),
        "{message}"
    );
}
