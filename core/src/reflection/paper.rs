//! The closed form as the paper prints it: the baseline to compare with.

use nalgebra::Vector3;

use crate::geometry::{Direction, Position, Real, World};

/// Solves the reflection point by equations geores_1 to geores_3 of the paper, m.
///
/// The sign of all `+-` is plus for an azimuth in [-pi/2, pi/2] and minus otherwise. The equations are in tan(azimuth)
/// and cot(zenith): near azimuth +-90 degrees and zenith 0 and 180 degrees they lose accuracy and finally return UAV's
/// own position or a vector that is not finite. Use [`super::vector_point`] unless the comparison is the point.
pub fn paper_point<T: Real>(
    uav: &Position<World, T>,
    gmt: &Position<World, T>,
    aoa: &Direction<World, T>,
    c_tau_m: T,
) -> Vector3<T> {
    let [x_r, y_r, z_r] = uav.to_array();
    let [x_g, y_g, z_g] = gmt.to_array();
    let (azimuth, zenith) = (aoa.azimuth_rad(), aoa.zenith_rad());
    let (one, two) = (T::one(), T::of(2.0));
    let sign = if azimuth.abs() <= T::frac_pi_2() {
        one
    } else {
        -one
    };
    let tan = azimuth.tan_libm();
    let cot = one / zenith.tan_libm();
    let secant = (one + tan * tan).sqrt();
    let a = ((one + tan * tan) * (one + cot * cot)).sqrt();
    let (dy, dz) = (y_r - y_g, z_r - z_g);

    let slope = dy * tan + sign * dz * cot * secant + sign * c_tau_m * a;
    let numerator = c_tau_m * c_tau_m + x_r * x_r - x_g * x_g - dy * dy - dz * dz + two * slope * x_r;
    let denominator = two * (slope + x_r - x_g);
    let x_p = numerator / denominator;
    let y_p = y_r + tan * (x_p - x_r);
    let z_p = z_r + sign * cot * (x_p - x_r) * secant;
    Vector3::new(x_p, y_p, z_p)
}
