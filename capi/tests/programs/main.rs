//! The library in other people's programs: the command, Rust, C and Python print the same paths of the same recording, character for
//! character; and wrong arguments of the C interface never do more than give a status.

mod c;
mod m7;
mod python;
mod recording;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Root of the workspace.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Runs a command that must succeed; what it printed.
fn printed(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    assert_success(command, &output);
    String::from_utf8(output.stdout).expect("text")
}

fn assert_success(command: &Command, output: &Output) {
    assert!(
        output.status.success(),
        "{command:?}: {}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

/// Whether a program of this name is there.
fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// Has cargo build something in release mode: the files that came of it.
fn built(arguments: &[&str]) -> Vec<PathBuf> {
    files(&[&["--release"], arguments].concat())
}

/// The library for C programs on the emulated Cortex-M7.
fn built_for_a_chip() -> PathBuf {
    let files = files(&[
        "--profile=firmware",
        "--package=cslam-c",
        "--lib",
        "--no-default-features",
        "--features=panic-handler",
        "--target=thumbv7em-none-eabihf",
    ]);
    let archive = files.into_iter().find(|file| file.ends_with("libcslam_c.a"));
    archive.expect("libcslam_c.a among what cargo built")
}

fn files(arguments: &[&str]) -> Vec<PathBuf> {
    let messages = printed(
        cargo()
            .args(["build", "--quiet", "--locked", "--message-format=json"])
            .args(arguments),
    );
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter_map(|message| message["filenames"].as_array().cloned())
        .flatten()
        .filter_map(|file| file.as_str().map(PathBuf::from))
        .collect()
}

fn cargo() -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.current_dir(ROOT);
    command
}

/// An example of cslam-core, built and run by cargo.
fn rust_example(name: &str, arguments: &[&str]) -> String {
    let run = [
        "run",
        "--quiet",
        "--locked",
        "--release",
        "--package=cslam-core",
        "--example",
        name,
        "--",
    ];
    printed(cargo().args(run).args(arguments))
}

/// The page that shows all this.
fn page() -> String {
    fs::read_to_string(Path::new(ROOT).join("docs/bindings.md")).expect("a page")
}

#[test]
#[ignore = "builds in release mode: the stage capi runs it"]
fn the_page_shows_what_the_command_prints() {
    let page = page();
    for line in recording::Recorded::new().by_the_command().lines() {
        // Of the covariance the page has the first number.
        let shown: Vec<&str> = line.split(',').take(11).collect();
        let shown = format!("\n{},", shown.join(","));
        assert!(page.contains(&shown), "docs/bindings.md does not show{shown}");
    }
}

#[test]
#[ignore = "builds in release mode: the stage capi runs it"]
fn every_example_of_the_core_is_short_and_runs() {
    let expected = [
        (
            "solve",
            "off the wall: 0.001 20.001 4.000 m, sigma 0.202 m\nstraight: line of sight\n",
        ),
        ("classify", "40.20 m: LineOfSight"),
        (
            "own_geometry",
            "paths in silence: 0\nwaveform.active: expected an even number of 2 to 512\n",
        ),
        (
            "whole_receiver",
            "sweep 0: 0 paths in silence\nsweep 1: 0 paths in silence\n",
        ),
        ("embedded", "static memory: "),
    ];
    let mut known: Vec<&str> = expected.iter().map(|(name, _)| *name).collect();
    // Its lines are compared with those of the command.
    known.push("estimate");
    for entry in fs::read_dir(Path::new(ROOT).join("core/examples")).expect("a folder") {
        let file = entry.expect("an entry").path();
        let name = file.file_stem().and_then(|name| name.to_str()).expect("a name");
        if file.extension().is_some_and(|extension| extension == "rs") {
            assert!(known.contains(&name), "{name}: nothing runs it");
            let lines = fs::read_to_string(&file).expect("a text").lines().count();
            assert!(lines < 60, "{name}: {lines} lines, under 60 wanted");
        }
    }
    for (name, start) in expected {
        let printed = rust_example(name, &[]);
        assert!(printed.starts_with(start), "{name}: {printed}");
    }
}
