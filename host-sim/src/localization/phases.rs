//! Outages and starts: where they are put into a flight, and what they cost.

use serde::Serialize;

use super::flights::Prepared;
use super::fly::Record;
use crate::statistics::{median, quantile, rms};

/// When an outage of 20 s may begin: the first time from 40 s on after 15 s with line of sight in at least 80 % of the
/// sweeps, and in the last one. `None` when the flight has no such time.
pub fn outage_start_s(flight: &Prepared) -> Option<f64> {
    let seen: Vec<bool> = flight
        .sweeps
        .iter()
        .map(|sweep| sweep.sight().is_some())
        .collect();
    (80..seen.len().saturating_sub(42))
        .find(|&k| {
            let before = &seen[k - 30..=k];
            before.iter().filter(|seen| **seen).count() >= 25 && seen[k] && seen[k - 1]
        })
        .map(|k| (k as f64 + 1.0) * 0.5)
}

/// When a flight may be entered with line of sight for the next 15 s (in at least 90 % of the sweeps) and 20 s left: the
/// first such time from 8 s on.
pub fn sighted_start_s(flight: &Prepared) -> Option<f64> {
    let seen: Vec<bool> = flight
        .sweeps
        .iter()
        .map(|sweep| sweep.sight().is_some())
        .collect();
    (16..seen.len().saturating_sub(60))
        .find(|&k| seen[k..k + 40].iter().filter(|seen| **seen).count() >= 38 && seen[k])
        .map(|k| (k as f64 + 1.0) * 0.5 - 0.25)
}

/// An outage of 20 s.
#[derive(Clone, Debug, Serialize)]
pub struct OutageFigures {
    /// Flights.
    pub flights: usize,
    /// Root mean square of the position error after 0, 5, 10, 15 and 20 s, m.
    pub rms_m: [f64; 5],
    /// Median, 90 % and greatest error at the end, m.
    pub end_m: [f64; 3],
    /// Share of the sweeps in the outage with a reflection.
    pub reflections: f64,
}

impl OutageFigures {
    /// Of the records of flights whose outage began at the given times.
    pub fn of(flights: &[(f64, Vec<Record>)]) -> Self {
        let at = |(start_s, records): &(f64, Vec<Record>), after_s: f64| {
            let wanted = start_s + after_s;
            records
                .iter()
                .find(|r| (r.time_s - wanted).abs() < 0.1)
                .map(|r| r.position_m.norm())
        };
        let errors = |after_s: f64| -> Vec<f64> { flights.iter().filter_map(|f| at(f, after_s)).collect() };
        let end = errors(20.0);
        let (mut with, mut all) = (0.0, 0.0);
        for (start_s, records) in flights {
            for record in records
                .iter()
                .filter(|r| r.time_s > *start_s && r.time_s <= start_s + 20.0)
            {
                all += 1.0;
                with += f64::from(u8::from(record.reflections > 0));
            }
        }
        let figure = |q: f64| quantile(&end, q).unwrap_or(f64::NAN);
        Self {
            flights: flights.len(),
            rms_m: [0.0, 5.0, 10.0, 15.0, 20.0].map(|after| rms(&errors(after)).unwrap_or(f64::NAN)),
            end_m: [median(&end).unwrap_or(f64::NAN), figure(0.9), figure(1.0)],
            reflections: with / all,
        }
    }
}

/// Starts.
#[derive(Clone, Debug, Serialize)]
pub struct StartFigures {
    /// Flights.
    pub flights: usize,
    /// Limits: position m, attitude deg.
    pub limit: [f64; 2],
    /// Time until both limits are kept for 2 s: median, 90 %, greatest, s; infinite for never.
    pub time_s: [f64; 3],
}

impl StartFigures {
    /// Of the records of flights that were entered at the given times.
    pub fn of(flights: &[(f64, Vec<Record>)], limit: [f64; 2]) -> Self {
        let reached = |(start_s, records): &(f64, Vec<Record>)| {
            let good = |r: &Record| {
                r.running && r.position_m.norm() < limit[0] && r.attitude_rad.norm().to_degrees() < limit[1]
            };
            // Two seconds are five sweeps, the first included.
            records
                .windows(5)
                .find(|w| w.iter().all(good))
                .and_then(|w| w.first())
                .map_or(f64::INFINITY, |r| r.time_s - start_s)
        };
        let mut times: Vec<f64> = flights.iter().map(reached).collect();
        times.sort_by(f64::total_cmp);
        // Order statistics: infinities cannot be interpolated.
        let rank = |q: f64| {
            let place = (q * times.len() as f64).ceil() as usize;
            times.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
        };
        Self {
            flights: flights.len(),
            limit,
            time_s: [rank(0.5), rank(0.9), rank(1.0)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::fly::tests::record;
    use super::*;

    #[test]
    fn a_start_counts_when_it_is_kept() {
        // Good for one sweep at 12 s, for good from 14 s on.
        let records: Vec<Record> = (0..40)
            .map(|k| {
                record(
                    10.0 + 0.5 * f64::from(k),
                    true,
                    if k == 4 || k >= 8 { 0.1 } else { 2.0 },
                )
            })
            .collect();
        let bad: Vec<Record> = records.iter().map(|r| record(r.time_s, true, 2.0)).collect();
        let flights = [(10.0, records.clone()), (10.0, records), (10.0, bad)];
        let figures = StartFigures::of(&flights, [0.3, 0.5]);
        assert_eq!(figures.time_s, [4.0, f64::INFINITY, f64::INFINITY]);
    }

    #[test]
    fn outage_errors_are_taken_at_their_times() {
        let records: Vec<Record> = (0..100)
            .map(|k| record(0.5 * f64::from(k), true, 0.01 * f64::from(k)))
            .collect();
        let figures = OutageFigures::of(&[(10.0, records)]);
        assert!((figures.rms_m[0] - 0.2).abs() < 1e-12 && (figures.rms_m[4] - 0.6).abs() < 1e-12);
        assert!((figures.end_m[2] - 0.6).abs() < 1e-12 && figures.reflections == 0.0);
    }
}
