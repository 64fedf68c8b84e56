//! Near field: a large row of elements focuses, so its symbol can sweep range as well, and range needs no common clock
//! then.
//!
//! A wave to range r at sine s of the angle off the normal is `d_n = sqrt(r^2 + y_n^2 - 2 r y_n s) - r` longer from the
//! element at y_n than from the centre. With focus A at the first frequency f1 and B at the last f2, delays
//! `t_n = [f2 d_n(B) - f1 d_n(A)] / (c (f2 - f1))` and phases `phi_n = 2 pi f1 (d_n(A)/c - t_n)` (docs/signal-model.md, "Beam squint"), the weight
//! of element n at frequency f is `exp(j 2 pi [(f - f1) t_n + f1 d_n(A)/c])`, and the focus moves from A to B over the
//! band:
//! `f/r` runs evenly from `f1/r_A` to `f2/r_B` when both lie in the same direction.
//!
//! The direction has to be known, from the far-field sweeps of [`super::BeamSquint`].

mod sweep;

pub use sweep::{Focus, FocusSweep};

use nalgebra::{Complex, Matrix2, Vector2};

use super::fit::{BLIND_STEPS, FREE, MOST_DAMPING, NEAR_ENOUGH, ROUNDING, SETTLED, invert};
use super::pattern::Spin;
use super::peak::LEAST_PEAK;
use super::reception::{Reception, Spectrum};
use super::{Refusal, Sighting};
use crate::array::UavArrays;
use crate::signal::{BeamBlock, Correlator, Waveform, Workspace};

const ZERO: Complex<f32> = Complex::new(0.0, 0.0);
/// Iterations of the fit at most.
/// Capacity: work of a fit.
const ITERATIONS: usize = 16;
/// Longest step, as a share of the lobe of the focus over inverse range.
/// Numerical: a step of an iteration.
const LONGEST: f32 = 0.3;

/// A measured range. Clock offsets are not in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Range, m.
    pub range_m: f32,
    /// Variance, m^2.
    pub variance_m2: f32,
}

/// The UAV's side: one focus sweep heard.
#[derive(Clone, Debug)]
pub struct RangeSquint<
    const N: usize,
    const A: usize = 4,
    const E: usize = 8,
    const C: usize = 32,
    const ACTIVE: usize = 416,
> {
    arrays: UavArrays<f32, A, E>,
    sweep: FocusSweep<N>,
    reception: Reception<A, E, C, ACTIVE>,
    spectrum: Option<Spectrum<ACTIVE>>,
    begun: bool,
}

/// Normal equations over inverse range and delay, in noise variances.
struct Normal {
    energy: f32,
    gradient: Vector2<f32>,
    hessian: Matrix2<f32>,
}

impl<const N: usize, const A: usize, const E: usize, const C: usize, const ACTIVE: usize>
    RangeSquint<N, A, E, C, ACTIVE>
{
    /// A receiver for one sweep. None when the waveform has not `ACTIVE` subcarriers.
    #[must_use]
    pub fn new(sweep: FocusSweep<N>, arrays: UavArrays<f32, A, E>, waveform: &Waveform) -> Option<Self> {
        (waveform.active == ACTIVE).then(|| Self {
            arrays,
            sweep,
            reception: Reception::new(waveform),
            spectrum: None,
            begun: false,
        })
    }

    /// Prepares for the symbol, as [`super::BeamSquint::begin`].
    ///
    /// # Errors
    /// [`Refusal::NotLineOfSight`], [`Refusal::NotFinite`], [`Refusal::Masked`].
    pub fn begin(&mut self, sighting: &Sighting) -> Result<(), Refusal> {
        self.spectrum = None;
        self.begun = false;
        if !sighting.line_of_sight {
            return Err(Refusal::NotLineOfSight);
        }
        if !sighting.c_tau_m.is_finite() {
            return Err(Refusal::NotFinite);
        }
        let (aoa, nulls) = (&sighting.aoa, &sighting.interferers);
        if !self
            .reception
            .aim(&self.arrays, aoa, sighting.c_tau_m, nulls, None)
        {
            return Err(Refusal::Masked);
        }
        self.begun = true;
        Ok(())
    }

    /// Hears the symbol. The block is worked on in place.
    pub fn push(&mut self, block: BeamBlock<'_, C>, correlator: &Correlator, work: &mut Workspace) {
        if self.begun {
            self.spectrum = self.reception.hear(block, correlator, work);
        }
    }

    fn received(&self) -> Result<&Spectrum<ACTIVE>, Refusal> {
        if !self.begun {
            return Err(Refusal::NotBegun);
        }
        self.spectrum.as_ref().ok_or(Refusal::SymbolsMissing)
    }

    /// The paper's rule: the range on which the strongest subcarrier focuses. `sine`: direction, as in [`Focus`].
    ///
    /// # Errors
    /// [`Refusal::NotBegun`], [`Refusal::SymbolsMissing`], [`Refusal::TooWeak`].
    pub fn pick(&self, sine: f32) -> Result<Range, Refusal> {
        let spectrum = self.received()?;
        let mut best = (0, 0.0);
        for (k, y) in spectrum.bins.iter().enumerate() {
            if y.norm_sqr() > best.1 {
                best = (k, y.norm_sqr());
            }
        }
        let (k, power) = best;
        if power.is_nan() || power < LEAST_PEAK * spectrum.noise {
            return Err(Refusal::TooWeak);
        }
        let [f1, f2] = self.sweep.edges_hz;
        let at = |k: f64| self.sweep.focus_m(f1 + (f2 - f1) * k / (ACTIVE as f64 - 1.0));
        let range_m = at(k as f64) as f32;
        let step = (1.0 / at(k as f64 + 0.5) - 1.0 / at(k as f64 - 0.5)) as f32;
        // Subcarriers compete where the lobe has fallen by less than the noise of a power. Elements y, evenly spread
        // over +-Y, are y^2 pi f q / c off: their variance over the lobe's half width, where y = Y is half a turn off,
        // is pi^2 4/45.
        let lobe = self.sweep.lobe_per_m(f64::from(sine)) as f32;
        let bend = core::f32::consts::PI * core::f32::consts::PI * 4.0 / 45.0 / (lobe * lobe);
        let noise = libm::sqrtf(2.0 * spectrum.noise / power);
        let variance = step * step / 12.0 + 0.5 * noise / bend;
        let square = range_m * range_m;
        Ok(Range {
            range_m,
            variance_m2: square * square * variance,
        })
    }

    /// Maximum likelihood over range, delay and gain. `sine`: direction, as in [`Focus`].
    ///
    /// # Errors
    /// Those of [`Self::pick`], and [`Refusal::Unsettled`].
    pub fn fit(&self, sine: f32) -> Result<Range, Refusal> {
        let spectrum = self.received()?;
        let sine = f64::from(sine);
        let longest = LONGEST * self.sweep.lobe_per_m(sine) as f32;
        let mut q = 1.0 / f64::from(self.pick(sine as f32)?.range_m);
        let mut delay_m = 0.0_f32;
        let mut normal = self.normal(spectrum, q, sine, delay_m);
        let (mut damping, mut blind, mut length) = (1e-3, 0, f32::INFINITY);
        for _ in 0..ITERATIONS {
            let mut matrix = normal.hessian;
            matrix.m11 *= 1.0 + damping;
            matrix.m22 *= 1.0 + damping;
            let Some(inverse) = invert(&matrix) else { break };
            let step = inverse * normal.gradient;
            length = normal.gradient.dot(&step);
            if length.is_nan()
                || damping > MOST_DAMPING
                || (length < SETTLED && damping < FREE)
                || blind == BLIND_STEPS
            {
                break;
            }
            let scale = (longest / step.x.abs()).min(1.0 / step.y.abs()).min(1.0);
            let (next_q, next_m) = (q + f64::from(step.x * scale), delay_m + step.y * scale);
            let next = self.normal(spectrum, next_q, sine, next_m);
            let near = length < ROUNDING * normal.energy && damping < FREE;
            if near || next.energy > normal.energy {
                (q, delay_m, normal) = (next_q, next_m, next);
                damping *= 0.2;
                blind += u32::from(near);
            } else {
                damping = (damping * 8.0).max(1e-2);
            }
        }
        let inverse = invert(&normal.hessian).ok_or(Refusal::Unsettled)?;
        if length.is_nan() || length > NEAR_ENOUGH || q <= 0.0 {
            return Err(Refusal::Unsettled);
        }
        let range_m = (1.0 / q) as f32;
        let square = range_m * range_m;
        Ok(Range {
            range_m,
            variance_m2: square * square * inverse.m11,
        })
    }

    fn normal(&self, spectrum: &Spectrum<ACTIVE>, q: f64, sine: f64, delay_m: f32) -> Normal {
        let (field, slope) = self.sweep.responses::<ACTIVE>(q, sine);
        let turn = self.reception.per_m_rad() * delay_m;
        let middle = 0.5 * (ACTIVE as f32 - 1.0);
        let mut spin = Spin::new(-middle * turn, turn);
        let mut omega = -middle * self.reception.per_m_rad();
        // Columns: the field itself, its derivative over inverse range, and over delay (-j w times it).
        let (mut gram, mut against) = ([[ZERO; 3]; 3], [ZERO; 3]);
        for ((y, m), s) in spectrum.bins.iter().zip(&field).zip(&slope) {
            let y = y * spin.next();
            let columns = [*m, *s, Complex::new(m.im, -m.re) * omega];
            for ((line, sum), a) in gram.iter_mut().zip(&mut against).zip(&columns) {
                for (element, b) in line.iter_mut().zip(&columns) {
                    *element += a.conj() * b;
                }
                *sum += a.conj() * y;
            }
            omega += self.reception.per_m_rad();
        }
        let [[mm, _, _], [sm, ss, st], [tm, _, tt]] = gram;
        let [my, sy, ty] = against;
        let gain = my / mm.re;
        let weight = 2.0 / spectrum.noise;
        let power = gain.norm_sqr() * weight;
        // Parts of the columns beside the field.
        let beside = |aa: Complex<f32>, am: Complex<f32>, bm: Complex<f32>| (aa - am * bm.conj() / mm.re).re;
        let cross = beside(st, sm, tm);
        let pull = |ay: Complex<f32>, am: Complex<f32>| (gain.conj() * (ay - am * gain)).re * weight;
        Normal {
            energy: 0.5 * power * mm.re,
            gradient: Vector2::new(pull(sy, sm), pull(ty, tm)),
            hessian: Matrix2::new(beside(ss, sm, sm), cross, cross, beside(tt, tm, tm)) * power,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::phasor;

    const EDGES_HZ: [f64; 2] = [30e9 - 208.0 * 480e3, 30e9 + 207.0 * 480e3];
    const SINE: f64 = 0.3;

    fn sweep<const N: usize>() -> FocusSweep<N> {
        let at = |range_m| Focus { range_m, sine: SINE };
        FocusSweep::new(0.005, at(5.0), at(100.0), EDGES_HZ).expect("sound")
    }

    #[test]
    fn an_exact_field_gives_its_range_whatever_the_clock_says() {
        let mut squint = RangeSquint::<128>::new(sweep(), UavArrays::default(), &Waveform::default())
            .expect("416 subcarriers");
        assert_eq!(squint.fit(0.3), Err(Refusal::NotBegun));
        let sighting = Sighting {
            line_of_sight: true,
            face: 0,
            aoa: crate::geometry::Direction::from_vector(nalgebra::Vector3::x()).expect("unit"),
            c_tau_m: 100.0,
            interferers: heapless::Vec::new(),
            expected: None,
            ground: None,
        };
        squint.begin(&sighting).expect("line of sight");
        assert_eq!(squint.fit(0.3), Err(Refusal::SymbolsMissing));
        for range_m in [7.0, 20.0, 55.0] {
            let field = sweep::<128>().field::<416>(Focus { range_m, sine: SINE });
            // 0.8 m of clock offset.
            let step = squint.reception.per_m_rad() * 0.8;
            let bins = core::array::from_fn(|k| field[k] * phasor(0.4 - step * (k as f32 - 208.0)) * 30.0);
            squint.spectrum = Some(Spectrum { bins, noise: 1.0 });
            let (picked, fitted) = (
                squint.pick(0.3).expect("strong"),
                squint.fit(0.3).expect("strong"),
            );
            let off = (f64::from(fitted.range_m) - range_m).abs();
            let sigma = f64::from(libm::sqrtf(fitted.variance_m2));
            assert!(
                off < 0.2 * sigma && sigma < 0.05 * range_m,
                "{range_m}: {off}, sigma {sigma}"
            );
            let off = (f64::from(picked.range_m) - range_m).abs();
            assert!(
                off < 4.0 * f64::from(libm::sqrtf(picked.variance_m2)),
                "{range_m}: {off}"
            );
        }
    }
}
