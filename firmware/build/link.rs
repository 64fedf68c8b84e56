//! Gives the linker the memory map of the chosen board. Two boards, or a board for a host, are refused; without a board there is nothing to do.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Layout of an image, the same for every board.
const LAYOUT: &str = include_str!("../memory/image.x");

/// A board: its feature, its memory map relative to the package, and its binaries.
pub(crate) struct Board {
    pub(crate) feature: &'static str,
    pub(crate) memory: &'static str,
    pub(crate) binaries: &'static [&'static str],
    /// Linker scripts that crates bring: tables of defmt, names of the chip's interrupts.
    pub(crate) scripts: &'static [&'static str],
}

/// Links the binaries of the board whose feature is on.
pub(crate) fn chosen(boards: &[Board]) {
    println!("cargo::rerun-if-changed=build.rs");
    let chosen: Vec<&Board> = boards.iter().filter(|board| is_on(board.feature)).collect();
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
    let map = Path::new(board.memory);
    println!("cargo::rerun-if-changed={}", map.display());
    tell(&out.join("board.x"), fs::copy(map, out.join("board.x")).map(drop));
    let script = out.join("image.x");
    tell(&script, fs::write(&script, LAYOUT));
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

/// Ends the build when a file could not be made.
fn tell(file: &Path, made: std::io::Result<()>) {
    if let Err(error) = made {
        println!("cargo::error=cannot make {}: {error}", file.display());
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
