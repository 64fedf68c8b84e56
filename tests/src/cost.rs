//! Tables of instruction counts: reading them, and finding what became dearer.

use std::collections::BTreeMap;

/// A count may rise by this much before a test fails; a change below it is the compiler's.
const TOLERANCE: f64 = 0.02;

/// Counts by name, from lines `name: instructions`; others are passed over.
pub fn counts(text: &str) -> BTreeMap<String, f64> {
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.rsplit_once(": "))
        .filter_map(|(name, count)| Some((name.to_owned(), count.trim().parse().ok()?)))
        .collect()
}

/// What is missing, new, or dearer than committed.
pub fn rises(committed: &BTreeMap<String, f64>, measured: &BTreeMap<String, f64>) -> Vec<String> {
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

/// Prints what was measured, and holds it against a committed table of `tests/golden`.
///
/// # Panics
/// When something is missing, new, or dearer than committed: with all of it.
pub fn costs_no_more_than_committed(table: &str, measured: &BTreeMap<String, f64>) {
    for (name, count) in measured {
        println!("{name}: {count}");
    }
    let path = crate::root().join("tests/golden").join(table);
    let committed = std::fs::read_to_string(path).expect("the committed table");
    let rises = rises(&counts(&committed), measured);
    assert!(rises.is_empty(), "{}", rises.join("\n"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rise_a_missing_and_a_new_kernel_are_found() {
        let committed = counts("# made: 3\nfft 512: 14000\nlevel: 20000\nempty: 1\n");
        assert!(rises(&committed, &counts("fft 512: 14200\nlevel: 15000\nempty: 4")).is_empty());
        let found = rises(&committed, &counts("fft 512: 14300\nempty: 1\nmore: 7"));
        assert_eq!(
            found,
            [
                "level: not measured",
                "fft 512: 14300 instructions, committed 14000",
                "more: 7, not in the table"
            ]
        );
    }
}
