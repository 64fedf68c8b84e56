//! The strongest subcarrier names the direction: the paper's rule, and a parabola through the peak.
//!
//! Of the symbols that sweep an axis, the one with the strongest subcarrier is read: its beam of frequency f looks to
//! `s = (psi + 2 T f) / (1 + f/fc)` (docs/signal-model.md, "Beam squint"). Where a symbol sweeps both axes, the faster sweep makes the peak, and
//! the slower one is known to the spacing of its passes only.

use nalgebra::{Matrix3, Vector3};

use super::Refusal;
use super::fit::ReceivedSymbols;
use super::reception::Spectrum;
use crate::array::SquintSymbol;

/// Reach of the parabola on both sides and width of the smoothing, as shares of a lobe (peak to null): 20 and 9
/// subcarriers of an azimuth sweep.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const REACH: f32 = 1.0 / 3.0;
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const SMOOTHING: f32 = 0.15;
/// What a parabola gets wrong of a lobe that is none, and that the band may cut, as a share of the lobe (measured).
/// Measured: against the lobe itself (docs/beam-squint.md).
const MODEL: f32 = 0.003;
/// Most subcarriers of the reach.
/// Capacity: memory of a parabola.
const MOST: usize = 40;
/// Noise variances over which the strongest subcarrier must stand.
/// Derived: of 5000 of noise, one in a hundred thousand does.
pub(super) const LEAST_PEAK: f32 = 20.0;

/// One axis read off a peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reading {
    pub(super) cosine: f32,
    pub(super) variance: f32,
}

/// A symbol's peak along an axis.
struct Peak<'a, const ACTIVE: usize> {
    symbol: &'a SquintSymbol,
    spectrum: &'a Spectrum<ACTIVE>,
    index: usize,
    /// Cosine per subcarrier of this axis, of the axis that makes the peak, and of the other one, as if elements were half a wavelength apart.
    step: f32,
    sharp_step: f32,
    slow_step: f32,
}

impl<const ACTIVE: usize> Peak<'_, ACTIVE> {
    /// The cosine at a (fractional) subcarrier, in -1..=1, and its variance from that of the subcarrier.
    fn read<const SYMBOLS: usize>(
        &self,
        received: &ReceivedSymbols<'_, SYMBOLS, ACTIVE>,
        axis: usize,
        index: f32,
        index_variance: f32,
    ) -> Reading {
        let f = received.band.offset_ghz(index);
        let aim = self.symbol.aim(f, received.band.carrier_ghz);
        let s = aim.get(axis).copied().unwrap_or(0.0);
        // The array repeats after this.
        let spacing = self.symbol.half_wavelengths;
        let period = 2.0 / (1.0 + f / received.band.carrier_ghz) / spacing;
        // Anywhere between two passes of the slow axis; and there the slope of its lobe moves the peak of the sharp
        // one.
        let ratio = self.slow_step / self.sharp_step;
        let spacing_variance = 4.0 * ratio * ratio / 12.0;
        let unknown = if self.step == self.sharp_step {
            spacing_variance * ratio * ratio
        } else {
            spacing_variance
        };
        Reading {
            cosine: s - period * libm::floorf(s / period + 0.5),
            variance: (self.step * self.step * index_variance + unknown) / (spacing * spacing),
        }
    }
}

/// The symbol with the strongest subcarrier among those that sweep an axis.
#[inline(never)]
fn strongest<'a, const SYMBOLS: usize, const ACTIVE: usize>(
    received: &ReceivedSymbols<'a, SYMBOLS, ACTIVE>,
    axis: usize,
) -> Result<Peak<'a, ACTIVE>, Refusal> {
    let mut best: Option<(f32, Peak<'a, ACTIVE>)> = None;
    for (symbol, spectrum) in received.symbols() {
        let steps = symbol
            .delay_ns
            .map(|delay_ns| 2.0 * delay_ns * received.band.step_ghz);
        let step = steps.get(axis).copied().unwrap_or(0.0);
        if step == 0.0 {
            continue;
        }
        for (index, y) in spectrum.bins.iter().enumerate() {
            let power = y.norm_sqr() / spectrum.noise;
            if best.as_ref().is_none_or(|(most, _)| power > *most) {
                let (sharp_step, slow_step) = if steps[0].abs() > steps[1].abs() {
                    (steps[0], steps[1])
                } else {
                    (steps[1], steps[0])
                };
                let peak = Peak {
                    symbol,
                    spectrum,
                    index,
                    step,
                    sharp_step,
                    slow_step,
                };
                best = Some((power, peak));
            }
        }
    }
    match best {
        None => Err(Refusal::SymbolsMissing),
        Some((power, peak)) if power > LEAST_PEAK => Ok(peak),
        Some(_) => Err(Refusal::TooWeak),
    }
}

/// Peak subcarrier: the paper's rule. `N` elements along the axis.
///
/// Its error is half a subcarrier, and what noise makes of a flat top: subcarriers compete where the lobe has fallen by
/// less than the noise of a power.
pub(super) fn pick<const N: usize, const SYMBOLS: usize, const ACTIVE: usize>(
    received: &ReceivedSymbols<'_, SYMBOLS, ACTIVE>,
    axis: usize,
) -> Result<Reading, Refusal> {
    let peak = strongest(received, axis)?;
    let power = peak.spectrum.bins.get(peak.index).map_or(0.0, |y| y.norm_sqr());
    let noise = libm::sqrtf(2.0 * peak.spectrum.noise / power);
    // The lobe of N elements falls by (N^2 - 1)/12 (pi s)^2.
    let bend = (N * N - 1) as f32 / 12.0 * core::f32::consts::PI * core::f32::consts::PI;
    let per_index = bend * peak.sharp_step * peak.sharp_step;
    Ok(peak.read(
        received,
        axis,
        peak.index as f32,
        1.0 / 12.0 + 0.5 * noise / per_index,
    ))
}

/// Vertex of the parabola through the smoothed log power around the peak. `N` elements along the axis.
pub(super) fn parabola<const N: usize, const SYMBOLS: usize, const ACTIVE: usize>(
    received: &ReceivedSymbols<'_, SYMBOLS, ACTIVE>,
    axis: usize,
) -> Result<Reading, Refusal> {
    let peak = strongest(received, axis)?;
    let bins = &peak.spectrum.bins;
    let lobe = 2.0 / (N as f32 * peak.sharp_step.abs());
    let reach = ((REACH * lobe + 0.5) as usize).clamp(2, MOST);
    let half = (0.5 * SMOOTHING * lobe) as usize;
    let power = |index: usize| {
        bins.get(index)
            .map_or(0.0, |y| y.norm_sqr() / peak.spectrum.noise)
    };
    let smooth = |index: usize| {
        let (first, last) = (index.saturating_sub(half), (index + half).min(ACTIVE - 1));
        let sum: f32 = (first..=last).map(power).sum();
        // Under a tenth of the noise there is only noise.
        (sum / (last + 1 - first) as f32 - 1.0).max(0.1)
    };
    let around = |index: usize| index.saturating_sub(reach)..(index + reach + 1).min(ACTIVE);
    // The smoothed peak is near the highest subcarrier, whose place noise has chosen.
    let top = around(peak.index)
        .max_by(|a, b| smooth(*a).total_cmp(&smooth(*b)))
        .ok_or(Refusal::NoPeak)?;
    let (mut matrix, mut vector) = (Matrix3::zeros(), Vector3::zeros());
    for index in around(top) {
        let x = index as f32 - top as f32;
        let p = smooth(index);
        let column = Vector3::new(1.0, x, x * x);
        // The variance of a log power is 2/P noise variances; smoothing hardly changes what a smooth fit makes of it.
        matrix += column * column.transpose() * (0.5 * p);
        vector += column * (0.5 * p * libm::logf(p));
    }
    let spread = matrix.try_inverse().ok_or(Refusal::NoPeak)?;
    let fit = spread * vector;
    let bend = -2.0 * fit.z;
    let vertex = fit.y / bend;
    if !(bend > 0.0 && vertex.abs() <= reach as f32) {
        return Err(Refusal::NoPeak);
    }
    let slope = Vector3::new(0.0, 1.0 / bend, 2.0 * vertex / bend);
    let variance = slope.dot(&(spread * slope)) + (MODEL * lobe) * (MODEL * lobe);
    Ok(peak.read(received, axis, top as f32 + vertex, variance))
}
