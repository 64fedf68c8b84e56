//! Cross-crate tests are in `tests/`, the verify driver (`cargo verify`) in `src/bin/verify`.

#[cfg(feature = "constants")]
pub mod constants;
pub mod cost;
pub mod cycles;
pub mod elf;
pub mod tables;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Root of the workspace.
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package)
}

/// Every file below a folder whose name has one of the endings, in order: without results of builds, installed packages and hidden folders.
///
/// # Panics
/// When a folder cannot be read: with its name.
#[must_use]
pub fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        let entries = fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        for path in entries.flatten().map(|entry| entry.path()) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path.is_dir() {
                if !["target", "node_modules", "out"].contains(&&*name) && !name.starts_with('.') {
                    open.push(path);
                }
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// `cargo VERB` (build or run) of an image for the emulated board, with the features and flags it is made for whatever the environment
/// holds.
pub fn emulated_board(verb: &str, image: &str) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let features = match image {
        "checks-an500" => "qemu-an500,rivals",
        _ => "qemu-an500",
    };
    let mut command = Command::new(cargo);
    command
        .current_dir(root())
        .args([
            verb,
            "-q",
            "--profile",
            "firmware",
            "--target",
            "thumbv7em-none-eabihf",
        ])
        .args(["-p", "cslam-checks", "--features", features, "--bin", image])
        // They would replace the flags in `.cargo/config.toml`, and with them the choice of the processor.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        // What is logged is part of the tests.
        .env_remove("DEFMT_LOG");
    command
}

/// What a check of `checks-an500` printed, its clock counting instructions.
///
/// # Panics
/// When the image cannot be built or the check fails: with all that was printed.
pub fn counted_on_the_chip(check: &str) -> String {
    printed(
        emulated_board("run", "checks-an500")
            .args(["--", check])
            .env("CSLAM_ICOUNT", "10"),
    )
}

/// Arguments with which cargo builds the optimised binaries of the host, `cslam` and `fw`. The Python package is chosen with them, so that all
/// that they stand on has the features that it asks for: whatever else is chosen beside it, pip included, builds none of it again.
pub const RELEASE: [&str; 9] = [
    "build",
    "--release",
    "--locked",
    "-p=cslam-host-sim",
    "-p=cslam-tests",
    "-p=cslam-python",
    "--features=cslam-tests/fw",
    "--bin=cslam",
    "--bin=fw",
];

/// The `cslam` command, built with optimisation as `cargo verify` builds it; it may run in any directory.
///
/// # Panics
/// When it cannot be built: with what cargo printed.
pub fn cslam() -> Command {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let program = BUILT.get_or_init(|| {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        printed(Command::new(cargo).current_dir(root()).args(RELEASE).arg("-q"));
        root().join("target/release/cslam")
    });
    Command::new(program)
}

/// Runs a command and gives what it printed on standard output.
///
/// # Panics
/// When it does not start or does not succeed: with all that it printed.
pub fn printed(command: &mut Command) -> String {
    let output = command.output().expect("the program starts");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success(),
        "{command:?} ended with {}:\n{text}{}",
        output.status,
        String::from_utf8_lossy(&output.stderr)
    );
    text
}
