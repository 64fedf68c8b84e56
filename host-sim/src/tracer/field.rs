//! Complex gain of a path: free-space loss, half-space Fresnel reflections with polarisation, half-wave dipoles.
//!
//! The wave leaves along theta-hat(AoD). At each bounce it is split into `s = unit(k_i x n)` and `p = s x k_i`, reflected by
//!
//! ```text
//! r_s = (cos - q) / (cos + q)    r_p = (eta cos - q) / (eta cos + q)    q = sqrt(eta - sin^2)
//! ```
//!
//! and put together again with `p' = s x k_r`; it is received along theta-hat(AoA). Time convention `e^{+jwt}`; the carrier
//! phase `exp(-j 2 pi f tau)` is not part of the gain.

use core::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Complex;

use super::angles::theta_hat;
use crate::scene::{Material, Vec3};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

/// Greatest gain of a half-wave dipole, 2.15 dBi.
const DIPOLE_GAIN: f64 = 1.643;

/// Gain of the path through the given points (transmitter, interactions, receiver) and the normals of its bounces.
pub(super) fn gain(
    material: &Material,
    frequency_hz: f64,
    points: &[Vec3],
    normals: &[Vec3],
    length_m: f64,
) -> Complex<f64> {
    let [eta_re, eta_im] = material.complex_permittivity(frequency_hz);
    let eta = Complex::new(eta_re, eta_im);
    let leg = |i: usize| (points[i + 1] - points[i]).normalize();
    let departure = leg(0);
    let mut direction = departure;
    let mut field = theta_hat(&departure).map(|c| Complex::new(c, 0.0));
    for (bounce, normal) in normals.iter().enumerate() {
        let reflected = leg(bounce + 1);
        let across = direction.cross(normal);
        // At normal incidence every split is as good as another.
        let s = across
            .try_normalize(1e-12)
            .unwrap_or_else(|| any_perpendicular(&direction));
        let [r_s, r_p] = fresnel(eta, -direction.dot(normal));
        let along = |unit: &Vec3| field.x * unit.x + field.y * unit.y + field.z * unit.z;
        let e_s = r_s * along(&s);
        let e_p = r_p * along(&s.cross(&direction));
        let p = s.cross(&reflected);
        field = s.map(|c| e_s * c) + p.map(|c| e_p * c);
        direction = reflected;
    }
    // The angle of arrival points back to where the wave comes from.
    let arrival = -direction;
    let receive = theta_hat(&arrival);
    let received = field.x * receive.x + field.y * receive.y + field.z * receive.z;
    let wavelength_m = SPEED_OF_LIGHT_M_PER_S / frequency_hz;
    received * (wavelength_m / (4.0 * PI * length_m) * dipole(&departure) * dipole(&arrival))
}

/// Amplitude of a vertical half-wave dipole towards a unit direction, `sqrt(1.643) cos(pi/2 cos th) / sin th`.
fn dipole(direction: &Vec3) -> f64 {
    let sin = (direction.x * direction.x + direction.y * direction.y).sqrt();
    // Towards the poles the quotient goes to zero like (pi / 4) sin.
    if sin < 1e-9 {
        return 0.0;
    }
    DIPOLE_GAIN.sqrt() * libm::cos(FRAC_PI_2 * direction.z) / sin
}

/// Fresnel coefficients [r_s, r_p] of a half-space of relative permittivity `eta` at the given cosine of incidence.
fn fresnel(eta: Complex<f64>, cos: f64) -> [Complex<f64>; 2] {
    let q = sqrt(eta - (1.0 - cos * cos));
    let c = Complex::new(cos, 0.0);
    [(c - q) / (c + q), (eta * cos - q) / (eta * cos + q)]
}

/// Principal square root by real square roots alone, which are exact on every machine; without cancellation.
fn sqrt(z: Complex<f64>) -> Complex<f64> {
    let magnitude = (z.re * z.re + z.im * z.im).sqrt();
    let larger = (0.5 * (magnitude + z.re.abs())).sqrt();
    if larger == 0.0 {
        return Complex::new(0.0, 0.0);
    }
    let smaller = z.im / (2.0 * larger);
    if z.re >= 0.0 {
        Complex::new(larger, smaller)
    } else {
        Complex::new(smaller.abs(), larger.copysign(z.im))
    }
}

fn any_perpendicular(direction: &Vec3) -> Vec3 {
    let mut axis = Vec3::zeros();
    axis[direction.iamin()] = 1.0;
    direction.cross(&axis).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    fn lossless() -> Material {
        Material::new(15.0, 0.0).unwrap()
    }

    #[test]
    fn fresnel_meets_its_limits() {
        let eta = Complex::new(15.0, 0.0);
        let n = 15.0_f64.sqrt();
        let [s, p] = fresnel(eta, 1.0);
        assert!((s.re - (1.0 - n) / (1.0 + n)).abs() < 1e-15 && s.im == 0.0);
        assert!((p + s).norm() < 1e-15, "at normal incidence r_p = -r_s");
        let [s, p] = fresnel(eta, 1e-12);
        assert!(
            (s + 1.0).norm() < 1e-10 && (p + 1.0).norm() < 1e-10,
            "grazing: both -1"
        );
        // Brewster's angle, tan = n.
        assert!(fresnel(eta, 1.0 / (1.0 + 15.0_f64).sqrt())[1].norm() < 1e-15);
    }

    #[test]
    fn complex_root_squares_back() {
        for z in [[3.0, -4.0], [14.2, -0.009], [-2.0, 0.5], [-2.0, -0.5], [0.0, 0.0]] {
            let z = Complex::new(z[0], z[1]);
            let root = sqrt(z);
            assert!((root * root - z).norm() < 1e-14 && root.re >= 0.0);
        }
    }

    #[test]
    fn level_line_of_sight_has_friis_gain() {
        let points = [Vec3::new(0.0, 0.0, 2.0), Vec3::new(30.0, 40.0, 2.0)];
        let gain = gain(&lossless(), 30e9, &points, &[], 50.0);
        let friis = SPEED_OF_LIGHT_M_PER_S / 30e9 / (4.0 * PI * 50.0) * 1.643;
        assert!((gain.re - friis).abs() < 1e-12 * friis && gain.im == 0.0);
    }

    #[test]
    fn vertical_field_on_the_ground_is_p_and_on_a_wall_is_s() {
        let material = lossless();
        let eta = Complex::new(15.0, 0.0);
        let friis = |length: f64| SPEED_OF_LIGHT_M_PER_S / 30e9 / (4.0 * PI * length);
        // Ground: 45 degrees down, 45 degrees up.
        let points = [
            Vec3::new(0.0, 0.0, 5.0),
            Vec3::new(5.0, 0.0, 0.0),
            Vec3::new(10.0, 0.0, 5.0),
        ];
        let length = 50.0_f64.sqrt() * 2.0;
        let ground = gain(&material, 30e9, &points, &[Vec3::z()], length);
        let amplitude = dipole(&Vec3::new(1.0, 0.0, -1.0).normalize()).powi(2) * friis(length);
        let r_p = fresnel(eta, 0.5_f64.sqrt())[1];
        assert!((ground.norm() - amplitude * r_p.norm()).abs() < 1e-12 * amplitude);
        // Wall at x = 5: level.
        let points = [
            Vec3::new(0.0, 0.0, 5.0),
            Vec3::new(5.0, 5.0, 5.0),
            Vec3::new(0.0, 10.0, 5.0),
        ];
        let wall = gain(&material, 30e9, &points, &[-Vec3::x()], length);
        let r_s = fresnel(eta, 0.5_f64.sqrt())[0];
        assert!(
            (wall - r_s * (friis(length) * 1.643)).norm() < 1e-12 * wall.norm(),
            "sign included"
        );
    }
}
