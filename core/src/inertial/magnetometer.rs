//! Heading from the earth's magnetic field: whether an attitude may be right.
//!
//! The attitude turns the measured field into world axes; by how much its horizontal part misses magnetic north there,
//! the yaw is wrong. Iron on board and the surroundings turn the field by about 5 deg, most of it constant
//! or slow, so averaging does not help, and with line of sight the array knows yaw twenty times better: nothing but a pose that is set is
//! compared with it (docs/localization.md, "What it believes").

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Body, Real, Rotation, World};

/// The earth's field where the UAV flies, and how far what is measured may be from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagneticField {
    /// Field in the world frame (east, north, up), uT.
    pub earth_ut: Vector3<f32>,
    /// Standard deviation of all disturbances, hard iron and surroundings, uT per axis.
    pub disturbance_ut: f32,
}

impl MagneticField {
    /// The field of strength (uT), inclination below the horizon and declination east of north (rad), with disturbances of
    /// 1.7 uT.
    pub fn new(strength_ut: f32, inclination_rad: f32, declination_rad: f32) -> Self {
        let (sin_i, cos_i) = inclination_rad.sin_cos_libm();
        let (sin_d, cos_d) = declination_rad.sin_cos_libm();
        Self {
            earth_ut: Vector3::new(cos_i * sin_d, cos_i * cos_d, -sin_i) * strength_ut,
            disturbance_ut: 1.7,
        }
    }
}

/// A heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading {
    /// By how much the yaw of the attitude is too small, rad, in (-pi, pi].
    pub yaw_error_rad: f32,
    /// Standard deviation by the field's disturbance and by the attitude, rad.
    pub sigma_rad: f32,
}

/// Why there is no heading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HeadingRefusal {
    /// The strength is not the earth's: iron is near.
    Disturbed,
    /// The strength is the earth's, and the vertical part is not: the attitude is wrong.
    Tilted,
    /// A number is not finite.
    NotFinite,
}

impl MagneticField {
    /// The heading by a measured field (uT, body axes) with an attitude of this covariance (rad^2, world axes).
    ///
    /// # Errors
    /// [`HeadingRefusal::Disturbed`] when the strength differs from the earth's by more than four standard deviations, [`HeadingRefusal::Tilted`] when
    /// only the vertical part does; [`HeadingRefusal::NotFinite`].
    pub fn heading(
        &self,
        field_ut: &Vector3<f32>,
        attitude: &Rotation<Body, World>,
        covariance_rad2: &Matrix3<f32>,
    ) -> Result<Heading, HeadingRefusal> {
        let seen = attitude.apply_vector(field_ut);
        let earth = &self.earth_ut;
        let level = |v: &Vector3<f32>| libm::sqrtf(v.x * v.x + v.y * v.y);
        let length = |v: &Vector3<f32>| libm::sqrtf(v.x * v.x + v.y * v.y + v.z * v.z);
        let (strength, horizontal) = (length(&seen), level(earth));
        if !(strength.is_finite() && covariance_rad2.iter().all(|c| c.is_finite())) {
            return Err(HeadingRefusal::NotFinite);
        }
        // A turn of the attitude by a small vector changes a component of the field by its product with the field crossed with that axis.
        let variance = |lever: &Vector3<f32>| lever.dot(&(covariance_rad2 * lever));
        let iron = self.disturbance_ut * self.disturbance_ut;
        let limit = 4.0 * self.disturbance_ut;
        // Four standard deviations from no horizontal field at all: its direction means something.
        if (strength - length(earth)).abs() > limit || level(&seen) <= limit {
            return Err(HeadingRefusal::Disturbed);
        }
        let vertical = iron + variance(&earth.cross(&Vector3::z()));
        if (seen.z - earth.z).abs() > 4.0 * libm::sqrtf(vertical) {
            return Err(HeadingRefusal::Tilted);
        }
        let cross = seen.x * earth.y - seen.y * earth.x;
        let dot = seen.x * earth.x + seen.y * earth.y;
        let across = Vector3::new(earth.y, -earth.x, 0.0) / horizontal;
        let sigma = libm::sqrtf(iron + variance(&earth.cross(&across))) / horizontal;
        Ok(Heading {
            yaw_error_rad: cross.atan2_libm(dot),
            sigma_rad: sigma,
        })
    }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::PI;

    use super::*;

    fn field() -> MagneticField {
        MagneticField::new(48.0, 65.0 * PI / 180.0, 3.0 * PI / 180.0)
    }

    fn attitude(yaw: f32, pitch: f32, roll: f32) -> Rotation<Body, World> {
        Rotation::from_yaw_pitch_roll(yaw, pitch, roll).expect("finite")
    }

    #[test]
    fn the_yaw_error_comes_out_at_any_tilt_and_heading() {
        for k in 0..60 {
            let yaw = k as f32 * 0.4;
            let (pitch, roll) = (0.3 * libm::sinf(yaw * 3.0), 0.4 * libm::cosf(yaw * 2.0));
            let measured = attitude(yaw, pitch, roll)
                .inverse()
                .apply_vector(&field().earth_ut);
            for error in [-3.0, -0.5, 0.0, 0.02, 1.0, 3.1] {
                let believed = attitude(yaw - error, pitch, roll);
                let heading = field()
                    .heading(&measured, &believed, &Matrix3::zeros())
                    .expect("clean field");
                assert!(
                    (heading.yaw_error_rad - error).abs() < 1e-5,
                    "{heading:?}, error {error}"
                );
                assert!((heading.sigma_rad - 1.7 / 20.286).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn the_sigma_is_that_of_the_turns_that_the_attitude_may_be_off_by() {
        let level = attitude(1.0, 0.0, 0.0);
        let measured = level.inverse().apply_vector(&field().earth_ut);
        let north = field().earth_ut.xy().normalize();
        let sigma = |axis: Vector3<f32>| {
            let covariance = axis * axis.transpose() * 0.01;
            let heading = field().heading(&measured, &level, &covariance);
            heading.expect("clean").sigma_rad
        };
        let with = |turned: f32| libm::sqrtf(0.0838 * 0.0838 + turned * turned);
        // 1.7 uT over 20.3 uT beside the turn itself, and tilt about magnetic north times tan 65 deg; tilt about its side is none of yaw.
        for (axis, turned) in [
            (Vector3::z(), 0.1),
            (Vector3::new(north.x, north.y, 0.0), 0.2145),
            (Vector3::new(north.y, -north.x, 0.0), 0.0),
        ] {
            assert!(
                (sigma(axis) - with(turned)).abs() < 1e-3,
                "{axis} {}",
                sigma(axis)
            );
        }
    }

    #[test]
    fn iron_is_noticed() {
        let level = attitude(0.0, 0.0, 0.0);
        let heading = |x, y, z| {
            field().heading(
                &(field().earth_ut + Vector3::new(x, y, z)),
                &level,
                &Matrix3::from_diagonal_element(1e-4),
            )
        };
        assert!(heading(2.0, -2.0, 2.0).is_ok());
        assert_eq!(heading(0.0, 0.0, 9.0), Err(HeadingRefusal::Disturbed));
        assert_eq!(heading(0.0, 8.0, 8.0), Err(HeadingRefusal::Tilted));
        assert_eq!(heading(0.0, -16.0, 0.0), Err(HeadingRefusal::Disturbed));
        assert_eq!(heading(30.0, 0.0, 0.0), Err(HeadingRefusal::Disturbed));
        assert_eq!(heading(f32::NAN, 0.0, 0.0), Err(HeadingRefusal::NotFinite));
        assert_eq!(heading(0.0, f32::INFINITY, 0.0), Err(HeadingRefusal::NotFinite));
    }
}
