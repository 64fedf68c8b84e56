//! How far a pose is from the truth.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::estimator::Pose;
use cslam_core::signal::Waveform;
use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::sensors::Truth;

/// Errors of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseErrors {
    /// Position, 3-D, m.
    pub position_m: f64,
    /// The same in standard deviations: over the root of the covariance's trace.
    pub position_sigmas: f64,
    /// Square root of e^T P^-1 e of the position's error e with its covariance P; infinite where the covariance has no inverse.
    pub position_mahalanobis: f64,
    /// Attitude, deg.
    pub attitude_deg: f64,
    /// Of the attitude as of the position.
    pub attitude_mahalanobis: f64,
    /// Clock but for whole delay periods, ns.
    pub clock_ns: f64,
}

/// Compares a pose with the truth at its time.
#[must_use]
pub fn pose_errors(pose: &Pose, truth: &Truth) -> PoseErrors {
    let off_m = pose.position.vector().map(f64::from) - truth.uav.position_m;
    let position_m = off_m.norm();
    let sigma_m = f64::from(pose.position_covariance_m2.trace()).sqrt();
    let attitude = Rotation3::from_matrix_unchecked(pose.attitude.matrix().map(f64::from));
    let turned = attitude * truth.uav.attitude.inverse();
    let late_m = pose.clock.offset_m - truth.clock_offset_s * SPEED_OF_LIGHT_M_PER_S;
    let clock_m = Waveform::default().delay_period().wrap_m(late_m);
    PoseErrors {
        position_m,
        position_sigmas: position_m / sigma_m,
        position_mahalanobis: mahalanobis(&off_m, &pose.position_covariance_m2),
        attitude_deg: attitude.angle_to(&truth.uav.attitude).to_degrees(),
        attitude_mahalanobis: mahalanobis(&turned.scaled_axis(), &pose.attitude_covariance_rad2),
        clock_ns: clock_m.abs() / SPEED_OF_LIGHT_M_PER_S * 1e9,
    }
}

/// Square root of e^T P^-1 e.
fn mahalanobis(error: &Vector3<f64>, covariance: &Matrix3<f32>) -> f64 {
    let inverse = covariance.map(f64::from).try_inverse();
    inverse.map_or(f64::INFINITY, |inverse| error.dot(&(inverse * error)).sqrt())
}
