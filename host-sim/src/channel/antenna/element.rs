//! Amplitude patterns of single elements, without any error.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

/// Directivity of the dipole, as a power ratio: the customary figure (exact: 1.6409).
const DIPOLE: f64 = 1.643;
/// UAV: attenuation at 90 deg off the face's normal, dB, and what is added up to 180 deg.
const SIDE_DB: f64 = 6.0;
const REAR_DB: f64 = 12.0;
/// GMT: least cosine off the face's normal in front of the face, and amplitude behind it.
const LEAST_COSINE: f64 = 0.05;
const REAR_AMPLITUDE: f64 = 0.05;

/// Amplitude of a half-wave dipole along z towards the unit vector `u`: `sqrt(1.643) cos(pi/2 cos th) / sin th`.
pub(in crate::channel) fn half_wave_dipole(u: &Vector3<f64>) -> f64 {
    let sine = (u.x * u.x + u.y * u.y).sqrt();
    if sine < 1e-6 {
        return 0.0;
    }
    // cos(pi/2 c) = sin(pi/2 (1 - |c|)), and 1 - |c| = s^2 / (1 + |c|): no cancellation near the axis.
    let from_axis = sine * sine / (1.0 + u.z.abs());
    DIPOLE.sqrt() * libm::sin(FRAC_PI_2 * from_axis) / sine
}

/// Amplitude of an element on a face of the UAV: the dipole, twice the power in front, 6 dB less aside, 18 dB behind.
pub(super) fn of_uav(u: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    // Angle off the normal in right angles, 0..2.
    let off = libm::acos(u.dot(normal).clamp(-1.0, 1.0)) / FRAC_PI_2;
    let attenuation_db = if off <= 1.0 {
        SIDE_DB * off * off
    } else {
        SIDE_DB + REAR_DB * (off - 1.0)
    };
    half_wave_dipole(u) * libm::exp10((10.0 * libm::log10(2.0) - attenuation_db) / 20.0)
}

/// Amplitude of an element on a face of the GMT: the dipole times the root of the projected aperture.
pub(super) fn of_gmt(u: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    let cosine = u.dot(normal);
    let face = if cosine < 0.0 {
        REAR_AMPLITUDE
    } else {
        cosine.max(LEAST_COSINE).sqrt()
    };
    half_wave_dipole(u) * face
}
