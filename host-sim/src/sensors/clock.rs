//! The UAV's clock against the GMT's, which is the time of this world.
//!
//! Offset x and fractional frequency y obey dx = y dt + white FM, dy = ramp dt + random-walk FM (docs/localization.md, "The
//! model"). The ramp is a temperature drift of constant magnitude that reverses from time to time, so that the
//! frequency stays bounded. The whole flight is drawn in advance on a grid, hence any instant can be asked for.

use serde::{Deserialize, Serialize};

use super::ClockStep;
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Errors of the UAV clock. The default is a TCXO, budget of design section 6.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClockConfig {
    /// Standard deviation of the offset at the start, us.
    pub initial_offset_us: f64,
    /// Standard deviation of the fractional frequency at the start, parts per million.
    pub initial_drift_ppm: f64,
    /// White frequency noise, ns/sqrt(s).
    pub white_fm_ns_per_sqrt_s: f64,
    /// Random walk of the frequency, ns/s per sqrt(s).
    pub random_walk_ns_per_s_per_sqrt_s: f64,
    /// Magnitude of the temperature ramp of the frequency, ns/s^2.
    pub ramp_ns_per_s2: f64,
    /// The ramp reverses after this time, s; zero for never.
    pub ramp_reversal_s: f64,
}

impl Default for ClockConfig {
    fn default() -> Self {
        Self {
            initial_offset_us: 1.0,
            initial_drift_ppm: 0.3,
            white_fm_ns_per_sqrt_s: 0.1,
            random_walk_ns_per_s_per_sqrt_s: 0.3,
            ramp_ns_per_s2: 0.5,
            ramp_reversal_s: 60.0,
        }
    }
}

impl ClockConfig {
    /// A clock that agrees with the GMT's for ever.
    pub fn ideal() -> Self {
        Self {
            initial_offset_us: 0.0,
            initial_drift_ppm: 0.0,
            white_fm_ns_per_sqrt_s: 0.0,
            random_walk_ns_per_s_per_sqrt_s: 0.0,
            ramp_ns_per_s2: 0.0,
            ramp_reversal_s: 0.0,
        }
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        super::not_negative(&[
            ("clock.initial_offset_us", self.initial_offset_us),
            ("clock.initial_drift_ppm", self.initial_drift_ppm),
            ("clock.white_fm_ns_per_sqrt_s", self.white_fm_ns_per_sqrt_s),
            (
                "clock.random_walk_ns_per_s_per_sqrt_s",
                self.random_walk_ns_per_s_per_sqrt_s,
            ),
            ("clock.ramp_ns_per_s2", self.ramp_ns_per_s2),
            ("clock.ramp_reversal_s", self.ramp_reversal_s),
        ])?;
        for (key, value, most) in [
            ("clock.initial_offset_us", self.initial_offset_us, 1e5),
            ("clock.initial_drift_ppm", self.initial_drift_ppm, 100.0),
        ] {
            if value > most {
                return Err(InputError::at_key(
                    key,
                    format!("is {value}, expected 0 to {most}"),
                ));
            }
        }
        Ok(())
    }
}

/// Grid of the drawn clock, s. White FM moves the offset by 10 ps in this time: interpolation costs nothing.
const STEP_S: f64 = 0.01;

/// Offset and drift of the UAV clock over a flight: truth, hidden from the receiver.
#[derive(Clone, Debug)]
pub struct Clock {
    /// (offset s, fractional frequency) at k `STEP_S`.
    grid: Vec<(f64, f64)>,
    /// (time s, step s) of each step.
    steps: Vec<(f64, f64)>,
}

impl Clock {
    /// The clock of the world of `seed` over `duration_s` (and a second more).
    pub fn new(config: &ClockConfig, seed: u64, duration_s: f64) -> Self {
        let mut random = Seeded::new(seed, Source::Clock);
        let mut offset = config.initial_offset_us * 1e-6 * random.normal();
        let mut drift = config.initial_drift_ppm * 1e-6 * random.normal();
        let sign = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
        let ramp = sign * config.ramp_ns_per_s2 * 1e-9;
        let white = config.white_fm_ns_per_sqrt_s * 1e-9 * STEP_S.sqrt();
        let walk = config.random_walk_ns_per_s_per_sqrt_s * 1e-9 * STEP_S.sqrt();
        let steps = ((duration_s + 1.0) / STEP_S) as usize;
        let mut grid = Vec::with_capacity(steps + 1);
        for step in 0..=steps {
            grid.push((offset, drift));
            let reversed = config.ramp_reversal_s > 0.0
                && (step as f64 * STEP_S / config.ramp_reversal_s) as u64 % 2 == 1;
            let ramp = if reversed { -ramp } else { ramp };
            let kick = random.normal() * walk;
            // The frequency is taken as linear within the step; how it wanders there moves the offset by 0.1 ps.
            offset += (drift + ramp * STEP_S * 0.5 + kick * 0.5) * STEP_S + white * random.normal();
            drift += ramp * STEP_S + kick;
        }
        Self {
            grid,
            steps: Vec::new(),
        }
    }

    /// The same clock with steps added.
    #[must_use]
    pub fn with_steps(mut self, steps: &[ClockStep]) -> Self {
        self.steps
            .extend(steps.iter().map(|s| (s.at_s, s.step_ns * 1e-9)));
        self
    }

    /// Offset (UAV clock less GMT clock), s, at GMT time `time_s`.
    pub fn offset_s(&self, time_s: f64) -> f64 {
        let steps = self.steps.iter().filter(|(at_s, _)| time_s >= *at_s);
        self.interpolate(time_s, |point| point.0) + steps.map(|(_, step_s)| step_s).sum::<f64>()
    }

    /// Fractional frequency, s/s, at GMT time `time_s`; white FM apart.
    pub fn drift(&self, time_s: f64) -> f64 {
        self.interpolate(time_s, |point| point.1)
    }

    /// What the UAV clock shows at GMT time `time_s`.
    pub fn reading_s(&self, time_s: f64) -> f64 {
        time_s + self.offset_s(time_s)
    }

    /// GMT time at which the UAV clock shows `reading_s`.
    pub fn time_at_s(&self, reading_s: f64) -> f64 {
        // The offset changes by less than 1e-3 of the time: three rounds leave less than a femtosecond.
        (0..4).fold(reading_s, |time_s, _| reading_s - self.offset_s(time_s))
    }

    fn interpolate(&self, time_s: f64, value: impl Fn(&(f64, f64)) -> f64) -> f64 {
        let place = (time_s / STEP_S).clamp(0.0, (self.grid.len() - 1) as f64);
        let index = (place as usize).min(self.grid.len().saturating_sub(2));
        match self.grid.get(index..index + 2) {
            Some([low, high]) => {
                let (low, high) = (value(low), value(high));
                low + (high - low) * (place - index as f64)
            }
            _ => self.grid.first().map_or(0.0, value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Root mean square over `runs` seeds.
    fn rms(runs: u64, value: impl Fn(u64) -> f64) -> f64 {
        ((0..runs).map(|seed| value(seed) * value(seed)).sum::<f64>() / runs as f64).sqrt()
    }

    #[test]
    fn white_fm_and_random_walk_have_their_laws() {
        let white = ClockConfig {
            white_fm_ns_per_sqrt_s: 0.1,
            ..ClockConfig::ideal()
        };
        let offset = rms(600, |seed| Clock::new(&white, seed, 4.0).offset_s(4.0)) * 1e9;
        assert!((offset / 0.2 - 1.0).abs() < 0.09, "{offset} ns after 4 s");
        let walk = ClockConfig {
            random_walk_ns_per_s_per_sqrt_s: 0.3,
            ..ClockConfig::ideal()
        };
        let drift = rms(600, |seed| Clock::new(&walk, seed, 4.0).drift(4.0)) * 1e9;
        assert!((drift / 0.6 - 1.0).abs() < 0.09, "{drift} ns/s after 4 s");
        let offset = rms(600, |seed| Clock::new(&walk, seed, 4.0).offset_s(4.0)) * 1e9;
        // 0.3 sqrt(4^3 / 3).
        assert!((offset / 1.386 - 1.0).abs() < 0.09, "{offset} ns after 4 s");
    }

    #[test]
    fn the_ramp_reverses_and_bounds_the_frequency() {
        let config = ClockConfig {
            ramp_ns_per_s2: 0.5,
            ramp_reversal_s: 60.0,
            ..ClockConfig::ideal()
        };
        let clock = Clock::new(&config, 5, 120.0);
        assert!((clock.drift(60.0).abs() * 1e9 - 30.0).abs() < 0.01);
        assert!((clock.offset_s(60.0).abs() * 1e9 - 900.0).abs() < 0.5);
        assert!((clock.drift(90.0) - clock.drift(30.0)).abs() * 1e9 < 0.02);
        let steady = Clock::new(
            &ClockConfig {
                ramp_reversal_s: 0.0,
                ..config
            },
            5,
            120.0,
        );
        assert!((steady.drift(120.0).abs() * 1e9 - 60.0).abs() < 0.01);
    }

    #[test]
    fn the_initial_errors_are_drawn_and_zero_means_zero() {
        let offset = rms(400, |seed| {
            Clock::new(&ClockConfig::default(), seed, 0.0).offset_s(0.0)
        });
        let drift = rms(400, |seed| {
            Clock::new(&ClockConfig::default(), seed, 0.0).drift(0.0)
        });
        assert!((offset * 1e6 - 1.0).abs() < 0.12 && (drift * 1e6 / 0.3 - 1.0).abs() < 0.12);
        let ideal = Clock::new(&ClockConfig::ideal(), 3, 10.0);
        assert!(ideal.offset_s(7.3) == 0.0 && ideal.drift(7.3) == 0.0 && ideal.reading_s(7.3) == 7.3);
    }

    #[test]
    fn a_reading_finds_its_time() {
        let config = ClockConfig {
            initial_offset_us: 1e4,
            initial_drift_ppm: 50.0,
            ..ClockConfig::default()
        };
        let clock = Clock::new(&config, 11, 60.0);
        for k in 1..60 {
            let time = f64::from(k) * 0.977;
            assert!(
                (clock.time_at_s(clock.reading_s(time)) - time).abs() < 2e-14,
                "{time}"
            );
        }
    }
}
