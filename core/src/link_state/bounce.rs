//! How strong a single reflection would be: the prediction that the measured power is held against.
//!
//! Free space over `c tau`, half-wave dipoles at both ends, and the Fresnel coefficients of a lossless half-space at the
//! solved point, polarisation included: the wave leaves along theta-hat, is split into `s = unit(k_i x n)` and
//! `p = s x k_i`, put together again with `p' = s x k_r`, and received along theta-hat. The reflecting plane is the one
//! that turns `k_i` into `k_r`. The permittivity of the world is unknown, so a middle one is taken; from 2 to 20 the
//! coefficients of most angles lie within 5 dB of it.

use core::f32::consts::{FRAC_PI_2, PI};

use libm::{cosf, log10f};
use nalgebra::Vector3;

use crate::kernels::sqrt;

/// Relative permittivity of the prediction: the geometric mean of 2 and 20.
const PERMITTIVITY: f32 = 6.3;

/// `sqrt(1.643)`: amplitude gain of a half-wave dipole across its axis.
const DIPOLE: f32 = 1.281_796;

/// Smallest amplitude ratio that is told apart from nothing: -60 dB.
const LEAST: f32 = 1e-3;

/// A reflection at the solved point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounce {
    /// Cosine of the angle of incidence, 0 (grazing) to 1.
    pub(super) cos_incidence: f32,
    /// Unit normal of the reflecting plane, on the side of the wave; zero where nothing is turned.
    pub(super) normal: Vector3<f32>,
    /// Gain without any reflection, dB: free space and the dipoles at both ends.
    pub(super) unreflected_db: f32,
    /// Gain of the reflection itself, dB.
    pub(super) reflection_db: f32,
}

impl Bounce {
    /// The bounce that turns a wave from direction of travel `incoming` into `-arrival`, over `length_m` in all. Unit
    /// vectors.
    pub(super) fn new(
        incoming: &Vector3<f32>,
        arrival: &Vector3<f32>,
        length_m: f32,
        wavelength_m: f32,
    ) -> Self {
        let outgoing = -arrival;
        let turn = outgoing - incoming;
        let twice_cos = sqrt(turn.norm_squared());
        let normal = if twice_cos > 1e-6 {
            turn / twice_cos
        } else {
            Vector3::zeros()
        };
        let cos = (0.5 * twice_cos).min(1.0);
        let amplitude = wavelength_m / (4.0 * PI * length_m) * dipole(incoming) * dipole(arrival);
        let reflection = reflected(incoming, &outgoing, arrival, &normal, cos).max(LEAST);
        Self {
            cos_incidence: cos,
            normal,
            unreflected_db: 20.0 * log10f(amplitude.max(1e-12)),
            reflection_db: 20.0 * log10f(reflection),
        }
    }
}

/// Share of the amplitude that a bounce leaves, seen by vertical dipoles.
fn reflected(
    incoming: &Vector3<f32>,
    outgoing: &Vector3<f32>,
    arrival: &Vector3<f32>,
    normal: &Vector3<f32>,
    cos: f32,
) -> f32 {
    let across = incoming.cross(normal);
    let length = sqrt(across.norm_squared());
    // At normal incidence every split is as good as another, and the field comes back whole.
    let s = if length > 1e-6 {
        across / length
    } else {
        theta_hat(incoming)
    };
    let q = sqrt((PERMITTIVITY - (1.0 - cos * cos)).max(0.0));
    let r_s = (cos - q) / (cos + q);
    let r_p = (PERMITTIVITY * cos - q) / (PERMITTIVITY * cos + q);
    let (sent, received) = (theta_hat(incoming), theta_hat(arrival));
    let e_s = r_s * sent.dot(&s);
    let e_p = r_p * sent.dot(&s.cross(incoming));
    (e_s * s.dot(&received) + e_p * s.cross(outgoing).dot(&received)).abs()
}

/// Unit vector of growing zenith angle; towards east where the direction is vertical.
fn theta_hat(direction: &Vector3<f32>) -> Vector3<f32> {
    let across = sqrt(direction.x * direction.x + direction.y * direction.y);
    if across > 0.0 {
        let share = direction.z / across;
        Vector3::new(share * direction.x, share * direction.y, -across)
    } else {
        Vector3::new(direction.z, 0.0, 0.0)
    }
}

/// Amplitude of a vertical half-wave dipole towards a unit direction, not below -60 dB.
fn dipole(direction: &Vector3<f32>) -> f32 {
    let sin = sqrt(direction.x * direction.x + direction.y * direction.y);
    let amplitude = DIPOLE * cosf(FRAC_PI_2 * direction.z) / sin;
    // Not a number at the poles.
    if amplitude > LEAST { amplitude } else { LEAST }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAVELENGTH_M: f32 = 0.01;

    #[test]
    fn a_level_way_without_a_turn_has_friis_gain() {
        let u = Vector3::new(0.6, 0.8, 0.0);
        let bounce = Bounce::new(&u, &-u, 50.0, WAVELENGTH_M);
        let friis = 20.0 * log10f(WAVELENGTH_M / (4.0 * PI * 50.0) * 1.643);
        assert!((bounce.unreflected_db - friis).abs() < 1e-3);
        assert!(bounce.cos_incidence < 1e-6);
    }

    #[test]
    fn a_wall_reflects_s_and_the_ground_p() {
        // 45 degrees on a wall at x = 5, level: s polarisation.
        let half = 0.5_f32.sqrt();
        let q = (PERMITTIVITY - 0.5).sqrt();
        let wall = Bounce::new(
            &Vector3::new(half, half, 0.0),
            &Vector3::new(half, -half, 0.0),
            20.0,
            WAVELENGTH_M,
        );
        assert!((wall.normal + Vector3::x()).norm() < 1e-6);
        assert!((wall.cos_incidence - half).abs() < 1e-6);
        let r_s = ((half - q) / (half + q)).abs();
        assert!((wall.reflection_db - 20.0 * log10f(r_s)).abs() < 1e-3);
        let ground = Bounce::new(
            &Vector3::new(half, 0.0, -half),
            &Vector3::new(-half, 0.0, -half),
            20.0,
            WAVELENGTH_M,
        );
        assert!((ground.normal - Vector3::z()).norm() < 1e-6);
        let r_p = ((PERMITTIVITY * half - q) / (PERMITTIVITY * half + q)).abs();
        assert!((ground.reflection_db - 20.0 * log10f(r_p)).abs() < 1e-3);
    }

    #[test]
    fn poles_and_backscatter_stay_finite() {
        for (a, b) in [
            (Vector3::z(), Vector3::z()),
            (-Vector3::z(), Vector3::x()),
            (Vector3::x(), Vector3::x()),
            (Vector3::y(), -Vector3::y()),
        ] {
            let bounce = Bounce::new(&a, &b, 1.0, WAVELENGTH_M);
            assert!(
                bounce.unreflected_db.is_finite() && bounce.reflection_db.is_finite(),
                "{a} {b}"
            );
        }
        // Straight back at a wall: (sqrt(eps) - 1) / (sqrt(eps) + 1).
        let back = Bounce::new(&Vector3::x(), &Vector3::x(), 1.0, WAVELENGTH_M);
        let n = PERMITTIVITY.sqrt();
        assert!((back.reflection_db - 20.0 * log10f((n - 1.0) / (n + 1.0))).abs() < 1e-3);
    }
}
