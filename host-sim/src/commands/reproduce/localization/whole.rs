//! Whole flights.

use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::rows::{ROWS, Row};
use crate::evaluation::{Evaluation, evaluate};
use crate::kept_flight::{Changes, KeptFlight};
use crate::statistics::{mean, median, quantile, rms};

/// Columns.
pub(super) const HEADER: [&str; 10] = [
    "whole flights",
    "flights",
    "position, m: rms",
    "median of flights",
    "90 %",
    "most",
    "settled, rms",
    "attitude, deg",
    "clock, ns",
    "NEES: position, attitude, clock",
];

/// A row of the table. Errors are root mean squares over all poses, pooled over the flights.
#[derive(Serialize)]
pub(super) struct Line {
    row: &'static str,
    flights: usize,
    position_m: f64,
    median_m: f64,
    ninety_m: f64,
    worst_m: f64,
    /// With line of sight for more than 1.5 s.
    settled_m: f64,
    attitude_deg: f64,
    clock_ns: f64,
    /// Normalised estimation error squared over its dimension, mean of all flights: position, attitude, clock.
    nees: [Option<f64>; 3],
}

impl Line {
    fn of(row: &'static str, flights: &[Evaluation]) -> Self {
        let each = |figure: &dyn Fn(&Evaluation) -> Option<f64>| -> Vec<f64> {
            flights.iter().filter_map(figure).collect()
        };
        let pooled = |figure: &dyn Fn(&Evaluation) -> Option<f64>| rms(&each(figure)).unwrap_or(f64::NAN);
        let position = each(&|e| e.trajectory.position_rmse_m);
        Self {
            row,
            flights: flights.len(),
            position_m: rms(&position).unwrap_or(f64::NAN),
            median_m: median(&position).unwrap_or(f64::NAN),
            ninety_m: quantile(&position, 0.9).unwrap_or(f64::NAN),
            worst_m: quantile(&position, 1.0).unwrap_or(f64::NAN),
            settled_m: pooled(&|e| e.trajectory.settled_position_rmse_m),
            attitude_deg: pooled(&|e| e.trajectory.attitude_rmse_deg),
            clock_ns: pooled(&|e| e.clock.rmse_ns),
            nees: [
                mean(each(&|e| e.consistency.position_nees)),
                mean(each(&|e| e.consistency.attitude_nees)),
                mean(each(&|e| e.consistency.clock_nees)),
            ],
        }
    }

    /// Flies all flights with these changes and the receiver of `row`.
    pub(super) fn flown(
        name: &'static str,
        flights: &[KeptFlight<'_>],
        changes: &Changes,
        row: &Row,
        bar: &ProgressBar,
    ) -> anyhow::Result<Self> {
        let flown = flights
            .par_iter()
            .map(|flight| {
                let mut log = flight.again(changes, row.receiver()?, |_, _| (), |_| ())?;
                Ok(evaluate(&mut log, None))
            })
            .collect::<anyhow::Result<Vec<_>>>()?;
        bar.inc(1);
        Ok(Self::of(name, &flown))
    }

    pub(super) fn cells(&self) -> Vec<String> {
        let nees = self
            .nees
            .map(|value| value.map_or("-".into(), |value| format!("{value:.2}")));
        vec![
            self.row.into(),
            self.flights.to_string(),
            format!("{:.3}", self.position_m),
            format!("{:.3}", self.median_m),
            format!("{:.3}", self.ninety_m),
            format!("{:.3}", self.worst_m),
            format!("{:.3}", self.settled_m),
            format!("{:.3}", self.attitude_deg),
            format!("{:.2}", self.clock_ns),
            nees.join(" "),
        ]
    }
}

/// Flies each row over all flights.
pub(super) fn fly(flights: &[KeptFlight<'_>], bar: &ProgressBar) -> anyhow::Result<Vec<Line>> {
    let line = |row: &Row| Line::flown(row.name, flights, &Changes::default(), row, bar);
    ROWS.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flights_are_pooled_by_their_squares() {
        let flight = |position_m, nees| {
            let mut flight = Evaluation::default();
            flight.trajectory.position_rmse_m = Some(position_m);
            flight.consistency.position_nees = Some(nees);
            flight
        };
        let line = Line::of("", &[flight(1.0, 0.5), flight(7.0, 1.5)]);
        assert_eq!((line.position_m, line.median_m, line.worst_m), (5.0, 4.0, 7.0));
        assert_eq!(line.nees, [Some(1.0), None, None]);
        assert!(line.settled_m.is_nan());
        assert_eq!(line.cells().len(), HEADER.len());
    }
}
