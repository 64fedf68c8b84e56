//! Instructions of localization, against the committed table and the design's budgets.

use std::collections::BTreeMap;

use cslam_tests::root;

use crate::chip;

/// A count may rise by this much before the test fails; a change below it is the compiler's.
const TOLERANCE: f64 = 0.02;

/// Counts by name, from lines `name: instructions`.
fn counts(text: &str) -> BTreeMap<String, f64> {
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.rsplit_once(": "))
        .filter_map(|(name, count)| Some((name.to_owned(), count.trim().parse().ok()?)))
        .collect()
}

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
    assert_eq!(
        committed.keys().collect::<Vec<_>>(),
        measured.keys().collect::<Vec<_>>(),
        "the table has other lines"
    );
    for (name, &before) in &committed {
        let now = measured[name];
        // The counter resolves a few instructions.
        assert!(
            now <= before * (1.0 + TOLERANCE) + 8.0,
            "{name}: {now}, committed {before}"
        );
    }
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
