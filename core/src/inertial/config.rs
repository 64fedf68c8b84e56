//! What the mechanisation knows about its sensor.

use core::f32::consts::PI;

use crate::constants::STANDARD_GRAVITY_M_PER_S2;

/// Properties of the inertial sensor and limits of the health monitor. The default is for the ICM-42688-P at 1 kHz in its
/// high-resolution mode.
/// Given: the data sheet of the sensor and what a quadrotor can do (docs/localization.md, "The inertial sensor").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuConfig {
    /// Time from sample to sample, ns.
    pub period_ns: u32,
    /// Length of the increments, ns: the filter's step.
    pub step_ns: u32,
    /// Longest gap between samples that is bridged; beyond it the sensor has stopped, ns.
    pub gap_ns: u32,
    /// A sample so much older than the newest is late and is dropped; one that is older still means that the clock was
    /// set back, ns.
    pub late_ns: u64,
    /// End of the gyroscope's range, rad/s: an axis at or beyond it is saturated.
    pub rate_limit_rad_per_s: f32,
    /// End of the accelerometer's range, m/s^2.
    pub force_limit_m_per_s2: f32,
    /// An axis that repeats its value so many times is stuck. White noise of ten codes repeats a code twenty times once
    /// in 10^31 samples. 0: never, for a simulated sensor without noise.
    pub stuck_samples: u16,
    /// A rate this far from the median of the last three is a spike, rad/s; ten times the usual change is added.
    pub rate_spike_rad_per_s: f32,
    /// The same of the specific force, m/s^2.
    pub force_spike_m_per_s2: f32,
    /// So many samples in a row that look like spikes are one; the next one means that the motion is real.
    pub spike_samples: u8,
    /// How long a flag stays up after the last sign of its fault, ns: long enough for telemetry to see it.
    pub flag_ns: u64,
}

impl Default for ImuConfig {
    fn default() -> Self {
        Self {
            period_ns: 1_000_000,
            step_ns: 10_000_000,
            gap_ns: 50_000_000,
            late_ns: 1_000_000_000,
            // One part in a thousand below 2000 deg/s and 16 g: the codes end one short, and the scale has an error.
            rate_limit_rad_per_s: 0.999 * 2000.0 * PI / 180.0,
            force_limit_m_per_s2: 0.999 * 16.0 * STANDARD_GRAVITY_M_PER_S2 as f32,
            stuck_samples: 20,
            // A quadrotor turns up its rate by less than 0.1 rad/s in a millisecond, and a spike below the limit turns
            // the attitude by at most 0.03 deg.
            rate_spike_rad_per_s: 0.5,
            force_spike_m_per_s2: 20.0,
            spike_samples: 3,
            flag_ns: 1_000_000_000,
        }
    }
}

impl ImuConfig {
    /// The same for a sensor without noise, as a simulation may have: it repeats its values and is not stuck.
    #[must_use]
    pub fn without_noise(self) -> Self {
        Self {
            stuck_samples: 0,
            ..self
        }
    }
}
