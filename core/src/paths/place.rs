//! Where a path is, in the coordinates that fits move it in.

use nalgebra::Vector3;

use crate::geometry::{Body, Direction};

/// Longest step of one iteration.
/// Numerical: 3 degrees and 0.5 m (docs/signal-model.md, "Path estimation").
pub(super) const LONGEST_ANGLE_RAD: f32 = 0.052;
/// Numerical: half a metre.
pub(super) const LONGEST_DELAY_TAPS: f32 = 0.41;

/// Where a path is: delay in window coordinates, direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Delay at the body origin, taps from the window's origin.
    pub(super) delay_taps: f32,
    /// Angle of arrival, a unit vector in body axes.
    pub(super) u: Vector3<f32>,
}

impl Place {
    /// Tangents (e1, e2) of the direction, as [`Direction::tangents`].
    pub(super) fn tangents(&self) -> (Vector3<f32>, Vector3<f32>) {
        Direction::<Body>::from_vector(self.u)
            .map_or_else(|_| (Vector3::y(), Vector3::z()), |direction| direction.tangents())
    }

    /// The place after a step (delay in taps, two angles in rad), each path's length limited.
    pub(super) fn moved(&self, step: [f32; 3]) -> Self {
        let angle = libm::sqrtf(step[1] * step[1] + step[2] * step[2]);
        let too_long = (angle / LONGEST_ANGLE_RAD)
            .max(step[0].abs() / LONGEST_DELAY_TAPS)
            .max(1.0);
        let scale = 1.0 / too_long;
        let (e1, e2) = self.tangents();
        let u = self.u + e1 * (step[1] * scale) + e2 * (step[2] * scale);
        Self {
            delay_taps: self.delay_taps + step[0] * scale,
            u: u / u.norm(),
        }
    }
}
