//! The figures of whole flights: of each its name, and how those of several flights become one.

use crate::evaluation::Evaluation;
use crate::flight_log::FlightLog;
use crate::statistics;

/// A figure of a flight: its name, and how those of several flights become one.
pub(super) struct Figure {
    pub(super) name: &'static str,
    pub(super) join: fn(&[f64]) -> Option<f64>,
    pub(super) decimals: usize,
    pub(super) of: fn(&FlightLog, &Evaluation) -> Option<f64>,
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Orders of the true paths of each sweep.
fn orders(log: &FlightLog) -> impl Iterator<Item = Vec<u8>> {
    log.sweeps
        .iter()
        .filter_map(|sweep| sweep.truth.link.as_ref())
        .map(|link| link.paths.iter().filter_map(|path| path.order).collect())
}

/// Share of sweeps for which `holds` is true of the orders of their true paths, of those for which `among` is, %.
fn share(log: &FlightLog, among: fn(&[u8]) -> bool, holds: fn(&[u8]) -> bool) -> Option<f64> {
    let held: Vec<f64> = orders(log)
        .filter(|orders| among(orders))
        .map(|orders| f64::from(u8::from(holds(&orders))))
        .collect();
    mean(&held).map(|share| 100.0 * share)
}

/// Points a sweep that could be accepted: true paths of one reflection, over the sweeps with any.
fn present(log: &FlightLog) -> Option<f64> {
    let counts: Vec<f64> = orders(log)
        .map(|orders| orders.iter().filter(|order| **order == 1).count() as f64)
        .filter(|count| *count > 0.0)
        .collect();
    mean(&counts)
}

pub(super) const FIGURES: [Figure; 17] = [
    Figure {
        name: "sweeps with line of sight, %",
        join: mean,
        decimals: 0,
        of: |log, _| share(log, |_| true, |orders| orders.contains(&0)),
    },
    Figure {
        name: "NLOS sweeps with a first-order path, %",
        join: mean,
        decimals: 0,
        of: |log, _| share(log, |orders| !orders.contains(&0), |orders| orders.contains(&1)),
    },
    Figure {
        name: "correct reflection order, %",
        join: mean,
        decimals: 1,
        of: |_, e| e.map.precision.map(|share| 100.0 * share),
    },
    Figure {
        name: "correct, presumed first order, %",
        join: mean,
        decimals: 1,
        of: |_, e| e.map.precision_first_order.map(|share| 100.0 * share),
    },
    Figure {
        name: "correct, presumed higher order, %",
        join: mean,
        decimals: 1,
        of: |_, e| e.map.precision_higher_order.map(|share| 100.0 * share),
    },
    Figure {
        name: "map to true surface, median, m",
        join: mean,
        decimals: 3,
        of: |_, e| e.map.surface_median_m,
    },
    Figure {
        name: "map to true surface, rms, m",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.map.surface_rmse_m,
    },
    Figure {
        name: "error of points of correct order, median, m",
        join: mean,
        decimals: 3,
        of: |_, e| e.map.point_median_m,
    },
    Figure {
        name: "points per sweep with a first-order path",
        join: mean,
        decimals: 2,
        of: |_, e| e.map.accepted_per_sweep,
    },
    Figure {
        name: "of these, first order",
        join: mean,
        decimals: 2,
        of: |_, e| e.map.accepted_first_order_per_sweep,
    },
    Figure {
        name: "true first-order paths in such a sweep",
        join: mean,
        decimals: 2,
        of: |log, _| present(log),
    },
    Figure {
        name: "lit walls mapped within 0.5 m, %",
        join: mean,
        decimals: 1,
        of: |_, e| e.map.completeness_0p5m.map(|share| 100.0 * share),
    },
    Figure {
        name: "position error, rms, whole flight, m",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.trajectory.position_rmse_m,
    },
    Figure {
        name: "position error, median, m",
        join: mean,
        decimals: 3,
        of: |_, e| e.trajectory.position_median_m,
    },
    Figure {
        name: "position error, rms, settled, m",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.trajectory.settled_position_rmse_m,
    },
    Figure {
        name: "attitude error, rms, deg",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.trajectory.attitude_rmse_deg,
    },
    Figure {
        name: "clock error, rms, ns",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.clock.rmse_ns,
    },
];
