//! Prediction: history, horizon, and what happens when inertial data are missing.

use super::Filter;
use super::covariance::Transition;
use super::layout::{
    ACCEL_BIAS, ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, FACE_BIAS, GYRO_BIAS, POSITION, VELOCITY,
};
use super::scalar::Pending;
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::Real;
use crate::localization::ImuIncrement;
use nalgebra::Vector3;

/// Gaps shorter than this are rounding of time stamps, ns.
const GAP_NS: u64 = 1_000_000;
/// A gap is bridged in steps of this length, ns.
const GAP_STEP_NS: u64 = 50_000_000;
/// Inertial trouble is shown for this long, ns.
const GAP_SHOWN_NS: u64 = 1_000_000_000;

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes in an inertial increment; increments come in order. Steps of 10 to 20 ms suit the filter best.
    ///
    /// When the history is full its oldest increment moves the horizon on, so a measurement may come as late as the
    /// history is long.
    pub fn increment(&mut self, increment: &ImuIncrement) {
        if increment.end_ns <= self.head.time_ns || increment.end_ns <= increment.start_ns {
            self.counters.too_late = self.counters.too_late.saturating_add(1);
            return;
        }
        if !is_finite(increment) {
            return;
        }
        if self.history.is_full()
            && let Some(oldest) = self.history.front().map(|oldest| oldest.end_ns)
        {
            self.advance_to(oldest);
        }
        if increment.start_ns > self.head.time_ns + GAP_NS {
            self.head.coast(increment.start_ns);
        }
        self.head.advance(increment);
        let _ = self.history.push_back(*increment);
    }

    /// Moves the horizon to `time_ns`, taking in whatever waits on the way.
    pub(super) fn advance_to(&mut self, time_ns: u64) {
        loop {
            let due = self
                .pending
                .front()
                .map(Pending::time_ns)
                .filter(|&due| due <= time_ns);
            self.inertial_to(due.unwrap_or(time_ns));
            match due {
                Some(_) => {
                    if let Some(pending) = self.pending.pop_front() {
                        self.take(pending);
                    }
                }
                None => break,
            }
        }
    }

    /// Carries the horizon forward over the history: the present pose.
    pub(super) fn renew_head(&mut self) {
        let mut head = self.nominal;
        for increment in &self.history {
            if increment.start_ns > head.time_ns + GAP_NS {
                head.coast(increment.start_ns);
            }
            head.advance(increment);
        }
        self.head = head;
    }

    fn inertial_to(&mut self, time_ns: u64) {
        while self.nominal.time_ns < time_ns {
            let Some(front) = self.history.front().copied() else {
                break;
            };
            if front.end_ns <= self.nominal.time_ns {
                let _ = self.history.pop_front();
                continue;
            }
            if front.start_ns > self.nominal.time_ns + GAP_NS {
                self.gap_to(front.start_ns.min(time_ns));
                continue;
            }
            let whole = match front.split(self.nominal.time_ns) {
                Some((_, rest)) => rest,
                None => front,
            };
            if whole.end_ns <= time_ns {
                let _ = self.history.pop_front();
                self.step(&whole);
            } else {
                let Some((first, rest)) = whole.split(time_ns) else {
                    break;
                };
                if let Some(entry) = self.history.front_mut() {
                    *entry = rest;
                }
                self.step(&first);
            }
        }
        if self.nominal.time_ns < time_ns {
            if time_ns - self.nominal.time_ns > GAP_NS {
                self.gap_to(time_ns);
            } else {
                self.nominal.coast(time_ns);
            }
        }
    }

    /// One step of state and covariance.
    fn step(&mut self, increment: &ImuIncrement) {
        let before = self.nominal.attitude;
        let dt = increment.end_ns.saturating_sub(self.nominal.time_ns) as f64 * 1e-9;
        let (force, yaw_rate) = self.nominal.advance(increment);
        self.window.advance(&increment.with_errors(&self.nominal.imu));
        self.covariance.propagate(&Transition {
            dt_s: T::of(dt),
            force_m_per_s2: force.map(T::of),
            // Halfway: the biases turn with the body.
            attitude: ((before + self.nominal.attitude) * 0.5).map(T::of),
            yaw_rate_rad_per_s: T::of(yaw_rate),
        });
        let noise = self.config.process;
        let acceleration = force - Vector3::z() * STANDARD_GRAVITY_M_PER_S2;
        let rate = increment.delta_angle_rad.map(f64::from).norm() / dt.max(1e-6);
        let square = |a: f64, b: f64| (a * a + b * b) * dt;
        let accel = square(noise.accel_m_per_s, noise.accel_scale * acceleration.norm());
        let gyro = square(noise.gyro_rad, noise.gyro_scale * rate);
        self.add_noise(dt, accel, gyro);
    }

    /// Bridges missing inertial data: the velocity is kept, and soon not known.
    fn gap_to(&mut self, time_ns: u64) {
        let noise = self.config.process;
        self.window.clear();
        self.last_gap_ns = Some(time_ns);
        self.health.inertial_missing = true;
        let mut bridged = 0;
        while self.nominal.time_ns < time_ns && bridged < 200 {
            bridged += 1;
            let start_ns = self.nominal.time_ns;
            let left = time_ns - start_ns;
            let until = if bridged == 200 {
                time_ns
            } else {
                start_ns + left.min(GAP_STEP_NS)
            };
            let dt = (until - start_ns) as f64 * 1e-9;
            self.nominal.coast(until);
            self.covariance.propagate(&Transition {
                dt_s: T::of(dt),
                force_m_per_s2: Vector3::new(T::zero(), T::zero(), T::zero()),
                attitude: self.nominal.attitude.map(T::of),
                yaw_rate_rad_per_s: T::zero(),
            });
            let accel = noise.gap_accel_m_per_s * noise.gap_accel_m_per_s * dt;
            let gyro = noise.gap_gyro_rad * noise.gap_gyro_rad * dt;
            self.add_noise(dt, accel, gyro);
        }
    }

    fn add_noise(&mut self, dt: f64, accel: f64, gyro: f64) {
        let noise = self.config.process;
        let walk = |density: f64| density * density * dt;
        for i in 0..3 {
            self.covariance.add(POSITION + i, T::of(accel * dt * dt / 3.0));
            self.covariance.add(VELOCITY + i, T::of(accel));
            self.covariance.add(ATTITUDE + i, T::of(gyro));
            self.covariance
                .add(GYRO_BIAS + i, T::of(walk(noise.gyro_bias_rad_per_s)));
            self.covariance
                .add(ACCEL_BIAS + i, T::of(walk(noise.accel_bias_m_per_s2)));
        }
        self.covariance
            .add(CLOCK_OFFSET, T::of(walk(noise.clock_offset_m)));
        self.covariance
            .add(CLOCK_DRIFT, T::of(walk(noise.clock_drift_m_per_s)));
        for i in 0..2 * super::layout::FACES {
            self.covariance.add(FACE_BIAS + i, T::of(walk(noise.face_bias)));
        }
        if let Some(gap) = self.last_gap_ns
            && self.nominal.time_ns.saturating_sub(gap) > GAP_SHOWN_NS
        {
            self.last_gap_ns = None;
            self.health.inertial_missing = false;
        }
    }

    /// Adds estimated errors to the state and the planes.
    pub(super) fn correct(&mut self, dx: &[T; N]) {
        let dx = dx.map(T::to_f64);
        self.nominal.correct(&dx);
        for (k, slot) in self.slots.iter_mut().enumerate() {
            let first = super::layout::plane(k);
            let at = |i: usize| dx.get(first + i).copied().unwrap_or(0.0);
            let correction = [at(0), at(1), at(2)].map(|c| c as f32);
            let covariance = self.covariance.block(first, first).map(|c| c.to_f64() as f32);
            if let Some(plane) = slot.plane.plane.corrected(correction, covariance) {
                slot.plane.plane = plane;
            }
        }
        if !(self.nominal.is_finite() && self.covariance.is_sound()) {
            self.counters.broken = self.counters.broken.saturating_add(1);
            self.restart();
        }
    }
}

fn is_finite(increment: &ImuIncrement) -> bool {
    let sum = increment.delta_angle_rad + increment.delta_velocity_m_per_s + increment.delta_position_m;
    sum.iter().all(|c| c.is_finite())
}
