//! Poses: where the receiver believed to be, and where it was.

use serde::{Deserialize, Serialize};

/// State of the UAV as the receiver estimated it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseEstimate {
    /// Position of the array centre, world frame, m.
    pub position_m: [f64; 3],
    /// Attitude [w, x, y, z], body to world.
    pub quaternion_wb: [f64; 4],
    /// Velocity, world frame, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Covariance of the position, m^2.
    pub position_covariance_m2: [[f64; 3]; 3],
    /// Covariance of the attitude as a small rotation vector in world axes, rad^2.
    pub attitude_covariance_rad2: [[f64; 3]; 3],
    /// Covariance of the velocity, (m/s)^2.
    pub velocity_covariance_m2_per_s2: [[f64; 3]; 3],
    /// UAV clock less GMT clock, s; `None` when the receiver does not estimate it.
    pub clock_offset_s: Option<f64>,
    /// Standard deviation of the clock offset, s.
    pub clock_sigma_s: Option<f64>,
}

/// State of the UAV as it was.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseTruth {
    /// Position of the array centre, world frame, m.
    pub position_m: [f64; 3],
    /// Attitude [w, x, y, z], body to world.
    pub quaternion_wb: [f64; 4],
    /// Velocity, world frame, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// UAV clock less GMT clock, s.
    pub clock_offset_s: f64,
}

/// Estimate and truth at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseRecord {
    /// Time by the UAV's clock, s.
    pub time_s: f64,
    /// What the receiver said; `None` before its first pose.
    pub estimate: Option<PoseEstimate>,
    /// What was so; `None` when nobody knows.
    pub truth: Option<PoseTruth>,
}
