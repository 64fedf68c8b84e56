//! Which way a path left a face of the GMT: what a face tells are cosines, whose errors are those of the angles times the sines.

use nalgebra::Vector3;

/// Sine of the angle to an axis of a face under which its cosine tells no angle.
/// Numerical: a guard of a division.
const LEAST_SLOPE: f64 = 1e-3;

/// Direction in which a path left, by a face of the GMT.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceDirection {
    /// Face of the mast.
    pub face: usize,
    /// Direction cosines along the face's row and column: (s_x, s_z) of docs/signal-model.md, "Beam squint".
    pub cosines: [f64; 2],
    /// Their standard deviations.
    pub sigma: [f64; 2],
}

impl FaceDirection {
    /// A direction that is known to `sigma_rad` along any tangent.
    #[must_use]
    pub fn of_angle(face: usize, cosines: [f64; 2], sigma_rad: f64) -> Self {
        let sure = Self {
            face,
            cosines,
            sigma: [0.0; 2],
        };
        sure.widened(sigma_rad)
    }

    /// The same with an error of so much along any tangent beside its own.
    #[must_use]
    pub fn widened(mut self, sigma_rad: f64) -> Self {
        let slopes = self.slopes();
        for (sigma, slope) in self.sigma.iter_mut().zip(slopes) {
            *sigma = libm::hypot(*sigma, sigma_rad * slope);
        }
        self
    }

    /// Standard deviations of the angles to row and column, rad.
    #[must_use]
    pub fn sigma_rad(&self) -> [f64; 2] {
        let [x, z] = self.sigma;
        let [by_x, by_z] = self.slopes();
        [x / by_x, z / by_z]
    }

    /// By how much each cosine changes with its angle: the sine.
    fn slopes(&self) -> [f64; 2] {
        self.cosines
            .map(|cosine| libm::sqrt((1.0 - cosine * cosine).max(LEAST_SLOPE * LEAST_SLOPE)))
    }

    /// Standard deviations along each axis of the world, rad, of a way that left so: its elevation may be known worse than its azimuth. That of the
    /// elevation moves a way that rises sideways as well.
    pub(super) fn sigma_along(&self, way: &Vector3<f64>) -> Vector3<f64> {
        let [x, z] = self.sigma_rad();
        let beside = x.max(z * way.z.abs());
        Vector3::new(beside, beside, z)
    }
}
