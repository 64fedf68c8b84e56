//! Gives the linker the memory map of the chosen board. Without a board there is nothing to do, so the library half
//! builds for a host; two boards, or a board for a host, are refused.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// A board: its feature, its memory map relative to this package, and its binaries.
struct Board {
    feature: &'static str,
    memory: &'static str,
    binaries: &'static [&'static str],
    /// Linker scripts that crates bring: tables of defmt, names of the chip's interrupts.
    scripts: &'static [&'static str],
}

const BOARDS: [Board; 5] = [
    Board {
        feature: "qemu-an500",
        memory: "memory/mps2-an500.x",
        binaries: &["checks-an500", "faults-an500", "receiver-an500", "sweeps-an500"],
        scripts: &["defmt.x"],
    },
    Board {
        feature: "qemu-an386",
        memory: "memory/mps2-an386.x",
        binaries: &["self-test-an386"],
        scripts: &["defmt.x"],
    },
    Board {
        feature: "qemu-an547",
        memory: "memory/mps3-an547.x",
        binaries: &["self-test-an547"],
        scripts: &["defmt.x"],
    },
    Board {
        feature: "stm32h743",
        memory: "../memory.x",
        binaries: &["cslam-h743"],
        scripts: &["defmt.x", "device.x"],
    },
    // Not a board: the memory map of one, to link the flight path against.
    Board {
        feature: "link-check",
        memory: "../memory.x",
        binaries: &["panic-free"],
        scripts: &[],
    },
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let chosen: Vec<&Board> = BOARDS.iter().filter(|board| is_on(board.feature)).collect();
    match chosen.as_slice() {
        [] => {}
        [board] if env_var("CARGO_CFG_TARGET_OS") == "none" => link(board),
        [board] => println!(
            "cargo::error=board `{}` needs a chip's target: add `--target thumbv7em-none-eabihf`",
            board.feature
        ),
        [one, other, ..] => println!(
            "cargo::error=two boards are chosen (`{}` and `{}`): an image has one memory map, choose one feature",
            one.feature, other.feature
        ),
    }
}

fn link(board: &Board) {
    let out = PathBuf::from(env_var("OUT_DIR"));
    // Not `memory.x`: the linker would find the file of that name in the workspace's root first, whatever the board.
    copy(Path::new(board.memory), &out.join("board.x"));
    let script = out.join("image.x");
    copy(Path::new("memory/image.x"), &script);
    println!("cargo::rustc-link-search={}", out.display());
    for binary in board.binaries {
        println!("cargo::rustc-link-arg-bin={binary}=-T{}", script.display());
        // Sections need not start on a page of the host's loader.
        println!("cargo::rustc-link-arg-bin={binary}=--nmagic");
        for script in board.scripts {
            println!("cargo::rustc-link-arg-bin={binary}=-T{script}");
        }
    }
}

fn copy(from: &Path, to: &Path) {
    println!("cargo::rerun-if-changed={}", from.display());
    if let Err(error) = fs::copy(from, to) {
        println!(
            "cargo::error=cannot copy {} to {}: {error}",
            from.display(),
            to.display()
        );
    }
}

/// Whether cargo turned a feature of this package on.
fn is_on(feature: &str) -> bool {
    let name = feature.to_uppercase().replace('-', "_");
    env::var_os(format!("CARGO_FEATURE_{name}")).is_some()
}

/// A variable that cargo sets for every build script.
fn env_var(name: &str) -> String {
    env::var(name).unwrap_or_else(|error| panic!("cargo sets {name}: {error}"))
}
