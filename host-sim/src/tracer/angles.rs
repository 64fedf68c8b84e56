//! Directions as the paths format gives them: zenith angle from +z, azimuth from +x.

use crate::scene::Vec3;

/// Zenith angle (0..=pi) and azimuth (-pi < phi <= pi) of a direction, rad. `libm` keeps them equal on every machine.
pub(super) fn zenith_azimuth(direction: &Vec3) -> [f64; 2] {
    let across = (direction.x * direction.x + direction.y * direction.y).sqrt();
    let azimuth = libm::atan2(direction.y, direction.x);
    [
        libm::atan2(across, direction.z),
        if azimuth == -core::f64::consts::PI {
            core::f64::consts::PI
        } else {
            azimuth
        },
    ]
}

/// Unit vector of growing zenith angle at a unit direction; the east-most of them where the direction is vertical.
pub(super) fn theta_hat(direction: &Vec3) -> Vec3 {
    let across = (direction.x * direction.x + direction.y * direction.y).sqrt();
    if across == 0.0 {
        return Vec3::new(direction.z, 0.0, 0.0);
    }
    Vec3::new(
        direction.z * direction.x / across,
        direction.z * direction.y / across,
        -across,
    )
}

/// Unit vector of growing azimuth at a unit direction, horizontal; north where the direction is vertical.
pub(super) fn phi_hat(direction: &Vec3) -> Vec3 {
    let across = (direction.x * direction.x + direction.y * direction.y).sqrt();
    if across == 0.0 {
        return Vec3::y();
    }
    Vec3::new(-direction.y / across, direction.x / across, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn axes_have_their_textbook_angles() {
        assert_eq!(zenith_azimuth(&Vec3::x()), [FRAC_PI_2, 0.0]);
        assert_eq!(zenith_azimuth(&Vec3::y()), [FRAC_PI_2, FRAC_PI_2]);
        assert_eq!(zenith_azimuth(&Vec3::new(-1.0, -0.0, 0.0)), [FRAC_PI_2, PI]);
        assert_eq!(zenith_azimuth(&Vec3::z())[0], 0.0);
        assert_eq!(zenith_azimuth(&-Vec3::z())[0], PI);
    }

    #[test]
    fn theta_hat_is_the_derivative_of_the_direction() {
        for (theta, phi) in [(0.3, 0.4), (1.2, -2.9), (2.8, 1.7)] {
            let at = |t: f64| Vec3::new(t.sin() * f64::cos(phi), t.sin() * f64::sin(phi), t.cos());
            let derivative = (at(theta + 1e-6) - at(theta - 1e-6)) / 2e-6;
            assert!((theta_hat(&at(theta)) - derivative).norm() < 1e-9);
            assert!((theta_hat(&at(theta)).cross(&phi_hat(&at(theta))) - at(theta)).norm() < 1e-12);
        }
    }
}
