//! How fast paths grow: velocity at the instant of a sweep, whatever the paths met.
//!
//! A path of any number of reflections grows by `-u.v`: the UAV's velocity against its direction of arrival. The walls between do not matter,
//! nor does the GMT, which stands while it sends. Where [delta ranges](super::delta_range) compare the lengths of two sweeps, and may take a path for its
//! neighbour, this is told by the phase of one path's carrier over a few milliseconds.
//!
//! The offset of the two carriers is in every rate, the same in all, and nobody knows it: of `n` rates `n - 1` numbers are left. They are taken
//! as recursive residuals, each rate against the weighted mean of those before it, whose errors are independent:
//!
//! ```text
//! r_k - m_k,  variance R_k + 1 / W_k,   m, W: mean and weight of the rates before
//! ```
//! A path that moves by itself, or is two, has a rate of its own. So the rates that most others agree with are taken, and the others are not; errors of those that
//! are taken have tails all the same.

use heapless::Vec;
use nalgebra::Vector3;

use super::Filter;
use super::delta_range::ARRIVAL_RAD;
use super::layout::{ATTITUDE, VELOCITY};
use super::measurement::PathMeasurement;
use super::row::Row;
use super::sweep_measurement::SweepMeasurement;
use crate::geometry::Real;
use crate::numeric::gather;

/// Paths of a sweep whose rates are compared.
/// Capacity: as many as path estimation finds.
const MOST_PATHS: usize = 9;
/// Standard deviations between two rates beyond which they do not agree.
/// Derived: three; one in 370 honest pairs is beyond.
const APART: f64 = 3.0;
/// Standard deviations that half a period must have, or nobody knows how many periods there are: a rate that is taken for that of the next period
/// leads the velocity off for good.
/// Derived: an error with the tails of a Student distribution of three degrees of freedom is beyond in one of 500.
const OF_PERIOD: f64 = 10.0;
/// Degrees of freedom of errors with the tails of a Student distribution: a path may be two.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const FREEDOM: f64 = 3.0;

/// Derivatives of a rate with respect to velocity and to attitude.
#[derive(Clone, Copy, Debug)]
struct Slopes {
    velocity: Vector3<f64>,
    attitude: Vector3<f64>,
}

impl Slopes {
    const NONE: Self = Self {
        velocity: Vector3::new(0.0, 0.0, 0.0),
        attitude: Vector3::new(0.0, 0.0, 0.0),
    };

    fn less(&self, other: &Self) -> Self {
        Self {
            velocity: self.velocity - other.velocity,
            attitude: self.attitude - other.attitude,
        }
    }

    fn row<T: Real>(&self, residual: f64, variance: f64) -> Row<T> {
        let mut row = Row::new(residual, variance);
        row.push_vector(VELOCITY, &self.velocity);
        row.push_vector(ATTITUDE, &self.attitude);
        row
    }
}

/// A rate against what the state expects of it.
#[derive(Clone, Copy, Debug)]
struct Rate {
    slopes: Slopes,
    residual: f64,
    variance: f64,
    period: f64,
}

impl Rate {
    /// Residual less another's, within half a period of nothing.
    fn beyond(&self, other: f64) -> f64 {
        let apart = self.residual - other;
        apart - self.period * libm::round(apart / self.period)
    }
}

/// Weighted mean of rates.
struct Mean {
    slopes: Slopes,
    residual: f64,
    weight: f64,
}

impl Mean {
    /// Takes another rate in; gives it against the mean before, unless it was the first.
    fn take<T: Real>(&mut self, rate: &Rate) -> Option<Row<T>> {
        let beyond = rate.beyond(self.residual);
        let slopes = rate.slopes.less(&self.slopes);
        let row = (self.weight > 0.0).then(|| slopes.row(beyond, rate.variance + 1.0 / self.weight));
        let own = 1.0 / rate.variance;
        self.weight += own;
        let share = own / self.weight;
        self.residual += share * beyond;
        self.slopes.velocity += slopes.velocity * share;
        self.slopes.attitude += slopes.attitude * share;
        row
    }
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes in how fast the paths of a sweep grow.
    pub(super) fn range_rates(&mut self, sweep: &SweepMeasurement<'_>) {
        let rates: Vec<Rate, MOST_PATHS> = gather(sweep.paths.iter().filter_map(|path| self.rate(path)));
        let agreeing = |a: &Rate| rates.iter().filter(|b| self.agree(a, b)).count();
        // Of equal ones the strongest path's.
        let most = rates.iter().rev().max_by_key(|a| agreeing(a));
        let mut mean = Mean {
            slopes: Slopes::NONE,
            residual: 0.0,
            weight: 0.0,
        };
        let of_most = |rate: &&Rate| most.is_some_and(|most| self.agree(most, rate));
        let mut rows: Vec<Row<T>, MOST_PATHS> =
            gather(rates.iter().filter(of_most).filter_map(|rate| mean.take(rate)));
        for row in &mut rows {
            self.spread_tails(row);
        }
        // One rate tells the offset alone.
        let unused = rates.len().saturating_sub(rows.len() + 1);
        let [taken, unused] = [rows.len(), unused].map(|count| count as u32);
        let counters = &mut self.counters;
        counters.range_rates = counters.range_rates.saturating_add(taken);
        counters.range_rates_rejected = counters.range_rates_rejected.saturating_add(unused);
        self.take_rows(&rows);
    }

    fn rate(&self, path: &PathMeasurement) -> Option<Rate> {
        let told = path.range_rate?;
        let v = self.nominal.velocity_m_per_s;
        let u = self.nominal.attitude * self.model.corrected(&path.aoa, &self.nominal);
        let along = u.dot(&v);
        // An arrival that is off takes velocity across for velocity along.
        let across = (v - u * along).norm();
        let off = across * libm::hypot(path.aoa_sigma_rad, ARRIVAL_RAD);
        // Turned by the error of the attitude, that of the velocity is another one: two axes across, each with the third of both variances.
        let turned = libm::sqrt(2.0) / 3.0 * self.sigma(VELOCITY) * self.sigma(ATTITUDE);
        let sigma = libm::hypot(libm::hypot(f64::from(told.sigma_m_per_s), off), turned);
        let rate = Rate {
            slopes: Slopes {
                velocity: -u,
                attitude: v.cross(&u),
            },
            residual: f64::from(told.m_per_s) + along,
            variance: sigma * sigma,
            period: f64::from(told.period_m_per_s),
        };
        (rate.residual.is_finite() && rate.variance > 0.0 && rate.period > 0.0).then_some(rate)
    }

    /// Widens the variance of a row whose errors have tails by how far it is off.
    fn spread_tails(&self, row: &mut Row<T>) {
        let spread = row.dot(&self.covariance.product(row)) + row.variance;
        let chi2 = (row.residual * row.residual / spread).to_f64();
        row.variance *= T::of(((FREEDOM + chi2) / (FREEDOM + 1.0)).max(1.0));
    }

    /// Whether two rates differ by nothing but their errors and those of the state.
    #[inline(never)]
    fn agree(&self, a: &Rate, b: &Rate) -> bool {
        let row = a.slopes.less(&b.slopes).row::<T>(0.0, 0.0);
        let of_state = row.dot(&self.covariance.product(&row)).to_f64();
        let sigma = libm::sqrt(a.variance + b.variance + of_state);
        a.beyond(b.residual).abs() < APART * sigma && OF_PERIOD * sigma < 0.5 * a.period
    }
}

#[cfg(test)]
mod tests;
