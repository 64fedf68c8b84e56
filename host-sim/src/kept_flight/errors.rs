//! How far a pose is from the truth.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::estimator::Pose;
use cslam_core::signal::Waveform;
use nalgebra::Rotation3;

use crate::sensors::Truth;

/// Errors of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseErrors {
    /// Position, 3-D, m.
    pub position_m: f64,
    /// The same in standard deviations: over the root of the covariance's trace.
    pub position_sigmas: f64,
    /// Attitude, deg.
    pub attitude_deg: f64,
    /// Clock but for whole delay periods, ns.
    pub clock_ns: f64,
}

/// Compares a pose with the truth at its time.
#[must_use]
pub fn pose_errors(pose: &Pose, truth: &Truth) -> PoseErrors {
    let position_m = (pose.position.vector().map(f64::from) - truth.uav.position_m).norm();
    let sigma_m = f64::from(pose.position_covariance_m2.trace()).sqrt();
    let attitude = Rotation3::from_matrix_unchecked(pose.attitude.matrix().map(f64::from));
    let off_m = pose.clock.offset_m - truth.clock_offset_s * SPEED_OF_LIGHT_M_PER_S;
    let clock_m = Waveform::default().delay_period().wrap_m(off_m);
    PoseErrors {
        position_m,
        position_sigmas: position_m / sigma_m,
        attitude_deg: attitude.angle_to(&truth.uav.attitude).to_degrees(),
        clock_ns: clock_m.abs() / SPEED_OF_LIGHT_M_PER_S * 1e9,
    }
}
