//! The path estimator's kernels on the emulated Cortex-M7: the same bits as on the host, at no more than the committed
//! number of instructions. Run by `cargo verify`, stage `kernels`.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use cslam_core::ltd::kernels::Native;
use cslam_core::ltd::{Correlator, Iq, Workspace};
use cslam_core::waveform::{SAMPLES, Waveform};
use cslam_firmware::front_end_check::{BLOCKS, Block, CHANNELS, run};
use cslam_tests::{emulated_board, root};

/// A count may rise by this much before the test fails; a change below it is the compiler's.
const TOLERANCE: f64 = 0.02;

/// What the chip printed: one run for all tests.
fn output() -> &'static str {
    static OUTPUT: OnceLock<String> = OnceLock::new();
    OUTPUT.get_or_init(|| {
        let output = emulated_board("run", "kernels-an500")
            .env("CSLAM_ICOUNT", "10")
            .output()
            .expect("cargo starts");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success(),
            "the run ended with {}:\n{text}{}",
            output.status,
            String::from_utf8_lossy(&output.stderr)
        );
        text
    })
}

/// Counts by kernel, from lines `name: instructions`; others are passed over.
fn counts(text: &str) -> BTreeMap<String, f64> {
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.rsplit_once(": "))
        .filter_map(|(name, count)| Some((name.to_owned(), count.trim().parse().ok()?)))
        .collect()
}

/// Kernels that are missing, new, or dearer than committed.
fn rises(committed: &BTreeMap<String, f64>, measured: &BTreeMap<String, f64>) -> Vec<String> {
    let missing = committed
        .keys()
        .filter(|name| !measured.contains_key(*name))
        .map(|name| format!("{name}: not measured"));
    let others = measured
        .iter()
        .filter_map(|(name, &count)| match committed.get(name) {
            None => Some(format!("{name}: {count}, not in the table")),
            // The counter resolves a few instructions: that much is no rise of an empty call.
            Some(&before) if count > before * (1.0 + TOLERANCE) + 8.0 => {
                Some(format!("{name}: {count} instructions, committed {before}"))
            }
            Some(_) => None,
        });
    missing.chain(others).collect()
}

#[test]
fn no_kernel_costs_more_than_committed() {
    let path = root().join("tests/golden/ltd_cost.txt");
    let table = std::fs::read_to_string(&path).expect("the committed table");
    let measured = counts(output());
    for (name, count) in &measured {
        println!("{name}: {count}");
    }
    let rises = rises(&counts(&table), &measured);
    assert!(rises.is_empty(), "{}", rises.join("\n"));
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

#[test]
fn a_rise_a_missing_and_a_new_kernel_are_found() {
    let table = |text: &str| counts(text);
    let committed = table("# made: 3\nfft 512: 14000\nlevel: 20000\nempty: 1\n");
    assert!(rises(&committed, &table("fft 512: 14200\nlevel: 15000\nempty: 4")).is_empty());
    let found = rises(&committed, &table("fft 512: 14300\nempty: 1\nmore: 7"));
    assert_eq!(
        found,
        [
            "level: not measured",
            "fft 512: 14300 instructions, committed 14000",
            "more: 7, not in the table"
        ]
    );
}

/// Digests of every block: the chip's assembly against this machine's portable form. (The chip has compared its assembly
/// with its own portable form and would have ended with an error.)
#[test]
fn the_chip_computes_the_bits_of_the_host() {
    let mut block: Box<Block> = vec![[Iq::ZERO; SAMPLES]; CHANNELS]
        .try_into()
        .expect("as many channels");
    let mut work = Workspace::new();
    let correlator = Correlator::<Native>::new(&Waveform::default());
    let mut seen = 0;
    for line in output().lines().filter(|line| line.starts_with("block ")) {
        let outcome = run(&correlator, &mut block, seen, &mut work);
        let expected = format!(
            "block {seen} {:016x} {} {} {}",
            outcome.digest, outcome.clips, outcome.unexamined, outcome.exponent
        );
        assert_eq!(line.trim(), expected);
        seen += 1;
    }
    assert_eq!(seen, BLOCKS);
}
