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
mod tests {
    use core::f64::consts::TAU;

    use nalgebra::Vector1;

    use super::*;
    use crate::flight::Spline;
    use crate::sensors::{GSensitivityConfig, MountingConfig, VibrationConfig};

    const STEP_S: f64 = 1e-3;

    /// A minute of curves.
    fn flight() -> Trajectory {
        let times = || (0..160).map(|k| f64::from(k) * 0.4);
        let place = |t: f64| {
            Vector3::new(
                9.0 * libm::sin(0.7 * t),
                8.0 * libm::cos(0.5 * t),
                8.0 + libm::sin(0.3 * t),
            )
        };
        let make = "more than six control points";
        Trajectory::new(
            Spline::new(times().map(place).collect(), 0.4).expect(make),
            Spline::new(times().map(|t| Vector1::new(0.6 * t)).collect(), 0.4).expect(make),
            0.15,
        )
    }

    fn run(config: &ImuConfig, uav: &Trajectory, carried: f64, seconds: f64) -> Vec<[Vector3<f64>; 2]> {
        let mut sampling = Sampling::new(config, 7);
        (0..(seconds / STEP_S) as u32)
            .map(|k| {
                let start_s = 5.0 + f64::from(k) * STEP_S;
                let (rate, force) = sampling.sample(uav, |_| carried, start_s, start_s + STEP_S);
                [rate, force]
            })
            .collect()
    }

    fn with(change: impl Fn(&mut ImuConfig)) -> ImuConfig {
        let mut config = ImuConfig::ideal();
        change(&mut config);
        config
    }

    /// Largest difference of rates and of forces.
    fn largest(a: &[[Vector3<f64>; 2]], b: &[[Vector3<f64>; 2]]) -> [f64; 2] {
        [0, 1].map(|i| {
            let pairs = a.iter().zip(b).skip(100);
            pairs.map(|(a, b)| (a[i] - b[i]).norm()).fold(0.0, f64::max)
        })
    }

    #[test]
    fn a_known_filter_leaves_a_slow_motion_where_it_was_and_latency_shifts_it() {
        let uav = flight();
        let exact = run(&ImuConfig::ideal(), &uav, 1.0, 10.0);
        let (rate, force) = uav.inertial_mean(5.0 + 77.0 * STEP_S, 5.0 + 77.0 * STEP_S + STEP_S);
        assert_eq!(exact[77], [rate, force]);
        let filtered = run(&with(|c| c.sampling.filter_hz = 200.0), &uav, 1.0, 10.0);
        let [rate, force] = largest(&filtered, &exact);
        assert!(rate < 1e-5 && force < 1e-5, "{rate} {force}");
        // Five samples of latency: exactly those of five samples before, but for how the mean is taken.
        let late = run(&with(|c| c.sampling.latency_s = 5e-3), &uav, 1.0, 10.0);
        let [rate, force] = largest(&late[5..], &exact[..exact.len() - 5]);
        assert!(rate < 1e-8 && force < 1e-8, "{rate} {force}");
        let [rate, _] = largest(&late, &exact);
        assert!(rate > 1e-4, "{rate}");
    }

    #[test]
    fn the_arm_adds_its_closed_form_to_the_force_only() {
        let uav = flight();
        let exact = run(&ImuConfig::ideal(), &uav, 1.0, 10.0);
        let config = with(|c| c.mounting.lever_arm_m = 0.05);
        let on_arm = run(&config, &uav, 1.0, 10.0);
        let [rate, _] = largest(&on_arm, &exact);
        assert!(rate < 1e-9, "{rate}");
        let mounting = Mounting::new(&config.mounting, 7);
        let (mut worst, mut size) = (0.0f64, 0.0f64);
        for (k, (on_arm, exact)) in on_arm.iter().zip(&exact).enumerate() {
            let middle = uav.at(5.0 + (k as f64 + 0.5) * STEP_S);
            let expected = mounting.force_m_per_s2(&middle) - middle.specific_force_m_per_s2;
            worst = worst.max((on_arm[1] - exact[1] - expected).norm());
            size = size.max(expected.norm());
        }
        assert!(worst < 1e-7 && size > 0.003, "{worst} of {size}");
    }

    #[test]
    fn what_shakes_above_half_the_data_rate_comes_back_below() {
        // The fourth harmonic only, at 1.55 g: 507 to 539 Hz, which samples at 1 kHz show at 461 to 493.
        let thrust_m_per_s2 = 1.55 * cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
        let climb = (0..20).map(|k| {
            let t = 0.5 * f64::from(k);
            let up = thrust_m_per_s2 - cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
            Vector3::z() * (0.5 * up * t * t)
        });
        let make = "more than six control points";
        let uav = Trajectory::new(
            Spline::new(climb.collect(), 0.5).expect(make),
            Spline::new(vec![Vector1::zeros(); 20], 0.5).expect(make),
            0.0,
        );
        let config = with(|c| {
            c.vibration.acceleration_m_per_s2 = [0.0, 0.0, 1.0];
            c.sampling.filter_hz = 200.0;
        });
        let samples = run(&config, &uav, 1.0, 1.0);
        let power_at = |hz: u32| {
            let (mut re, mut im) = (Vector3::zeros(), Vector3::zeros());
            for (k, [_, force]) in samples.iter().enumerate() {
                let (sin, cos) = libm::sincos(TAU * f64::from(hz) * k as f64 * STEP_S);
                re += force * cos;
                im += force * sin;
            }
            // The mean of the axes.
            2.0 * (re.norm_squared() + im.norm_squared()) / 3e6
        };
        let near: f64 = (458..=496).map(power_at).sum();
        let below: f64 = (50..=440).map(power_at).sum();
        // 1/(1 + (523/200)^4) = 0.021 of the power is left by the filter; a mean over the interval would leave 0.37.
        assert!((0.01..0.035).contains(&near), "{near}");
        assert!(below < 0.1 * near, "{below} of {near}");
    }

    #[test]
    fn rectification_is_of_what_the_sensor_feels_not_of_what_the_filter_leaves() {
        let uav = Trajectory::at_rest(Vector3::zeros(), 60.0);
        let config = |vibrates: bool| {
            with(|c| {
                c.g_sensitivity.accel_ug_per_g2 = 5000.0;
                c.sampling.filter_hz = 20.0;
                if vibrates {
                    c.vibration = VibrationConfig::real();
                }
            })
        };
        let mean = |config: &ImuConfig| {
            let samples = run(config, &uav, 1.0, 20.0);
            // Without the filter's beginning.
            samples[1000..].iter().map(|s| s[1]).sum::<Vector3<f64>>() / (samples.len() - 1000) as f64
        };
        let rectified = mean(&config(true)) - mean(&config(false));
        // 14 m^2/s^4 a axis, by the coefficients that are drawn for this sensor.
        let sensor = GSensitivity::new(&config(true).g_sensitivity, 7);
        let expected = sensor.errors(&Vector3::repeat(14.0_f64.sqrt())).1;
        assert!(
            (rectified - expected).norm() < 0.1 * expected.norm(),
            "{rectified} for {expected}"
        );
    }

    #[test]
    fn a_clock_of_its_own_runs_at_its_own_rate_all_the_time() {
        let second_ns = 1_000_000_000;
        let config = with(|c| c.clock_rms_ppm = 50.0);
        let errors: Vec<f64> = (0..400)
            .map(|seed| {
                let sampling = Sampling::new(&config, seed);
                let late_ns =
                    |s: u64| sampling.by_uav_clock_ns(s * second_ns) as f64 - (s * second_ns) as f64;
                assert!(
                    (late_ns(100) - 100.0 * late_ns(1)).abs() <= 51.0,
                    "not at one rate"
                );
                late_ns(1) * 1e-3
            })
            .collect();
        let rms_ppm = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        assert!((rms_ppm / 50.0 - 1.0).abs() < 0.12, "{rms_ppm}");
        assert_eq!(
            Sampling::new(&ImuConfig::default(), 1).by_uav_clock_ns(77 * second_ns),
            77 * second_ns
        );
        // What is sampled between two instants is none of the clock's.
        let uav = flight();
        let [with_it, without] = [&config, &ImuConfig::ideal()].map(|config| run(config, &uav, 1.0, 0.1));
        assert_eq!(with_it, without);
    }

    #[test]
    fn stamps_jitter_by_their_figure_in_order() {
        let config = with(|c| c.sampling.stamp_jitter_s = 50e-6);
        let mut sampling = Sampling::new(&config, 1);
        let stamps: Vec<u64> = (1..20_000).map(|k| sampling.stamp_ns(k * 1_000_000)).collect();
        let error = |k: usize| stamps[k] as f64 - (k as f64 + 1.0) * 1e6;
        let square: f64 = (0..stamps.len()).map(|k| error(k) * error(k)).sum();
        let rms = (square / stamps.len() as f64).sqrt();
        assert!((rms / 50e3 - 1.0).abs() < 0.03, "{rms}");
        let config = with(|c| c.sampling.stamp_jitter_s = 0.01);
        let mut wild = Sampling::new(&config, 1);
        let stamps: Vec<u64> = (1..2000).map(|k| wild.stamp_ns(k * 1_000_000)).collect();
        assert!(stamps.is_sorted());
        assert_eq!(Sampling::new(&ImuConfig::default(), 1).stamp_ns(77), 77);
    }

    #[test]
    fn each_effect_moves_no_draw_of_another() {
        let uav = flight();
        let all = with(|c| {
            c.vibration = VibrationConfig::real();
            c.mounting = MountingConfig::real();
            c.g_sensitivity = GSensitivityConfig::real();
        });
        // On the ground, vibration is configured but not there: bit for bit as without.
        let still = with(|c| {
            c.mounting = MountingConfig::real();
            c.g_sensitivity = GSensitivityConfig::real();
        });
        assert_eq!(run(&all, &uav, 0.0, 0.5), run(&still, &uav, 0.0, 0.5));
        assert_ne!(run(&all, &uav, 1.0, 0.5), run(&still, &uav, 1.0, 0.5));
    }
}
