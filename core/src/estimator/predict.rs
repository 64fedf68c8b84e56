//! Prediction: history, horizon, and what happens when inertial data are missing.

use super::Filter;
use super::covariance::Transition;
use super::layout::{
    ACCEL_BIAS, ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, CLOCK_RAMP, FACE_BIAS, GYRO_BIAS, POSITION, VELOCITY,
};
use super::nominal::Nominal;
use super::scalar::Exchange;
use super::watch::Step;
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::Real;
use crate::inertial::{ImuIncrement, ImuStep, Motion};
use nalgebra::Vector3;

/// Gaps shorter than this are rounding of time stamps, ns.
/// Given: how time stamps are rounded.
const GAP_NS: u64 = 1_000_000;
/// A gap is bridged in steps of this length, ns.
/// Numerical: a step of an integration.
const GAP_STEP_NS: u64 = 50_000_000;
/// A gap longer than this many steps is bridged at once at the end: ten seconds.
/// Capacity: work of a prediction, ten seconds.
const MOST_GAP_STEPS: u32 = 200;
/// Inertial trouble is shown for this long, ns.
/// Given: how long a person needs to see it; nothing is reckoned with it.
const GAP_SHOWN_NS: u64 = 1_000_000_000;

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes in an inertial increment that was measured without trouble; see [`Filter::step`].
    pub fn increment(&mut self, increment: &ImuIncrement) {
        self.step(&ImuStep {
            increment: *increment,
            motion: Motion::Measured,
            angle_variance_rad2: 0.0,
            velocity_variance_m2_per_s2: 0.0,
        });
    }

    /// Takes in a step of the inertial unit; steps come in order, 10 to 20 ms long.
    ///
    /// When the history is full its oldest step moves the horizon on, so a measurement may come as late as the history is
    /// long.
    pub fn step(&mut self, step: &ImuStep) {
        let (start_ns, end_ns) = (step.increment.start_ns, step.increment.end_ns);
        if end_ns <= self.head.time_ns || end_ns <= start_ns {
            self.counters.too_late = self.counters.too_late.saturating_add(1);
            return;
        }
        if !is_finite(step) {
            return;
        }
        if self.history.is_full()
            && let Some(oldest) = self.history.front().map(|oldest| oldest.increment.end_ns)
        {
            self.advance_to(oldest);
        }
        carry(&mut self.head, step);
        let _ = self.history.push_back(*step);
    }

    /// Moves the horizon to `time_ns`, taking in whatever waits on the way.
    pub(super) fn advance_to(&mut self, time_ns: u64) {
        loop {
            let due = self
                .pending
                .front()
                .map(|exchange| exchange.time_ns)
                .filter(|&due| due <= time_ns);
            let from_m = self.nominal.position_m;
            self.inertial_to(due.unwrap_or(time_ns));
            self.moved_m += self.nominal.position_m - from_m;
            match due {
                Some(_) => {
                    if let Some(Exchange { time_ns, offset_m }) = self.pending.pop_front() {
                        self.take_two_way(time_ns, offset_m);
                    }
                }
                None => break,
            }
        }
    }

    /// Carries the horizon forward over the history: the present pose.
    pub(super) fn renew_head(&mut self) {
        let mut head = self.nominal;
        for step in &self.history {
            carry(&mut head, step);
        }
        self.head = head;
    }

    fn inertial_to(&mut self, time_ns: u64) {
        while self.nominal.time_ns < time_ns {
            let Some(front) = self.history.front().copied() else {
                break;
            };
            if front.increment.end_ns <= self.nominal.time_ns {
                let _ = self.history.pop_front();
                continue;
            }
            if front.increment.start_ns > self.nominal.time_ns + GAP_NS {
                self.gap_to(front.increment.start_ns.min(time_ns));
                continue;
            }
            let whole = match split(&front, self.nominal.time_ns) {
                Some((_, rest)) => rest,
                None => front,
            };
            if whole.increment.end_ns <= time_ns {
                let _ = self.history.pop_front();
                self.take_step(&whole);
            } else {
                let Some((first, rest)) = split(&whole, time_ns) else {
                    break;
                };
                if let Some(entry) = self.history.front_mut() {
                    *entry = rest;
                }
                self.take_step(&first);
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
    fn take_step(&mut self, step: &ImuStep) {
        let (accel, gyro) = (
            f64::from(step.velocity_variance_m2_per_s2),
            f64::from(step.angle_variance_rad2),
        );
        let end_ns = step.increment.end_ns;
        match step.motion {
            Motion::Measured => {
                // A part of the motion was guessed, as where an axis is at the end of its range: more than a second of the sensor's noise.
                let noise = self.config.process;
                let second = [noise.accel_m_per_s, noise.gyro_rad].map(|density| density * density);
                if accel > second[0] || gyro > second[1] {
                    self.inertial_trouble(end_ns);
                }
                self.measured(&step.increment, accel, gyro);
            }
            Motion::Coasting => self.coasted(end_ns, accel, gyro),
        }
    }

    /// Shows that inertial data up to this time are missing or doubtful.
    fn inertial_trouble(&mut self, until_ns: u64) {
        self.last_gap_ns = Some(until_ns);
        self.health.inertial_missing = true;
    }

    fn measured(&mut self, increment: &ImuIncrement, extra_accel: f64, extra_gyro: f64) {
        self.tell(Step::Stands);
        let before = self.nominal.attitude;
        let dt = increment.end_ns.saturating_sub(self.nominal.time_ns) as f64 * 1e-9;
        let (place, velocity) = (self.nominal.position_m, self.nominal.velocity_m_per_s);
        let (mut force, rate) = self.nominal.advance(increment);
        let noise = self.config.process;
        let mut unknown = 0.0;
        if self.health.attitude_lost {
            // A force of unknown direction does more harm than none: the velocity is kept, as without inertial data.
            self.nominal.position_m = place + velocity * dt;
            self.nominal.velocity_m_per_s = velocity;
            force = Vector3::zeros();
            unknown = noise.gap_accel_m_per_s * noise.gap_accel_m_per_s * dt;
        }
        self.window.advance(&increment.with_errors(&self.nominal.imu));
        let transition = Transition {
            dt_s: T::of(dt),
            force_m_per_s2: force.map(T::of),
            // Halfway: the biases turn with the body.
            attitude: ((before + self.nominal.attitude) * 0.5).map(T::of),
            rate_rad_per_s: rate.map(T::of),
        };
        self.covariance.propagate(&transition);
        self.tell(Step::Carried(&transition));
        // Scale and misalignment of the accelerometer for what differs from hovering, where they are a bias: a multirotor's force
        // stays along its own axis, whatever it does.
        let felt = increment.delta_velocity_m_per_s.map(f64::from) / dt.max(1e-6);
        let unlike = felt - Vector3::z() * STANDARD_GRAVITY_M_PER_S2;
        let scale = noise.accel_scale * unlike.norm();
        let accel = (noise.accel_m_per_s * noise.accel_m_per_s + scale * scale) * dt;
        let gyro = noise.gyro_rad * noise.gyro_rad * dt;
        self.add_noise(dt, accel + extra_accel + unknown, gyro + extra_gyro);
    }

    /// Nobody measured the motion: velocity and attitude are kept, and soon not known.
    #[inline(never)]
    fn coasted(&mut self, until_ns: u64, accel: f64, gyro: f64) {
        self.window.clear();
        self.rest_tilt = None;
        self.inertial_trouble(until_ns);
        let dt = until_ns.saturating_sub(self.nominal.time_ns) as f64 * 1e-9;
        self.tell(Step::Stands);
        self.nominal.coast(until_ns);
        let transition = Transition {
            dt_s: T::of(dt),
            force_m_per_s2: Vector3::new(T::zero(), T::zero(), T::zero()),
            attitude: self.nominal.attitude.map(T::of),
            rate_rad_per_s: Vector3::new(T::zero(), T::zero(), T::zero()),
        };
        self.covariance.propagate(&transition);
        self.tell(Step::Carried(&transition));
        self.add_noise(dt, accel, gyro);
    }

    /// Bridges missing steps.
    fn gap_to(&mut self, time_ns: u64) {
        let noise = self.config.process;
        let mut bridged = 0;
        while self.nominal.time_ns < time_ns && bridged < MOST_GAP_STEPS {
            bridged += 1;
            let start_ns = self.nominal.time_ns;
            let left = time_ns - start_ns;
            let step_ns = if bridged == MOST_GAP_STEPS {
                left
            } else {
                left.min(GAP_STEP_NS)
            };
            let dt = step_ns as f64 * 1e-9;
            let accel = noise.gap_accel_m_per_s * noise.gap_accel_m_per_s * dt;
            let gyro = noise.gap_gyro_rad * noise.gap_gyro_rad * dt;
            self.coasted(start_ns + step_ns, accel, gyro);
        }
    }

    fn add_noise(&mut self, dt: f64, accel: f64, gyro: f64) {
        let noise = self.config.process;
        let walk = |density: f64| density * density * dt;
        for i in 0..3 {
            self.covariance
                .add(POSITION + i, T::of(accel * dt * dt / 3.0 + walk(noise.beacon_m)));
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
        self.covariance
            .add(CLOCK_RAMP, T::of(walk(noise.clock_ramp_m_per_s2)));
        for i in 0..2 * super::layout::FACES {
            self.covariance.add(FACE_BIAS + i, T::of(walk(noise.face_bias)));
        }
        self.tell(Step::Spread);
        if let Some(gap) = self.last_gap_ns
            && self.nominal.time_ns.saturating_sub(gap) > GAP_SHOWN_NS
        {
            self.last_gap_ns = None;
            self.health.inertial_missing = false;
        }
    }

    /// Adds estimated errors to the state and the planes.
    #[inline(never)]
    pub(super) fn correct(&mut self, errors: &[T; N]) {
        let dx = errors.map(T::to_f64);
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
        self.tell(Step::Corrected(errors));
        if !(self.nominal.is_finite() && self.covariance.is_sound()) {
            self.counters.broken = self.counters.broken.saturating_add(1);
            self.restart();
        }
    }
}

fn is_finite(step: &ImuStep) -> bool {
    let increment = &step.increment;
    let sum = increment.delta_angle_rad + increment.delta_velocity_m_per_s + increment.delta_position_m;
    sum.iter().all(|c| c.is_finite())
        && (step.angle_variance_rad2 + step.velocity_variance_m2_per_s2).is_finite()
}

/// Moves a state on by a step.
fn carry(state: &mut Nominal, step: &ImuStep) {
    if step.increment.start_ns > state.time_ns + GAP_NS {
        state.coast(step.increment.start_ns);
    }
    match step.motion {
        Motion::Measured => {
            state.advance(&step.increment);
        }
        Motion::Coasting => state.coast(step.increment.end_ns),
    }
}

/// Cuts a step at `at_ns`; `None` when that is not strictly inside.
fn split(step: &ImuStep, at_ns: u64) -> Option<(ImuStep, ImuStep)> {
    let (first, second) = step.increment.split(at_ns)?;
    let share = first.dt_s() / step.increment.dt_s();
    let part = |increment: ImuIncrement, share: f32| ImuStep {
        increment,
        angle_variance_rad2: step.angle_variance_rad2 * share,
        velocity_variance_m2_per_s2: step.velocity_variance_m2_per_s2 * share,
        ..*step
    };
    Some((part(first, share), part(second, 1.0 - share)))
}
