//! Data association on the emulated Cortex-M7: the same verdicts as on the host, to the last bit, at no more than the committed number of
//! instructions. Run by `cargo verify`, stage `kernels`.

use std::sync::OnceLock;

use cslam_core::surfaces::{SurfaceConfig, Surfaces};
use cslam_firmware::association_check;
use cslam_tests::cost::{counts, rises};
use cslam_tests::{emulated_board, printed, root};

/// What the chip printed: one run for all tests.
fn output() -> &'static str {
    static OUTPUT: OnceLock<String> = OnceLock::new();
    OUTPUT.get_or_init(|| {
        printed(
            emulated_board("run", "checks-an500")
                .args(["--", "association"])
                .env("CSLAM_ICOUNT", "10"),
        )
    })
}

#[test]
fn association_costs_no_more_than_committed() {
    let path = root().join("tests/golden/association_cost.txt");
    let table = std::fs::read_to_string(&path).expect("the committed table");
    let measured = counts(output());
    for (name, count) in &measured {
        println!("{name}: {count}");
    }
    let rises = rises(&counts(&table), &measured);
    assert!(rises.is_empty(), "{}", rises.join("\n"));
}

/// The design's budget, whatever the table says: 3 million instructions a sweep, 6 at most.
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
    let done = association_check::run(
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
