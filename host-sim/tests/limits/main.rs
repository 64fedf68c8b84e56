//! What a user may hand the program by mistake or by malice, command by command: exit code 2 and one line that names the file, its
//! line or key, and what was expected.

mod configurations;
mod scenes;

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
