//! Judges each sample by its values: stuck, saturated, spike.
//!
//! A spike is far from the median of the last three values that were believed, compared with how much the sensor
//! usually changes (a running mean of the same distance). The median takes its place. A real jump looks the same at
//! first: when [`ImuConfig::spike_samples`] in a row stand out, the next one is believed, and what was held back is paid
//! back with it, so that no motion is lost. Except at the end of the range: no UAV that flies jumps there, so that a
//! value that does and stays is a broken sensor's. A value that gets there in small steps is a clipped motion.

use nalgebra::Vector3;

use super::ImuConfig;
use crate::inertial::ImuSample;

/// The usual change is averaged over about so many samples while it falls,
/// Tuned: the motions of docs/localization.md, "Health".
const FALLING_SAMPLES: f32 = 256.0;
/// and over so many while it rises.
/// Given: motors start within a tenth of a second.
const RISING_SAMPLES: f32 = 16.0;
/// A spike is further from the median than so many usual changes, besides the fixed limit.
/// Tuned: the motions of docs/localization.md, "Health".
const USUAL_CHANGES: f32 = 10.0;

/// A sample as it may be integrated, and what is wrong with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Judged {
    /// Angular rate, spikes replaced, rad/s.
    pub(super) rate_rad_per_s: Vector3<f32>,
    /// Specific force, spikes replaced, m/s^2.
    pub(super) force_m_per_s2: Vector3<f32>,
    /// What earlier samples held back as a spike and has turned out real: to be added, rad/s and m/s^2 over one sample.
    pub(super) owed: (Vector3<f32>, Vector3<f32>),
    /// A value was replaced.
    pub(super) spike: bool,
    /// An axis of the gyroscope is at the end of its range.
    pub(super) rate_saturated: bool,
    /// An axis of the accelerometer is at the end of its range.
    pub(super) force_saturated: bool,
    /// An axis is stuck.
    pub(super) stuck: bool,
    /// An axis has jumped to the end of its range and stays there.
    pub(super) broken: bool,
}

/// One axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Axis {
    /// The last value as it came, and how often it has come in a row.
    raw: f32,
    repeats: u16,
    /// The last three values that were believed.
    believed: [f32; 3],
    /// Spikes in a row, and their sum above what replaced them.
    spikes: u8,
    held_back: f32,
    /// Running mean distance from the median.
    usual: f32,
}

/// Limits of one kind of sensor.
#[derive(Clone, Copy, Debug)]
struct Limits {
    end: f32,
    spike: f32,
    spike_samples: u8,
    stuck_samples: u16,
}

/// Verdict on one value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Value {
    value: f32,
    owed: f32,
    spike: bool,
    saturated: bool,
    stuck: bool,
    broken: bool,
}

impl Axis {
    /// As it is when a sensor begins.
    fn starting_at(value: f32) -> Self {
        Self {
            raw: value,
            repeats: 1,
            believed: [value; 3],
            ..Self::default()
        }
    }

    fn judge(&mut self, value: f32, limits: &Limits) -> Value {
        let at_end = value.abs() >= limits.end;
        // At the end of the range values repeat because there is nothing beyond.
        self.repeats = if value.to_bits() == self.raw.to_bits() && !at_end {
            self.repeats.saturating_add(1)
        } else {
            1
        };
        self.raw = value;
        let stuck = limits.stuck_samples > 0 && self.repeats >= limits.stuck_samples;

        let [a, b, c] = self.believed;
        let median = a.min(b).max(a.max(b).min(c));
        let distance = (value - median).abs();
        if distance <= limits.spike + USUAL_CHANGES * self.usual {
            let samples = if distance > self.usual {
                RISING_SAMPLES
            } else {
                FALLING_SAMPLES
            };
            self.usual += (distance - self.usual) / samples;
            self.spikes = 0;
            self.held_back = 0.0;
            self.believed = [b, c, value];
            return Value {
                value,
                saturated: at_end,
                stuck,
                ..Value::default()
            };
        }
        if self.spikes < limits.spike_samples {
            self.spikes += 1;
            self.held_back += value - median;
            return Value {
                value: median,
                spike: true,
                stuck,
                ..Value::default()
            };
        }
        if at_end {
            return Value {
                value: median,
                saturated: true,
                broken: true,
                ..Value::default()
            };
        }
        let owed = self.held_back;
        *self = Self {
            raw: value,
            repeats: self.repeats,
            believed: [value; 3],
            usual: self.usual,
            ..Self::default()
        };
        Value {
            value,
            owed,
            stuck,
            ..Value::default()
        }
    }
}

/// The six axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Monitor {
    axes: Option<[Axis; 6]>,
}

impl Monitor {
    /// Judges the next sample. Its values are finite.
    pub(super) fn judge(&mut self, sample: &ImuSample, config: &ImuConfig) -> Judged {
        let (rate, force) = (&sample.rate_rad_per_s, &sample.specific_force_m_per_s2);
        let values = [rate.x, rate.y, rate.z, force.x, force.y, force.z];
        let axes = self.axes.get_or_insert_with(|| values.map(Axis::starting_at));
        let limits = |end, spike| Limits {
            end,
            spike,
            spike_samples: config.spike_samples,
            stuck_samples: config.stuck_samples,
        };
        let rate_limits = limits(config.rate_limit_rad_per_s, config.rate_spike_rad_per_s);
        let force_limits = limits(config.force_limit_m_per_s2, config.force_spike_m_per_s2);
        let [gx, gy, gz, ax, ay, az] = axes;
        let g = [
            gx.judge(rate.x, &rate_limits),
            gy.judge(rate.y, &rate_limits),
            gz.judge(rate.z, &rate_limits),
        ];
        let a = [
            ax.judge(force.x, &force_limits),
            ay.judge(force.y, &force_limits),
            az.judge(force.z, &force_limits),
        ];
        Judged {
            rate_rad_per_s: Vector3::from(g.map(|v| v.value)),
            force_m_per_s2: Vector3::from(a.map(|v| v.value)),
            owed: (Vector3::from(g.map(|v| v.owed)), Vector3::from(a.map(|v| v.owed))),
            spike: g.iter().chain(&a).any(|v| v.spike),
            rate_saturated: g.iter().any(|v| v.saturated),
            force_saturated: a.iter().any(|v| v.saturated),
            stuck: g.iter().chain(&a).any(|v| v.stuck),
            broken: g.iter().chain(&a).any(|v| v.broken),
        }
    }

    /// Forgets what was believed: after a stop it says nothing about the next value.
    pub(super) fn forget(&mut self) {
        self.axes = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        end: 30.0,
        spike: 0.5,
        spike_samples: 3,
        stuck_samples: 20,
    };

    /// Sum of what is integrated, with what is owed, and the number of spikes.
    fn run(values: &[f32]) -> (f32, usize) {
        let mut axis = Axis::starting_at(values[0]);
        let verdicts = values.iter().map(|&v| axis.judge(v, &LIMITS));
        verdicts.fold((0.0, 0), |(sum, spikes), v| {
            (sum + v.value + v.owed, spikes + usize::from(v.spike))
        })
    }

    #[test]
    fn up_to_three_wild_values_are_replaced_by_the_median() {
        for wild in 1..=3 {
            let mut values = [1.0_f32; 40];
            values[20..20 + wild].fill(-25.0);
            assert_eq!(run(&values), (40.0, wild), "{wild}");
        }
    }

    #[test]
    fn a_real_jump_is_believed_and_nothing_of_it_is_lost() {
        let mut values = [1.0_f32; 40];
        values[20..].fill(5.0);
        // Three samples late, then the three missing differences of 4 at once.
        assert_eq!(run(&values), (20.0 + 20.0 * 5.0, 3));
    }

    #[test]
    fn a_lively_signal_raises_the_limit() {
        let swing = |k: usize| if k.is_multiple_of(2) { 0.4 } else { -0.4 };
        let mut axis = Axis::starting_at(0.4);
        let calm = Axis::starting_at(0.0);
        for k in 0..2000 {
            // It grows within 50 samples, as when motors start.
            let size = (k as f32 / 50.0).min(1.0);
            assert!(!axis.judge(size * swing(k), &LIMITS).spike, "{k}");
        }
        // A change of 3 stands out of rest, but not of a signal that changes by up to 0.8 at every sample.
        assert!(calm.clone().judge(3.0, &LIMITS).spike);
        assert!(!axis.clone().judge(3.0, &LIMITS).spike);
        assert!(axis.judge(20.0, &LIMITS).spike);
    }

    #[test]
    fn repeats_are_stuck_except_at_the_end_of_the_range() {
        let stuck_at = |value: f32| {
            let mut axis = Axis::starting_at(value);
            (2..60).find(|_| axis.judge(value, &LIMITS).stuck)
        };
        assert_eq!(stuck_at(0.25), Some(20));
        assert_eq!(stuck_at(30.0), None);
        let mut axis = Axis::starting_at(30.0);
        assert!(axis.judge(30.0, &LIMITS).saturated && !axis.judge(29.9, &LIMITS).saturated);
        // One other value, and it counts anew.
        let mut axis = Axis::starting_at(0.25);
        for k in 0..100 {
            let value = if k % 15 == 14 { 0.26 } else { 0.25 };
            assert!(!axis.judge(value, &LIMITS).stuck);
        }
        let never = Limits {
            stuck_samples: 0,
            ..LIMITS
        };
        let mut axis = Axis::starting_at(0.25);
        assert!((0..100).all(|_| !axis.judge(0.25, &never).stuck));
    }

    #[test]
    fn a_jump_to_full_scale_is_a_spike_and_then_a_broken_sensor() {
        let mut axis = Axis::starting_at(0.0);
        let verdicts: heapless::Vec<Value, 8> = (0..6).map(|_| axis.judge(31.0, &LIMITS)).collect();
        assert!(verdicts.iter().all(|v| v.value == 0.0 && v.owed == 0.0));
        assert!(verdicts[..3].iter().all(|v| v.spike && !v.broken));
        assert!(verdicts[3..].iter().all(|v| v.saturated && v.broken));
        // Back again, it is believed at once.
        assert_eq!(
            axis.judge(0.1, &LIMITS),
            Value {
                value: 0.1,
                ..Value::default()
            }
        );
    }

    #[test]
    fn a_motion_that_grows_to_full_scale_is_clipped_and_used() {
        let mut axis = Axis::starting_at(0.0);
        let climb = (0..100).map(|k| (k as f32 * 0.4).min(31.0));
        let last = climb.map(|v| axis.judge(v, &LIMITS)).last().expect("a hundred");
        assert!(last.saturated && !last.broken && last.value == 31.0);
    }
}
