//! Figures of a set of flights.

use serde::Serialize;

use super::fly::Record;
use crate::statistics::{median, quantile, rms};

/// Before this time a flight starts up, s (docs/localization.md, "The model").
const FROM_S: f64 = 20.0;
/// Line of sight must have lasted this long to count as settled, s.
const SETTLED_S: f64 = 1.5;
/// A light-nanosecond, m.
const NS_M: f64 = 0.299_792_458;

/// What a line of the table says. Errors are root mean squares over all sweeps after the first 20 s.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// Flights.
    pub flights: usize,
    /// 3-D position error with line of sight for more than 1.5 s, m.
    pub settled_m: f64,
    /// Median of that over flights, and what 90 % of the flights stay below, m.
    pub settled_flights_m: [f64; 2],
    /// 3-D position error over the whole flight, m.
    pub all_m: f64,
    /// Median of that over flights, and what 90 % of the flights stay below, m.
    pub all_flights_m: [f64; 2],
    /// Median of the 3-D position error in line of sight, m.
    pub sight_median_m: f64,
    /// Attitude error, norm and per world axis, deg.
    pub attitude_deg: f64,
    /// Per axis east, north, up, deg.
    pub attitude_axes_deg: [f64; 3],
    /// Clock error, ns.
    pub clock_ns: f64,
    /// Normalised estimation error squared over its dimension: position, attitude, clock.
    pub nees: [f64; 3],
    /// Share of sweeps whose mean over the flights lies within the 95 % band: position, attitude, clock.
    pub nees_in_band: [f64; 3],
    /// Normalised innovation squared of line of sight over its dimension.
    pub nis: f64,
    /// Share of sweeps whose mean over the flights lies within the 95 % band.
    pub nis_in_band: f64,
    /// Flights that stayed beyond 3 m for more than 10 s while the GMT was seen.
    pub lost: usize,
}

impl Figures {
    /// Of the records of several flights.
    pub fn of(flights: &[Vec<Record>]) -> Self {
        let used = |flight: &[Record]| -> Vec<Record> {
            flight
                .iter()
                .filter(|r| r.running && r.time_s > FROM_S)
                .copied()
                .collect()
        };
        let norms =
            |records: &[Record]| -> Vec<f64> { records.iter().map(|r| r.position_m.norm()).collect() };
        let all: Vec<Vec<Record>> = flights.iter().map(|flight| used(flight)).collect();
        let settled: Vec<Vec<Record>> = flights.iter().map(|flight| settled(flight)).collect();
        let pooled: Vec<Record> = all.iter().flatten().copied().collect();
        let per_flight = |sets: &[Vec<Record>]| {
            let each: Vec<f64> = sets.iter().filter_map(|set| rms(&norms(set))).collect();
            [
                median(&each).unwrap_or(f64::NAN),
                quantile(&each, 0.9).unwrap_or(f64::NAN),
            ]
        };
        let pool = |value: &dyn Fn(&Record) -> f64| {
            rms(&pooled.iter().map(value).collect::<Vec<_>>()).unwrap_or(f64::NAN)
        };
        let seen: Vec<f64> = pooled
            .iter()
            .filter(|r| r.sight)
            .map(|r| r.position_m.norm())
            .collect();
        let nees = [(0, 3.0), (1, 3.0), (2, 1.0)].map(|(k, order)| {
            band(flights, order, |r| {
                (r.time_s > FROM_S && r.running).then_some(r.nees[k])
            })
        });
        let nis = band(flights, 5.0, |r| {
            (r.time_s > FROM_S && r.running && r.sight && !r.outlier).then_some(r.nis)
        });
        Self {
            flights: flights.len(),
            settled_m: rms(&norms(&settled.concat())).unwrap_or(f64::NAN),
            settled_flights_m: per_flight(&settled),
            all_m: pool(&|r| r.position_m.norm()),
            all_flights_m: per_flight(&all),
            sight_median_m: median(&seen).unwrap_or(f64::NAN),
            attitude_deg: pool(&|r| r.attitude_rad.norm().to_degrees()),
            attitude_axes_deg: [0, 1, 2].map(|axis| pool(&|r| r.attitude_rad[axis].to_degrees())),
            clock_ns: pool(&|r| r.clock_m / NS_M),
            nees: nees.map(|(mean, _)| mean),
            nees_in_band: nees.map(|(_, share)| share),
            nis: nis.0,
            nis_in_band: nis.1,
            lost: flights.iter().filter(|flight| is_lost(flight)).count(),
        }
    }
}

/// Records with line of sight that has lasted.
fn settled(flight: &[Record]) -> Vec<Record> {
    let mut blind_s = f64::NEG_INFINITY;
    let mut settled = Vec::new();
    for record in flight {
        if !record.sight {
            blind_s = record.time_s;
        }
        // The sweep after the last blind one is the re-acquisition.
        let since_s = record.time_s - blind_s - 0.5;
        if record.running && record.time_s > FROM_S && record.sight && since_s > SETTLED_S {
            settled.push(*record);
        }
    }
    settled
}

/// Whether a flight stayed beyond 3 m for more than 10 s in which the GMT was seen.
fn is_lost(flight: &[Record]) -> bool {
    let mut seen = 0;
    for record in flight.iter().filter(|r| r.running) {
        let far = !record.position_m.iter().all(|c| c.is_finite()) || record.position_m.norm() > 3.0;
        seen = match (far, record.sight) {
            (false, _) => 0,
            (true, true) => seen + 1,
            (true, false) => seen,
        };
        if seen > 20 {
            return true;
        }
    }
    // A flight that never had a pose is lost as well.
    !flight.iter().any(|r| r.running)
}

/// Mean of a normalised square over its order, and the share of sweeps whose mean over the flights lies within the 95 %
/// band of a chi-square of as many degrees of freedom.
fn band(flights: &[Vec<Record>], order: f64, value: impl Fn(&Record) -> Option<f64>) -> (f64, f64) {
    let sweeps = flights.iter().map(Vec::len).max().unwrap_or(0);
    let (mut sum, mut count, mut inside, mut judged) = (0.0, 0.0, 0.0, 0.0);
    for sweep in 0..sweeps {
        let values: Vec<f64> = flights
            .iter()
            .filter_map(|flight| flight.get(sweep).and_then(&value))
            .filter(|value| value.is_finite())
            .collect();
        if values.is_empty() {
            continue;
        }
        let total: f64 = values.iter().sum();
        let freedom = order * values.len() as f64;
        sum += total / order;
        count += values.len() as f64;
        judged += 1.0;
        if (chi_square_quantile(freedom, -1.96)..=chi_square_quantile(freedom, 1.96)).contains(&total) {
            inside += 1.0;
        }
    }
    if judged > 0.0 {
        (sum / count, inside / judged)
    } else {
        (f64::NAN, f64::NAN)
    }
}

/// Quantile of chi-square at a normal deviate (Wilson and Hilferty): exact to a percent from three degrees of freedom on.
fn chi_square_quantile(freedom: f64, deviate: f64) -> f64 {
    let ninth = 2.0 / (9.0 * freedom);
    let root = 1.0 - ninth + deviate * libm::sqrt(ninth);
    freedom * root * root * root
}

#[cfg(test)]
mod tests {
    use super::super::fly::tests::record;
    use super::*;

    #[test]
    fn settled_begins_two_seconds_after_the_first_sight() {
        let flight: Vec<Record> = (0..20)
            .map(|k| record(30.0 + 0.5 * f64::from(k), k != 5, 0.1))
            .collect();
        let times: Vec<f64> = settled(&flight).iter().map(|r| r.time_s).collect();
        // Blind at 32.5, sight again at 33: settled after 34.5.
        assert!(times.contains(&32.0) && !times.contains(&34.5) && times.contains(&35.0));
    }

    #[test]
    fn a_flight_is_lost_after_ten_seconds_of_contradiction() {
        let flight = |far: u32| -> Vec<Record> {
            (0..60)
                .map(|k| {
                    record(
                        30.0 + 0.5 * f64::from(k),
                        k % 2 == 0,
                        if k < far { 3.5 } else { 0.1 },
                    )
                })
                .collect()
        };
        assert!(is_lost(&flight(44)) && !is_lost(&flight(38)));
        assert!(!is_lost(&flight(0)));
    }

    #[test]
    fn figures_of_known_errors() {
        let flight: Vec<Record> = (0..200).map(|k| record(0.5 * f64::from(k), true, 0.3)).collect();
        let figures = Figures::of(&[flight.clone(), flight]);
        assert!((figures.settled_m - 0.3).abs() < 1e-12 && (figures.all_m - 0.3).abs() < 1e-12);
        assert_eq!((figures.flights, figures.lost), (2, 0));
        assert!((figures.nees[0] - 1.0).abs() < 1e-12 && figures.nees_in_band[0] == 1.0);
        // 95 % of chi-square with 10 degrees of freedom: 3.247 to 20.483.
        assert!((chi_square_quantile(10.0, -1.96) / 3.247 - 1.0).abs() < 0.01);
        assert!((chi_square_quantile(10.0, 1.96) / 20.483 - 1.0).abs() < 0.01);
    }
}
