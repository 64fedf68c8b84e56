//! Scalar measurements: two-way timing, which waits until the horizon passes its time stamps.

use super::row::Row;
use super::{Filter, Gates};
use crate::geometry::Real;

/// An exchange that waits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exchange {
    /// UAV clock, ns.
    pub(super) time_ns: u64,
    /// Clock offset, m.
    pub(super) offset_m: f64,
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
        if !offset_m.is_finite() {
            return TimingVerdict::NotFinite;
        }
        let exchange = Exchange { time_ns, offset_m };
        let latest = self.pending.back().map_or(0, |latest| latest.time_ns);
        if self.pending.is_full()
            && let Some(oldest) = self.pending.front().map(|oldest| oldest.time_ns)
        {
            self.advance_to(oldest);
        }
        if time_ns < self.nominal.time_ns || time_ns < latest || self.pending.push_back(exchange).is_err() {
            self.counters.too_late = self.counters.too_late.saturating_add(1);
            return TimingVerdict::TooLate;
        }
        TimingVerdict::Queued
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
