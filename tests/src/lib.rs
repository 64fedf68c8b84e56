//! Cross-crate tests are in `tests/`, the verify driver (`cargo verify`) in `src/bin/verify`.

pub mod cost;
pub mod elf;

use std::path::Path;
use std::process::Command;

/// Root of the workspace.
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package)
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
        .args(["-p", "cslam-firmware", "--features", features, "--bin", image])
        // They would replace the flags in `.cargo/config.toml`, and with them the choice of the processor.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        // What is logged is part of the tests.
        .env_remove("DEFMT_LOG");
    command
}

/// The `cslam` command, built as `cargo verify` and the users build it; its arguments follow. It may run in any directory.
pub fn cslam() -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .args(["run", "-q", "--release", "-p", "cslam-host-sim", "--bin", "cslam"])
        .arg("--manifest-path")
        .arg(root().join("Cargo.toml"))
        .arg("--");
    command
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
