//! Amplitude patterns of single elements, without any error.

use std::f64::consts::FRAC_PI_2;

use cslam_core::array::{GmtElement, UavElement};
use nalgebra::Vector3;

/// Directivity of the dipole, as a power ratio: the customary figure (exact: 1.6409).
const DIPOLE: f64 = 1.643;

/// Amplitude of a half-wave dipole along z towards the unit vector `u`: `sqrt(1.643) cos(pi/2 cos th) / sin th`.
pub(crate) fn half_wave_dipole(u: &Vector3<f64>) -> f64 {
    let sine = (u.x * u.x + u.y * u.y).sqrt();
    if sine < 1e-6 {
        return 0.0;
    }
    // cos(pi/2 c) = sin(pi/2 (1 - |c|)), and 1 - |c| = s^2 / (1 + |c|): no cancellation near the axis.
    let from_axis = sine * sine / (1.0 + u.z.abs());
    DIPOLE.sqrt() * libm::sin(FRAC_PI_2 * from_axis) / sine
}

/// Amplitude of an element on a face of the UAV: the dipole, with more power in front and less aside and behind.
pub(super) fn of_uav(element: &UavElement, u: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    // Angle off the normal in right angles, 0..2.
    let off = libm::acos(u.dot(normal).clamp(-1.0, 1.0)) / FRAC_PI_2;
    let attenuation_db = if off <= 1.0 {
        element.side_attenuation_db * off * off
    } else {
        element.side_attenuation_db + element.rear_attenuation_db * (off - 1.0)
    };
    half_wave_dipole(u) * libm::exp10((element.front_gain_db - attenuation_db) / 20.0)
}

/// Amplitude of an element on a face of the GMT: the dipole times the root of the projected aperture.
pub(super) fn of_gmt(element: &GmtElement, u: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    let cosine = u.dot(normal);
    let face = if cosine < 0.0 {
        element.rear_amplitude
    } else {
        cosine.max(element.least_cosine).sqrt()
    };
    half_wave_dipole(u) * face
}
