//! Inertial samples, and their integral over a step of the filter.
//!
//! A receiver samples rate and force a thousand times per second; the filter steps at 50 to 100 Hz. Between them stands
//! the increment: rotation, velocity and position gained over a step, in the body axes at its start, so that it is
//! independent of where the UAV is and may wait until a late measurement has corrected the pose before it.

use nalgebra::{Matrix3, Vector3};

/// Nanoseconds in a second.
/// Given: a unit.
const NS: f32 = 1e-9;

/// One sample of the inertial sensor: means over the interval that ends at its time stamp, body axes (FLU).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// UAV clock at the end of the interval, ns.
    pub time_ns: u64,
    /// Angular rate against the inertial frame, rad/s.
    pub rate_rad_per_s: Vector3<f32>,
    /// Specific force (acceleration less gravity; +g along z at rest), m/s^2.
    pub specific_force_m_per_s2: Vector3<f32>,
}

/// Systematic errors of the inertial sensor, as the filter estimates them (docs/localization.md, "The model").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuErrors {
    /// Bias of the gyroscope, rad/s.
    pub gyro_bias_rad_per_s: Vector3<f32>,
    /// Bias of the accelerometer, m/s^2.
    pub accel_bias_m_per_s2: Vector3<f32>,
    /// Scale and misalignment of the gyroscope: its reading per unit of true rate less the identity.
    pub gyro_matrix: Matrix3<f32>,
    /// How the sensor is turned against the body, whose axes are those of the arrays: the rotation vector that takes its axes into the
    /// body's, rad. Biases and matrix are in its own axes.
    pub mounting_rad: Vector3<f32>,
}

impl Default for ImuErrors {
    /// None.
    fn default() -> Self {
        Self {
            gyro_bias_rad_per_s: Vector3::zeros(),
            accel_bias_m_per_s2: Vector3::zeros(),
            gyro_matrix: Matrix3::zeros(),
            mounting_rad: Vector3::zeros(),
        }
    }
}

impl ImuErrors {
    /// Angular rate of a sample without the errors, body axes: `w = exp[m]x (I - M) (wm - bg)`, rad/s.
    pub fn rate_rad_per_s(&self, sample: &ImuSample) -> Vector3<f32> {
        let rate = sample.rate_rad_per_s - self.gyro_bias_rad_per_s;
        turned(&self.mounting_rad, &(rate - self.gyro_matrix * rate))
    }

    /// Specific force of a sample without the errors, body axes, m/s^2.
    pub fn specific_force_m_per_s2(&self, sample: &ImuSample) -> Vector3<f32> {
        turned(
            &self.mounting_rad,
            &(sample.specific_force_m_per_s2 - self.accel_bias_m_per_s2),
        )
    }
}

/// Motion over a step, in the body axes at its start. Gravity is not in it: the receiver of the increment adds it.
///
/// With position p, velocity v and attitude R at the start and gravity g,
/// `p += v dt + R delta_position + g dt^2 / 2`, `v += R delta_velocity + g dt`, `R = R exp(delta_angle)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuIncrement {
    /// UAV clock at the start, ns.
    pub start_ns: u64,
    /// UAV clock at the end, ns; after the start.
    pub end_ns: u64,
    /// Rotation vector from the body axes at the start to those at the end, rad.
    pub delta_angle_rad: Vector3<f32>,
    /// Integral of the specific force, m/s.
    pub delta_velocity_m_per_s: Vector3<f32>,
    /// Integral of that integral, m.
    pub delta_position_m: Vector3<f32>,
    /// The errors that were taken out of the samples. An estimate that is newer than these is applied to first order.
    pub removed: ImuErrors,
}

impl ImuIncrement {
    /// Duration, s. Zero for an increment whose end is not after its start.
    pub fn dt_s(&self) -> f32 {
        self.end_ns.saturating_sub(self.start_ns) as f32 * NS
    }

    /// The same motion with other sensor errors taken out, to first order in their difference.
    pub fn with_errors(&self, errors: &ImuErrors) -> Self {
        let dt = self.dt_s();
        let rate_bias = errors.gyro_bias_rad_per_s - self.removed.gyro_bias_rad_per_s;
        let matrix = errors.gyro_matrix - self.removed.gyro_matrix;
        let force = errors.accel_bias_m_per_s2 - self.removed.accel_bias_m_per_s2;
        let biased = rate_bias * dt;
        let turn = -(biased + matrix * (self.delta_angle_rad - biased));
        // A turn error that grows evenly over the step rotates the force by half of it on average.
        let (half, third) = (turn * 0.5, turn * (1.0 / 3.0));
        let velocity = self.delta_velocity_m_per_s - force * dt + half.cross(&self.delta_velocity_m_per_s);
        let position = self.delta_position_m - force * (0.5 * dt * dt) + third.cross(&self.delta_position_m);
        // A sensor that is turned in the body has the whole step turned.
        let mounting = errors.mounting_rad - self.removed.mounting_rad;
        Self {
            delta_angle_rad: turned(&mounting, &(self.delta_angle_rad + turn)),
            delta_velocity_m_per_s: turned(&mounting, &velocity),
            delta_position_m: turned(&mounting, &position),
            removed: *errors,
            ..*self
        }
    }

    /// Cuts the increment at `at_ns`: what happened before, and after. The rate and the force count as constant in body
    /// axes; the two parts joined give the whole again.
    ///
    /// `None` when the cut is not strictly inside.
    pub fn split(&self, at_ns: u64) -> Option<(Self, Self)> {
        if at_ns <= self.start_ns || at_ns >= self.end_ns {
            return None;
        }
        let (dt, before) = (self.dt_s(), (at_ns - self.start_ns) as f32 * NS);
        let share = before / dt;
        let angle = self.delta_angle_rad;
        // dv(t) = f t + w x f t^2 / 2 for a constant force f and rate w.
        let force_dt = self.delta_velocity_m_per_s - angle.cross(&self.delta_velocity_m_per_s) * 0.5;
        let curl = angle.cross(&force_dt) * (0.5 * share * share);
        let first = Self {
            end_ns: at_ns,
            delta_angle_rad: angle * share,
            delta_velocity_m_per_s: force_dt * share + curl,
            delta_position_m: (force_dt * (0.5 * share) + curl * (1.0 / 3.0)) * before,
            ..*self
        };
        let rest = dt - before;
        let back = -first.delta_angle_rad;
        let second = Self {
            start_ns: at_ns,
            delta_angle_rad: angle - first.delta_angle_rad,
            delta_velocity_m_per_s: turned(
                &back,
                &(self.delta_velocity_m_per_s - first.delta_velocity_m_per_s),
            ),
            delta_position_m: turned(
                &back,
                &(self.delta_position_m - first.delta_position_m - first.delta_velocity_m_per_s * rest),
            ),
            ..*self
        };
        Some((first, second))
    }
}

/// A vector turned by a small rotation vector, to second order: exact to 1e-7 up to 0.01 rad.
fn turned(angle_rad: &Vector3<f32>, v: &Vector3<f32>) -> Vector3<f32> {
    let once = angle_rad.cross(v);
    v + once + angle_rad.cross(&once) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    const STEP_NS: u64 = 10_000_000;

    /// Ten milliseconds of a brisk turn under a constant body rate and force, integrated finely.
    fn integrated(steps: u64, errors: &ImuErrors) -> ImuIncrement {
        let rate = Vector3::new(0.9, -0.5, 1.2f64);
        let force = Vector3::new(2.0, -1.0, 11.0f64);
        let biased = rate - errors.gyro_bias_rad_per_s.map(f64::from);
        let mounting = Rotation3::new(errors.mounting_rad.map(f64::from));
        let rate = mounting * (biased - errors.gyro_matrix.map(f64::from) * biased);
        let force = mounting * (force - errors.accel_bias_m_per_s2.map(f64::from));
        let fine = 20_000;
        let dt = STEP_NS as f64 * 1e-9 * steps as f64 / 2.0 / f64::from(fine);
        let (mut v, mut p) = (Vector3::zeros(), Vector3::zeros());
        for k in 0..fine {
            let middle = Rotation3::new(rate * ((f64::from(k) + 0.5) * dt)) * force;
            p += v * dt + middle * (0.5 * dt * dt);
            v += middle * dt;
        }
        ImuIncrement {
            start_ns: 5,
            end_ns: 5 + STEP_NS * steps / 2,
            delta_angle_rad: (rate * dt * f64::from(fine)).map(|c| c as f32),
            delta_velocity_m_per_s: v.map(|c| c as f32),
            delta_position_m: p.map(|c| c as f32),
            removed: *errors,
        }
    }

    #[test]
    fn a_cut_gives_the_halves_that_a_finer_step_would_have_given() {
        let whole = integrated(2, &ImuErrors::default());
        let half = integrated(1, &ImuErrors::default());
        let (first, second) = whole.split(5 + STEP_NS / 2).expect("inside");
        for part in [first, second] {
            assert!((part.delta_angle_rad - half.delta_angle_rad).norm() < 1e-8);
            assert!((part.delta_velocity_m_per_s - half.delta_velocity_m_per_s).norm() < 2e-6);
            assert!((part.delta_position_m - half.delta_position_m).norm() < 1e-8);
        }
        assert_eq!(
            (first.end_ns, second.start_ns),
            (5 + STEP_NS / 2, 5 + STEP_NS / 2)
        );
        assert!(whole.split(5).is_none() && whole.split(5 + STEP_NS).is_none() && whole.split(1).is_none());
    }

    #[test]
    fn newer_errors_are_applied_to_first_order() {
        let errors = ImuErrors {
            gyro_bias_rad_per_s: Vector3::new(0.01, -0.02, 0.015),
            accel_bias_m_per_s2: Vector3::new(0.2, 0.1, -0.3),
            gyro_matrix: Matrix3::new(0.002, 0.001, 0.003, -0.003, 0.004, -0.002, 0.001, 0.002, 0.004),
            mounting_rad: Vector3::new(0.008, -0.009, 0.007),
        };
        let (plain, exact) = (integrated(2, &ImuErrors::default()), integrated(2, &errors));
        let corrected = plain.with_errors(&errors);
        let change = (plain.delta_velocity_m_per_s - exact.delta_velocity_m_per_s).norm();
        assert!(change > 3e-3);
        assert!((corrected.delta_angle_rad - exact.delta_angle_rad).norm() < 1e-6);
        // The force error is not turned with the body: second order, a hundredth of the change.
        assert!((corrected.delta_velocity_m_per_s - exact.delta_velocity_m_per_s).norm() < 0.02 * change);
        assert!((corrected.delta_position_m - exact.delta_position_m).norm() < 2e-7);
        assert_eq!(corrected.removed, errors);
    }

    #[test]
    fn errors_are_taken_out_of_a_sample() {
        let errors = ImuErrors {
            gyro_bias_rad_per_s: Vector3::new(0.1, 0.2, 0.3),
            accel_bias_m_per_s2: Vector3::new(1.0, 2.0, 3.0),
            gyro_matrix: Matrix3::new(0.01, 0.0, 0.01, 0.0, 0.02, 0.02, 0.0, 0.0, 0.03),
            // A turn to the left about z: what the sensor has ahead lies to the left in the body.
            mounting_rad: Vector3::new(0.0, 0.0, 0.01),
        };
        let sample = ImuSample {
            time_ns: 0,
            rate_rad_per_s: Vector3::new(1.1, 1.2, 2.3),
            specific_force_m_per_s2: Vector3::new(1.0, 2.0, 12.0),
        };
        let turn = Rotation3::new(errors.mounting_rad);
        let rate = turn * Vector3::new(0.97, 0.94, 1.94);
        assert!((errors.rate_rad_per_s(&sample) - rate).norm() < 1e-6 && rate.y > 0.949);
        let force = turn * Vector3::new(0.0, 0.0, 9.0);
        assert!((errors.specific_force_m_per_s2(&sample) - force).norm() < 1e-6);
    }
}
