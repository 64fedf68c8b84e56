//! Directories of results as a user meets them: `fly --out`, `record --out` and `replay --out` never mix with what is there.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use common::cslam;
use std::time::Duration;

/// The line of a command that succeeded, or of one that was given bad input.
fn stderr_of(directory: &Path, args: &[&str], code: i32) -> String {
    let output = cslam(directory, args);
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(code), "{args:?}: {stderr}");
    stderr
}

fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(directory)
        .expect("a directory")
        .map(|entry| entry.expect("an entry"))
        .map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, fs::read(entry.path()).unwrap_or_default())
        })
        .collect();
    files.sort();
    files
}

fn names(directory: &Path) -> Vec<String> {
    files(directory).into_iter().map(|(name, _)| name).collect()
}

const FLIGHT: [&str; 7] = ["fly", "--paths", "bundled", "--steps", "20", "--out", "out"];
const RECORDING: [&str; 8] = [
    "record",
    "--scene",
    "street",
    "--duration",
    "1",
    "--no-samples",
    "--out",
    "out",
];

#[test]
fn a_directory_with_files_of_others_is_refused_and_left_as_it_is() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    stderr_of(at, &[&RECORDING[..6], &["--out", "recorded"]].concat(), 0);
    for args in [&FLIGHT[..], &RECORDING, &["replay", "recorded", "--out", "out"]] {
        fs::create_dir(at.join("out")).expect("writable");
        fs::write(at.join("out/thesis.txt"), "mine").expect("writable");
        // A map of that name is not one of ours by that alone.
        fs::write(at.join("out/map.ply"), "mine").expect("writable");
        let before = files(&at.join("out"));
        let error = stderr_of(at, args, 2);
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
        assert!(
            error.contains("out: holds ") && error.contains("expected a new or empty directory"),
            "{error}"
        );
        assert_eq!(files(&at.join("out")), before, "{args:?}");
        fs::remove_file(at.join("out/thesis.txt")).expect("there");
        let error = stderr_of(at, args, 2);
        assert!(error.contains("holds map.ply"), "{error}");
        fs::remove_dir_all(at.join("out")).expect("there");
    }
    assert_eq!(names(at), ["recorded"]);
}

#[test]
fn an_older_result_is_replaced_whole() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let with_samples: Vec<&str> = RECORDING
        .into_iter()
        .filter(|arg| *arg != "--no-samples")
        .collect();
    stderr_of(at, &with_samples, 0);
    assert!(at.join("out/sweep-0001.sigmf-data").is_file());
    stderr_of(at, &RECORDING, 0);
    let without = names(&at.join("out"));
    assert!(without.iter().all(|name| !name.contains("sigmf")), "{without:?}");
    assert!(!without.contains(&"truth_paths.jsonl".to_owned()), "{without:?}");
    // The replay knows no truth, so none of the older recording may stay beside it.
    stderr_of(at, &[&RECORDING[..6], &["--out", "recorded"]].concat(), 0);
    stderr_of(at, &["replay", "recorded", "--out", "out"], 0);
    assert!(!at.join("out/truth.csv").exists());
    // A flight is not a recording: neither replaces the other.
    assert!(stderr_of(at, &FLIGHT, 2).contains("which is no file of a flight"));
    fs::remove_dir_all(at.join("out")).expect("there");

    stderr_of(at, &FLIGHT, 0);
    let first = files(&at.join("out"));
    // Left by a version that wrote in place and was killed.
    fs::write(at.join("out/map.ply.part"), "half").expect("writable");
    stderr_of(at, &[&FLIGHT[..], &["--seed", "2"]].concat(), 0);
    let second = files(&at.join("out"));
    let names_of =
        |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names_of(&first), names_of(&second));
    assert_ne!(first, second);
    fs::write(at.join("out/notes.txt"), "mine").expect("writable");
    let error = stderr_of(at, &FLIGHT, 2);
    assert!(
        error.contains("out: holds notes.txt, which is no file of a flight"),
        "{error}"
    );
    assert_eq!(fs::read(at.join("out/notes.txt")).expect("left"), b"mine");
    let [a, b] = ["map.ply", "report.json"].map(|name| {
        let find = |files: &[(String, Vec<u8>)]| files.iter().find(|(n, _)| n == name).cloned();
        find(&files(&at.join("out"))) == find(&second)
    });
    assert!(a && b, "nothing was replaced");
    assert_eq!(names(at), ["out", "recorded"], "nothing is left beside");
}

#[test]
fn the_directory_that_one_is_in_is_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let error = stderr_of(
        directory.path(),
        &["fly", "--paths", "bundled", "--steps", "2", "--out", "."],
        2,
    );
    assert!(error.contains("is the directory you are in"), "{error}");
}

#[test]
fn the_help_says_what_becomes_of_what_is_there() {
    let directory = tempfile::tempdir().expect("a directory");
    for command in ["fly", "record", "replay"] {
        let output = cslam(directory.path(), &[command, "--help"]);
        let help = String::from_utf8(output.stdout).expect("text");
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            help.contains("is replaced whole") && help.contains("anything else in it is refused"),
            "{help}"
        );
    }
}

/// A long recording into `out` that has written its first sweep, with hundreds to go, and where it writes.
#[cfg(unix)]
fn at_work(at: &Path) -> (std::process::Child, std::path::PathBuf) {
    let mut run = Command::new(env!("CARGO_BIN_EXE_cslam"))
        .current_dir(at)
        .args(["record", "--scene", "street", "--duration", "600", "--out", "out"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary runs");
    let part = at.join(format!("out.part-{}", run.id()));
    while !fs::read_dir(&part).is_ok_and(|mut entries| entries.next().is_some()) {
        assert!(run.try_wait().expect("it runs").is_none(), "it ended");
        std::thread::sleep(Duration::from_millis(20));
    }
    (run, part)
}

/// Killed without a chance to put anything in order, a run leaves the older result as it was.
#[cfg(unix)]
#[test]
fn a_killed_run_leaves_the_older_result() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    stderr_of(at, &RECORDING, 0);
    let before = files(&at.join("out"));
    let (mut run, part) = at_work(at);
    run.kill().expect("it runs");
    assert!(!run.wait().expect("it ends").success());
    assert!(files(&at.join("out")) == before);
    // And Ctrl-C leaves nothing beside it either.
    let _left = fs::remove_dir_all(&part);
    let (mut run, _) = at_work(at);
    let pid = rustix::process::Pid::from_child(&run);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("it runs");
    assert!(!run.wait().expect("it ends").success());
    assert!(files(&at.join("out")) == before);
    assert_eq!(names(at), ["out"]);
}
