//! How fast paths grow: the phase that a path's carrier gains between two pilots, its beam sent twice again after the sweep.
//!
//! Where the path is, the sweep has told. What is left of it in a pilot is its gain at each array: least squares, path after path, each from
//! what the ones before it have left, and once more for the paths that are asked for. An array's oscillator has one phase in both pilots, so the product of
//! the gains tells how far the carrier has turned, and the arrays' products add up:
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

use heapless::Vec;
use nalgebra::{Complex, Vector3};

use super::cancel::Source;
use super::estimated::EstimatedPath;
use super::fit::{REACH, fit};
use super::model::ArrayModel;
use super::place::Place;
use super::template::{SPAN, Template};
use super::window::{SINGLE, Window};
use crate::kernels::stages::Channel;
use crate::numeric::gather;
use crate::path::RangeRate;
use crate::signal::{SAMPLES, Waveform, phasor};

/// Standard deviation of a phase between two pilots beside noise, rad.
/// Derived: phase noise of the oscillators, 0.018 (`cslam accuracy range-rates`), and their walk between the beams of a sweep, 150 us apart: 0.026.
const PHASE_RAD: f32 = 0.03;

/// Standard deviation of a phase between two pilots beyond which it tells nothing, rad: three of them are a sixth of a turn.
/// Derived: of the gains of two blocks of noise fewer than one pair in a million pass. A path that is just found has 0.2 rad.
const MOST_PHASE_RAD: f32 = 0.35;
/// Share of an energy under which the difference of two energies is rounding.
/// Numerical: sums of 416 numbers in single precision; a phase is then known a hundred times better than oscillators allow.
const ROUNDING: f32 = 1e-5;
/// Beams whose pilots are listened to, those of the strongest paths.
/// Capacity: work, a million instructions a pilot.
pub(super) const BEAMS: usize = 4;

/// Gains of a path at the arrays in a pilot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains<const A: usize> {
    gains: [Complex<f32>; A],
    /// Variance of each by noise.
    noise: f32,
}

impl<const A: usize> Gains<A> {
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

/// Whether the pilots of a beam are listened to: it shows one of the paths best, and is among the [`BEAMS`] of the strongest.
pub(super) fn is_heard(paths: &[EstimatedPath], is_of: impl Fn(&EstimatedPath) -> bool) -> bool {
    let mut beams: Vec<u16, BEAMS> = Vec::new();
    for path in paths {
        if is_of(path) {
            return !beams.is_full() || beams.contains(&path.beam);
        }
        if !beams.contains(&path.beam) {
            let _full = beams.push(path.beam);
        }
    }
    false
}

/// Gains of paths in the taps of a pilot: of each, what the ones before it have left around it, and of the paths in `wanted` once more, what all
/// others leave. LSB of a tap.
pub(super) fn gains<const A: usize, const E: usize, const C: usize, const K: usize>(
    model: &ArrayModel<A, E>,
    template: &Template,
    taps: &[Channel; C],
    paths: &[EstimatedPath],
    wanted: impl Fn(&EstimatedPath) -> bool,
) -> Vec<Gains<A>, K> {
    let mut sources: Vec<Source<A>, K> = gather(paths.iter().map(|path| {
        let delay_taps = path.path.c_tau_m / model.metres_per_tap();
        let origin = libm::roundf(delay_taps);
        Source {
            origin: origin as usize & (SAMPLES - 1),
            delay_taps: delay_taps - origin,
            u: *path.path.aoa.vector(),
            gains: [Complex::new(0.0, 0.0); A],
        }
    }));
    let again: Vec<usize, K> =
        gather((0..paths.len()).filter(|index| paths.get(*index).is_some_and(&wanted)));
    // What is further away than the kernel's table reaches leaves nothing around them.
    let near: Vec<usize, K> = gather((0..paths.len()).filter(|index| {
        again
            .iter()
            .filter_map(|wanted| sources.get(*wanted).zip(sources.get(*index)))
            .any(|(wanted, other)| other.delay_from(wanted.origin).abs() < SPAN as f32)
    }));
    let mut noises = [0.0; K];
    for index in near.iter().chain(&again).copied() {
        let (gains, noise) = left_around(model, template, taps, &sources, index);
        if let (Some(source), Some(kept)) = (sources.get_mut(index), noises.get_mut(index)) {
            (source.gains, *kept) = (gains, noise);
        }
    }
    gather(sources.iter().zip(noises).map(|(source, noise)| Gains {
        gains: source.gains,
        noise: noise / E as f32,
    }))
}

/// Gains of a path in what the others, as far as theirs are known, leave around it, and the variance of a tap that is left then.
fn left_around<const A: usize, const E: usize, const C: usize>(
    model: &ArrayModel<A, E>,
    template: &Template,
    taps: &[Channel; C],
    sources: &[Source<A>],
    index: usize,
) -> ([Complex<f32>; A], f32) {
    let mut window = Window::<C, SINGLE>::new();
    let mut own = Place {
        delay_taps: 0.0,
        u: Vector3::zeros(),
    };
    if let Some(source) = sources.get(index) {
        own = Place {
            delay_taps: source.delay_taps,
            u: source.u,
        };
        window.load(taps, source.origin, -REACH, REACH, template.centre_turns());
        for other in sources.iter().enumerate().filter(|(place, _)| *place != index) {
            let (_, other) = other;
            let (delay_taps, gains) = other.seen_from(source.origin, template.centre_turns());
            // One that is not known yet leaves nothing, and neither does one that is too far away.
            if other.power() > 0.0 && delay_taps.abs() < SPAN as f32 {
                let place = Place {
                    delay_taps,
                    u: other.u,
                };
                window.add(model, template, &place, &gains.map(|gain| -gain));
            }
        }
    }
    let fit = fit::<1, 3, A, E, C, SINGLE>(model, template, &window, [own], 0.0, 0);
    let content = window.content();
    let left = (content.energy - fit.energy).max(ROUNDING * content.energy);
    let noise = left / (template.occupancy() * content.samples.max(1) as f32);
    let [gains] = fit.gains;
    (gains, noise)
}

#[cfg(test)]
mod tests;
