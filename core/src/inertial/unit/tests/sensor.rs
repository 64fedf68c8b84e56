//! A sensor whose samples can be spoilt, and what the unit made of them.

use super::*;

/// A sensor with noise, in a turn of 0.5 rad/s with a push of 1 m/s^2 to the left: the codes never repeat for long.
pub(super) struct Sensor(pub(super) u32);

impl Sensor {
    /// White noise in -1..1, of a linear congruential generator.
    pub(super) fn noise(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 8_388_608.0 - 1.0
    }

    pub(super) fn at(&mut self, time_ns: u64) -> ImuSample {
        let mut noisy = |level: f32, size: f32| level + size * self.noise();
        let rate = [noisy(0.0, 3e-3), noisy(0.0, 3e-3), noisy(0.5, 3e-3)];
        ImuSample {
            time_ns,
            rate_rad_per_s: Vector3::from(rate),
            specific_force_m_per_s2: Vector3::new(noisy(0.0, 0.04), noisy(1.0, 0.04), noisy(G, 0.04)),
        }
    }
}

/// What became of a run of samples.
pub(super) struct Outcome {
    pub(super) imu: Imu,
    pub(super) steps: Vec<ImuStep>,
    /// When a flag first stood, ms of the run.
    pub(super) flagged_ms: Option<u64>,
}

impl Outcome {
    /// Sum of the rotation about z over the steps, rad, and variances added to rotation and velocity.
    pub(super) fn sums(&self) -> (f32, f32, f32) {
        self.steps.iter().fold((0.0, 0.0, 0.0), |(angle, a, v), step| {
            (
                angle + step.increment.delta_angle_rad.z,
                a + step.angle_variance_rad2,
                v + step.velocity_variance_m2_per_s2,
            )
        })
    }

    /// Steps follow each other without hole or overlap.
    pub(super) fn is_seamless(&self) -> bool {
        self.steps
            .windows(2)
            .all(|pair| pair[0].increment.end_ns == pair[1].increment.start_ns)
    }

    pub(super) fn coasted_ms(&self) -> u64 {
        let coasting = self.steps.iter().filter(|s| s.motion == Motion::Coasting);
        coasting
            .map(|s| s.increment.end_ns - s.increment.start_ns)
            .sum::<u64>()
            / MS
    }
}

/// Two seconds of samples, changed (or left out) by `fault`, which is given the time in ms; the clock ticks beside.
pub(super) fn run(mut fault: impl FnMut(u64, ImuSample) -> Option<ImuSample>) -> Outcome {
    let mut sensor = Sensor(7);
    let mut outcome = Outcome {
        imu: Imu::new(ImuConfig::default()),
        steps: Vec::new(),
        flagged_ms: None,
    };
    for ms in 0..=2000 {
        let sample = sensor.at(ms * MS);
        if let Some(sample) = fault(ms, sample) {
            outcome.steps.extend(outcome.imu.push(&sample));
        }
        if ms % 10 == 0 {
            while let Some(step) = outcome.imu.elapse(ms * MS) {
                outcome.steps.push(step);
            }
        }
        if outcome.flagged_ms.is_none() && !outcome.imu.health(ms * MS).is_sound() {
            outcome.flagged_ms = Some(ms);
        }
        assert!(
            outcome
                .steps
                .iter()
                .all(|s| s.increment.delta_angle_rad.norm().is_finite())
        );
    }
    outcome.steps.extend(outcome.imu.finish_step());
    outcome
}
