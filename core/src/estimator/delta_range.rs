//! How much paths have grown since the last sweep: velocity, whatever the paths met.
//!
//! A path of any number of reflections grows by what the UAV moves against its direction of arrival and by what the GMT moves
//! against its direction of departure. The walls between them do not matter, so they need not be known: this is the delta range of
//! satellite navigation, between two sweeps. Where the line of sight is hidden and no mapped plane explains a reflection it holds
//! the velocity along every direction that a path comes from, and through it the tilt; without it a tilt of a few milliradians
//! moves a dead-reckoned position by metres in ten seconds.
//!
//! With the directions of both ends averaged over the two sweeps the difference is exact to the second order of the motion.

use heapless::Vec;
use nalgebra::Vector3;

use super::Filter;
use super::layout::{ATTITUDE, CLOCK_DRIFT, VELOCITY};
use super::measurement::{PathMeasurement, Transmitter};
use super::row::Row;
use super::sweep_measurement::SweepMeasurement;
use crate::geometry::Real;
use crate::signal::DelayPeriod;

/// Paths of a sweep that are kept for the next one.
/// Capacity: as many as path estimation finds.
const MOST_PATHS: usize = 9;
/// Time between two sweeps whose paths are compared, s.
/// Derived: of sweeps twice a second, the next but one at most.
const APART_S: (f64, f64) = (0.1, 1.2);
/// Two paths are one when they have grown by nothing but what the motion explains, m, and come from one direction ([`SAME_RAD`]).
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const SAME_M: f64 = 1.0;
/// Directions closer than this are one, rad. A departure known worse does not tell what the GMT's motion does.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const SAME_RAD: f64 = 0.05;
/// Share of partners that are another path: its growth is anything up to [`SAME_M`].
/// Measured: the likelihood of the differences without sight in 18 flights of `real` (tuning seeds) is greatest there.
const EXCHANGED: f64 = 0.2;
/// A difference that is of the same path with less probability than this says nothing.
/// Numerical: a variance that is a hundred times as large corrects nothing.
const LEAST_SAME: f64 = 0.01;
/// A GMT that has moved less stands, m.
/// Derived: what an honest beacon scatters between two sweeps: 5 mm an axis in each, and its walk.
const STANDING_M: f64 = 0.01;
/// Errors of an angle of arrival beside what is claimed, rad.
/// Measured: of reflected paths half are within 2.3 mrad, both axes together, and their tail is long (docs/localization.md, "Reflections").
pub(super) const ARRIVAL_RAD: f64 = 3e-3;
/// Standard deviation of a difference beside what the delays claim, m: paths that come nearly at once pull at each other.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const PULLED_M: f64 = 0.02;

/// A path as the next sweep needs it.
#[derive(Clone, Copy, Debug)]
struct Length {
    c_tau_m: f64,
    variance_m2: f64,
    /// Direction that it came from, world axes.
    towards: Vector3<f64>,
    /// Direction in which it left the GMT, world axes.
    left: Option<Vector3<f64>>,
}

/// The paths of a sweep.
#[derive(Clone, Debug, Default)]
pub(super) struct Lengths {
    time_ns: u64,
    gmt_m: Vector3<f64>,
    paths: Vec<Length, MOST_PATHS>,
}

/// What happened between two sweeps.
struct Between {
    dt_s: f64,
    /// Motion of the UAV and of the GMT, m.
    moved_m: Vector3<f64>,
    shifted_m: Vector3<f64>,
    drift_m: f64,
    delay_period: DelayPeriod,
}

impl Between {
    /// Growth of a path that the UAV's motion and the clock do not explain, m.
    fn growth_m(&self, before: &Length, now: &Length) -> f64 {
        let towards = (before.towards + now.towards) * 0.5;
        self.delay_period
            .wrap_m(now.c_tau_m - before.c_tau_m + towards.dot(&self.moved_m) - self.drift_m)
    }

    /// How unlike two paths are, in units of what one path may be.
    fn unlike(&self, before: &Length, now: &Length) -> f64 {
        let growth = self.growth_m(before, now).abs() / SAME_M;
        growth.max((before.towards - now.towards).norm() / SAME_RAD)
    }

    /// The path of the last sweep that a path goes on from: each is the other's nearest.
    fn partner<'a>(&self, now: &Length, before: &'a [Length], all: &[Length]) -> Option<&'a Length> {
        let nearest = before
            .iter()
            .min_by(|a, b| self.unlike(a, now).total_cmp(&self.unlike(b, now)))?;
        let own = self.unlike(nearest, now);
        (own < 1.0 && all.iter().all(|other| self.unlike(nearest, other) >= own)).then_some(nearest)
    }

    /// The growth of a path as a row over velocity and drift. `None` when the GMT has moved and the departure is not known.
    fn row<T: Real>(&self, before: &Length, now: &Length) -> Option<Row<T>> {
        let mut residual = self.growth_m(before, now);
        let towards = (before.towards + now.towards) * 0.5;
        // An arrival that is off takes motion across for motion along.
        let aside_m = towards.cross(&self.moved_m).norm() * ARRIVAL_RAD;
        let mut variance = before.variance_m2 + now.variance_m2 + PULLED_M * PULLED_M + aside_m * aside_m;
        let shifted_m = self.shifted_m.norm();
        if shifted_m > STANDING_M {
            let left = (before.left? + now.left?) * 0.5;
            residual += left.dot(&self.shifted_m);
            variance += SAME_RAD * SAME_RAD * shifted_m * shifted_m;
        }
        let mut row = Row::new(residual, variance);
        row.push_vector(VELOCITY, &(towards * -self.dt_s));
        row.push_vector(ATTITUDE, &self.moved_m.cross(&towards));
        row.push(CLOCK_DRIFT, self.dt_s);
        Some(row)
    }
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Keeps the paths of a sweep; gives those of the last one, and by what the UAV has moved since, m.
    pub(super) fn lengths(
        &mut self,
        gmt: &Transmitter,
        sweep: &SweepMeasurement<'_>,
    ) -> (Lengths, Vector3<f64>) {
        let mut now = Lengths {
            time_ns: sweep.time_ns,
            gmt_m: gmt.position_m,
            paths: Vec::new(),
        };
        for path in sweep.paths {
            // Paths come strongest first; a weaker one that finds no room is not compared.
            let _full = now.paths.push(self.length(gmt, path));
        }
        let before = core::mem::replace(&mut self.lengths, now);
        (before, core::mem::take(&mut self.moved_m))
    }

    fn length(&self, gmt: &Transmitter, path: &PathMeasurement) -> Length {
        let noise = self.config.radio.delay_m;
        let known = |sigma: &f64| *sigma < SAME_RAD;
        let departure = path.departure.filter(|left| left.sigma.iter().all(known));
        Length {
            c_tau_m: path.c_tau_m,
            variance_m2: path.c_tau_sigma_m * path.c_tau_sigma_m + noise * noise,
            towards: self.nominal.attitude * self.model.corrected(&path.aoa, &self.nominal),
            left: departure.and_then(|left| self.model.departed(&left, gmt, &self.nominal)),
        }
    }

    /// A row with the probability that both lengths are of one path; `None` when there is next to none.
    fn of_partner(&self, row: Row<T>) -> Option<Row<T>> {
        let of_state = row.dot(&self.covariance.product(&row)).to_f64();
        let spread = of_state + row.variance.to_f64();
        let residual = row.residual.to_f64();
        let of_same =
            libm::exp(-0.5 * residual * residual / spread) / libm::sqrt(core::f64::consts::TAU * spread);
        let of_others = EXCHANGED / (2.0 * SAME_M);
        let same = (1.0 - EXCHANGED) * of_same;
        let probability = same / (same + of_others);
        let alone = [residual, residual * residual];
        (probability > LEAST_SAME).then(|| row.of_origins(probability, alone, of_state))
    }

    /// Takes in how much the paths have grown since `before`, in which the UAV went by `moved_m`.
    pub(super) fn delta_ranges(&mut self, before: &Lengths, moved_m: Vector3<f64>) {
        let now = self.lengths.clone();
        let dt_s = now.time_ns.saturating_sub(before.time_ns) as f64 * 1e-9;
        if !(APART_S.0..APART_S.1).contains(&dt_s) {
            return;
        }
        let between = Between {
            dt_s,
            moved_m,
            shifted_m: now.gmt_m - before.gmt_m,
            drift_m: self.nominal.clock_drift_m_per_s * dt_s,
            delay_period: self.nominal.delay_period,
        };
        let mut rows = Vec::<Row<T>, MOST_PATHS>::new();
        for path in &now.paths {
            let partner = between.partner(path, &before.paths, &now.paths);
            let Some(row) = partner.and_then(|partner| between.row(partner, path)) else {
                continue;
            };
            // There is room for a row of every path.
            if self.of_partner(row).is_some_and(|row| rows.push(row).is_ok()) {
                self.counters.delta_ranges = self.counters.delta_ranges.saturating_add(1);
            } else {
                self.counters.delta_ranges_rejected = self.counters.delta_ranges_rejected.saturating_add(1);
            }
        }
        self.take_rows(&rows);
    }
}

#[cfg(test)]
mod tests;
