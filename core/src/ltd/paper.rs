//! Paper mode: the low-rank decomposition as published, with what it lacks to feed the reflection solver.
//!
//! The correlations of all beams in a window of taps are unfolded into a matrix of channels x (tap, beam). Its leading
//! left singular vectors stand for paths: each is scanned over a grid of angles, its arrays added without phase; the right
//! singular vector's strongest entry gives tap and beam. Source: paper.tex, eq. (rho) and what follows, after the method
//! it borrows (signal.md section 8).
//!
//! Ours, so that it can be compared at all: the scan covers elevation too, since horizontal angles alone cannot locate a
//! point; delays are absolute, where the published one subtracts the first. And for a bounded memory the window lies
//! around each beam's own strongest tap, not around that of the sweep, which is known only at its end.
//!
//! What it cannot do is published here as well: delays are whole taps (1.22 m), angles grid points, and singular vectors
//! are orthogonal, which paths are not. Its covariance is that of the grid.

use heapless::Vec;
use nalgebra::{Complex, Matrix3, Vector3};

use super::PathEstimator;
use super::correlator::{Correlator, Workspace};
use super::detector::Detector;
use super::estimator::{BeamReport, EstimatedPath, EstimatorConfig};
use super::iq::Iq;
use super::model::ArrayModel;
use super::phase::{phasor, round_half_up};
use crate::block::BeamBlock;
use crate::geometry::{Direction, Gmt, Rotation, World};
use crate::path::{Departure, Path};
use crate::waveform::SAMPLES;

/// Taps kept of a beam: five on either side of its peak.
const KEPT: usize = 11;
/// Steps of the angle scan, degrees of azimuth and of elevation.
const AZIMUTH_STEP_DEG: usize = 1;
const ELEVATION_STEP_DEG: usize = 2;
/// Points of the spatial spectrum in which the scan looks directions up; linear in between would change nothing visible.
const BINS: usize = 256;
/// Power iterations for one singular vector.
const ITERATIONS: usize = 60;

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
    detector: Detector,
    correlator: Correlator,
    beam_directions: [Option<Direction<Gmt>>; BEAMS],
    gmt_attitude: Rotation<Gmt, World>,
    active: f32,
    share: f32,
    work: Workspace,
    beams: [Option<Kept<C>>; BEAMS],
    /// `Y Y^H` of the unfolding, deflated path by path.
    gram: [[Complex<f32>; C]; C],
}

impl<const A: usize, const E: usize, const C: usize, const BEAMS: usize, const K: usize>
    PaperEstimator<A, E, C, BEAMS, K>
{
    /// An estimator with empty state. All tables are computed here.
    pub fn new<const FACES: usize, const X: usize, const Z: usize, const ELEVATIONS: usize>(
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
    ) -> Self {
        const { assert!(C == A * E) };
        let tests = BEAMS * config.waveform.active;
        Self {
            model: ArrayModel::new(&config.arrays, &config.waveform),
            detector: Detector::new(C, config.false_alarms_per_sweep, tests),
            correlator: Correlator::new(&config.waveform),
            beam_directions: core::array::from_fn(|m| {
                let beam = config.codebook.beam(m)?;
                Direction::from_vector(beam.direction()).ok()
            }),
            gmt_attitude: config.gmt_attitude,
            active: config.waveform.active as f32,
            share: libm::powf(10.0, -0.1 * config.dynamic_range_db),
            work: Workspace::new(),
            beams: [None; BEAMS],
            gram: [[Complex::new(0.0, 0.0); C]; C],
        }
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

    fn build_gram(&mut self, exponent: i32) {
        let mut gram = [[Complex::new(0.0, 0.0); C]; C];
        for (_, _, column) in self.columns(exponent) {
            for (row, a) in gram.iter_mut().zip(&column) {
                for (sum, b) in row.iter_mut().zip(&column) {
                    *sum += a * b.conj();
                }
            }
        }
        self.gram = gram;
    }

    /// Leading eigenvector of the Gram matrix, unit norm, taken out of it, and its eigenvalue. None when nothing is left.
    fn next_vector(&mut self) -> Option<([Complex<f32>; C], f32)> {
        // Start from the strongest row: it has the largest part of the leading vector.
        let power = |row: &[Complex<f32>; C]| row.iter().map(|x| x.norm_sqr()).sum::<f32>();
        let mut vector = *self.gram.iter().max_by(|a, b| power(a).total_cmp(&power(b)))?;
        for x in &mut vector {
            *x = x.conj();
        }
        let mut value = normalise(&mut vector)?;
        for _ in 0..ITERATIONS {
            let mut next = [Complex::new(0.0, 0.0); C];
            for (sum, row) in next.iter_mut().zip(&self.gram) {
                for (g, x) in row.iter().zip(&vector) {
                    *sum += g * x;
                }
            }
            vector = next;
            value = normalise(&mut vector)?;
        }
        for (row, a) in self.gram.iter_mut().zip(&vector) {
            for (g, b) in row.iter_mut().zip(&vector) {
                *g -= a * b.conj() * value;
            }
        }
        Some((vector, value))
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
        let (mut best, mut most) = (Vector3::z(), -1.0);
        for elevation in 0..=180 / ELEVATION_STEP_DEG {
            let zenith = phasor((elevation * ELEVATION_STEP_DEG) as f32 / 360.0);
            for azimuth in 0..360 / AZIMUTH_STEP_DEG {
                let turn = phasor((azimuth * AZIMUTH_STEP_DEG) as f32 / 360.0);
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

    /// Tap, beam and power of the strongest entry of a right singular vector.
    fn strongest_entry(&self, vector: &[Complex<f32>; C], exponent: i32) -> (usize, usize, f32) {
        let (mut tap, mut beam, mut most) = (0, 0, 0.0);
        for (m, n, column) in self.columns(exponent) {
            let mut sum = Complex::new(0.0, 0.0);
            for (v, y) in vector.iter().zip(&column) {
                sum += v.conj() * y;
            }
            let power = sum.norm_sqr();
            if power > most {
                (tap, beam, most) = (n & (SAMPLES - 1), m, power);
            }
        }
        (tap, beam, most)
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
        let covariance = Matrix3::from_diagonal(&Vector3::new(
            uniform(self.model.metres_per_tap()),
            angle(AZIMUTH_STEP_DEG),
            angle(ELEVATION_STEP_DEG),
        ));
        let aod = self
            .beam_directions
            .get(beam)
            .copied()
            .flatten()
            .map(|direction| Departure {
                direction: self.gmt_attitude.apply(direction),
                sigma_rad: libm::sqrtf(uniform(14.0_f32.to_radians())),
            });
        let snr = energy / (C as f32 * self.active * noise.max(f32::MIN_POSITIVE));
        Some(EstimatedPath {
            path: Path {
                c_tau_m: self.model.metres(tap, 0.0),
                aoa,
                aod,
                covariance,
            },
            beam: beam as u16,
            snr_db: 10.0 * libm::log10f(snr),
            energy: energy / (self.active * self.active),
        })
    }
}

impl<const A: usize, const E: usize, const C: usize, const BEAMS: usize, const K: usize> PathEstimator<C, K>
    for PaperEstimator<A, E, C, BEAMS, K>
{
    fn push_beam(&mut self, block: BeamBlock<'_, C>) -> BeamReport {
        let levelled = self.correlator.level(block);
        let taps = self.correlator.correlate(levelled, &mut self.work);
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
            weak: false,
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
            self.build_gram(exponent);
            while !paths.is_full() {
                let Some((vector, value)) = self.next_vector() else {
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

/// Scales to unit norm; gives the norm, or none where there is nothing to scale.
fn normalise<const C: usize>(vector: &mut [Complex<f32>; C]) -> Option<f32> {
    let norm = libm::sqrtf(vector.iter().map(|x| x.norm_sqr()).sum());
    if !(norm > 0.0 && norm.is_finite()) {
        return None;
    }
    for x in vector {
        *x /= norm;
    }
    Some(norm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Body;
    use crate::ltd::model::steering;

    type Paper = PaperEstimator<4, 8, 32, 72, 9>;

    /// A path whose arrays all see it with this amplitude, LSB at the peak's tap.
    #[derive(Clone, Copy)]
    struct Made {
        zenith_deg: f32,
        azimuth_deg: f32,
        amplitude: f32,
    }

    impl Made {
        fn aoa(&self) -> Direction<Body> {
            Direction::from_zenith_azimuth(self.zenith_deg.to_radians(), self.azimuth_deg.to_radians())
                .expect("angles")
        }
    }

    /// Keeps a beam in which the path peaks at `tap`, its neighbours 12 dB down.
    fn keep(paper: &mut Paper, beam: usize, tap: usize, made: Made, exponent: i32) {
        let u = *made.aoa().vector();
        let mut taps = [[Iq::ZERO; KEPT]; 32];
        for (j, step) in paper.model.steps().iter().enumerate() {
            for (i, s) in steering::<8>(step.dot(&u)).iter().enumerate() {
                // A phase of its own for each array.
                let x = s * phasor(0.37 * j as f32) * made.amplitude;
                let row = &mut taps[8 * j + i];
                row[KEPT / 2] = Iq::new(x.re as i16, x.im as i16);
                row[KEPT / 2 + 1] = Iq::new((x.re * 0.25) as i16, (x.im * 0.25) as i16);
            }
        }
        paper.beams[beam] = Some(Kept {
            taps,
            first: tap.wrapping_sub(KEPT / 2) & (SAMPLES - 1),
            exponent,
            noise: 100.0,
        });
    }

    fn paper() -> Paper {
        Paper::new(&EstimatorConfig::<4, 8, 3, 8, 8, 3>::default())
    }

    const STRONG: Made = Made {
        zenith_deg: 70.0,
        azimuth_deg: 35.0,
        amplitude: 9000.0,
    };

    #[test]
    fn path_is_its_grid_point_its_tap_and_its_beam() {
        let mut paper = paper();
        keep(&mut paper, 30, 3, STRONG, -20);
        let paths = paper.finish();
        let path = &paths[0];
        // The truth is a point of the grid; the spectra's bins are 1.4 degrees of phase apart.
        assert!(
            path.path.aoa.angle_to_rad(&STRONG.aoa()).to_degrees() < 1.5,
            "{path:?}"
        );
        assert_eq!((path.beam, path.path.c_tau_m), (30, paper.model.metres(3, 0.0)));
        let energy = 32.0 * STRONG.amplitude * STRONG.amplitude / 2_f32.powi(40);
        assert!(
            (path.energy * 416.0 * 416.0 / energy - 1.0).abs() < 0.01,
            "{path:?}"
        );
        // 9000^2 / (416 x 100): 32.9 dB.
        assert!((path.snr_db - 32.89).abs() < 0.1, "{path:?}");
        let aod = path.path.aod.expect("a beam");
        let beam = crate::array::Codebook::<f32>::default()
            .beam(30)
            .expect("beam")
            .direction();
        assert!((aod.direction.vector() - beam).norm() < 1e-5);
        // Uniform over cells of a tap, 1 degree and 2 degrees.
        let sigma = |i: usize| libm::sqrtf(path.path.covariance[(i, i)] * 12.0);
        assert!((sigma(0) - 1.2198).abs() < 1e-3 && (sigma(1).to_degrees() - 1.0).abs() < 1e-3);
        assert!((sigma(2).to_degrees() - 2.0).abs() < 1e-3);
        // What is left of one path is rounding, under the dynamic range.
        assert_eq!(paths.len(), 1);
    }

    #[test]
    fn paths_come_strongest_first_on_one_scale_down_to_the_dynamic_range() {
        let mut paper = paper();
        let weak = Made {
            zenith_deg: 100.0,
            azimuth_deg: -120.0,
            amplitude: 6000.0,
        };
        // The larger integers are the weaker path: its block has 12 dB less exponent.
        keep(&mut paper, 5, 200, weak, -22);
        keep(
            &mut paper,
            41,
            100,
            Made {
                amplitude: 5000.0,
                ..STRONG
            },
            -20,
        );
        let faint = Made {
            zenith_deg: 60.0,
            azimuth_deg: 150.0,
            amplitude: 4000.0,
        };
        keep(&mut paper, 66, 400, faint, -28);
        let paths = paper.finish();
        let beams: Vec<u16, 9> = paths.iter().map(|p| p.beam).collect();
        assert_eq!(beams[..2], [41, 5], "{paths:?}");
        assert!(paths.iter().all(|p| p.beam != 66), "50 dB down: {paths:?}");
        // Singular vectors are orthogonal, the paths' steering nearly: angles bend by a few degrees.
        let off = paths[1].path.aoa.angle_to_rad(&weak.aoa()).to_degrees();
        assert!(off < 6.0, "{off} deg");
        let ratio = 10.0 * libm::log10f(paths[0].energy / paths[1].energy);
        assert!((ratio - 10.46).abs() < 1.0, "{ratio} dB");
        assert!(paper.finish().is_empty(), "nothing is left for the next sweep");
    }

    /// What counts is the energy in one tap of one beam, as for the strongest path, not the sum over beams.
    #[test]
    fn dynamic_range_is_that_of_single_beams() {
        let faint = |share_db: f32| Made {
            zenith_deg: 100.0,
            azimuth_deg: -120.0,
            amplitude: STRONG.amplitude * libm::powf(10.0, 0.05 * share_db),
        };
        for (share_db, expected) in [(-33.0, 2), (-35.0, 1)] {
            let mut paper = paper();
            keep(&mut paper, 41, 100, STRONG, -20);
            for beam in [5, 6, 7, 8] {
                keep(&mut paper, beam, 200, faint(share_db), -20);
            }
            let paths = paper.finish();
            assert_eq!(paths.len(), expected, "{share_db} dB: {paths:?}");
        }
    }
}
