//! Two campaigns side by side, flight by flight.

use std::collections::BTreeMap;

use super::figure::FIGURES;
use super::shard::{Flight, Shard};
use crate::statistics::median;
use crate::table::Table;

/// A figure of the flights that both have.
#[derive(Clone, Debug, PartialEq)]
struct Pair {
    name: &'static str,
    better: usize,
    worse: usize,
    equal: usize,
    difference: Option<f64>,
    probability: f64,
    scale: f64,
    decimals: usize,
}

/// Two campaigns.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    flights: usize,
    pairs: Vec<Pair>,
    tables: Vec<(Flight, Vec<[Option<f64>; 2]>)>,
}

/// Compares what two campaigns have in common. Configurations may have other names: a flight is its scene, seed and mode.
pub fn compare(a: &[Shard], b: &[Shard]) -> Comparison {
    let key = |shard: &Shard| {
        (
            shard.flight.mode.clone(),
            shard.flight.scene.clone(),
            shard.flight.seed,
        )
    };
    let other: BTreeMap<_, &Shard> = b.iter().map(|shard| (key(shard), shard)).collect();
    let both: Vec<(&Shard, &Shard)> = a
        .iter()
        .filter_map(|shard| Some((shard, *other.get(&key(shard))?)))
        .filter(|(a, b)| a.report.is_some() && b.report.is_some())
        .collect();
    let tables: Vec<(Flight, Vec<[Option<f64>; 2]>)> = both
        .iter()
        .map(|(a, b)| {
            let of = |shard: &Shard, index: usize| FIGURES[index].of(shard.report.as_ref()?);
            let figures = (0..FIGURES.len()).map(|index| [of(a, index), of(b, index)]);
            (a.flight.clone(), figures.collect())
        })
        .collect();
    let pairs = FIGURES.iter().enumerate().map(|(index, figure)| {
        let known: Vec<f64> = tables
            .iter()
            .filter_map(|(_, figures)| {
                let [a, b] = figures[index];
                Some(b? - a?)
            })
            .collect();
        let gained = |difference: &&f64| {
            if figure.more_is_better {
                **difference > 0.0
            } else {
                **difference < 0.0
            }
        };
        let equal = known.iter().filter(|difference| **difference == 0.0).count();
        let better = known.iter().filter(gained).count();
        let worse = known.len() - equal - better;
        Pair {
            name: figure.name,
            better,
            worse,
            equal,
            difference: median(&known),
            probability: sign_test(better, worse),
            scale: figure.scale,
            decimals: figure.decimals,
        }
    });
    Comparison {
        flights: both.len(),
        pairs: pairs.collect(),
        tables,
    }
}

/// How probable a split at least as uneven is when neither is better: two-sided, ties left out.
fn sign_test(better: usize, worse: usize) -> f64 {
    let (n, few) = (better + worse, better.min(worse));
    // The binomial coefficients over 2^n, from the middle of which nothing overflows.
    let mut term = libm::exp2(-(n as f64));
    let mut tail = 0.0;
    for k in 0..=few {
        tail += term;
        term *= (n - k) as f64 / (k + 1) as f64;
    }
    (2.0 * tail).min(1.0)
}

impl Comparison {
    /// It as text: figure by figure, then flight by flight in the figures that changed.
    pub fn text(&self, names: [&str; 2]) -> String {
        let [a, b] = names;
        let mut table = Table::new([
            format!("{b} against {a}, {} flights", self.flights),
            "better".into(),
            "worse".into(),
            "equal".into(),
            "median difference".into(),
            "by chance, %".into(),
        ]);
        for pair in &self.pairs {
            table.row([
                pair.name.to_owned(),
                pair.better.to_string(),
                pair.worse.to_string(),
                pair.equal.to_string(),
                pair.difference.map_or_else(
                    || "-".into(),
                    |difference| format!("{:+.*}", pair.decimals, difference * pair.scale),
                ),
                format!("{:.1}", 100.0 * pair.probability),
            ]);
        }
        let changed: Vec<usize> = (0..FIGURES.len())
            .filter(|index| {
                self.pairs
                    .get(*index)
                    .is_some_and(|pair| pair.better + pair.worse > 0)
            })
            .collect();
        let header =
            core::iter::once("flight".to_owned()).chain(changed.iter().map(|i| FIGURES[*i].name.to_owned()));
        let mut flights = Table::new(header);
        for (flight, figures) in &self.tables {
            let cells = changed.iter().map(|index| {
                let [before, after] = figures[*index];
                let text = |value| FIGURES[*index].text(value);
                format!("{} > {}", text(before), text(after))
            });
            flights.row(core::iter::once(flight.text()).chain(cells));
        }
        if changed.is_empty() {
            return format!("{table}\nno figure of any flight differs\n");
        }
        format!("{table}\n{flights}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::Build;
    use serde_json::json;

    fn shards(errors_m: &[f64]) -> Vec<Shard> {
        let one = |(seed, error_m): (usize, &f64)| Shard {
            flight: Flight {
                world: "default".into(),
                mode: "best".into(),
                scene: "outdoor".into(),
                seed: seed as u64,
            },
            build: Build {
                version: String::new(),
                executable_crc: 0,
                config_crc: 0,
            },
            report: Some(json!({"trajectory": {"position_rmse_m": error_m}})),
            error: None,
        };
        errors_m.iter().enumerate().map(one).collect()
    }

    #[test]
    fn the_sign_test_is_that_of_the_books() {
        // 1 of 10: 2 (1 + 10) / 1024.
        assert!((sign_test(9, 1) - 22.0 / 1024.0).abs() < 1e-12);
        assert!((sign_test(1, 9) - 22.0 / 1024.0).abs() < 1e-12);
        assert_eq!((sign_test(0, 0), sign_test(5, 5)), (1.0, 1.0));
        assert!(sign_test(600, 0) < 1e-100);
    }

    #[test]
    fn flights_are_told_apart_and_what_only_one_has_is_left_out() {
        let (a, b) = (shards(&[0.1, 0.2, 0.3, 0.4]), shards(&[0.1, 0.1, 0.4]));
        let comparison = compare(&a, &b);
        let pair = comparison
            .pairs
            .iter()
            .find(|pair| pair.name == "position, rms, m")
            .expect("a row");
        assert_eq!((pair.better, pair.worse, pair.equal), (1, 1, 1));
        assert_eq!(comparison.flights, 3);
        let text = comparison.text(["before", "after"]);
        assert!(text.contains("0.200 > 0.100"), "{text}");
        assert!(
            compare(&a, &a)
                .text(["before", "after"])
                .contains("no figure of any flight differs")
        );
    }
}
