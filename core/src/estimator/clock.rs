//! The clock of the filter: set for the first time, settled, stepped.

use super::Filter;
use super::layout::{CLOCK_DRIFT, CLOCK_OFFSET, CLOCK_RAMP, TWO_WAY_BIAS};
use crate::geometry::Real;

/// Exchanges in agreement that a start stands on.
/// Derived: two tell offset and rate, the third that they are right.
const ACQUIRED: u32 = 3;
/// Standard deviation of a clock that a start may stand on, in those of an exchange.
/// Derived: that of the last of [`ACQUIRED`] exchanges is 0.9, and as much again is what their rate is off by at the next sweep.
const SETTLED: f64 = 2.0;
/// Measurements closer in time than this tell no rate, s.
/// Numerical: a guard of a division.
pub(super) const SHORTEST_STEP_S: f64 = 0.1;

impl<T: Real, const N: usize> Filter<T, N> {
    /// Sets the clock as if no exchange had been before.
    pub(super) fn acquire(&mut self, offset_m: f64, variance: f64) {
        let priors = self.config.priors;
        self.clock_known = true;
        self.acquired = 1;
        self.set_clock(offset_m, variance);
        (self.nominal.clock_drift_m_per_s, self.nominal.clock_ramp_m_per_s2) = (0.0, 0.0);
        for (state, sigma) in [
            (CLOCK_DRIFT, priors.clock_drift_m_per_s),
            (CLOCK_RAMP, priors.clock_ramp_m_per_s2),
        ] {
            self.covariance.reset(state, T::of(sigma * sigma));
        }
        self.window.clear();
    }

    /// Whether enough exchanges agree for a start to stand on them, and the clock is as sure as these make it: its error becomes one of the
    /// place.
    pub(super) fn has_clock(&self) -> bool {
        let limit_m = SETTLED * self.config.radio.two_way_m;
        self.acquired >= ACQUIRED && self.variance(CLOCK_OFFSET) < limit_m * limit_m
    }

    /// The clock has jumped, or runs at another rate than was believed: independent measurements say so, `apart` (m) of each other after what
    /// the drift explains, in a time (s). What they are apart by is all that is known of a change of rate.
    /// With a wrong rate and no doubt of it, the clock would run off again and again.
    pub(super) fn clock_step(&mut self, offset_m: f64, variance: f64, (apart_m, dt_s): (f64, f64)) {
        self.set_clock(offset_m, variance);
        let dt_s = dt_s.max(SHORTEST_STEP_S);
        let rate_variance = (apart_m * apart_m + 2.0 * variance) / (dt_s * dt_s);
        self.covariance.add(CLOCK_DRIFT, T::of(rate_variance));
        self.suspect_clock = None;
        self.health.clock_contested = false;
        self.counters.clock_steps = self.counters.clock_steps.saturating_add(1);
        // Earlier fixes of the window were made with the old clock.
        self.window.clear();
    }

    /// Sets the offset, with the variance of what told it, m^2.
    pub(super) fn set_clock(&mut self, offset_m: f64, variance: f64) {
        self.nominal.clock_offset_m = self
            .nominal
            .delay_period
            .wrap_m(offset_m - self.nominal.two_way_bias_m);
        self.covariance
            .reset_to_sum(CLOCK_OFFSET, TWO_WAY_BIAS, T::of(variance));
        // A step of the offset says nothing about the rate; what ties the rate to other states goes with the offset.
        let drift = self.variance(CLOCK_DRIFT);
        self.covariance.reset(CLOCK_DRIFT, T::of(drift));
    }
}
