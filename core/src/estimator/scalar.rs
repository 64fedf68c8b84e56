//! Scalar measurements: two-way timing, magnetic heading. They wait until the horizon passes their time stamps.

use super::layout::ATTITUDE;
use super::row::Row;
use super::tilt::CARRIED_NS;
use super::{Filter, Gates};
use crate::geometry::Real;

/// Square of the level part of the nose's direction under which there is no heading.
/// Numerical: a guard of a division.
const LEAST_LEVEL_SQUARE: f64 = 0.1;

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

    #[inline(never)]
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

    fn take_heading(&mut self, yaw_rad: f64, sigma_rad: f64) {
        let blind = self.nominal.time_ns.saturating_sub(self.last_sight_ns) > CARRIED_NS;
        if !self.running || !blind {
            return;
        }
        let r = &self.nominal.attitude;
        let (c, s) = (r.m11, r.m21);
        let square = c * c + s * s;
        if square < LEAST_LEVEL_SQUARE {
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
    #[inline(never)]
    pub(super) fn scalar_ratio(&self, row: &Row<T>, gate: f64) -> f64 {
        let innovation = row.dot(&self.covariance.product(row)) + row.variance;
        let residual = row.residual.to_f64();
        residual * residual / innovation.to_f64() / gate
    }

    /// Takes in one row.
    pub(super) fn apply(&mut self, row: &Row<T>) {
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
