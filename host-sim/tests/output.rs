//! What every command does with an output that nobody reads any more, or that does not take any more.

use std::fs::OpenOptions;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn cslam(directory: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cslam"));
    command.current_dir(directory).args(arguments);
    command
}

/// Makes what the commands below read.
fn prepare(directory: &Path) {
    let link = ["--scene", "outdoor_a", "--tx", "10,10,2", "--rx", "60,60,10"];
    let prepared: [&[&str]; 4] = [
        &[&["trace", "--out", "paths.jsonl"], &link[..]].concat(),
        &["synth", "--paths", "paths.jsonl", "--out", "link"],
        &["record", "--duration", "1", "--no-samples", "--out", "flight"],
        &["fly", "--paths", "bundled", "--steps", "2", "--out", "flown"],
    ];
    for arguments in prepared {
        let output = cslam(directory, arguments).output().expect("it starts");
        assert!(output.status.success(), "{arguments:?}: {output:?}");
    }
}

/// A command of every kind: prints lines as it goes, a table at the end, one object, or a configuration.
const COMMANDS: &[&[&str]] = &[
    &["accuracy", "--trials", "1", "twin"],
    &["accuracy", "--trials", "1", "--json", "twin"],
    &["classify", "--paths", "paths.jsonl"],
    &["classify", "--paths", "paths.jsonl", "--json"],
    &["estimate", "link.sigmf-meta"],
    &["estimate", "link.sigmf-meta", "--json"],
    &["fly", "--paths", "bundled", "--steps", "2"],
    &["fly", "--paths", "bundled", "--steps", "2", "--json"],
    &["config"],
    &["fly", "--print-config"],
    #[cfg(feature = "ground")]
    &["ground", "--test-key", "--file", "flown/packets.bin", "--json"],
    #[cfg(feature = "ground")]
    &[
        "ground",
        "--test-key",
        "--listen",
        "127.0.0.1:0",
        "--http",
        "127.0.0.1:0",
    ],
    &["imu", "--hours", "0.01"],
    &["imu", "--hours", "0.01", "--json"],
    &["key", "new", "new.key", "--uav", "1"],
    &["key", "check", "new.key"],
    &["record", "--print-config"],
    &["replay", "flight"],
    &["replay", "flight", "--json"],
    &["reproduce", "link"],
    &["solve", "--paths", "paths.jsonl"],
    &["synth", "--paths", "paths.jsonl", "--out", "again", "--json"],
    &[
        "trace",
        "--scene",
        "outdoor_a",
        "--tx",
        "10,10,2",
        "--rx",
        "60,60,10",
    ],
];

/// Runs every command with the output that `output` makes.
fn each(output: impl Fn() -> Stdio, mut check: impl FnMut(&[&str], &Output, &str)) {
    let directory = tempfile::tempdir().expect("a directory");
    prepare(directory.path());
    for arguments in COMMANDS {
        if arguments.starts_with(&["key", "new"]) {
            let _none = std::fs::remove_file(directory.path().join("new.key"));
        }
        let result = cslam(directory.path(), arguments)
            .stdout(output())
            .output()
            .expect("it starts");
        check(arguments, &result, &String::from_utf8_lossy(&result.stderr));
    }
}

#[test]
fn an_output_that_nobody_reads_ends_every_command_quietly() {
    let closed = || {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        Stdio::from(writer)
    };
    let mut noisy = Vec::new();
    each(closed, |arguments, result, said| {
        if result.status.code() != Some(0) || said.contains("panicked") {
            noisy.push(format!("{arguments:?}: {:?} {said}", result.status));
        }
    });
    assert!(noisy.is_empty(), "{}", noisy.join("\n"));
}

/// `/dev/full` is a disk without room.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_under_the_output_has_one_exit_code() {
    let full = || {
        let device = OpenOptions::new().write(true).open("/dev/full");
        Stdio::from(device.expect("it is there"))
    };
    let mut wrong = Vec::new();
    each(full, |arguments, result, said| {
        if result.status.code() != Some(3) || said.contains("panicked") || !said.contains("cslam: ") {
            wrong.push(format!("{arguments:?}: {:?} {said}", result.status));
        }
    });
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A file that may not grow is a full disk for whoever writes it.
#[cfg(unix)]
#[test]
fn a_full_disk_under_a_file_has_the_same_exit_code_and_spares_the_file_before() {
    let directory = tempfile::tempdir().expect("a directory");
    prepare(directory.path());
    let map = directory.path().join("flown/map.ply");
    let before = std::fs::read(&map).expect("flown");
    let commands: [&[&str]; 4] = [
        &["fly", "--paths", "bundled", "--steps", "2", "--out", "flown"],
        &["record", "--duration", "1", "--no-samples", "--out", "other"],
        &["synth", "--paths", "paths.jsonl", "--out", "other"],
        &["key", "image", "new.key", "image.bin"],
    ];
    let mut new = cslam(directory.path(), &["key", "new", "new.key", "--uav", "1"]);
    assert!(new.output().expect("it starts").status.success());
    for arguments in commands {
        let limits = "trap '' XFSZ; ulimit -f 0; exec \"$0\" \"$@\"";
        let output = Command::new("sh")
            .current_dir(directory.path())
            .args(["-c", limits, env!("CARGO_BIN_EXE_cslam")])
            .args(arguments)
            .output()
            .expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{arguments:?}: {said}");
    }
    assert!(std::fs::read(&map).expect("still there") == before);
}

/// Nor does a closed standard error end a command that has other things to do.
#[test]
fn an_error_output_that_nobody_reads_changes_nothing() {
    let directory = tempfile::tempdir().expect("a directory");
    prepare(directory.path());
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let status = cslam(directory.path(), &["fly", "--paths", "bundled", "--steps", "2"])
        .stdout(Stdio::null())
        .stderr(writer)
        .status()
        .expect("it starts");
    assert_eq!(status.code(), Some(0));
}
