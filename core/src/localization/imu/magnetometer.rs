//! Heading from the earth's magnetic field: a weak aid.
//!
//! The attitude turns the measured field into world axes; by how much its horizontal part misses magnetic north there,
//! the yaw is wrong. Iron on board and the surroundings turn the field by about 5 deg, most of it constant
//! or slow, so averaging does not help, and with line of sight the array knows yaw twenty times better: the aid speaks
//! only when there has been no line of sight for a while, and seldom (localization.md sections 3 and 6).

use nalgebra::Vector3;

use crate::geometry::{Body, Real, Rotation, World};

/// The earth's field where the UAV flies, and how far what is measured may be from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagneticField {
    /// Field in the world frame (east, north, up), uT.
    pub earth_ut: Vector3<f32>,
    /// Standard deviation of all disturbances, hard iron and surroundings, uT per axis.
    pub disturbance_ut: f32,
    /// Smallest standard deviation of a heading, rad: the error is a bias that the filter takes for noise.
    pub least_sigma_rad: f32,
    /// How long there must have been no line of sight, s.
    pub wait_s: f32,
    /// Time from one heading to the next, s.
    pub interval_s: f32,
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
            least_sigma_rad: 0.14,
            wait_s: 10.0,
            interval_s: 1.0,
        }
    }
}

/// A heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading {
    /// By how much the yaw of the attitude is too small, rad, in (-pi, pi].
    pub yaw_error_rad: f32,
    /// Standard deviation, rad.
    pub sigma_rad: f32,
}

/// Why there is no heading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HeadingRefusal {
    /// There is or was line of sight.
    LineOfSight,
    /// The last heading was given just now.
    TooSoon,
    /// Strength or inclination are not the earth's: iron is near.
    Disturbed,
    /// A number is not finite.
    NotFinite,
}

/// Gives headings when they help.
#[derive(Clone, Copy, Debug)]
pub struct MagneticAid {
    field: MagneticField,
    last_ns: Option<u64>,
}

impl MagneticAid {
    /// An aid that has given no heading.
    pub fn new(field: MagneticField) -> Self {
        Self { field, last_ns: None }
    }

    /// The heading by a measured field (uT, body axes) at `time_ns`. `tilt_sigma_rad` is the standard deviation of the
    /// attitude about a horizontal axis; `los_ns` when line of sight was last seen, if ever, ns.
    ///
    /// # Errors
    /// [`HeadingRefusal`]: why there is none.
    pub fn heading(
        &mut self,
        field_ut: &Vector3<f32>,
        attitude: &Rotation<Body, World>,
        tilt_sigma_rad: f32,
        time_ns: u64,
        los_ns: Option<u64>,
    ) -> Result<Heading, HeadingRefusal> {
        let since_s = |then: u64| time_ns.saturating_sub(then) as f32 * 1e-9;
        if los_ns.is_some_and(|then| since_s(then) < self.field.wait_s) {
            return Err(HeadingRefusal::LineOfSight);
        }
        if self
            .last_ns
            .is_some_and(|then| since_s(then) < self.field.interval_s)
        {
            return Err(HeadingRefusal::TooSoon);
        }
        let heading = self.field.heading(field_ut, attitude, tilt_sigma_rad)?;
        self.last_ns = Some(time_ns);
        Ok(heading)
    }
}

impl MagneticField {
    /// The heading by a measured field, whether it helps or not.
    ///
    /// # Errors
    /// [`HeadingRefusal::Disturbed`] when strength or vertical part differ from the earth's by more than four standard
    /// deviations; [`HeadingRefusal::NotFinite`].
    pub fn heading(
        &self,
        field_ut: &Vector3<f32>,
        attitude: &Rotation<Body, World>,
        tilt_sigma_rad: f32,
    ) -> Result<Heading, HeadingRefusal> {
        let seen = attitude.apply_vector(field_ut);
        let earth = &self.earth_ut;
        let level = |v: &Vector3<f32>| libm::sqrtf(v.x * v.x + v.y * v.y);
        let length = |v: &Vector3<f32>| libm::sqrtf(v.x * v.x + v.y * v.y + v.z * v.z);
        let (strength, horizontal) = (length(&seen), level(earth));
        if !(strength.is_finite() && tilt_sigma_rad.is_finite()) {
            return Err(HeadingRefusal::NotFinite);
        }
        // A tilt error swaps horizontal for vertical field.
        let slope_ut = tilt_sigma_rad * horizontal;
        let vertical_limit =
            4.0 * libm::sqrtf(self.disturbance_ut * self.disturbance_ut + slope_ut * slope_ut);
        let sound = (strength - length(earth)).abs() <= 4.0 * self.disturbance_ut
            && (seen.z - earth.z).abs() <= vertical_limit
            // Four standard deviations from no horizontal field at all: its direction means something.
            && level(&seen) > 4.0 * self.disturbance_ut;
        if !sound {
            return Err(HeadingRefusal::Disturbed);
        }
        let cross = seen.x * earth.y - seen.y * earth.x;
        let dot = seen.x * earth.x + seen.y * earth.y;
        let iron = self.disturbance_ut / horizontal;
        let tilt = tilt_sigma_rad * earth.z / horizontal;
        let sigma = libm::sqrtf(iron * iron + tilt * tilt);
        Ok(Heading {
            yaw_error_rad: cross.atan2_libm(dot),
            sigma_rad: sigma.max(self.least_sigma_rad),
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
                let heading = field().heading(&measured, &believed, 0.0).expect("clean field");
                assert!(
                    (heading.yaw_error_rad - error).abs() < 1e-5,
                    "{heading:?}, error {error}"
                );
                assert_eq!(heading.sigma_rad, 0.14);
            }
        }
    }

    #[test]
    fn the_sigma_grows_with_the_tilt_and_the_inclination() {
        let level = attitude(1.0, 0.0, 0.0);
        let measured = level.inverse().apply_vector(&field().earth_ut);
        let sigma = |tilt: f32| field().heading(&measured, &level, tilt).expect("clean").sigma_rad;
        // 1.7 uT over 20.3 uT, and tilt times tan 65 deg.
        assert!(
            (sigma(0.1) - libm::sqrtf(0.0838 * 0.0838 + 0.2145 * 0.2145)).abs() < 1e-3,
            "{}",
            sigma(0.1)
        );
    }

    #[test]
    fn iron_is_noticed() {
        let level = attitude(0.0, 0.0, 0.0);
        let heading = |x, y, z| field().heading(&(field().earth_ut + Vector3::new(x, y, z)), &level, 0.01);
        assert!(heading(2.0, -2.0, 2.0).is_ok());
        assert_eq!(heading(0.0, 0.0, 9.0), Err(HeadingRefusal::Disturbed));
        assert_eq!(heading(0.0, -16.0, 0.0), Err(HeadingRefusal::Disturbed));
        assert_eq!(heading(30.0, 0.0, 0.0), Err(HeadingRefusal::Disturbed));
        assert_eq!(heading(f32::NAN, 0.0, 0.0), Err(HeadingRefusal::NotFinite));
        assert_eq!(heading(0.0, f32::INFINITY, 0.0), Err(HeadingRefusal::NotFinite));
    }

    #[test]
    fn it_speaks_only_without_line_of_sight_and_once_a_second() {
        let level = attitude(0.0, 0.0, 0.0);
        let mut aid = MagneticAid::new(field());
        let s = 1_000_000_000;
        let mut at = |time_ns, los_ns| aid.heading(&field().earth_ut, &level, 0.01, time_ns, los_ns);
        assert_eq!(at(20 * s, Some(11 * s)), Err(HeadingRefusal::LineOfSight));
        assert!(at(21 * s, Some(11 * s)).is_ok());
        assert_eq!(at(21 * s + s / 2, Some(11 * s)), Err(HeadingRefusal::TooSoon));
        assert!(at(22 * s, Some(11 * s)).is_ok());
        assert_eq!(at(23 * s, Some(23 * s)), Err(HeadingRefusal::LineOfSight));
        assert!(at(24 * s, None).is_ok());
    }
}
