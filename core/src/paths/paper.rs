//! Paper mode: the low-rank decomposition as published, with what it lacks to feed the reflection solver.
//!
//! The correlations of all beams in a window of taps are unfolded into a matrix of channels x (tap, beam). Its leading
//! left singular vectors stand for paths: each is scanned over a grid of angles, its arrays added without phase; the right
//! singular vector's strongest entry gives tap and beam. Source: Mou and Gao, eq. (rho) and what follows, after the method
//! it borrows (docs/paper-to-code.md, "Where this differs from the paper").
//!
//! Ours, so that it can be compared at all: the scan covers elevation too, since horizontal angles alone cannot locate a
//! point; delays are absolute, where the published one subtracts the first. And for a bounded memory the window lies
//! around each beam's own strongest tap, not around that of the sweep, which is known only at its end.
//!
//! What it cannot do is published here as well: delays are whole taps (1.22 m), angles grid points, and singular vectors
//! are orthogonal, which paths are not. Its covariance is that of the grid. The paper does not say whether a delay may lie
//! between two taps, so both are here: [`TapDelays`].
//!
//! Given: numbers here are those of the paper's method, or bounds of its work; it is a baseline.

mod gram;

use heapless::Vec;
use nalgebra::{Complex, Matrix3, Vector3};

use self::gram::Gram;
use super::PathEstimator;
use super::config::EstimatorConfig;
use super::estimated::{BeamReport, EstimatedPath};
use super::model::ArrayModel;
use super::nomp::vertex;
use super::template::Template;
use crate::geometry::{Direction, Gmt};
use crate::kernels::Iq;
use crate::path::{Departure, Path};
use crate::signal::{BeamBlock, Correlator, Detector, SAMPLES, Workspace, phasor, round_half_up};

/// Taps kept of a beam: five on either side of its peak.
const KEPT: usize = 11;
/// Steps of the angle scan, degrees of azimuth and of elevation.
const AZIMUTH_STEP_DEG: usize = 1;
const ELEVATION_STEP_DEG: usize = 2;
/// Points of the spatial spectrum in which the scan looks directions up; linear in between would change nothing visible.
const BINS: usize = 256;
/// Taps on either side of the strongest one, and steps of half a tap, by which a delay between taps is sought.
const AROUND: usize = 2;
const HALF_TAP_STEPS: i32 = 16;
/// Error of a delay between taps without noise, standard deviation, m: the arrays lie 0.2 m around the body's centre, which
/// this method does not take out (docs/signal-model.md, "Arrays").
const LEVER_ARM_M: f32 = 0.103;
/// Speed of light over 2 pi times the rms bandwidth, m (docs/signal-model.md, "Waveform and link budget"): by the root of twice the SNR of all elements and
/// subcarriers together it gives the bound of a delay.
const BAND_M: f32 = 0.828;

/// Where a path's delay lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TapDelays {
    /// On the strongest tap, as published.
    #[default]
    Whole,
    /// Between the taps, where the right singular vector fits the band's kernel best.
    Interpolated,
}

/// The kept taps of a beam.
#[derive(Clone, Copy, Debug)]
struct Kept<const C: usize> {
    taps: [[Iq; KEPT]; C],
    first: usize,
    exponent: i32,
    /// Noise variance of a tap, squared LSB.
    noise: f32,
}

/// Paper mode. `A` arrays of `E` elements (`C` = A E channels), `BEAMS` transmit beams, `K` paths reported.
#[derive(Clone, Debug)]
pub struct PaperEstimator<
    const A: usize = 4,
    const E: usize = 8,
    const C: usize = 32,
    const BEAMS: usize = 72,
    const K: usize = 9,
> {
    model: ArrayModel<A, E>,
    template: Template,
    delays: TapDelays,
    detector: Detector,
    correlator: Correlator,
    beam_directions: [Option<Direction<Gmt>>; BEAMS],
    active: f32,
    share: f32,
    work: Workspace,
    beams: [Option<Kept<C>>; BEAMS],
    /// Of the unfolding, deflated path by path.
    gram: Gram<C>,
}

impl<const A: usize, const E: usize, const C: usize, const BEAMS: usize, const K: usize>
    PaperEstimator<A, E, C, BEAMS, K>
{
    /// An estimator with empty state, delays on whole taps. All tables are computed here.
    pub fn new<const FACES: usize, const X: usize, const Z: usize, const ELEVATIONS: usize>(
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
    ) -> Self {
        const { assert!(C == A * E) };
        let tests = BEAMS * config.waveform.active;
        Self {
            model: ArrayModel::new(&config.arrays, &config.waveform),
            template: Template::new(&config.waveform),
            delays: TapDelays::Whole,
            detector: Detector::new(C, config.false_alarms_per_sweep, tests),
            correlator: Correlator::new(&config.waveform),
            beam_directions: core::array::from_fn(|m| {
                let beam = config.codebook.beam(m)?;
                Direction::from_vector(beam.direction()).ok()
            }),
            active: config.waveform.active as f32,
            share: libm::powf(10.0, -0.1 * config.dynamic_range_db),
            work: Workspace::new(),
            beams: [None; BEAMS],
            gram: Gram::zero(),
        }
    }

    /// The same with delays of this kind.
    #[must_use]
    pub fn with_delays(self, delays: TapDelays) -> Self {
        Self { delays, ..self }
    }

    /// Columns of the unfolding, amplitude units over 2^`exponent`, with beam and tap.
    fn columns(&self, exponent: i32) -> impl Iterator<Item = (usize, usize, [Complex<f32>; C])> {
        let kept = self
            .beams
            .iter()
            .enumerate()
            .filter_map(|(m, kept)| Some((m, kept.as_ref()?)));
        kept.flat_map(move |(m, kept)| {
            let scale = libm::scalbnf(1.0, kept.exponent - exponent);
            (0..KEPT).map(move |t| {
                let column = core::array::from_fn(|c| {
                    let x = kept.taps.get(c).and_then(|row| row.get(t));
                    let x = x.copied().unwrap_or(Iq::ZERO);
                    Complex::new(f32::from(x.re()), f32::from(x.im())) * scale
                });
                (m, kept.first + t, column)
            })
        })
    }

    /// Direction of the grid that a singular vector fits best, arrays added without phase.
    fn scan(&self, vector: &[Complex<f32>; C]) -> Vector3<f32> {
        let mut spectra = [[0.0_f32; BINS]; A];
        for (spectrum, elements) in spectra.iter_mut().zip(vector.as_chunks::<E>().0) {
            for (bin, power) in spectrum.iter_mut().enumerate() {
                let step = phasor(-(bin as f32) / BINS as f32);
                // Horner's scheme over the elements.
                let sum = elements
                    .iter()
                    .rev()
                    .fold(Complex::new(0.0, 0.0), |sum, x| sum * step + x);
                *power = sum.norm_sqr();
            }
        }
        let turns: [_; 360 / AZIMUTH_STEP_DEG] =
            core::array::from_fn(|azimuth| phasor((azimuth * AZIMUTH_STEP_DEG) as f32 / 360.0));
        let (mut best, mut most) = (Vector3::z(), -1.0);
        for elevation in 0..=180 / ELEVATION_STEP_DEG {
            let zenith = phasor((elevation * ELEVATION_STEP_DEG) as f32 / 360.0);
            for turn in &turns {
                let u = Vector3::new(zenith.im * turn.re, zenith.im * turn.im, zenith.re);
                let mut sum = 0.0;
                for (spectrum, step) in spectra.iter().zip(self.model.steps()) {
                    let bin = round_half_up(BINS as f32 * step.dot(&u)) & (BINS as i32 - 1);
                    sum += spectrum[bin as usize & (BINS - 1)];
                }
                if sum > most {
                    (best, most) = (u, sum);
                }
            }
        }
        best
    }

    /// Entries of the right singular vector that belongs to a left one, with beam and tap.
    fn entries(
        &self,
        vector: &[Complex<f32>; C],
        exponent: i32,
    ) -> impl Iterator<Item = (usize, usize, Complex<f32>)> {
        self.columns(exponent).map(move |(m, n, column)| {
            let mut sum = Complex::new(0.0, 0.0);
            for (v, y) in vector.iter().zip(&column) {
                sum += v.conj() * y;
            }
            (m, n, sum)
        })
    }

    /// Tap, beam and power of the strongest entry of a right singular vector.
    fn strongest_entry(&self, vector: &[Complex<f32>; C], exponent: i32) -> (usize, usize, f32) {
        let (mut tap, mut beam, mut most) = (0, 0, 0.0);
        for (m, n, sum) in self.entries(vector, exponent) {
            let power = sum.norm_sqr();
            if power > most {
                (tap, beam, most) = (n & (SAMPLES - 1), m, power);
            }
        }
        (tap, beam, most)
    }

    /// Where the kernel of the band fits the entries around the strongest one best, in taps from there: -0.5..=0.5.
    fn between(&self, vector: &[Complex<f32>; C], exponent: i32, tap: usize, beam: usize) -> f32 {
        let mut around: Vec<(f32, Complex<f32>), { 2 * AROUND + 1 }> = Vec::new();
        for (_, n, entry) in self.entries(vector, exponent).filter(|(m, ..)| *m == beam) {
            let place = (n + AROUND).wrapping_sub(tap) & (SAMPLES - 1);
            if place <= 2 * AROUND {
                // There is room for all of them.
                let _fits = around.push((place as f32 - AROUND as f32, entry));
            }
        }
        // Energy that a path at this delay explains. The band's centre turns a tap by a thousandth: left out.
        let explained = |step: i32| {
            let delay = 0.5 * step as f32 / HALF_TAP_STEPS as f32;
            let (mut sum, mut kernel) = (Complex::new(0.0, 0.0), 0.0);
            for (place, entry) in &around {
                let [d, _] = self.template.at(place - delay);
                sum += entry * d;
                kernel += d * d;
            }
            sum.norm_sqr() / kernel
        };
        let (mut best, mut most) = (0, -1.0);
        for step in -HALF_TAP_STEPS..=HALF_TAP_STEPS {
            let energy = explained(step);
            if energy > most {
                (best, most) = (step, energy);
            }
        }
        let vertex = vertex([explained(best - 1), most, explained(best + 1)]);
        (0.5 * (best as f32 + vertex) / HALF_TAP_STEPS as f32).clamp(-0.5, 0.5)
    }

    fn path(&self, vector: &[Complex<f32>; C], exponent: i32) -> Option<EstimatedPath> {
        let aoa = Direction::from_vector(self.scan(vector)).ok()?;
        let (tap, beam, power) = self.strongest_entry(vector, exponent);
        let kept = (*self.beams.get(beam)?)?;
        let energy = power * libm::scalbnf(1.0, 2 * exponent);
        let noise = kept.noise * libm::scalbnf(1.0, 2 * kept.exponent);
        // Uniform over a cell: its square over 12. A beam's cell is 7 degrees wide (half of the codebook's spacing on either side).
        let uniform = |cell: f32| cell * cell / 12.0;
        let angle = |degrees: usize| uniform((degrees as f32).to_radians());
        let (delay_taps, delay_variance_m2) = match self.delays {
            TapDelays::Whole => (0.0, uniform(self.model.metres_per_tap())),
            TapDelays::Interpolated => (
                self.between(vector, exponent, tap, beam),
                LEVER_ARM_M * LEVER_ARM_M + BAND_M * BAND_M * 0.5 * noise / energy.max(f32::MIN_POSITIVE),
            ),
        };
        let covariance = Matrix3::from_diagonal(&Vector3::new(
            delay_variance_m2,
            angle(AZIMUTH_STEP_DEG),
            angle(ELEVATION_STEP_DEG),
        ));
        let aod = self
            .beam_directions
            .get(beam)
            .copied()
            .flatten()
            .map(|direction| Departure {
                direction,
                sigma_rad: libm::sqrtf(uniform(14.0_f32.to_radians())),
            });
        let snr = energy / (C as f32 * self.active * noise.max(f32::MIN_POSITIVE));
        Some(EstimatedPath {
            path: Path {
                c_tau_m: self.model.metres(tap, delay_taps),
                aoa,
                aod,
                covariance,
            },
            beam: beam as u16,
            snr_db: 10.0 * libm::log10f(snr),
            energy: energy / (self.active * self.active),
            range_rate: None,
        })
    }
}

impl<const A: usize, const E: usize, const C: usize, const BEAMS: usize, const K: usize> PathEstimator<C, K>
    for PaperEstimator<A, E, C, BEAMS, K>
{
    fn push_beam(&mut self, block: BeamBlock<'_, C>) -> BeamReport {
        let scaled = self.correlator.scale(block);
        let power = scaled.mean_power() as f32;
        let taps = self.correlator.correlate(scaled, &mut self.work);
        let (clips, unexamined) = (taps.clips(), taps.unexamined());
        let peak = self.detector.peak(taps.profile());
        let BeamBlock {
            samples,
            beam,
            exponent,
        } = taps.into_block();
        let kept = peak.map(|peak| {
            let first = peak.tap.wrapping_sub(KEPT / 2) & (SAMPLES - 1);
            Kept {
                taps: core::array::from_fn(|c| {
                    core::array::from_fn(|t| samples[c][(first + t) & (SAMPLES - 1)])
                }),
                first,
                exponent,
                noise: peak.noise,
            }
        });
        let paths = u8::from(kept.is_some());
        if let Some(slot) = self.beams.get_mut(usize::from(beam)) {
            *slot = kept;
        }
        BeamReport {
            paths,
            power,
            weak: false,
            left_out: false,
            clips,
            unexamined,
        }
    }

    fn front_end(&mut self) -> (&Correlator, &mut Workspace) {
        (&self.correlator, &mut self.work)
    }

    fn finish(&mut self) -> Vec<EstimatedPath, K> {
        let mut paths: Vec<EstimatedPath, K> = Vec::new();
        let exponent = self.beams.iter().flatten().map(|kept| kept.exponent).max();
        if let Some(exponent) = exponent {
            self.gram = Gram::of(self.columns(exponent).map(|(_, _, column)| column));
            while !paths.is_full() {
                let Some((vector, value)) = self.gram.next_vector() else {
                    break;
                };
                // No entry of a right singular vector has more energy than its eigenvalue. One that could not be reported is
                // not looked at: below some 70 dB what deflation leaves is rounding, and points anywhere.
                let most = value * libm::scalbnf(1.0, 2 * exponent) / (self.active * self.active);
                let least = paths.first().map_or(0.0, |first| self.share * first.energy);
                let Some(path) = (most >= least).then(|| self.path(&vector, exponent)).flatten() else {
                    break;
                };
                let strongest = paths.first().map_or(path.energy, |first| first.energy);
                if path.energy < self.share * strongest {
                    break;
                }
                let _ = paths.push(path);
            }
        }
        self.beams = [None; BEAMS];
        paths
    }
}

#[cfg(test)]
mod tests;
