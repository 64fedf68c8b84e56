//! Covariance of the state errors: prediction by two sparse passes, scalar updates.
//!
//! The matrix is stored whole and kept symmetric bit by bit. With `f32` its standard deviations stay within 2 % of a
//! double-precision filter over a flight, which `tests/` asserts; that is why flight code uses `f32` here.

use nalgebra::{Matrix3, Vector3};

use super::layout::{
    ACCEL_BIAS, ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, CLOCK_RAMP, GYRO_BIAS, GYRO_MATRIX, MOUNTING, VELOCITY,
};
use super::row::Row;
use crate::geometry::Real;

/// Motion over a step, as far as errors feel it.
#[derive(Clone, Copy, Debug)]
pub struct Transition<T: Real> {
    /// Length of the step, s.
    pub dt_s: T,
    /// Specific force in world axes, m/s^2.
    pub force_m_per_s2: Vector3<T>,
    /// Attitude R_wb.
    pub attitude: Matrix3<T>,
    /// Angular rate, body axes, rad/s.
    pub rate_rad_per_s: Vector3<T>,
}

impl<T: Real> Transition<T> {
    /// `F x dt` on the states that move, in the order of [`CHANGED`]; the others stay. F of docs/localization.md, "The model".
    fn change(&self, x: impl Fn(usize) -> T) -> [T; CHANGED.len()] {
        let at = |i: usize| Vector3::new(x(i), x(i + 1), x(i + 2));
        let dt = self.dt_s;
        let (velocity, angle) = (at(VELOCITY), at(ATTITUDE));
        let rate = &self.rate_rad_per_s;
        let mounting = at(MOUNTING);
        let gyro = at(GYRO_BIAS)
            + at(GYRO_MATRIX) * rate.x
            + at(GYRO_MATRIX + 3) * rate.y
            + at(GYRO_MATRIX + 6) * rate.z
            - mounting.cross(rate);
        let force = self.attitude * at(ACCEL_BIAS);
        let turn = self.attitude * gyro;
        // -[f]x th = th x f; a force is turned with the body, and with the sensor in it.
        let turned = angle + self.attitude * mounting;
        let gained = turned.cross(&self.force_m_per_s2) - force;
        let half = dt * T::of(0.5);
        let moved = velocity + gained * half;
        let ramp = x(CLOCK_RAMP);
        [
            moved.x,
            moved.y,
            moved.z,
            gained.x,
            gained.y,
            gained.z,
            -turn.x,
            -turn.y,
            -turn.z,
            x(CLOCK_DRIFT) + ramp * half,
            ramp,
        ]
        .map(|rate| rate * dt)
    }
}

#[cfg(feature = "watch")]
impl<T: Real> Transition<T> {
    /// The transition in double precision.
    #[must_use]
    pub fn to_f64(&self) -> Transition<f64> {
        Transition {
            dt_s: self.dt_s.to_f64(),
            force_m_per_s2: self.force_m_per_s2.map(T::to_f64),
            attitude: self.attitude.map(T::to_f64),
            rate_rad_per_s: self.rate_rad_per_s.map(T::to_f64),
        }
    }

    /// Carries the errors of all states over the motion: `x <- (I + F dt) x`. What is missing of `x` counts as zero.
    pub fn carry(&self, x: &mut [T]) {
        let change = self.change(|i| x.get(i).copied().unwrap_or(T::zero()));
        for (&i, change) in CHANGED.iter().zip(change) {
            if let Some(value) = x.get_mut(i) {
                *value += change;
            }
        }
    }
}

/// States that a motion changes.
/// Derived: position, velocity, attitude, the clock's offset and drift.
const CHANGED: [usize; 11] = [0, 1, 2, 3, 4, 5, 6, 7, 8, CLOCK_OFFSET, CLOCK_DRIFT];

/// Covariance of `N` state errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance<T: Real, const N: usize> {
    p: [[T; N]; N],
}

impl<T: Real, const N: usize> Covariance<T, N> {
    /// All states known exactly.
    pub fn zero() -> Self {
        const {
            assert!(
                N >= super::layout::PLANES && (N - super::layout::PLANES).is_multiple_of(3),
                "49 states and three a plane"
            );
        }
        Self {
            p: [[T::zero(); N]; N],
        }
    }

    /// Element (i, j); zero outside.
    pub fn at(&self, i: usize, j: usize) -> T {
        self.p
            .get(i)
            .and_then(|row| row.get(j))
            .copied()
            .unwrap_or(T::zero())
    }

    /// The 3 x 3 block that starts at (i, j).
    pub fn block(&self, i: usize, j: usize) -> Matrix3<T> {
        Matrix3::from_fn(|a, b| self.at(i + a, j + b))
    }

    /// Forgets all about a state but a new variance: its correlations vanish. Never inlined: forty states are set by it at the start.
    #[inline(never)]
    pub fn reset(&mut self, state: usize, variance: T) {
        for (i, row) in self.p.iter_mut().enumerate() {
            if i == state {
                *row = [T::zero(); N];
            }
            if let Some(value) = row.get_mut(state) {
                *value = if i == state { variance } else { T::zero() };
            }
        }
    }

    /// Forgets all about three neighbouring states but a new covariance.
    pub fn reset_block(&mut self, first: usize, covariance: &Matrix3<T>) {
        for a in 0..3 {
            self.reset(first + a, T::zero());
        }
        for (a, row) in self.p.iter_mut().skip(first).take(3).enumerate() {
            for (b, value) in row.iter_mut().skip(first).take(3).enumerate() {
                *value = covariance[(a, b)];
            }
        }
    }

    /// Sets the covariance of two states.
    pub fn correlate(&mut self, i: usize, j: usize, covariance: T) {
        for (a, b) in [(i, j), (j, i)] {
            if let Some(value) = self.p.get_mut(a).and_then(|row| row.get_mut(b)) {
                *value = covariance;
            }
        }
    }

    /// Forgets all about a state but that the sum of it and `other` was just measured with this variance.
    pub fn reset_to_sum(&mut self, state: usize, other: usize, variance: T) {
        let known = self.at(other, other);
        for k in 0..N {
            let shared = self.at(other, k);
            self.correlate(state, k, -shared);
        }
        self.correlate(state, state, variance + known);
    }

    /// Adds variance to a state (process noise).
    pub fn add(&mut self, state: usize, variance: T) {
        if let Some(value) = self.p.get_mut(state).and_then(|row| row.get_mut(state)) {
            *value += variance;
        }
    }

    /// Adds the covariance of one unknown: a standard deviation of it changes the state by `along`.
    #[inline(never)]
    pub fn spread(&mut self, along: &[T; N]) {
        for (row, a) in self.p.iter_mut().zip(along) {
            for (value, b) in row.iter_mut().zip(along) {
                *value += *a * *b;
            }
        }
    }

    /// Whether every variance is a positive finite number.
    pub fn is_sound(&self) -> bool {
        (0..N).all(|i| {
            let variance = self.at(i, i);
            variance.is_finite() && variance >= T::zero()
        })
    }

    /// `P <- (I + F dt) P (I + F dt)^T`: the columns first, then the rows, as far as they change.
    pub fn propagate(&mut self, transition: &Transition<T>) {
        for j in 0..N {
            let change = transition.change(|i| self.p[i][j]);
            for (&i, change) in CHANGED.iter().zip(change) {
                if let Some(value) = self.p.get_mut(i).and_then(|row| row.get_mut(j)) {
                    *value += change;
                }
            }
        }
        for &i in &CHANGED {
            let Some(row) = self.p.get_mut(i) else {
                continue;
            };
            let change = transition.change(|j| row[j]);
            for (&j, change) in CHANGED.iter().zip(change) {
                if let Some(value) = row.get_mut(j) {
                    *value += change;
                }
            }
        }
        for &i in &CHANGED {
            let Some(mut row) = self.p.get(i).copied() else {
                continue;
            };
            if let Some(variance) = row.get_mut(i) {
                *variance += rounding(*variance);
            }
            for (line, across) in self.p.iter_mut().zip(&row) {
                if let Some(value) = line.get_mut(i) {
                    *value = *across;
                }
            }
        }
    }

    /// `P H^T`.
    #[inline(never)]
    pub fn product(&self, row: &Row<T>) -> [T; N] {
        let mut sum = [T::zero(); N];
        for &(state, h) in row.entries() {
            if let Some(line) = self.p.get(usize::from(state)) {
                for (s, p) in sum.iter_mut().zip(line) {
                    *s += h * *p;
                }
            }
        }
        sum
    }

    /// Takes in one scalar measurement and gives the gain; `None`, and nothing changed, when the innovation variance is not positive.
    ///
    /// `P <- P - P H^T (H P H^T + R)^-1 H P`, half of it, as the result is symmetric. No variance is taken for finer than the
    /// arithmetic: so none ends below zero, whatever was known to hundreds of metres before and is to centimetres now.
    #[inline(never)]
    pub fn update(&mut self, row: &Row<T>) -> Option<[T; N]> {
        let s = self.product(row);
        let innovation = row.dot(&s) + row.update_variance();
        if !(innovation.is_finite() && innovation > T::zero()) {
            return None;
        }
        let inverse = T::one() / innovation;
        let gain = s.map(|value| value * inverse);
        for (i, (line, k)) in self.p.iter_mut().zip(&gain).enumerate() {
            let before = line.get(i).copied().unwrap_or(T::zero());
            for (p, along) in line.iter_mut().zip(&s).take(i + 1) {
                *p -= *k * *along;
            }
            if let Some(variance) = line.get_mut(i) {
                *variance += rounding(before);
            }
        }
        self.mirror();
        Some(gain)
    }

    /// Copies the lower half to the upper one.
    fn mirror(&mut self) {
        for i in 1..N {
            let (above, below) = self.p.split_at_mut(i);
            if let Some(line) = below.first() {
                for (row, value) in above.iter_mut().zip(line) {
                    row[i] = *value;
                }
            }
        }
    }
}

/// Rounding error of a variance that was computed from one of this size: a unit in its last place, and as much again for its covariances.
fn rounding<T: Real>(variance: T) -> T {
    T::default_epsilon() * T::of(2.0) * variance
}
