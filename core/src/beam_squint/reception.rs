//! Reception of a squint symbol: from int16 samples to one spectrum that holds the transmit pattern and nothing else.
//!
//! Each array forms a beam towards the path's known arrival, with nulls where the caller knows interferers (the ground
//! bounce; docs/signal-model.md, "Beam squint"): of its channels one is made, in integers, before the transform, which is linear. Waveform, reference delay and lever arms are taken out, then the arrays are added:
//! their oscillators are free, so the phases between them come from the symbol itself, as the principal direction of
//! their Gram matrix. Against free gains for each array this loses nothing to first order, and it needs a quarter of
//! the memory.

use nalgebra::Complex;

use super::pattern::Spin;
use crate::array::{Null, ReceiveBeam, UavArrays};
use crate::constants::SPEED_OF_LIGHT_M_PER_S;
use crate::geometry::{Body, Direction};
use crate::kernels::Channel;
use crate::signal::{BeamBlock, Correlator, Iq, REFERENCE_EXPONENT, SAMPLES, Waveform, Workspace, bin_at};

/// Interferers that can be nulled, the ground bounce among them.
/// Capacity: work of a reception.
pub const NULLS: usize = 2;
/// Share of its power towards the path that an array must keep beside the null of the ground bounce (-10 dB): one that would keep less does without that null. The fit has the
/// bounce as well, and a path that the null weakens is one that everything else outweighs.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const LEAST_KEPT_OF_BOUNCE: f32 = 0.1;
/// Subcarriers beside the band that tell the noise begin this many beyond its edges.
/// Given: the waveform's edge.
const GUARD: i32 = 12;
/// Iterations for the principal direction.
/// Capacity: the path stands far over the noise, a few suffice.
const ITERATIONS: usize = 8;

const ZERO: Complex<f32> = Complex::new(0.0, 0.0);

/// One symbol: the path's response on the active subcarriers, at a reference delay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spectrum<const ACTIVE: usize> {
    pub(super) bins: [Complex<f32>; ACTIVE],
    /// Noise variance of a bin, same units.
    pub(super) noise: f32,
}

/// Receive beam of all arrays, and scratch.
#[derive(Clone, Debug)]
pub(super) struct Reception<const A: usize, const E: usize, const C: usize, const ACTIVE: usize> {
    /// Conjugate waveform.
    reference: [Complex<f32>; ACTIVE],
    /// Offset of the first active subcarrier.
    first: i32,
    /// Phase per subcarrier of a metre of delay, rad.
    per_m_rad: f32,
    /// Beam of every array.
    beams: [ReceiveBeam<E>; A],
    /// Delay taken out of each array, m; none where the array is left out.
    delay_m: [Option<f32>; A],
    /// The beam of an array, and its spectrum.
    beam: Channel,
    spectrum: Channel,
    rows: [[Complex<f32>; ACTIVE]; A],
}

impl<const A: usize, const E: usize, const C: usize, const ACTIVE: usize> Reception<A, E, C, ACTIVE> {
    pub(super) fn new(waveform: &Waveform) -> Self {
        const { assert!(C == A * E && A > 0) };
        let per_m = core::f64::consts::TAU * waveform.spacing_hz() / SPEED_OF_LIGHT_M_PER_S;
        Self {
            reference: core::array::from_fn(|index| waveform.symbol::<f32>(index).conj()),
            first: waveform.offset(0),
            per_m_rad: per_m as f32,
            beams: [ReceiveBeam::DEAF; A],
            delay_m: [None; A],
            beam: [Iq::ZERO; SAMPLES],
            spectrum: [Iq::ZERO; SAMPLES],
            rows: [[ZERO; ACTIVE]; A],
        }
    }

    /// Points the beam at `aoa`, with nulls, and one for the ground bounce where that is not too near. Returns whether any array
    /// keeps enough of the path.
    pub(super) fn aim(
        &mut self,
        arrays: &UavArrays<f32, A, E>,
        aoa: &Direction<Body>,
        c_tau_m: f32,
        nulls: &[Direction<Body>],
        bounce: Option<&Direction<Body>>,
    ) -> bool {
        let steps = arrays.phase_step_rad(aoa);
        let leads_m = arrays.lead_m(aoa);
        let mut any = false;
        for (j, (beam, delay)) in self.beams.iter_mut().zip(&mut self.delay_m).enumerate() {
            let of = |values: &[f32; A]| values.get(j).copied().unwrap_or(0.0);
            let steering = |steps: &[f32; A]| UavArrays::<f32, A, E>::steering(of(steps));
            let bounce = bounce.into_iter().map(|null| (null, LEAST_KEPT_OF_BOUNCE));
            let nulls = bounce.chain(nulls.iter().map(|null| (null, 0.0)));
            let nulls = nulls.map(|(null, least_kept)| Null {
                steering: steering(&arrays.phase_step_rad(null)),
                least_kept,
            });
            *beam = ReceiveBeam::new::<NULLS>(&steering(&steps), nulls);
            let keeps = beam.keeps();
            *delay = keeps.then(|| c_tau_m - of(&leads_m));
            any |= keeps;
        }
        any
    }

    /// Phase per subcarrier of a metre of delay, rad.
    pub(super) fn per_m_rad(&self) -> f32 {
        self.per_m_rad
    }

    /// Hears a symbol. None when there is nothing but zeros.
    pub(super) fn hear(
        &mut self,
        block: BeamBlock<'_, C>,
        correlator: &Correlator,
        work: &mut Workspace,
    ) -> Option<Spectrum<ACTIVE>> {
        let scaled = correlator.scale(block);
        let (mut noise, mut count) = (0.0, 0.0);
        // In units of weights of norm one.
        let gain = ReceiveBeam::<E>::gain();
        let channels = scaled.samples().as_chunks::<E>().0;
        for (j, (channels, beam)) in channels.iter().zip(&self.beams).enumerate() {
            let Some(row) = self.rows.get_mut(j) else { continue };
            let Some(delay_m) = self.delay_m.get(j).copied().flatten() else {
                *row = [ZERO; ACTIVE];
                continue;
            };
            beam.hear(channels, &mut self.beam);
            correlator.spectrum(&self.beam, &mut self.spectrum, work);
            for (position, x) in self.spectrum.iter().enumerate() {
                let sum = Complex::new(f32::from(x.re()), f32::from(x.im())) * gain;
                let bin = bin_at(position) as i32;
                let offset = if bin < SAMPLES as i32 / 2 {
                    bin
                } else {
                    bin - SAMPLES as i32
                };
                let index = offset - self.first;
                if let Some(slot) = usize::try_from(index).ok().and_then(|index| row.get_mut(index)) {
                    *slot = sum;
                } else if index < -GUARD || index >= ACTIVE as i32 + GUARD {
                    noise += sum.norm_sqr();
                    count += 1.0;
                }
            }
            let step = self.per_m_rad * delay_m;
            let mut spin = Spin::new(self.first as f32 * step, step);
            for (y, reference) in row.iter_mut().zip(&self.reference) {
                *y *= reference * spin.next();
            }
        }
        let direction = self.principal()?;
        let mut bins = [ZERO; ACTIVE];
        for (row, share) in self.rows.iter().zip(direction) {
            for (bin, y) in bins.iter_mut().zip(row) {
                *bin += share.conj() * y;
            }
        }
        // A converter that shows the path and no noise at all rounds it: a twelfth of a squared step, both parts.
        let noise = (noise / count).max(1.0 / 6.0);
        // Symbols have gains of their own in the converter; their amplitudes are to be compared.
        let scale = libm::scalbnf(1.0, scaled.exponent().saturating_sub(REFERENCE_EXPONENT));
        let usable = (scale * scale * noise).is_finite() && scale > 0.0;
        usable.then(|| Spectrum {
            bins: bins.map(|y| y * scale),
            noise: noise * scale * scale,
        })
    }

    /// Relative gains of the arrays, of norm one: the principal direction of their Gram matrix by power iteration.
    fn principal(&self) -> Option<[Complex<f32>; A]> {
        let mut gram = [[ZERO; A]; A];
        for (line, a) in gram.iter_mut().zip(&self.rows) {
            for (element, b) in line.iter_mut().zip(&self.rows) {
                *element = a.iter().zip(b).map(|(a, b)| a * b.conj()).sum();
            }
        }
        // From the strongest array's column: never at right angles to the answer.
        let strongest = (0..A).max_by(|a, b| gram[*a][*a].re.total_cmp(&gram[*b][*b].re))?;
        let mut direction: [Complex<f32>; A] = core::array::from_fn(|j| gram[j][strongest]);
        for _ in 0..ITERATIONS {
            let norm = libm::sqrtf(direction.iter().map(Complex::norm_sqr).sum());
            if norm.is_nan() || norm <= 0.0 {
                return None;
            }
            direction = direction.map(|d| d / norm);
            direction = core::array::from_fn(|j| gram[j].iter().zip(&direction).map(|(g, d)| g * d).sum());
        }
        let norm = libm::sqrtf(direction.iter().map(Complex::norm_sqr).sum());
        (norm > 0.0).then(|| direction.map(|d| d / norm))
    }
}
