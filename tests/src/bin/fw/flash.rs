//! The image on a real board, by probe-rs.

use std::process::{Command, Stdio};

use anyhow::{Context, bail};
use cslam_tests::root;

/// The chip's name in probe-rs.
const CHIP: &str = "STM32H743ZITx";

/// Builds the image for the STM32H743, flashes it and shows its log until interrupted.
pub(crate) fn flash() -> anyhow::Result<()> {
    let found = Command::new("probe-rs")
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    if !found.is_ok_and(|status| status.success()) {
        bail!("probe-rs is missing; install it with: cargo install --locked probe-rs-tools");
    }
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .current_dir(root())
        .args(["run", "--profile", "board", "--target", "thumbv7em-none-eabihf"])
        .args([
            "-p",
            "cslam-firmware",
            "--features",
            "stm32h743",
            "--bin",
            "cslam-h743",
        ])
        .env(
            "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUNNER",
            format!("probe-rs run --chip {CHIP}"),
        )
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .status()
        .context("cargo does not start")?;
    if !status.success() {
        bail!("flashing or running ended with {status}");
    }
    Ok(())
}
