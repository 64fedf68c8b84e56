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
//!
//! A phase tells a rate but for whole periods, and one that agrees may still be of another path. Neither is decided: a rate is taken as its mean over
//! the periods that it may be of and the chance that it says nothing, and what it leaves in doubt stays in the covariance ([`Row::of_origins`]).
//! One rate after the other, so that the first ones tell the periods of those after them.

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
/// Standard deviations that half a period must have.
/// Derived: two rates that have nothing to do with each other agree within [`APART`] of them in three cases of five.
const OF_PERIOD: f64 = 5.0;
/// Share of the rates that agree and are anything within their period.
/// Measured: of 13 700 in 12 flights of `real` (tuning seeds) 3.7 % are off by 0.4 to 0.8 m/s and 3.1 % by more: one in ten over the period.
const OF_ANOTHER: f64 = 0.1;
/// Degrees of freedom of errors with the tails of a Student distribution: a path may be two.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const FREEDOM: f64 = 3.0;
/// Density of that distribution in its middle, in units of its scale.
/// Given: of three degrees of freedom, 2 / (pi sqrt 3).
const STUDENT_PEAK: f64 = 0.367_552_596_947_861_4;

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
    /// Of no rates.
    const NONE: Self = Self {
        slopes: Slopes::NONE,
        residual: 0.0,
        weight: 0.0,
    };

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
        let rate = |path| Some((path, self.rate(path)?));
        let rates: Vec<(&PathMeasurement, Rate), MOST_PATHS> = gather(sweep.paths.iter().filter_map(rate));
        let agreeing = |a: &Rate| rates.iter().filter(|(_, b)| self.agree(a, b)).count();
        // Of equal ones the strongest path's.
        let most = rates.iter().rev().max_by_key(|(_, a)| agreeing(a));
        let of_most = |rate: &Rate| most.is_some_and(|(_, most)| self.agree(most, rate));
        let paths = rates.iter().filter(|(_, rate)| of_most(rate));
        let paths: Vec<&PathMeasurement, MOST_PATHS> = gather(paths.map(|(path, _)| *path));
        let mut taken = 0;
        for last in 1..=paths.len() {
            // What the rates before have told is in all of them.
            let (mut mean, mut row) = (Mean::NONE, None);
            for rate in paths.iter().take(last).filter_map(|path| self.rate(path)) {
                row = mean.take(&rate).map(|row| (row, rate.period));
            }
            if let Some((row, period)) = row {
                self.take_rows(&[self.in_doubt(row, period)]);
                taken += 1;
            }
        }
        // One rate tells the offset alone.
        let unused = rates.len().saturating_sub(taken + 1);
        let [taken, unused] = [taken, unused].map(|count| count as u32);
        let counters = &mut self.counters;
        counters.range_rates = counters.range_rates.saturating_add(taken);
        counters.range_rates_rejected = counters.range_rates_rejected.saturating_add(unused);
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

    /// A row over the periods that it may be of, its own and the next ones, and the chance that it is of another path; its variance is widened by
    /// how far it is off.
    fn in_doubt(&self, mut row: Row<T>, period: f64) -> Row<T> {
        let of_state = row.dot(&self.covariance.product(&row)).to_f64();
        let spread = of_state + row.variance.to_f64();
        let (mut sum, mut mean, mut mean_square) = (0.0, 0.0, 0.0);
        for periods in [-1.0, 0.0, 1.0] {
            let residual = row.residual.to_f64() + periods * period;
            let square = residual * residual;
            // Density of three degrees of freedom.
            let tail = 1.0 + square / (FREEDOM * spread);
            let weight = 1.0 / (tail * tail);
            sum += weight;
            mean += weight * residual;
            mean_square += weight * square;
        }
        let (mean, mean_square) = (mean / sum, mean_square / sum);
        let of_path = (1.0 - OF_ANOTHER) * STUDENT_PEAK / libm::sqrt(spread) * sum;
        let probability = of_path / (of_path + OF_ANOTHER / period);
        let tails = (FREEDOM + mean * mean / spread) / (FREEDOM + 1.0);
        row.variance *= T::of(tails.max(1.0));
        row.of_origins(probability, [mean, mean_square], of_state)
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
