//! Scalar measurements: two-way timing, magnetic heading. They wait until the horizon passes their time stamps.

use super::layout::{ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, TWO_WAY_BIAS};
use super::nominal::wrap_delay_m;
use super::row::Row;
use super::{Filter, Gates};
use crate::geometry::Real;

/// Two exchanges that agree on a new offset within this set the clock anew, m (besides what its drift explains).
const STEP_AGREEMENT_M: f64 = 1.0;
/// Measurements closer in time than this tell no rate, s.
const SHORTEST_STEP_S: f64 = 0.1;
/// Without line of sight for this long, the magnetic heading is better than none, ns (localization.md section 3).
const HEADING_AFTER_NS: u64 = 10_000_000_000;

/// A scalar measurement that waits.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pending {
    /// Two-way timing.
    TwoWay {
        /// UAV clock, ns.
        time_ns: u64,
        /// Clock offset, m.
        offset_m: f64,
    },
    /// Magnetic heading.
    Heading {
        /// UAV clock, ns.
        time_ns: u64,
        /// Yaw, rad.
        yaw_rad: f64,
        /// Its standard deviation, rad.
        sigma_rad: f64,
    },
}

impl Pending {
    /// Time stamp, ns.
    pub(super) fn time_ns(&self) -> u64 {
        match self {
            Self::TwoWay { time_ns, .. } | Self::Heading { time_ns, .. } => *time_ns,
        }
    }
}

/// What became of a two-way exchange when it was handed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimingVerdict {
    /// Waits until the horizon reaches it.
    Queued,
    /// Its time stamp lies before the horizon, or the queue is full.
    TooLate,
    /// Not a number.
    NotFinite,
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes in a two-way timing exchange: UAV clock less GMT clock as a length, at `time_ns` of the UAV clock. A whole
    /// number of delay periods does not matter.
    pub fn two_way(&mut self, time_ns: u64, offset_m: f64) -> TimingVerdict {
        self.queue(offset_m, Pending::TwoWay { time_ns, offset_m })
    }

    /// Takes in a magnetic heading (yaw of the body against east, rad). It is used only after ten seconds without line of
    /// sight: before, its slow error does harm.
    pub fn heading(&mut self, time_ns: u64, yaw_rad: f64, sigma_rad: f64) -> TimingVerdict {
        let heading = Pending::Heading {
            time_ns,
            yaw_rad,
            sigma_rad,
        };
        self.queue(yaw_rad + sigma_rad, heading)
    }

    fn queue(&mut self, value: f64, pending: Pending) -> TimingVerdict {
        if !value.is_finite() {
            return TimingVerdict::NotFinite;
        }
        let latest = self.pending.back().map_or(0, Pending::time_ns);
        let time_ns = pending.time_ns();
        if self.pending.is_full()
            && let Some(oldest) = self.pending.front().map(Pending::time_ns)
        {
            self.advance_to(oldest);
        }
        if time_ns < self.nominal.time_ns || time_ns < latest || self.pending.push_back(pending).is_err() {
            self.counters.too_late = self.counters.too_late.saturating_add(1);
            return TimingVerdict::TooLate;
        }
        TimingVerdict::Queued
    }

    /// Takes in a measurement at the horizon.
    pub(super) fn take(&mut self, pending: Pending) {
        match pending {
            Pending::TwoWay { time_ns, offset_m } => self.take_two_way(time_ns, offset_m),
            Pending::Heading {
                yaw_rad, sigma_rad, ..
            } => self.take_heading(yaw_rad, sigma_rad),
        }
    }

    fn take_two_way(&mut self, time_ns: u64, offset_m: f64) {
        let variance = self.config.radio.two_way_m * self.config.radio.two_way_m;
        if !self.clock_known {
            self.clock_known = true;
            self.set_clock(offset_m, variance);
            return;
        }
        let expected = self.nominal.clock_offset_m + self.nominal.two_way_bias_m;
        let mut row = Row::new(wrap_delay_m(offset_m - expected), variance);
        row.push(CLOCK_OFFSET, 1.0);
        row.push(TWO_WAY_BIAS, 1.0);
        let gate = self.config.gates.one;
        let ratio = self.scalar_ratio(&row, gate);
        self.ratios.two_way = ratio as f32;
        if ratio <= 1.0 {
            self.suspect_clock = None;
            self.health.clock_contested = false;
            self.apply(&row);
            return;
        }
        self.health.clock_contested = true;
        self.counters.timing_rejected = self.counters.timing_rejected.saturating_add(1);
        let apart = self.suspect_clock.and_then(|(since, before)| {
            let dt = time_ns.saturating_sub(since) as f64 * 1e-9;
            let drift = self.nominal.clock_drift_m_per_s;
            let apart_m = wrap_delay_m(offset_m - before - drift * dt);
            (dt < 3.0 && apart_m.abs() < STEP_AGREEMENT_M).then_some((apart_m, dt))
        });
        match apart {
            Some(apart) => self.clock_step(offset_m, variance, apart),
            None => self.suspect_clock = Some((time_ns, offset_m)),
        }
    }

    /// The clock has jumped, or runs at another rate than was believed: two independent measurements say so, `apart` (m) of
    /// each other after what the drift explains, in a time (s). What they are apart by is all that is known of a change of rate.
    /// With a wrong rate and no doubt of it, the clock would run off again and again.
    fn clock_step(&mut self, offset_m: f64, variance: f64, (apart_m, dt_s): (f64, f64)) {
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

    /// When a rejected exchange and the delay of a sweep differ from the clock by the same amount, the clock is wrong and
    /// both are right. True when it was set.
    pub(super) fn clock_step_by_delay(&mut self, delay_residual_m: f64) -> bool {
        let Some((since, offset_m)) = self.suspect_clock else {
            return false;
        };
        let dt = self.nominal.time_ns.saturating_sub(since) as f64 * 1e-9;
        let stepped = offset_m + self.nominal.clock_drift_m_per_s * dt;
        let jump = wrap_delay_m(stepped - self.nominal.clock_offset_m);
        if dt > 1.0 || jump.abs() < STEP_AGREEMENT_M || (jump - delay_residual_m).abs() > STEP_AGREEMENT_M {
            return false;
        }
        let variance = self.config.radio.two_way_m * self.config.radio.two_way_m;
        self.clock_step(stepped, variance, (jump - delay_residual_m, dt));
        true
    }

    pub(super) fn set_clock(&mut self, offset_m: f64, variance: f64) {
        self.nominal.clock_offset_m = wrap_delay_m(offset_m - self.nominal.two_way_bias_m);
        self.covariance
            .reset_to_sum(CLOCK_OFFSET, TWO_WAY_BIAS, T::of(variance));
        // A step of the offset says nothing about the rate; what ties the rate to other states goes with the offset.
        let drift = self.variance(CLOCK_DRIFT);
        self.covariance.reset(CLOCK_DRIFT, T::of(drift));
    }

    fn take_heading(&mut self, yaw_rad: f64, sigma_rad: f64) {
        let blind = self.nominal.time_ns.saturating_sub(self.last_sight_ns) > HEADING_AFTER_NS;
        if !self.running || !blind {
            return;
        }
        let r = &self.nominal.attitude;
        let (c, s) = (r.m11, r.m21);
        let square = c * c + s * s;
        if square < 0.1 {
            return;
        }
        let floor = self.config.radio.heading_rad;
        let turn = yaw_rad - libm::atan2(s, c);
        // To (-pi, pi].
        let residual = libm::atan2(libm::sin(turn), libm::cos(turn));
        let mut row = Row::new(residual, sigma_rad * sigma_rad + floor * floor);
        row.push(ATTITUDE, -r.m31 * c / square);
        row.push(ATTITUDE + 1, -r.m31 * s / square);
        row.push(ATTITUDE + 2, 1.0);
        let gate = self.config.gates.one;
        let ratio = self.scalar_ratio(&row, gate);
        self.ratios.heading = ratio as f32;
        if ratio <= 1.0 {
            self.apply(&row);
        }
    }

    /// Chi-square of one row over its gate.
    fn scalar_ratio(&self, row: &Row<T>, gate: f64) -> f64 {
        let innovation = row.dot(&self.covariance.product(row)) + row.variance;
        let residual = row.residual.to_f64();
        residual * residual / innovation.to_f64() / gate
    }

    /// Takes in one row.
    fn apply(&mut self, row: &Row<T>) {
        if let Some(gain) = self.covariance.update(row) {
            let dx = gain.map(|k| k * row.residual);
            self.correct(&dx);
        }
    }

    /// The gates.
    pub(super) fn gates(&self) -> Gates {
        self.config.gates
    }
}
