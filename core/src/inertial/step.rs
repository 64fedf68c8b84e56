//! A step of the inertial unit: the motion over it, and how far that can be trusted.

use super::ImuIncrement;

/// Where an increment comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Motion {
    /// From samples.
    Measured,
    /// From nothing: the increment is zero, and stands for constant velocity and attitude. Gravity must not be added.
    Coasting,
}

/// An increment and how far it can be trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuStep {
    /// The motion.
    pub increment: ImuIncrement,
    /// Measured, or a guess.
    pub motion: Motion,
    /// Variance of the rotation beyond the sensor's noise, rad^2 per axis; 0 in sound operation.
    pub angle_variance_rad2: f32,
    /// Variance of the velocity beyond the sensor's noise, (m/s)^2 per axis; 0 in sound operation.
    pub velocity_variance_m2_per_s2: f32,
}
