//! Clock error, and whether the receiver's covariances tell the truth about its errors.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::figures::Spread;
use super::trajectory::PoseError;
use crate::flight_log::FlightLog;
use crate::statistics::{mean, rms};

/// Figures of the estimated clock offset. Absent when it is not estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ClockFigures {
    /// Rms error of the offset, ns.
    pub rmse_ns: Option<f64>,
    /// Median of its magnitude, ns.
    pub median_ns: Option<f64>,
    /// 95 % quantile of its magnitude, ns.
    pub p95_ns: Option<f64>,
}

/// Mean normalised estimation error squared over degrees of freedom: 1 when covariances are honest, above when they are
/// too small. Absent where no covariance was positive definite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Consistency {
    /// Of the position.
    pub position_nees: Option<f64>,
    /// Of the attitude.
    pub attitude_nees: Option<f64>,
    /// Of the velocity.
    pub velocity_nees: Option<f64>,
    /// Of the clock offset.
    pub clock_nees: Option<f64>,
}

/// Judges the clock.
pub(super) fn clock(errors: &[PoseError]) -> ClockFigures {
    let errors_ns: Vec<f64> = errors
        .iter()
        .filter_map(|e| e.clock_s)
        .map(|s| (s * 1e9).abs())
        .collect();
    let spread = Spread::of(&errors_ns);
    ClockFigures {
        rmse_ns: rms(&errors_ns),
        median_ns: spread.median,
        p95_ns: spread.p95,
    }
}

/// Judges the covariances.
pub(super) fn consistency(log: &FlightLog, errors: &[PoseError]) -> Consistency {
    let estimates: Vec<_> = log
        .trajectory()
        .iter()
        .filter_map(|record| record.truth.and(record.estimate))
        .collect();
    let both = || estimates.iter().zip(errors);
    let clock = both().filter_map(|(e, error)| {
        let sigma_s = e.clock_sigma_s.filter(|s| *s > 0.0)?;
        Some((error.clock_s? / sigma_s).powi(2))
    });
    Consistency {
        position_nees: mean(
            both().filter_map(|(e, error)| nees(&error.position_m, &e.position_covariance_m2)),
        ),
        attitude_nees: mean(
            both().filter_map(|(e, error)| nees(&error.attitude_rad, &e.attitude_covariance_rad2)),
        ),
        velocity_nees: mean(
            both().filter_map(|(e, error)| nees(&error.velocity_m_per_s, &e.velocity_covariance_m2_per_s2)),
        ),
        clock_nees: mean(clock),
    }
}

/// Normalised estimation error squared, e^T P^-1 e: chi-square of three where P is honest. `None` unless P is positive definite.
pub fn normalised_squared(error: &Vector3<f64>, covariance: &Matrix3<f64>) -> Option<f64> {
    let whitened = covariance.cholesky()?.solve(error);
    Some(error.dot(&whitened)).filter(|value| value.is_finite())
}

/// The same over its dimension.
fn nees(error: &Vector3<f64>, covariance: &[[f64; 3]; 3]) -> Option<f64> {
    let covariance = Matrix3::from_fn(|i, j| covariance[i][j]);
    Some(normalised_squared(error, &covariance)? / 3.0)
}
