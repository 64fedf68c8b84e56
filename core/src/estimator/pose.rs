//! The result of localization at one instant.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Body, Position, Rotation, World};

/// The UAV clock against the GMT's, as lengths (speed of light times time).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockEstimate {
    /// UAV clock less GMT clock, m, wrapped to the unambiguous range of the waveform (-312.5 to 312.5 m: delays are
    /// cyclic with 625 m). Subtract it from a measured `c tau` and wrap again.
    pub offset_m: f64,
    /// Standard deviation of the offset, m.
    pub offset_sigma_m: f32,
    /// Rate of the offset, m/s.
    pub drift_m_per_s: f32,
    /// Standard deviation of the rate, m/s.
    pub drift_sigma_m_per_s: f32,
}

/// Position, velocity, attitude and clock at one instant, each with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// UAV clock, ns.
    pub time_ns: u64,
    /// Body origin in the world frame, m.
    pub position: Position<World, f64>,
    /// Velocity in the world frame, m/s.
    pub velocity_m_per_s: Vector3<f32>,
    /// Attitude R_wb.
    pub attitude: Rotation<Body, World>,
    /// The UAV clock.
    pub clock: ClockEstimate,
    /// Covariance of the position, m^2.
    pub position_covariance_m2: Matrix3<f32>,
    /// Covariance of the velocity, m^2/s^2.
    pub velocity_covariance_m2_per_s2: Matrix3<f32>,
    /// Covariance of the attitude error as a small rotation vector in world axes, rad^2.
    pub attitude_covariance_rad2: Matrix3<f32>,
    /// Covariance of position (rows) with attitude error (columns), m rad.
    pub position_attitude_covariance_m_rad: Matrix3<f32>,
    /// Counts the jumps: raised by one whenever the pose was set anew instead of corrected. Two poses with different
    /// counts must not be differenced.
    pub resets: u32,
}

impl Pose {
    /// Standard deviation of the position as a 3-D norm, m.
    pub fn position_sigma_m(&self) -> f32 {
        libm::sqrtf(self.position_covariance_m2.trace().max(0.0))
    }

    /// Standard deviation of the attitude as a norm over three axes, rad.
    pub fn attitude_sigma_rad(&self) -> f32 {
        libm::sqrtf(self.attitude_covariance_rad2.trace().max(0.0))
    }
}
