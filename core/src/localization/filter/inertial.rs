//! The inertial unit's steps, with their doubts; and how far the horizon may go ahead of a sweep.

use super::Filter;
use super::layout::{ATTITUDE, VELOCITY};
use crate::geometry::Real;
use crate::localization::imu::{ImuStep, Motion};

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes in a step of the inertial unit. What was coasted stays a gap, which the horizon bridges; what was bridged or
    /// clipped within the step makes attitude and velocity as much less certain.
    pub fn inertial(&mut self, step: &ImuStep) {
        if step.motion == Motion::Coasting {
            return;
        }
        self.increment(&step.increment);
        if step.angle_variance_rad2 > 0.0 || step.velocity_variance_m2_per_s2 > 0.0 {
            // Added at the horizon, a little early.
            for axis in 0..3 {
                let (angle, velocity) = (step.angle_variance_rad2, step.velocity_variance_m2_per_s2);
                self.covariance.add(ATTITUDE + axis, T::of(f64::from(angle)));
                self.covariance.add(VELOCITY + axis, T::of(f64::from(velocity)));
            }
        }
    }

    /// Moves the horizon to `time_ns`, for a sweep that has that time stamp and is still being worked on: so that what is
    /// left to do when it is done are the updates. Nothing older can be taken in afterwards.
    pub fn advance(&mut self, time_ns: u64) {
        self.advance_to(time_ns);
    }
}
