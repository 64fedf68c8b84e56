//! How fast paths grow: the phase that a path's carrier gains between two pilots, its beam sent twice again after the sweep.
//!
//! Where the path is, the sweep has told. What is left of it in a pilot is its gain at each array ([`reading`]). An array's oscillator has one phase in
//! both pilots, so the product of the gains tells how far the carrier has turned, and the arrays' products add up:
//!
//! ```text
//! phase = arg sum_j g2_j conj(g1_j) exp(-j 2 pi / lambda u.(w x p_j) T)      w: rate of turn of the body, p_j: centre of array j
//! rate = -lambda phase / (2 pi T)
//! ```
//! How well that is known, the pilots themselves tell: the phase's variance is
//!
//! ```text
//! max((n2 P1 + n1 P2 + A n1 n2) / (2 S), D / ((2 A - 1) (P1 + P2) / 2))     P = sum_j |g_j|^2, S = |sum_j g2_j conj(g1_j)|^2
//! ```
//! The first is what noise makes, `n` its variance in a gain by what the fit leaves around the path, be it noise or other paths. `D` is what the gains of the `A` arrays differ by beside the phase: those of a path that is alone are the same twice. Pilots of zeros or of
//! noise give no rate.
//!
//! The frequency offset of the two ends is in every path's rate, the same in all.

use nalgebra::{Complex, Vector3};

use super::estimated::EstimatedPath;
use super::model::ArrayModel;
use crate::path::RangeRate;
use crate::signal::{Waveform, phasor};

pub(super) mod reading;

/// Standard deviation of a phase between two pilots beside noise, rad.
/// Derived: phase noise of the oscillators, 0.018 (`cslam accuracy range-rates`), and their walk between the beams of a sweep, 150 us apart: 0.026.
const PHASE_RAD: f32 = 0.03;

/// Standard deviation of a phase between two pilots beyond which it tells nothing, rad: three of them are a sixth of a turn.
/// Derived: of the gains of two blocks of noise fewer than one pair in a million pass. A path that is just found has 0.2 rad.
const MOST_PHASE_RAD: f32 = 0.35;
/// Gains of a path at the arrays in a pilot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains<const A: usize> {
    gains: [Complex<f32>; A],
    /// Variance of each by noise.
    noise: f32,
}

impl<const A: usize> Gains<A> {
    /// Of no path.
    const NONE: Self = Self {
        gains: [Complex::new(0.0, 0.0); A],
        noise: 0.0,
    };

    /// The same in units of `1 / scale`.
    pub(super) fn scaled(&self, scale: f32) -> Self {
        Self {
            gains: self.gains.map(|gain| gain * scale),
            noise: self.noise * scale * scale,
        }
    }

    fn power(&self) -> f32 {
        self.gains.iter().map(|gain| gain.norm_sqr()).sum()
    }
}

/// What is kept of the pilots of a sweep of `K` paths.
#[derive(Clone, Debug)]
pub(super) struct Pilots<const A: usize, const K: usize> {
    /// Gains of each path in the first pilot of its beam.
    first: [Option<Gains<A>>; K],
    wavelength_m: f32,
    /// Turns of the carrier over a tap.
    carrier_turns: f32,
}

impl<const A: usize, const K: usize> Pilots<A, K> {
    pub(super) fn new(waveform: &Waveform) -> Self {
        Self {
            first: [None; K],
            wavelength_m: waveform.wavelength_m() as f32,
            carrier_turns: (waveform.carrier_hz / waveform.sample_rate_hz) as f32,
        }
    }

    /// Forgets the pilots of a sweep.
    pub(super) fn clear(&mut self) {
        self.first = [None; K];
    }

    /// Notes the gains of a path in one of its pilots, both in one unit; after the second, how fast it grows. Nothing of a second one without a first one.
    pub(super) fn heard<const E: usize>(
        &mut self,
        model: &ArrayModel<A, E>,
        again: bool,
        path: (usize, &EstimatedPath),
        second: Gains<A>,
        turn_rad_per_s: &Vector3<f32>,
    ) -> Option<RangeRate> {
        let (index, path) = path;
        let kept = self.first.get_mut(index)?;
        if !again {
            *kept = Some(second);
            return None;
        }
        let first = kept.take()?;
        let apart_s = Waveform::PILOT_INTERVAL_S as f32;
        let mut pairs = [[Complex::new(0.0, 0.0); 2]; A];
        let arrays = model.arrays().zip(second.gains.iter().zip(&first.gains));
        for (pair, ((_, lead), (second, first))) in pairs.iter_mut().zip(arrays) {
            let moved_taps = turn_rad_per_s.cross(lead).dot(path.path.aoa.vector()) * apart_s;
            *pair = [*first * phasor(self.carrier_turns * moved_taps), *second];
        }
        let sum: Complex<f32> = pairs.iter().map(|[first, second]| second * first.conj()).sum();
        let turned = sum / libm::sqrtf(sum.norm_sqr());
        let rest: f32 = pairs
            .iter()
            .map(|[first, second]| (second - first * turned).norm_sqr())
            .sum();
        let (one, other) = (first.power(), second.power());
        let both = second.noise * one + first.noise * other + A as f32 * first.noise * second.noise;
        // Gains of zero give no number, or infinity.
        let noise = both / (2.0 * sum.norm_sqr());
        let differs = rest / (0.5 * (one + other) * (2 * A - 1) as f32);
        let phase_rad = libm::sqrtf(noise.max(differs) + PHASE_RAD * PHASE_RAD);
        let period_m_per_s = self.wavelength_m / apart_s;
        let turns = libm::atan2f(sum.im, sum.re) / core::f32::consts::TAU;
        let rate = RangeRate {
            m_per_s: -period_m_per_s * turns,
            sigma_m_per_s: period_m_per_s * phase_rad / core::f32::consts::TAU,
            period_m_per_s,
        };
        (phase_rad < MOST_PHASE_RAD && sum.norm_sqr().is_finite()).then_some(rate)
    }
}

#[cfg(test)]
mod tests;
