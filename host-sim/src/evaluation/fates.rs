//! What became of every measured path, by what it truly was.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::flight_log::{FlightLog, MeasuredPath};

/// Measured paths that met one verdict, by the true path behind them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Fate {
    /// The verdict: `ok`, `ok, of higher order`, or the reason of a rejection.
    pub verdict: String,
    /// Truly line of sight.
    pub los: usize,
    /// Truly of first order.
    pub first_order: usize,
    /// Truly of higher order.
    pub higher_order: usize,
    /// No true path behind them.
    pub ghosts: usize,
}

/// Counts the measured paths of all sweeps whose truth is known, verdict by verdict, `ok` first.
pub(super) fn fates(log: &FlightLog) -> Vec<Fate> {
    let mut all: BTreeMap<(bool, &str), Fate> = BTreeMap::new();
    for sweep in &log.sweeps {
        let Some(link) = &sweep.truth.link else {
            continue;
        };
        for (path, matched) in sweep.estimate.paths.iter().zip(&sweep.truth.matches) {
            let verdict = path.verdict.as_str();
            let fate = all
                .entry((!MeasuredPath::is_accepted(verdict), verdict))
                .or_insert_with(|| Fate {
                    verdict: verdict.to_owned(),
                    ..Fate::default()
                });
            match matched.and_then(|index| link.paths.get(index)).map(|p| p.order) {
                None => fate.ghosts += 1,
                Some(Some(0)) => fate.los += 1,
                Some(Some(1)) => fate.first_order += 1,
                Some(Some(_)) => fate.higher_order += 1,
                // A list that does not say its orders.
                Some(None) => {}
            }
        }
    }
    all.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_flight::{log_of, measured, sweep, true_path};

    #[test]
    fn every_path_is_counted_once_under_its_verdict() {
        let mut record = sweep(0, [0.0; 3]);
        let orders = [0, 1, 2, 3];
        record.truth.link.as_mut().expect("known").paths = orders
            .map(|order| true_path(order, 10.0 + f64::from(order), [1.0, 1.0]))
            .to_vec();
        record.estimate.paths = vec![measured(10.0, [1.0, 1.0]); 5];
        record.truth.matches = vec![Some(0), Some(1), Some(2), Some(3), None];
        record.estimate.paths[0].verdict = "line of sight".into();
        record.estimate.paths[3].verdict = "under ground".into();
        let fate = |verdict: &str, [los, first_order, higher_order, ghosts]: [usize; 4]| Fate {
            verdict: verdict.into(),
            los,
            first_order,
            higher_order,
            ghosts,
        };
        let expected = [
            fate("ok", [0, 1, 1, 1]),
            fate("line of sight", [1, 0, 0, 0]),
            fate("under ground", [0, 0, 1, 0]),
        ];
        assert_eq!(fates(&log_of(vec![record])), expected);
    }
}
