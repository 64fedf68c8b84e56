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

use nalgebra::{Complex, Vector3};

use super::angles::{phi_hat, theta_hat};
use super::surface::Surface;
use crate::scene::Vec3;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

/// Greatest gain of a half-wave dipole, 2.15 dBi.
const DIPOLE_GAIN: f64 = 1.643;

/// The field of a wave, world axes.
pub(super) type Field = Vector3<Complex<f64>>;

/// A face that reflects.
#[derive(Clone, Copy)]
pub(super) struct Bounce<'a> {
    pub(super) normal: &'a Vec3,
    pub(super) surface: &'a Surface,
}

/// Gain of the path through the given points (transmitter, interactions, receiver) and its bounces.
pub(super) fn gain<'a>(
    frequency_hz: f64,
    points: &[Vec3],
    bounces: impl IntoIterator<Item = Bounce<'a>>,
    length_m: f64,
) -> Complex<f64> {
    let [vertical, _] = gains(frequency_hz, points, bounces, length_m);
    vertical
}

/// The same, and what arrives along phi-hat(AoA) on the same scale: the horizontal component that reflections have made.
pub(super) fn gains<'a>(
    frequency_hz: f64,
    points: &[Vec3],
    bounces: impl IntoIterator<Item = Bounce<'a>>,
    length_m: f64,
) -> [Complex<f64>; 2] {
    let leg = |i: usize| (points[i + 1] - points[i]).normalize();
    let departure = leg(0);
    let mut direction = departure;
    let mut field = departing(&departure);
    for (bounce, at) in bounces.into_iter().enumerate() {
        let reflected = leg(bounce + 1);
        field = reflect(&field, &direction, &at, &reflected);
        direction = reflected;
    }
    // The angle of arrival points back to where the wave comes from.
    let arrival = -direction;
    let wavelength_m = SPEED_OF_LIGHT_M_PER_S / frequency_hz;
    let spread = wavelength_m / (4.0 * PI * length_m) * dipole(&departure) * dipole(&arrival);
    [
        received(&field, &arrival) * spread,
        received_across(&field, &arrival) * spread,
    ]
}

/// Unit field of a vertical antenna towards a unit direction.
pub(super) fn departing(departure: &Vec3) -> Field {
    theta_hat(departure).map(|c| Complex::new(c, 0.0))
}

/// What a vertical antenna takes of a field that comes from a unit direction.
pub(super) fn received(field: &Field, arrival: &Vec3) -> Complex<f64> {
    along(field, &theta_hat(arrival))
}

/// The component of such a field that a vertical antenna is blind to.
pub(super) fn received_across(field: &Field, arrival: &Vec3) -> Complex<f64> {
    along(field, &phi_hat(arrival))
}

/// Component of a field along a real unit vector.
pub(super) fn along(field: &Field, unit: &Vec3) -> Complex<f64> {
    field.x * unit.x + field.y * unit.y + field.z * unit.z
}

/// The field behind a bounce of a wave that comes along one unit direction and leaves along another.
pub(super) fn reflect(field: &Field, direction: &Vec3, at: &Bounce<'_>, reflected: &Vec3) -> Field {
    let across = direction.cross(at.normal);
    // At normal incidence every split is as good as another.
    let s = across
        .try_normalize(1e-12)
        .unwrap_or_else(|| any_perpendicular(direction));
    let [r_s, r_p] = at.surface.reflection(-direction.dot(at.normal));
    let e_s = r_s * along(field, &s);
    let e_p = r_p * along(field, &s.cross(direction));
    let p = s.cross(reflected);
    s.map(|c| e_s * c) + p.map(|c| e_p * c)
}

/// The field behind a sheet that a wave goes straight through, by its coefficients [t_s, t_p].
pub(super) fn transmit(
    field: &Field,
    direction: &Vec3,
    normal: &Vec3,
    [t_s, t_p]: [Complex<f64>; 2],
) -> Field {
    let s = direction
        .cross(normal)
        .try_normalize(1e-12)
        .unwrap_or_else(|| any_perpendicular(direction));
    let p = s.cross(direction);
    let (e_s, e_p) = (t_s * along(field, &s), t_p * along(field, &p));
    s.map(|c| e_s * c) + p.map(|c| e_p * c)
}

/// Amplitude of a vertical half-wave dipole towards a unit direction, `sqrt(1.643) cos(pi/2 cos th) / sin th`.
pub(super) fn dipole(direction: &Vec3) -> f64 {
    let sin = (direction.x * direction.x + direction.y * direction.y).sqrt();
    // Towards the poles the quotient goes to zero like (pi / 4) sin.
    if sin < 1e-9 {
        return 0.0;
    }
    DIPOLE_GAIN.sqrt() * libm::cos(FRAC_PI_2 * direction.z) / sin
}

fn any_perpendicular(direction: &Vec3) -> Vec3 {
    let mut axis = Vec3::zeros();
    axis[direction.iamin()] = 1.0;
    direction.cross(&axis).normalize()
}

#[cfg(test)]
mod tests {
    use super::super::surface::fresnel;
    use super::*;
    use crate::scene::Material;
    use crate::tracer::Propagation;

    fn lossless() -> Surface {
        Surface::new(&Material::new(15.0, 0.0).unwrap(), 30e9, &Propagation::default())
    }

    #[test]
    fn level_line_of_sight_has_friis_gain() {
        let points = [Vec3::new(0.0, 0.0, 2.0), Vec3::new(30.0, 40.0, 2.0)];
        let gain = gain(30e9, &points, [], 50.0);
        let friis = SPEED_OF_LIGHT_M_PER_S / 30e9 / (4.0 * PI * 50.0) * 1.643;
        assert!((gain.re - friis).abs() < 1e-12 * friis && gain.im == 0.0);
    }

    #[test]
    fn a_slanting_bounce_makes_a_horizontal_component_and_a_straight_one_none() {
        let surface = lossless();
        let off = |normal: &Vec3, points: &[Vec3]| {
            let surface = &surface;
            gains(30e9, points, [Bounce { normal, surface }], 20.0)
        };
        let corner = Vec3::new(5.0, 5.0, 5.0);
        let ends = |dz: f64| {
            [
                Vec3::new(0.0, 0.0, 5.0 - dz),
                corner,
                Vec3::new(0.0, 10.0, 5.0 + dz),
            ]
        };
        let [level, none] = off(&-Vec3::x(), &ends(0.0));
        assert!(none.norm() < 1e-15 * level.norm().max(1e-3));
        // Off a wall and up: s and p are reflected unlike.
        let points = ends(4.0);
        let [vertical, across] = off(&-Vec3::x(), &points);
        assert!(across.norm() > 0.05 * vertical.norm(), "{vertical} {across}");
        // What comes is what the coefficients leave of what went: no more, no less.
        let cos = (points[1] - points[0]).normalize().x;
        let [r_s, r_p] = fresnel(Complex::new(15.0, 0.0), cos).map(|r| r.norm_sqr());
        let departure = (points[1] - points[0]).normalize();
        let s = departure.cross(&Vec3::x()).normalize();
        let share = theta_hat(&departure).dot(&s).powi(2);
        let [d, a] = [departure, (points[1] - points[2]).normalize()].map(|u| dipole(&u));
        let scale = SPEED_OF_LIGHT_M_PER_S / 30e9 / (4.0 * PI * 20.0) * d * a;
        let power = (vertical.norm_sqr() + across.norm_sqr()) / (scale * scale);
        assert!(
            (power - share * r_s - (1.0 - share) * r_p).abs() < 1e-12,
            "{power}"
        );
        // A mirror image in an upright plane turns its sign.
        let flipped = points.map(|p| Vec3::new(p.x, -p.y, p.z));
        let [same, opposite] = off(&-Vec3::x(), &flipped);
        assert!((same - vertical).norm() < 1e-15 && (opposite + across).norm() < 1e-15);
    }

    #[test]
    fn vertical_field_on_the_ground_is_p_and_on_a_wall_is_s() {
        let surface = lossless();
        let off = |normal: &Vec3, points: &[Vec3], length: f64| {
            let surface = &surface;
            gain(30e9, points, [Bounce { normal, surface }], length)
        };
        let eta = Complex::new(15.0, 0.0);
        let friis = |length: f64| SPEED_OF_LIGHT_M_PER_S / 30e9 / (4.0 * PI * length);
        // Ground: 45 degrees down, 45 degrees up.
        let points = [
            Vec3::new(0.0, 0.0, 5.0),
            Vec3::new(5.0, 0.0, 0.0),
            Vec3::new(10.0, 0.0, 5.0),
        ];
        let length = 50.0_f64.sqrt() * 2.0;
        let ground = off(&Vec3::z(), &points, length);
        let amplitude = dipole(&Vec3::new(1.0, 0.0, -1.0).normalize()).powi(2) * friis(length);
        let r_p = fresnel(eta, 0.5_f64.sqrt())[1];
        assert!((ground.norm() - amplitude * r_p.norm()).abs() < 1e-12 * amplitude);
        // Wall at x = 5: level.
        let points = [
            Vec3::new(0.0, 0.0, 5.0),
            Vec3::new(5.0, 5.0, 5.0),
            Vec3::new(0.0, 10.0, 5.0),
        ];
        let wall = off(&-Vec3::x(), &points, length);
        let r_s = fresnel(eta, 0.5_f64.sqrt())[0];
        assert!(
            (wall - r_s * (friis(length) * 1.643)).norm() < 1e-12 * wall.norm(),
            "sign included"
        );
    }
}
