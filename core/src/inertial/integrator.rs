//! Pre-integration: the sum of samples over a step of the filter, with coning and sculling compensated.
//!
//! A gyroscope's sample is the integral of a rate, but rotations about changing axes do not add: the part that is lost is
//! half the integral of alpha x omega (coning), and for the specific force likewise (sculling). Between the ends of a
//! sample nothing is known of the motion, but the two samples before it tell its course, so that with `a_0` the angle
//! of this sample, `a_1` and `a_2` those before it, and `v_0..2` the velocity likewise,
//!
//! `rotation = a_0 + c x a_0`, `push = v_0 + a_0 x (v_0 / 2 + a_0 x v_0 / 6) + c x v_0 + d x a_0`,
//! `c = 7/60 a_1 - 1/60 a_2`, `d = 7/60 v_1 - 1/60 v_2`.
//!
//! The two coefficients follow from a coning motion of frequency f sampled every h: with x = 2 pi f h, the true
//! coning of a sample is proportional to (x - sin x) / 2 and that of samples k apart to 4 sin^2(x/2) sin(k x); equating
//! the powers x^3 and x^5 gives them. What is left of the drift falls with x^7: for 1 kHz samples, coning at 50 Hz
//! leaves 1/2430 of it, at 100 Hz 1/159 (the sample before alone: 1/51 and 1/13). Every sample is turned into the axes at the start of the step exactly, so
//! the step may be long.

use nalgebra::Vector3;

use super::Turn;
use crate::geometry::Real;

/// Weight of the sample before in coning and sculling.
/// Given: mathematics (docs/localization.md, "The inertial sensor").
const ONE_BEFORE: f64 = 7.0 / 60.0;
/// Weight of the sample before that.
/// Given: mathematics (docs/localization.md, "The inertial sensor").
const TWO_BEFORE: f64 = -1.0 / 60.0;

/// Angle and velocity of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample<T: Real> {
    angle: Vector3<T>,
    velocity: Vector3<T>,
}

impl<T: Real> Sample<T> {
    fn zero() -> Self {
        Self {
            angle: Vector3::zeros(),
            velocity: Vector3::zeros(),
        }
    }
}

/// The sum of samples since the start of a step, in the body axes at that start. The type of the numbers is `f32` in
/// flight: increments are small, so the rounding is too (see the tests against `f64`).
#[derive(Clone, Debug, PartialEq)]
pub struct Integrator<T: Real = f32> {
    rotation: Turn<T>,
    velocity_m_per_s: Vector3<T>,
    position_m: Vector3<T>,
    before: [Sample<T>; 2],
}

impl<T: Real> Default for Integrator<T> {
    fn default() -> Self {
        Self {
            rotation: Turn::identity(),
            velocity_m_per_s: Vector3::zeros(),
            position_m: Vector3::zeros(),
            before: [Sample::zero(); 2],
        }
    }
}

impl<T: Real> Integrator<T> {
    /// Adds a sample: mean angular rate (rad/s) and mean specific force (m/s^2) over `dt_s`, body axes, errors taken out.
    pub fn add(&mut self, rate_rad_per_s: &Vector3<T>, force_m_per_s2: &Vector3<T>, dt_s: T) {
        let (angle, velocity) = (rate_rad_per_s * dt_s, force_m_per_s2 * dt_s);
        let [one, two] = &self.before;
        let (near, far) = (T::of(ONE_BEFORE), T::of(TWO_BEFORE));
        let course = one.angle * near + two.angle * far;
        let pull = one.velocity * near + two.velocity * far;

        let mean = velocity * T::of(0.5) + angle.cross(&velocity) * T::of(1.0 / 6.0);
        let sculling = course.cross(&velocity) + pull.cross(&angle);
        let push = velocity + angle.cross(&mean) + sculling;
        self.position_m += (self.velocity_m_per_s + self.rotation.apply(&mean)) * dt_s;
        self.velocity_m_per_s += self.rotation.apply(&push);
        let rotation = angle + course.cross(&angle);
        self.rotation = self.rotation.then(&Turn::from_rotation_vector(&rotation));
        self.before = [Sample { angle, velocity }, *one];
    }

    /// Rotation since the start as a rotation vector, rad.
    pub fn angle_rad(&self) -> Vector3<T> {
        self.rotation.rotation_vector()
    }

    /// Integral of the specific force, m/s.
    pub fn velocity_m_per_s(&self) -> Vector3<T> {
        self.velocity_m_per_s
    }

    /// Integral of that integral, m.
    pub fn position_m(&self) -> Vector3<T> {
        self.position_m
    }

    /// Starts the next step where this one ends. The course of the motion is kept for the compensation.
    pub fn restart(&mut self) {
        *self = Self {
            before: self.before,
            ..Self::default()
        };
    }

    /// Forgets the course of the motion: after a gap it says nothing about the next sample.
    pub fn forget_course(&mut self) {
        self.before = [Sample::zero(); 2];
    }
}
