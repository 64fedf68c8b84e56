//! The path estimator's kernels on the emulated Cortex-M7: the same bits as on the host, at no more than the committed
//! number of instructions. Run by `cargo verify`, stage `kernels`.

use std::sync::OnceLock;

use cslam_checks::front_end::{BLOCKS, run};
use cslam_core::kernels::Native;
use cslam_core::profile::Samples;
use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
use cslam_core::signal::{Correlator, Iq, SAMPLES, Waveform, Workspace};
use cslam_tests::cost::{costs_no_more_than_committed, counts};
use cslam_tests::counted_on_the_chip;

/// What the chip printed: one run for all tests.
fn output() -> &'static str {
    static OUTPUT: OnceLock<String> = OnceLock::new();
    OUTPUT.get_or_init(|| counted_on_the_chip("kernels"))
}

#[test]
fn no_kernel_costs_more_than_committed() {
    costs_no_more_than_committed("kernel_cost.txt", &counts(output()));
}

/// The design's budgets, whatever the table says.
#[test]
fn the_kernels_meet_their_budgets() {
    let measured = counts(output());
    for (name, budget) in [("fft 512", 15_500.0), ("correlate, 32 channels", 1_050_000.0)] {
        let count = measured[name];
        assert!(count > 0.0 && count <= budget, "{name}: {count}, budget {budget}");
    }
}

/// Digests of every block: the chip's assembly against this machine's portable form. (The chip has compared its assembly
/// with its own portable form and would have ended with an error.)
#[test]
fn the_chip_computes_the_bits_of_the_host() {
    let mut block: Box<Samples> = vec![[Iq::ZERO; SAMPLES]; CHANNELS]
        .try_into()
        .expect("as many channels");
    let mut work = Workspace::new();
    let correlator = Correlator::<Native>::new(&Waveform::default());
    let mut seen = 0;
    for line in output().lines().filter(|line| line.starts_with("block ")) {
        let outcome = run(&correlator, &mut block, seen, &mut work);
        assert_eq!(line.trim(), format!("block {seen} {outcome}"));
        seen += 1;
    }
    assert_eq!(seen, BLOCKS);
}
