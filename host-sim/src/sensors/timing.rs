//! Two-way timing: the exchange of packets that gives the offset of the UAV clock.
//!
//! Each side stamps what it sends and what it hears; half the difference of the two one-way delays is the clock offset.
//! The path length cancels, whatever the path, so the exchange works without line of sight too. The two directions
//! are microseconds apart, in which neither clock drift nor motion reaches a picosecond.

use serde::{Deserialize, Serialize};

use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Errors of the two-way timing. Defaults are the budget of design section 6.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TimingConfig {
    /// Exchanges per second, Hz; divides 1 000 000.
    pub rate_hz: u32,
    /// White error of an exchange, ns rms.
    pub white_ns: f64,
    /// Standard deviation of the constant error of a flight, ns: unequal delays of the two radios.
    pub fixed_ns: f64,
    /// Share of exchanges that succeed, 0..=1 (docs/localization.md, "The model").
    pub availability: f64,
    /// Whether exchanges go through the channel: they fail, and err, with its paths ([`super::OverAir`]).
    pub over_air: bool,
}

impl Default for TimingConfig {
    fn default() -> Self {
        Self {
            rate_hz: 2,
            white_ns: 0.3,
            fixed_ns: 0.1,
            availability: 0.9,
            over_air: false,
        }
    }
}

impl TimingConfig {
    /// Exchanges through the channel, between radios whose delays are known to 0.1 ns.
    pub fn real() -> Self {
        Self {
            white_ns: 0.0,
            availability: 1.0,
            over_air: true,
            ..Self::default()
        }
    }

    /// An exchange that always succeeds and never errs.
    pub fn ideal() -> Self {
        Self {
            white_ns: 0.0,
            fixed_ns: 0.0,
            availability: 1.0,
            ..Self::default()
        }
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        super::divides_a_second("timing.rate_hz", self.rate_hz)?;
        super::not_negative(&[
            ("timing.white_ns", self.white_ns),
            ("timing.fixed_ns", self.fixed_ns),
            ("timing.availability", self.availability),
        ])?;
        super::at_most_one("timing.availability", self.availability)
    }
}

/// Result of one exchange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimingSample {
    /// UAV clock less GMT clock, s.
    pub clock_offset_s: f64,
}

/// The exchanges of one flight: state of the simulation.
#[derive(Clone, Debug)]
pub struct Timing {
    fixed_s: f64,
    white_s: f64,
    availability: f64,
    random: Seeded,
}

impl Timing {
    /// The exchanges of the world of `seed`.
    pub fn new(config: &TimingConfig, seed: u64) -> Self {
        let mut random = Seeded::new(seed, Source::Timing);
        Self {
            fixed_s: config.fixed_ns * 1e-9 * random.normal(),
            white_s: config.white_ns * 1e-9,
            availability: config.availability,
            random,
        }
    }

    /// The next exchange, at a true offset of `offset_s`; `None` when it fails.
    pub fn measure(&mut self, offset_s: f64) -> Option<TimingSample> {
        let white_s = self.random.normal() * self.white_s;
        let succeeds = self.random.uniform() < self.availability;
        succeeds.then_some(TimingSample {
            clock_offset_s: offset_s + self.fixed_s + white_s,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_split_into_a_fixed_and_a_white_part() {
        let (flights, exchanges) = (2000, 50);
        let (mut between, mut within, mut count) = (0.0, 0.0, 0.0);
        for seed in 0..flights {
            let mut timing = Timing::new(&TimingConfig::default(), seed);
            let errors: Vec<f64> = (0..exchanges)
                .filter_map(|_| timing.measure(2e-6))
                .map(|sample| (sample.clock_offset_s - 2e-6) * 1e9)
                .collect();
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            between += mean * mean / f64::from(flights as u32);
            within += errors.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>();
            count += errors.len() as f64;
        }
        let white = (within / (count - f64::from(flights as u32))).sqrt();
        // The mean of 45 exchanges keeps 0.3 / sqrt 45 = 0.045 ns of the white part.
        let fixed = (between - white * white / (count / f64::from(flights as u32))).sqrt();
        assert!((white / 0.3 - 1.0).abs() < 0.03, "{white}");
        assert!((fixed / 0.1 - 1.0).abs() < 0.1, "{fixed} {white} {between}");
        let share = count / f64::from(flights as u32 * exchanges);
        assert!((share - 0.9).abs() < 0.01, "{share}");
    }

    #[test]
    fn zero_is_exactly_zero() {
        let mut timing = Timing::new(&TimingConfig::ideal(), 3);
        for k in 0..100 {
            let offset = f64::from(k) * 1e-8;
            assert_eq!(
                timing.measure(offset),
                Some(TimingSample {
                    clock_offset_s: offset
                })
            );
        }
    }
}
