//! Instructions of localization, against the committed table and the design's budgets.

use std::collections::BTreeMap;

use cslam_tests::cost::{counts, rises};
use cslam_tests::root;

use crate::chip;

fn measured() -> BTreeMap<String, f64> {
    let mut all = counts(&chip::flown(46).log);
    all.extend(counts(&chip::flown(58).log));
    all
}

#[test]
fn no_part_costs_more_than_committed() {
    let path = root().join("tests/golden/localization_cost.txt");
    let committed = counts(&std::fs::read_to_string(path).expect("the committed table"));
    let measured = measured();
    for (name, count) in &measured {
        println!("{name}: {count}");
    }
    let rises = rises(&committed, &measured);
    assert!(rises.is_empty(), "{}", rises.join("\n"));
}

/// The design's budgets, whatever the table says: for the dearest single occurrence in a minute of flight.
#[test]
fn localization_meets_its_budgets() {
    let measured = measured();
    for states in [46, 58] {
        for (part, budget) in [
            ("inertial sample, most", 2_000.0),
            ("covariance step, most", 60_000.0),
            ("updates of a sweep with line of sight, most", 1e6),
            ("updates of a sweep of reflections, most", 1e6),
        ] {
            let name = format!("{states} states, {part}");
            let count = measured[&name];
            assert!(count > 0.0 && count <= budget, "{name}: {count}, budget {budget}");
        }
    }
}
