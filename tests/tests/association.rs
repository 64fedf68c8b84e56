//! Data association on the emulated Cortex-M7: the same verdicts as on the host, to the last bit, at no more than the committed number of
//! instructions. Run by `cargo verify`, stage `kernels`.

use std::sync::OnceLock;

use cslam_checks::association;
use cslam_core::surfaces::{SurfaceConfig, Surfaces};
use cslam_tests::cost::{costs_no_more_than_committed, counts};
use cslam_tests::counted_on_the_chip;

/// What the chip printed: one run for all tests.
fn output() -> &'static str {
    static OUTPUT: OnceLock<String> = OnceLock::new();
    OUTPUT.get_or_init(|| counted_on_the_chip("association"))
}

#[test]
fn association_costs_no_more_than_committed() {
    costs_no_more_than_committed("association_cost.txt", &counts(output()));
}

/// The design's budget, whatever the table says: 3 million instructions a sweep; 6 at most for each time that it is asked.
#[test]
fn association_meets_its_budget() {
    let measured = counts(output());
    let of = |name: &str| measured[&format!("association, {name}")];
    let usual = of("pose as in flight, mean") + of("learning, mean");
    let most = of("pose as after an outage, most").max(of("pose as in flight, most") + of("learning, most"));
    println!("{usual} in the mean, {most} at most");
    assert!(usual > 1e4 && usual <= 3e6, "{usual}");
    assert!(most <= 6e6, "{most}");
}

#[test]
fn the_chip_decides_as_the_host_does() {
    let mut surfaces = Surfaces::new(SurfaceConfig::default());
    let mut lines = Vec::new();
    let done = association::run(
        &mut surfaces,
        |_, each| each(),
        |number, digest| lines.push(format!("sweep {number} {digest:016x}")),
    );
    assert!(done.is_some());
    let chip: Vec<_> = output()
        .lines()
        .filter(|line| line.starts_with("sweep "))
        .collect();
    assert_eq!(chip, lines);
}
