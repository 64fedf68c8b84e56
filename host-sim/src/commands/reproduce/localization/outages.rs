//! Planned outages: the line of sight is blocked in flights that have it, from samples.

use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::rows::ROWS;
use crate::kept_flight::{KeptFlight, OutageEnd, fly_outage, outage_start_s};
use crate::recording::Span;
use crate::statistics::{median, quantile};

/// Columns.
pub(super) const HEADER: [&str; 8] = [
    "outage",
    "flights",
    "error at its end, m: median",
    "90 %",
    "most",
    "within 3 sigma",
    "smoothed: median, 90 %, most",
    "false sights",
];

/// A row of the table.
#[derive(Serialize)]
pub(super) struct Line {
    outage_s: f64,
    row: &'static str,
    flights: usize,
    median_m: f64,
    ninety_m: f64,
    worst_m: f64,
    within_3_sigma: usize,
    /// Error of the smoothed trajectory at the same place: median, 90 % and most; absent without a filter.
    smoothed_m: Option<[f64; 3]>,
    false_sights: usize,
}

impl Line {
    fn of(outage_s: f64, row: &'static str, ends: &[OutageEnd]) -> Self {
        let errors: Vec<f64> = ends.iter().map(|end| end.error_m).collect();
        let smoothed: Vec<f64> = ends.iter().filter_map(|end| end.smoothed_m).collect();
        let smoothed_m = [0.5, 0.9, 1.0].map(|share| quantile(&smoothed, share));
        Self {
            outage_s,
            row,
            flights: ends.len(),
            median_m: median(&errors).unwrap_or(f64::NAN),
            ninety_m: quantile(&errors, 0.9).unwrap_or(f64::NAN),
            worst_m: quantile(&errors, 1.0).unwrap_or(f64::NAN),
            within_3_sigma: ends.iter().filter(|end| end.sigmas <= 3.0).count(),
            smoothed_m: match smoothed_m {
                [Some(half), Some(ninety), Some(most)] => Some([half, ninety, most]),
                _ => None,
            },
            false_sights: ends.iter().map(|end| end.false_sights).sum(),
        }
    }

    pub(super) fn cells(&self) -> Vec<String> {
        vec![
            format!("{} s, {}", self.outage_s, self.row),
            self.flights.to_string(),
            format!("{:.2}", self.median_m),
            format!("{:.2}", self.ninety_m),
            format!("{:.2}", self.worst_m),
            format!("{}/{}", self.within_3_sigma, self.flights),
            self.smoothed_m.map_or("-".into(), |errors| {
                errors.map(|error_m| format!("{error_m:.2}")).join(", ")
            }),
            self.false_sights.to_string(),
        ]
    }
}

/// Flies each row over all flights, with outages of these lengths, s. All that begin at one place of a flight are parts of the longest, which is flown
/// from its samples once.
pub(super) fn fly(
    flights: &[KeptFlight<'_>],
    lengths_s: &[f64],
    bar: &ProgressBar,
) -> anyhow::Result<Vec<Line>> {
    let longest = |flight| {
        let started = |length_s: &f64| Some((outage_start_s(flight, *length_s)?, *length_s));
        lengths_s
            .iter()
            .filter_map(started)
            .max_by(|(_, a), (_, b)| a.total_cmp(b))
    };
    let mut planned = Vec::new();
    for flight in flights {
        if let Some((from_s, length_s)) = longest(flight) {
            let to_s = from_s + length_s;
            planned.push((flight, length_s, flight.blocked(Span { from_s, to_s })?));
        }
        bar.inc(1);
    }
    let mut lines = Vec::new();
    for &length_s in lengths_s {
        for row in ROWS {
            let ends = planned
                .par_iter()
                .filter(|(_, longest_s, _)| *longest_s >= length_s)
                .map(|(flight, _, blocked)| fly_outage(flight, row.receiver()?, &blocked.for_s(length_s)))
                .collect::<anyhow::Result<Vec<_>>>()?;
            bar.inc(1);
            lines.push(Line::of(length_s, row.name, &ends));
        }
    }
    Ok(lines)
}
