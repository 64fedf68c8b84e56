//! Where the inertial sensor is and how it is turned, against what the receiver takes for granted.
//!
//! The receiver knows arm and axes from the drawing of the board and brings them in, or takes them for zero and the body's. What counts is
//! the remainder, which it knows nothing of: the sensor stands `arm` from where the receiver believes it, and feels
//! f + omega' x arm + omega x (omega x arm).

use core::f64::consts::PI;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::flight::Motion;
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Errors of what is known about the mounting; zeros for none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MountingConfig {
    /// Standard deviation of the arm from the centre of the arrays that nobody compensates, m per body axis.
    pub lever_arm_m: f64,
    /// Standard deviation of the rotation that nobody compensates, deg about each body axis.
    pub rotation_deg: f64,
}

impl MountingConfig {
    /// A board that was measured with a ruler.
    pub fn real() -> Self {
        Self {
            lever_arm_m: 0.005,
            rotation_deg: 0.5,
        }
    }

    /// Whether there are none.
    pub(super) fn is_off(&self) -> bool {
        *self == Self::default()
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        super::not_negative(&[
            ("imu.mounting.lever_arm_m", self.lever_arm_m),
            ("imu.mounting.rotation_deg", self.rotation_deg),
        ])
    }
}

/// The mounting of one sensor.
#[derive(Clone, Debug)]
pub(super) struct Mounting {
    arm_m: Vector3<f64>,
    /// Turns body vectors into the sensor's.
    to_sensor: Matrix3<f64>,
}

impl Mounting {
    /// The mounting of the world of `seed`.
    pub(super) fn new(config: &MountingConfig, seed: u64) -> Self {
        let mut random = Seeded::new(seed, Source::ImuMounting);
        let arm_m = random.normal_vector() * config.lever_arm_m;
        let half = random.normal_vector() * (0.5 * config.rotation_deg * PI / 180.0);
        // By the tangent of half the angle: exact as a rotation, and for small angles the rotation vector itself.
        let turn = UnitQuaternion::new_normalize(Quaternion::from_parts(1.0, half));
        Self {
            arm_m,
            to_sensor: turn.to_rotation_matrix().into_inner().transpose(),
        }
    }

    /// Specific force where the sensor stands, body axes, m/s^2.
    pub(super) fn force_m_per_s2(&self, motion: &Motion) -> Vector3<f64> {
        let rate = &motion.rate_rad_per_s;
        motion.specific_force_m_per_s2
            + motion.angular_acceleration_rad_per_s2.cross(&self.arm_m)
            + rate.cross(&rate.cross(&self.arm_m))
    }

    /// A vector in the sensor's axes.
    pub(super) fn to_sensor(&self, body: &Vector3<f64>) -> Vector3<f64> {
        self.to_sensor * body
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;

    fn motion(rate: Vector3<f64>, angular_acceleration: Vector3<f64>) -> Motion {
        Motion {
            position_m: Vector3::zeros(),
            velocity_m_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
            attitude: Rotation3::identity(),
            rate_rad_per_s: rate,
            angular_acceleration_rad_per_s2: angular_acceleration,
            specific_force_m_per_s2: Vector3::new(0.0, 0.0, 9.8),
        }
    }

    #[test]
    fn on_a_turntable_the_arm_feels_the_centrifugal_and_the_tangential_force() {
        let arm_m = Vector3::new(-0.06, 0.02, -0.03);
        let mounting = Mounting {
            arm_m,
            to_sensor: Matrix3::identity(),
        };
        // Turning about z at 3 rad/s and faster by 5 rad/s every second: -9 r towards the axis, 5 r along.
        let force = mounting.force_m_per_s2(&motion(Vector3::z() * 3.0, Vector3::z() * 5.0));
        let expected = Vector3::new(0.54 - 0.1, -0.18 - 0.3, 9.8);
        assert!((force - expected).norm() < 1e-14, "{force}");
    }

    #[test]
    fn the_errors_have_their_size_and_zero_is_none() {
        let (mut arm, mut turn) = (0.0, 0.0);
        for seed in 0..400 {
            let mounting = Mounting::new(&MountingConfig::real(), seed);
            arm += mounting.arm_m.norm_squared() / 1200.0;
            let skew = (mounting.to_sensor - mounting.to_sensor.transpose()) * 0.5;
            let vector = Vector3::new(skew.m32, skew.m13, skew.m21);
            turn += vector.norm_squared() / 1200.0;
            let unit = mounting.to_sensor * mounting.to_sensor.transpose() - Matrix3::identity();
            assert!(unit.norm() < 1e-14);
        }
        assert!((arm.sqrt() / 0.005 - 1.0).abs() < 0.06, "{}", arm.sqrt());
        let deg = turn.sqrt() * 180.0 / PI;
        assert!((deg / 0.5 - 1.0).abs() < 0.06, "{deg}");
        let none = Mounting::new(&MountingConfig::default(), 1);
        let turning = motion(Vector3::new(1.0, 2.0, 3.0), Vector3::new(4.0, 5.0, 6.0));
        assert_eq!(none.force_m_per_s2(&turning), turning.specific_force_m_per_s2);
        assert_eq!(none.to_sensor, Matrix3::identity());
    }
}
