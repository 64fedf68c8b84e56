//! The link state networks on the emulated Cortex-M7: the same bits as on the host, from measured paths to probabilities,
//! at no more than the committed number of instructions. Run by `cargo verify`, stage `kernels`.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use cslam_checks::link_state::{LINKS, Link, ModelFile, Networks, Which, trees_digest};
use cslam_core::kernels::Native;
use cslam_core::link_state::{Activations, models};
use cslam_tests::cost::{costs_no_more_than_committed, counts};
use cslam_tests::counted_on_the_chip;

/// What the chip printed: one run for all tests.
fn output() -> &'static str {
    static OUTPUT: OnceLock<String> = OnceLock::new();
    OUTPUT.get_or_init(|| counted_on_the_chip("networks"))
}

#[test]
fn no_step_costs_more_than_committed() {
    costs_no_more_than_committed("link_state_cost.txt", &counts(output()));
}

/// The design's budgets, whatever the table says: instructions for each multiplication, requantisation and the rounding of
/// the inputs included, and for a whole link.
#[test]
fn the_networks_meet_their_budgets() {
    let measured = counts(output());
    let sum = |set: &str| -> f64 {
        let steps: BTreeMap<_, _> = measured
            .iter()
            .filter(|(name, _)| name.starts_with(&format!("{set}, ")))
            .collect();
        assert!(steps.len() >= 4, "{set}: {steps:?}");
        steps.values().copied().sum()
    };
    for (set, which) in [("geometric", Which::WithDeparture), ("paper", Which::Paper)] {
        let macs = which.shape().expect("sound").macs() as f64;
        let each = sum(set) / macs;
        println!("{set}: {each:.3} instructions a multiplication");
        assert!((0.5..=1.5).contains(&each), "{set}: {each}");
    }
    let link = measured["features and geometric, nine paths"];
    assert!(link > 9.0 * sum("geometric") && link <= 60_000.0, "{link}");
}

/// Digests of every link: the chip's assembly against this machine's portable form. (The chip has compared its assembly
/// with its own portable form and would have ended with an error.)
#[test]
fn the_chip_computes_the_bits_of_the_host() {
    let shipped = Networks::<Native>::shipped().expect("sound");
    same_bits("link ", &shipped);
    let mut files = [const { ModelFile::EMPTY }; 3];
    let [a, b, c] = &mut files;
    let models = [
        a.random(Which::WithDeparture),
        b.random(Which::WithoutDeparture),
        c.random(Which::Paper),
    ];
    let networks = Networks::<Native>::new(models.map(|model| model.expect("sound")));
    same_bits("random ", &networks);
}

/// Digests of every link by the trees: the chip's against this machine's.
#[test]
fn the_chips_trees_say_what_the_hosts_say() {
    let trees = models::trees().expect("sound");
    let lines: Vec<&str> = output()
        .lines()
        .filter(|line| line.starts_with("trees ") && !line.contains(':'))
        .collect();
    assert_eq!(lines.len(), LINKS as usize);
    for (index, line) in (0..).zip(lines) {
        let link = Link::random(index).expect("a link");
        let digest = trees_digest(&trees, &link).expect("finite");
        assert_eq!(line.trim(), format!("trees {index} {digest:016x}"));
    }
}

/// The chip's lines of a set of networks against the host's digests.
fn same_bits(name: &str, networks: &Networks<'_, Native>) {
    let (mut work, mut seen) = (Activations::new(), 0);
    for line in output().lines().filter(|line| line.starts_with(name)) {
        let link = Link::random(seen).expect("a link");
        let digest = networks.digest(&link, &mut work).expect("finite");
        assert_eq!(line.trim(), format!("{name}{seen} {digest:016x}"));
        seen += 1;
    }
    assert_eq!(seen, LINKS);
}
