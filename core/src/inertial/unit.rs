//! The inertial unit as the filter sees it: samples in, increments out, whatever happens to the sensor.

use nalgebra::Vector3;

use super::health::{Fault, Flags};
use super::monitor::{Judged, Monitor};
use super::step::{ImuStep, Motion};
use super::timeline::{Stamp, Timeline};
use super::{ImuConfig, ImuCounters, ImuHealth, Integrator};
use crate::inertial::{ImuErrors, ImuIncrement, ImuSample};

/// Nanoseconds in seconds.
/// Given: a unit.
const NS: f32 = 1e-9;
/// Growth of the attitude variance per axis while nobody measures the rotation, rad^2/s.
/// Given: a quadrotor that may turn by half a radian in the first second.
const UNKNOWN_ANGLE_RAD2_PER_S: f32 = 0.25;
/// Growth of the velocity variance per axis while nobody measures the force, (m/s)^2/s.
/// Given: 2 m/s in the first second.
const UNKNOWN_VELOCITY_M2_PER_S3: f32 = 4.0;
/// Standard deviation of the angular acceleration within a bridged gap, rad/s^2.
/// Given: what a quadrotor can do.
const GAP_ANGULAR_ACCELERATION: f32 = 10.0;
/// Standard deviation of the change of force over time within a bridged gap, m/s^3.
/// Given: what a quadrotor can do.
const GAP_JERK_M_PER_S3: f32 = 50.0;

/// The increment in the making.
#[derive(Clone, Debug, PartialEq)]
struct Pending {
    start_ns: u64,
    end_ns: u64,
    motion: Motion,
    sum: Integrator,
    angle_variance: f32,
    velocity_variance: f32,
}

/// Time stamps, health monitor and pre-integration of one inertial sensor.
#[derive(Clone, Debug)]
pub struct Imu {
    config: ImuConfig,
    /// Taken out of the samples of the current step.
    errors: ImuErrors,
    /// Taken out from the next step on.
    newer_errors: ImuErrors,
    timeline: Timeline,
    monitor: Monitor,
    pending: Option<Pending>,
    /// Last rate and force that were integrated, to bridge gaps.
    last: Option<(Vector3<f32>, Vector3<f32>)>,
    /// The sensor has stopped and nothing has come since.
    silent: bool,
    flags: Flags,
    counters: ImuCounters,
}

impl Imu {
    /// A unit that has seen no sample.
    pub fn new(config: ImuConfig) -> Self {
        Self {
            config,
            errors: ImuErrors::default(),
            newer_errors: ImuErrors::default(),
            timeline: Timeline::default(),
            monitor: Monitor::default(),
            pending: None,
            last: None,
            silent: false,
            flags: Flags::default(),
            counters: ImuCounters::default(),
        }
    }

    /// Systematic errors to take out of the samples from the next step on.
    pub fn set_errors(&mut self, errors: ImuErrors) {
        self.newer_errors = errors;
        if self.pending.as_ref().is_none_or(|p| p.start_ns == p.end_ns) {
            self.errors = errors;
        }
    }

    /// Takes a sample; a step comes back when one is complete.
    pub fn push(&mut self, sample: &ImuSample) -> Option<ImuStep> {
        let finite = |v: &Vector3<f32>| v.x.is_finite() && v.y.is_finite() && v.z.is_finite();
        if !finite(&sample.rate_rad_per_s) || !finite(&sample.specific_force_m_per_s2) {
            // Its time is bridged like that of a sample that never came.
            self.counters.invalid = self.counters.invalid.saturating_add(1);
            return None;
        }
        let now_ns = sample.time_ns;
        match self.timeline.accept(now_ns, &self.config, &mut self.counters) {
            Stamp::Refused => None,
            Stamp::First => {
                self.begin(now_ns);
                self.judge(sample);
                None
            }
            Stamp::Restarted => {
                self.counters.restarts = self.counters.restarts.saturating_add(1);
                self.silent = false;
                self.forget();
                self.begin(now_ns);
                self.judge(sample);
                None
            }
            Stamp::AfterStop { interval_ns } => self.resume(sample, interval_ns),
            Stamp::Next { interval_ns, .. } if self.silent => self.resume(sample, u64::from(interval_ns)),
            Stamp::Next { interval_ns, missing } => {
                let judged = self.judge(sample);
                if judged.stuck || judged.broken {
                    self.disregard(&judged, now_ns, interval_ns)
                } else {
                    self.integrate(&judged, now_ns, interval_ns, missing)
                }
            }
        }
    }

    /// Tells the time, ns of the UAV clock, so that a silent sensor is noticed: to be called at least every
    /// [`ImuConfig::gap_ns`] by whatever else has a clock. Call it until it gives nothing more.
    pub fn elapse(&mut self, now_ns: u64) -> Option<ImuStep> {
        let silence_ns = self.timeline.silence_ns(now_ns);
        // Silence is news after a gap; from then on a step at a time is coasted.
        let patience_ns = if self.silent {
            self.config.step_ns
        } else {
            self.config.gap_ns
        };
        if silence_ns <= u64::from(patience_ns) {
            return None;
        }
        let missing = silence_ns / u64::from(self.config.period_ns.max(1));
        let missing = u32::try_from(missing).unwrap_or(u32::MAX);
        self.counters.missing = self.counters.missing.saturating_add(missing);
        self.stop(now_ns);
        self.timeline.coasted_to(now_ns);
        self.coast(now_ns, silence_ns)
    }

    /// Ends the step at `time_ns`, for a measurement of that time. Samples that are missing just before it are bridged as those between
    /// samples are, by the last one, up to [`ImuConfig::gap_ns`]: a lost sample is no reason to call the motion unknown.
    pub fn finish_step_at(&mut self, time_ns: u64) -> Option<ImuStep> {
        let silence_ns = self.timeline.silence_ns(time_ns);
        if let (Some((rate, force)), Ok(gap_ns)) = (self.last, u32::try_from(silence_ns))
            && !self.silent
            && gap_ns > self.config.period_ns
            && gap_ns <= self.config.gap_ns
            && let Some(pending) = self
                .pending
                .as_mut()
                .filter(|pending| pending.motion == Motion::Measured)
        {
            pending.sum.forget_course();
            pending.sum.add(&rate, &force, gap_ns as f32 * NS);
            pending.sum.forget_course();
            pending.end_ns = time_ns;
            self.timeline.coasted_to(time_ns);
            self.counters.missing = self
                .counters
                .missing
                .saturating_add(gap_ns / self.config.period_ns.max(1));
            self.doubt(gap_ns);
        }
        self.finish_step()
    }

    /// Ends the step early; nothing when it is empty.
    pub fn finish_step(&mut self) -> Option<ImuStep> {
        let pending = self.pending.as_mut()?;
        if pending.start_ns == pending.end_ns {
            return None;
        }
        let step = ImuStep {
            increment: ImuIncrement {
                start_ns: pending.start_ns,
                end_ns: pending.end_ns,
                delta_angle_rad: pending.sum.angle_rad(),
                delta_velocity_m_per_s: pending.sum.velocity_m_per_s(),
                delta_position_m: pending.sum.position_m(),
                removed: self.errors,
            },
            motion: pending.motion,
            angle_variance_rad2: pending.angle_variance,
            velocity_variance_m2_per_s2: pending.velocity_variance,
        };
        pending.start_ns = pending.end_ns;
        pending.angle_variance = 0.0;
        pending.velocity_variance = 0.0;
        pending.sum.restart();
        self.errors = self.newer_errors;
        Some(step)
    }

    /// Time up to which samples (or coasting) have been taken, ns; `None` before the first sample.
    pub fn newest_ns(&self) -> Option<u64> {
        self.timeline.newest_ns()
    }

    /// Faults seen lately, by the UAV clock at `now_ns`.
    pub fn health(&self, now_ns: u64) -> ImuHealth {
        let mut health = self.flags.at(now_ns, &self.config);
        health.stopped |= self.timeline.silence_ns(now_ns) > u64::from(self.config.gap_ns);
        health
    }

    /// How fast the body turns by the newest sample, rad/s in its own axes; zero before the first.
    pub fn turn_rad_per_s(&self) -> Vector3<f32> {
        self.last.map_or_else(Vector3::zeros, |(turn, _)| turn)
    }

    /// What became of all samples.
    pub fn counters(&self) -> &ImuCounters {
        &self.counters
    }

    /// The first sample ends an interval of unknown beginning: it only says when integration begins.
    fn begin(&mut self, now_ns: u64) {
        self.errors = self.newer_errors;
        self.pending = Some(Pending {
            start_ns: now_ns,
            end_ns: now_ns,
            motion: Motion::Measured,
            sum: Integrator::default(),
            angle_variance: 0.0,
            velocity_variance: 0.0,
        });
    }

    /// After a gap the past says nothing about the next sample.
    fn forget(&mut self) {
        self.monitor.forget();
        self.last = None;
        if let Some(pending) = &mut self.pending {
            pending.sum.forget_course();
        }
    }

    /// The sensor is silent.
    fn stop(&mut self, now_ns: u64) {
        if !self.silent {
            self.counters.stops = self.counters.stops.saturating_add(1);
        }
        self.silent = true;
        self.flags.raise(Fault::Stopped, now_ns);
        self.forget();
    }

    /// The first sample after a silence: up to it nothing is known of the motion.
    fn resume(&mut self, sample: &ImuSample, interval_ns: u64) -> Option<ImuStep> {
        self.stop(sample.time_ns);
        self.silent = false;
        self.judge(sample);
        self.coast(sample.time_ns, interval_ns)
    }

    /// Values, flags and counters of a sample.
    fn judge(&mut self, sample: &ImuSample) -> Judged {
        let judged = self.monitor.judge(sample, &self.config);
        let count = |counter: &mut u32, seen: bool| *counter = counter.saturating_add(u32::from(seen));
        count(&mut self.counters.spikes, judged.spike);
        count(&mut self.counters.stuck, judged.stuck);
        let saturated = judged.rate_saturated || judged.force_saturated;
        count(&mut self.counters.saturated, saturated);
        for (fault, seen) in [
            (Fault::Spike, judged.spike),
            (Fault::Stuck, judged.stuck),
            (Fault::Saturated, saturated),
        ] {
            if seen {
                self.flags.raise(fault, sample.time_ns);
            }
        }
        judged
    }

    /// Lengthens the step to `to_ns` in the given way. A step is of one kind: one that was of the other kind ends here.
    fn extend(&mut self, to_ns: u64, motion: Motion) -> Option<ImuStep> {
        let changes = self.pending.as_ref().is_some_and(|p| p.motion != motion);
        let ended = if changes { self.finish_step() } else { None };
        if let Some(pending) = &mut self.pending {
            pending.motion = motion;
            pending.end_ns = to_ns;
        }
        ended
    }

    /// Ends the step if it is long enough.
    fn finish_if_due(&mut self) -> Option<ImuStep> {
        let pending = self.pending.as_ref()?;
        // Half a sample early is due as well: jitter must not make a step one sample longer.
        let due_ns =
            u64::from(self.config.step_ns) - u64::from(self.config.period_ns.min(self.config.step_ns) / 2);
        if pending.end_ns.saturating_sub(pending.start_ns) >= due_ns {
            self.finish_step()
        } else {
            None
        }
    }

    /// Goes on without knowledge of the motion.
    fn coast(&mut self, now_ns: u64, interval_ns: u64) -> Option<ImuStep> {
        let ended = self.extend(now_ns, Motion::Coasting);
        if let Some(pending) = &mut self.pending {
            let dt_s = interval_ns as f32 * NS;
            pending.angle_variance += UNKNOWN_ANGLE_RAD2_PER_S * dt_s;
            pending.velocity_variance += UNKNOWN_VELOCITY_M2_PER_S3 * dt_s;
        }
        ended.or_else(|| self.finish_if_due())
    }

    /// A sample of a stuck or broken sensor: as none.
    fn disregard(&mut self, judged: &Judged, now_ns: u64, interval_ns: u32) -> Option<ImuStep> {
        if self.last.is_some() && judged.stuck {
            // The samples before it that looked alike were guesses too.
            let before_ns = self
                .config
                .period_ns
                .saturating_mul(u32::from(self.config.stuck_samples));
            self.doubt(before_ns);
        }
        self.last = None;
        if let Some(pending) = &mut self.pending {
            pending.sum.forget_course();
        }
        self.coast(now_ns, u64::from(interval_ns))
    }

    /// Adds the variance of a motion that was guessed over a short time.
    fn doubt(&mut self, duration_ns: u32) {
        if let Some(pending) = &mut self.pending {
            let dt_s = duration_ns as f32 * NS;
            let half_square = 0.5 * dt_s * dt_s;
            let angle = GAP_ANGULAR_ACCELERATION * half_square;
            let velocity = GAP_JERK_M_PER_S3 * half_square;
            pending.angle_variance += angle * angle;
            pending.velocity_variance += velocity * velocity;
        }
    }

    /// A sample that may be used.
    fn integrate(&mut self, judged: &Judged, now_ns: u64, interval_ns: u32, missing: u32) -> Option<ImuStep> {
        self.counters.used = self.counters.used.saturating_add(1);
        let ended = self.extend(now_ns, Motion::Measured);
        let clean = ImuSample {
            time_ns: now_ns,
            rate_rad_per_s: judged.rate_rad_per_s,
            specific_force_m_per_s2: judged.force_m_per_s2,
        };
        let rate = self.errors.rate_rad_per_s(&clean);
        let force = self.errors.specific_force_m_per_s2(&clean);
        let mut own_ns = interval_ns;
        if missing > 0 {
            own_ns = interval_ns.min(self.config.period_ns);
            self.doubt(interval_ns - own_ns);
        }
        if let Some(pending) = &mut self.pending {
            if missing > 0 {
                let (rate_before, force_before) = self.last.unwrap_or((rate, force));
                let gap_s = (interval_ns - own_ns) as f32 * NS;
                pending.sum.forget_course();
                pending.sum.add(
                    &((rate_before + rate) * 0.5),
                    &((force_before + force) * 0.5),
                    gap_s,
                );
                pending.sum.forget_course();
            }
            let dt_s = own_ns as f32 * NS;
            let (owed_rate, owed_force) = judged.owed;
            pending.sum.add(&(rate + owed_rate), &(force + owed_force), dt_s);
            if judged.rate_saturated {
                pending.angle_variance += UNKNOWN_ANGLE_RAD2_PER_S * dt_s;
            }
            if judged.force_saturated {
                pending.velocity_variance += UNKNOWN_VELOCITY_M2_PER_S3 * dt_s;
            }
        }
        self.last = Some((rate, force));
        ended.or_else(|| self.finish_if_due())
    }
}

#[cfg(test)]
mod tests;
