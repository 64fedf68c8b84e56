//! What beam squint localization gives: direction and delay of the UAV as the GMT's face sees it.

use nalgebra::Matrix2;

use crate::array::GmtFace;
use crate::geometry::{Direction, Gmt};

/// Standard deviation of what calibration errors of a face (5 degrees and 20 ps an element) add to its cosines (s_x, s_z),
/// the same in every direction. Not in a [`Bearing`]'s covariance: a constant of the face is a state of the filter, not
/// noise.
/// Independent phase errors of e rad over 8 x 8 elements tilt the wave front by `e / (pi sqrt(sum n^2))` along each axis,
/// `sum n^2` = 64 x 5.25: 1.5 mrad for 5 degrees, whatever reads the pattern.
/// Derived: 5 degrees and 20 ps an element of the error budget.
pub const FACE_BIAS_SIGMA: [f32; 2] = [1.5e-3, 1.5e-3];

/// A measured delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    /// Speed of light times delay, on the receiver's clock (its offset included), m.
    pub c_tau_m: f32,
    /// Variance, m^2.
    pub variance_m2: f32,
}

/// Direction and delay of the UAV as the GMT's face sees it. Direction and delay are uncorrelated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bearing {
    /// Face of the GMT.
    pub face: usize,
    /// Direction cosines along the row and up the column of the face: s_x, s_z.
    pub cosines: [f32; 2],
    /// Covariance of the cosines: noise and what varies of the face's calibration error, without the constant part
    /// ([`FACE_BIAS_SIGMA`]).
    pub covariance: Matrix2<f32>,
    /// Delay; only the maximum-likelihood fit measures it.
    pub delay: Option<Delay>,
}

impl Bearing {
    /// The direction from the GMT: `sqrt(1 - s_x^2 - s_z^2)` along the face's normal, s_x along its row, s_z up.
    #[must_use]
    pub fn direction(&self, face: &GmtFace) -> Option<Direction<Gmt>> {
        let [x, z] = self.cosines;
        let ahead = 1.0 - x * x - z * z;
        let up = face.normal.cross(&face.tangent);
        (ahead > 0.0)
            .then(|| face.normal * libm::sqrtf(ahead) + face.tangent * x + up * z)
            .and_then(|v| Direction::from_vector(v).ok())
    }
}
