//! Every number of the flight code says where it comes from, and `docs/constants.md` says it as the sources do.

use std::collections::BTreeSet;

use cslam_tests::constants::{Effects, found, page};

#[test]
fn every_number_says_where_it_comes_from() {
    let found = found();
    assert!(
        found.constants.len() > 300,
        "only {} numbers were found",
        found.constants.len()
    );
    let wrong = found.wrong();
    assert!(wrong.is_empty(), "{} numbers:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn names_are_unique_and_effects_are_of_numbers_that_exist() {
    let constants = found().constants;
    let mut keys = BTreeSet::new();
    for constant in &constants {
        assert!(
            keys.insert(constant.key()),
            "two numbers are called {}",
            constant.key()
        );
    }
    for (name, _) in Effects::committed().of.keys() {
        let key = name.split('#').next().unwrap_or(name);
        assert!(
            keys.contains(key),
            "tests/golden/constants.csv: there is no {key}"
        );
    }
}

#[test]
fn the_page_is_what_the_sources_say() {
    let path = cslam_tests::root().join("docs/constants.md");
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    let expected = page(&found().constants, &Effects::committed());
    let (mut before, mut after) = (committed.lines(), expected.lines());
    let differs = std::iter::from_fn(|| Some((before.next(), after.next())))
        .take_while(|lines| *lines != (None, None))
        .find(|(committed, expected)| committed != expected);
    assert!(
        committed == expected,
        "docs/constants.md is stale, `cargo constants > docs/constants.md` writes it: {differs:?}"
    );
}
