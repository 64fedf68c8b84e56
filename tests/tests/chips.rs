//! The self-test on processors beside the Cortex-M7: an emulated Cortex-M4F with the kernels in assembly and a
//! Cortex-M55 with the portable ones compute the host's bits. Run by `cargo verify`, stage `kernels`.

use std::process::Command;

use cslam_checks::front_end::{BLOCKS, run};
use cslam_checks::link_state::{LINKS, Link, Networks};
use cslam_core::kernels::{Native, Native as NativeLayers};
use cslam_core::link_state::Activations;
use cslam_core::profile::Samples;
use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
use cslam_core::signal::{Correlator, Iq, SAMPLES, Waveform, Workspace};
use cslam_tests::{printed, root};

/// A board, its compiler's target, and the processor where the target's is another.
struct Chip {
    machine: &'static str,
    board: &'static str,
    target: &'static str,
    processor: Option<&'static str>,
}

const M4F: Chip = Chip {
    machine: "mps2-an386",
    board: "an386",
    target: "thumbv7em-none-eabihf",
    processor: Some("cortex-m4"),
};
const M55: Chip = Chip {
    machine: "mps3-an547",
    board: "an547",
    target: "thumbv8m.main-none-eabihf",
    processor: None,
};

impl Chip {
    /// Builds the image, runs it and gives what it printed.
    fn output(&self) -> String {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let image = "self-test";
        let mut build = Command::new(cargo);
        build
            .current_dir(root())
            .args([
                "build",
                "-q",
                "--locked",
                "--profile",
                "firmware",
                "--target",
                self.target,
            ])
            .args(["-p", "cslam-checks", "--bin", image])
            .args(["--features", &format!("qemu-{}", self.board)])
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS")
            .env_remove("DEFMT_LOG");
        if let Some(processor) = self.processor {
            let name = self.target.to_uppercase().replace(['-', '.'], "_");
            // In the stead of the flags in `.cargo/config.toml`, which are for another processor.
            build.env(
                format!("CARGO_TARGET_{name}_RUSTFLAGS"),
                format!("-C target-cpu={processor}"),
            );
        }
        assert!(
            build.status().expect("cargo starts").success(),
            "{image} does not build for {}",
            self.board
        );
        let elf = root()
            .join("target")
            .join(self.target)
            .join("firmware")
            .join(image);
        let mut run = Command::new(root().join("checks/tools/qemu-run.sh"));
        printed(run.arg(self.machine).arg(elf))
    }
}

/// The host's lines, after that of the kernels.
fn expected(kernels: &str) -> Vec<String> {
    let mut block: Box<Samples> = vec![[Iq::ZERO; SAMPLES]; CHANNELS]
        .try_into()
        .expect("as many channels");
    let mut work = Workspace::new();
    let correlator = Correlator::<Native>::new(&Waveform::default());
    let blocks = (0..BLOCKS).map(|index| {
        let outcome = run(&correlator, &mut block, index, &mut work);
        format!("block {index} {outcome}")
    });
    let networks = Networks::<NativeLayers>::shipped().expect("sound models");
    let mut activations = Activations::new();
    let links = (0..LINKS).map(|index| {
        let link = Link::random(index).expect("a link");
        let digest = networks.digest(&link, &mut activations).expect("finite");
        format!("link {index} {digest:016x}")
    });
    let kernels = std::iter::once(format!("kernels {kernels}"));
    kernels.chain(blocks).chain(links).collect()
}

#[test]
fn a_cortex_m4f_computes_the_bits_of_the_host() {
    assert_eq!(
        M4F.output().lines().map(str::trim).collect::<Vec<_>>(),
        expected("Armv7em Armv7em")
    );
}

#[test]
fn a_cortex_m55_computes_the_bits_of_the_host() {
    assert_eq!(
        M55.output().lines().map(str::trim).collect::<Vec<_>>(),
        expected("Portable Portable")
    );
}
