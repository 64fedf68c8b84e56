//! A path of a sweep as it leaves path estimation: what was measured, and what the estimator and the network say of it.

use crate::geometry::{Body, Direction, Matrix3, World};
use crate::link_state::Probabilities;
use crate::path::Departure;
use crate::paths::EstimatedPath;
use crate::signal::DelayPeriod;

/// A path of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceivedPath {
    /// Speed of light times delay with the clock's offset in it, m; a whole number of delay periods does not matter.
    pub c_tau_m: f64,
    /// Angle of arrival, without the arrays' estimated calibration errors.
    pub arrival: Direction<Body>,
    /// Angle of departure in world axes, when it was measured. Its standard deviation is the estimator's own.
    pub departure: Option<Departure>,
    /// The estimator's covariance of (delay, angle along e1, angle along e2), the tangents of the arrival in body axes: noise alone.
    pub covariance: Matrix3<f32>,
    /// Power, dB of any reference that the paths of a sweep share.
    pub power_db: f32,
    /// What the network says of it; `None` when nothing was said.
    pub probabilities: Option<Probabilities>,
}

impl ReceivedPath {
    /// Of an estimated path whose departure is in world axes, as the mast stands. `corrected`: its arrival without the arrays' estimated errors.
    #[must_use]
    pub fn of(
        estimated: &EstimatedPath<World>,
        corrected: Direction<Body>,
        probabilities: Option<Probabilities>,
    ) -> Self {
        Self {
            c_tau_m: f64::from(estimated.path.c_tau_m),
            arrival: corrected,
            departure: estimated.path.aod,
            covariance: estimated.path.covariance,
            power_db: 10.0 * libm::log10f(estimated.energy.max(f32::MIN_POSITIVE)),
            probabilities,
        }
    }

    /// Difference of two delays, m.
    pub(super) fn apart_m(&self, other: &Self, period: &DelayPeriod) -> f64 {
        period.wrap_m(self.c_tau_m - other.c_tau_m).abs()
    }
}
