//! Random processes over the minutes of a flight, as a function of time: any sweep may ask first.
//!
//! A sum of cosines whose frequencies are drawn from the spectrum and whose phases are uniform has, over the draws, the
//! autocorrelation that belongs to the spectrum.

use std::f64::consts::{PI, TAU};

use crate::random::Stream;

/// Cosines of a process: enough for values that are close to normal.
const COSINES: usize = 32;

/// A stationary process of mean zero.
#[derive(Clone, Debug)]
pub(crate) struct SlowProcess {
    amplitude: f64,
    /// Angular frequency, rad/s, and phase, rad.
    cosines: [[f64; 2]; COSINES],
}

impl SlowProcess {
    /// Of the autocorrelation `rms^2 exp(-|t| / time_s)`: a Gauss-Markov process. Its spectrum is a Cauchy density.
    pub(crate) fn gauss_markov(rms: f64, time_s: f64, stream: &mut Stream) -> Self {
        // The argument stays a hair off +-pi/2, where the tangent has no bound: no faster than a turn in time_s / 1e4.
        let rad_per_s = |uniform: f64| libm::tan(PI * 0.999_98 * (uniform - 0.5)) / time_s;
        let cosine = |_| [rad_per_s(stream.uniform()), TAU * stream.uniform()];
        Self {
            amplitude: rms * (2.0 / COSINES as f64).sqrt(),
            cosines: std::array::from_fn(cosine),
        }
    }

    /// Of the autocorrelation `rms^2 exp(-t^2 / (2 time_s^2))`: smooth, its rate has the rms `rms / time_s`.
    pub(crate) fn smooth(rms: f64, time_s: f64, stream: &mut Stream) -> Self {
        let cosine = |_| [stream.normal() / time_s, TAU * stream.uniform()];
        Self {
            amplitude: rms * (2.0 / COSINES as f64).sqrt(),
            cosines: std::array::from_fn(cosine),
        }
    }

    /// Its value at a time, s.
    pub(crate) fn at(&self, time_s: f64) -> f64 {
        let sum: f64 = self
            .cosines
            .iter()
            .map(|[w, phase]| libm::cos(w * time_s + phase))
            .sum();
        self.amplitude * sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gauss_markov_process_forgets_exponentially() {
        let (rms, time_s, draws) = (0.5, 60.0, 4000);
        let mut sums = [0.0; 4];
        for seed in 0..draws {
            let process = SlowProcess::gauss_markov(rms, time_s, &mut Stream::new(seed, 0));
            let now = process.at(100.0);
            for (sum, later_s) in sums.iter_mut().zip([0.0, 30.0, 60.0, 120.0]) {
                *sum += now * process.at(100.0 + later_s) / draws as f64;
            }
        }
        for (sum, later_s) in sums.iter().zip([0.0, 30.0, 60.0, 120.0]) {
            let expected = rms * rms * libm::exp(-later_s / time_s);
            // A product of two normals has an rms of at most sqrt(2) rms^2: four standard errors.
            assert!(
                (sum - expected).abs() < 0.09 * rms * rms,
                "{later_s} s: {sum} {expected}"
            );
        }
    }
}
