//! From the motion of the body to what an inertial sensor samples: mounted, shaken, filtered, late.
//!
//! With everything off, a sample is the exact mean over the interval that ends at its stamp. Otherwise the sensor's signals are made eight
//! times a sample, which its own filter sees before every eighth value is kept: what shakes above half the data rate comes back at another
//! frequency. A driver knows the filter and stamps a sample by the middle of what it holds; the latency is what no driver knows.

use nalgebra::{Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::ImuConfig;
use super::g_sensitivity::GSensitivity;
use super::low_pass::LowPass;
use super::mounting::Mounting;
use super::vibration::Vibration;
use crate::flight::Trajectory;
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Values a sample: 8 kHz at the default rate.
const OVERSAMPLING: u32 = 8;
/// Stamps are off by at most this share of the interval: they keep their order.
const MOST_JITTER: f64 = 0.4;

/// How the sensor samples; zeros for exact means and exact stamps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SamplingConfig {
    /// Bandwidth (3 dB) of the filter of second order, Hz, at most twice the data rate; 0 for the mean over the interval.
    pub filter_hz: f64,
    /// What a sample holds is older than its stamp says by this, s: 0 to 0.05.
    pub latency_s: f64,
    /// Jitter of the stamps, s rms, each on its own; at most 0.4 of the interval.
    pub stamp_jitter_s: f64,
}

impl SamplingConfig {
    /// A filter of 200 Hz, a latency of 1.2 ms, stamps by an interrupt.
    pub fn real() -> Self {
        Self {
            filter_hz: 200.0,
            latency_s: 1.2e-3,
            stamp_jitter_s: 50e-6,
        }
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self, rate_hz: u32) -> Result<(), InputError> {
        let most_hz = 2.0 * f64::from(rate_hz);
        for (key, value, most) in [
            ("imu.sampling.filter_hz", self.filter_hz, most_hz),
            ("imu.sampling.latency_s", self.latency_s, 0.05),
            ("imu.sampling.stamp_jitter_s", self.stamp_jitter_s, 0.05),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(InputError::at_key(
                    key,
                    format!("is {value}, expected 0 to {most}"),
                ));
            }
        }
        Ok(())
    }
}

/// The signals of one sensor before its own errors: state of the simulation.
#[derive(Clone, Debug)]
pub(super) struct Sampling {
    interval_s: f64,
    /// By how much more than the UAV's clock its own one takes for a second, s/s.
    clock_error: f64,
    jitter_s: f64,
    jitter: Seeded,
    /// `None` when samples are exact means.
    signals: Option<Signals>,
}

/// What the sensor feels, value by value.
#[derive(Clone, Debug)]
struct Signals {
    mounting: Mounting,
    vibration: Vibration,
    g_sensitivity: GSensitivity,
    filter: Option<LowPass<6>>,
    is_settled: bool,
    /// The values of a sample are those of this much later than its interval, s.
    ahead_s: f64,
}

impl Sampling {
    /// The sensor of the world of `seed`.
    pub(super) fn new(config: &ImuConfig, seed: u64) -> Self {
        let interval_s = 1.0 / f64::from(config.rate_hz);
        let sampling = &config.sampling;
        let is_off = config.vibration.is_off()
            && config.g_sensitivity.is_off()
            && config.mounting.is_off()
            && sampling.filter_hz == 0.0
            && sampling.latency_s == 0.0;
        let filter = (sampling.filter_hz > 0.0)
            .then(|| LowPass::new(sampling.filter_hz, interval_s / f64::from(OVERSAMPLING)));
        // The middle of what the filter's output holds, against that of the interval.
        let known_s = filter.as_ref().map_or(0.0, |_| {
            LowPass::<6>::delay_s(sampling.filter_hz) - 0.5 * interval_s
        });
        Self {
            interval_s,
            clock_error: Seeded::new(seed, Source::ImuClock).normal() * config.clock_rms_ppm * 1e-6,
            jitter_s: sampling.stamp_jitter_s,
            jitter: Seeded::new(seed, Source::ImuStampJitter),
            signals: (!is_off).then(|| Signals {
                mounting: Mounting::new(&config.mounting, seed),
                vibration: Vibration::new(&config.vibration, seed),
                g_sensitivity: GSensitivity::new(&config.g_sensitivity, seed),
                filter,
                is_settled: false,
                ahead_s: known_s - sampling.latency_s,
            }),
        }
    }

    /// What the UAV's clock shows when the sensor's own shows a time, ns: both are at zero together.
    pub(super) fn by_uav_clock_ns(&self, own_ns: u64) -> u64 {
        if self.clock_error == 0.0 {
            return own_ns;
        }
        own_ns.saturating_add_signed(libm::floor(own_ns as f64 * self.clock_error + 0.5) as i64)
    }

    /// Angular rate (rad/s) and specific force (m/s^2) of the sample over an interval, in the sensor's axes. `carried` is the share of
    /// the weight that the rotors carry at a time.
    pub(super) fn sample(
        &mut self,
        uav: &Trajectory,
        carried: impl Fn(f64) -> f64,
        start_s: f64,
        end_s: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        match &mut self.signals {
            None => uav.inertial_mean(start_s, end_s),
            Some(signals) => signals.sample(uav, carried, start_s, end_s),
        }
    }

    /// A stamp as the receiver gets it, ns.
    pub(super) fn stamp_ns(&mut self, exact_ns: u64) -> u64 {
        if self.jitter_s == 0.0 {
            return exact_ns;
        }
        let most_s = MOST_JITTER * self.interval_s;
        let late_s = (self.jitter.normal() * self.jitter_s).clamp(-most_s, most_s);
        libm::floor(exact_ns as f64 + late_s * 1e9 + 0.5).max(0.0) as u64
    }
}

impl Signals {
    fn sample(
        &mut self,
        uav: &Trajectory,
        carried: impl Fn(f64) -> f64,
        start_s: f64,
        end_s: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let step_s = (end_s - start_s) / f64::from(OVERSAMPLING);
        let (mut sum, mut last) = (Vector6::zeros(), Vector6::zeros());
        for step in 0..OVERSAMPLING {
            let time_s = start_s + (f64::from(step) + 0.5) * step_s + self.ahead_s;
            let value = self.value(uav, carried(time_s), time_s, step_s);
            if let Some(filter) = &mut self.filter {
                if !self.is_settled {
                    self.is_settled = true;
                    filter.settle(value);
                }
                last = filter.step(&value);
            }
            sum += value;
        }
        let held = if self.filter.is_some() {
            last
        } else {
            sum / f64::from(OVERSAMPLING)
        };
        (
            held.fixed_rows::<3>(0).into_owned(),
            held.fixed_rows::<3>(3).into_owned(),
        )
    }

    /// Rate and force at one instant, `step_s` after the one before.
    fn value(&mut self, uav: &Trajectory, carried: f64, time_s: f64, step_s: f64) -> Vector6<f64> {
        let motion = uav.at(time_s);
        let shake = self
            .vibration
            .advance(step_s, motion.specific_force_m_per_s2.norm(), carried);
        // Body vectors in the axes of the shaken sensor: the angle is far below a milliradian.
        let shaken = |v: Vector3<f64>| v - shake.angle_rad.cross(&v);
        let rate = shaken(motion.rate_rad_per_s) + shake.rate_rad_per_s;
        let force = shaken(self.mounting.force_m_per_s2(&motion)) + shake.acceleration_m_per_s2;
        let (rate, force) = (self.mounting.to_sensor(&rate), self.mounting.to_sensor(&force));
        let (rate_error, force_error) = self.g_sensitivity.errors(&force);
        let (rate, force) = (rate + rate_error, force + force_error);
        Vector6::new(rate.x, rate.y, rate.z, force.x, force.y, force.z)
    }
}

#[cfg(test)]
mod tests;
