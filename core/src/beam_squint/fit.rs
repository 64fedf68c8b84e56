//! Maximum-likelihood fit of the known pattern: direction cosines and delay, a free complex gain for every symbol.
//!
//! The gains are eliminated (variable projection). Because the pattern is real and a delay turns it, the Gauss-Newton
//! normal equations fall apart into two by two for the direction and one for the delay: their errors are uncorrelated.
//! With unit weights in the noise's standard deviation the inverse of the matrix is the Cramer-Rao bound.
//!
//! A gain that is wholly free makes false optima: in a null of its pattern a symbol of the right phase can claim to be
//! a faint image of a giant signal. All symbols have the same transmitter and the same way, so a symbol that asks for
//! more than twice the gain of the best heard one is left out.

use nalgebra::{Complex, Matrix2, Vector2};

use super::pattern::{Band, Row, Spin};
use super::reception::Spectrum;
use crate::array::SquintSymbol;

/// Longest step of an iteration.
/// Numerical: a quarter of the pattern's half lobe, and a metre.
const LONGEST: f32 = 0.06;
/// Numerical: a step of an iteration.
pub(super) const LONGEST_M: f32 = 1.0;
/// Subcarriers that a first fit takes as one.
/// Numerical: a lobe of the pattern is sixty wide, and they move the optimum by hundredths of a milliradian.
pub(super) const PAIR: usize = 2;
/// Iterations at most.
/// Capacity: the sixth is usually the last.
const ITERATIONS: usize = 16;
/// Steps under this share of a standard deviation (squared, all parameters) end the iteration.
/// Numerical: an end of an iteration.
pub(super) const SETTLED: f32 = 1e-4;
/// Energies are not compared when the step promises less than this share of them.
/// Numerical: they would differ by rounding. That near, two full steps are taken without a look.
pub(super) const ROUNDING: f32 = 4e-6;
/// Numerical: an end of an iteration.
pub(super) const BLIND_STEPS: u32 = 2;
/// A fit whose next step is shorter than half a standard deviation is good enough when the iterations are used up.
/// Numerical: an end of an iteration.
pub(super) const NEAR_ENOUGH: f32 = 0.25;
/// Damping under which a step is as long as without, and over which there is none.
/// Numerical: a guard of an iteration.
pub(super) const FREE: f32 = 0.1;
/// See [`FREE`].
/// Numerical: a guard of an iteration.
pub(super) const MOST_DAMPING: f32 = 1e4;
/// Determinant, of a matrix of unit diagonal, that rounding leaves of none.
/// Numerical: a guard of a division.
pub(super) const LEAST_DETERMINANT: f32 = 1e-6;
/// Iterations after which symbols may be left out or taken in.
/// Capacity: work of a fit.
const CHOICES: usize = 8;
/// Most gain of a symbol, against the best heard one.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const MOST_GAIN: f32 = 2.0;

/// Where the path is: cosines in the face frame, delay beyond the reference in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) cosines: [f32; 2],
    pub(super) delay_m: f32,
}

/// Result of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit<const SYMBOLS: usize> {
    pub(super) place: Place,
    /// Energy explained, in noise variances.
    pub(super) energy: f32,
    /// Fisher information over the cosines, and over the delay, 1/m^2.
    pub(super) information: Matrix2<f32>,
    pub(super) delay_information: f32,
    /// Whether the steps died out.
    pub(super) settled: bool,
    /// Symbols that were fitted.
    pub(super) heeded: [bool; SYMBOLS],
}

/// Everything one evaluation gives, in noise variances.
#[derive(Clone, Copy, Debug)]
struct Normal {
    energy: f32,
    gradient: Vector2<f32>,
    hessian: Matrix2<f32>,
    delay_gradient: f32,
    delay_hessian: f32,
}

/// The symbols that a fit is over, as sent and as received.
#[derive(Clone, Copy)]
pub(super) struct ReceivedSymbols<'a, const SYMBOLS: usize, const ACTIVE: usize> {
    pub(super) schedule: &'a [SquintSymbol; SYMBOLS],
    pub(super) spectra: &'a [Option<Spectrum<ACTIVE>>; SYMBOLS],
    pub(super) band: Band,
    /// Phase per subcarrier of a metre, rad.
    pub(super) per_m_rad: f32,
}

impl<'a, const SYMBOLS: usize, const ACTIVE: usize> ReceivedSymbols<'a, SYMBOLS, ACTIVE> {
    /// The symbols that were received.
    pub(super) fn symbols(&self) -> impl Iterator<Item = (&'a SquintSymbol, &'a Spectrum<ACTIVE>)> {
        let pairs = self.schedule.iter().zip(self.spectra);
        pairs.filter_map(|(symbol, spectrum)| Some((symbol, spectrum.as_ref()?)))
    }

    /// Fits from a starting place, `P` subcarriers as one.
    pub(super) fn fit<const X: usize, const Z: usize, const P: usize>(&self, start: Place) -> Fit<SYMBOLS> {
        let mut place = start;
        let mut sums = self.evaluate::<X, Z, P>(&place);
        let mut heeded = heeded(&sums);
        let mut normal = total(&sums, &heeded);
        let mut damping = 1e-3;
        let (mut blind, mut length) = (0, f32::INFINITY);
        for iteration in 0..ITERATIONS {
            let Some((step, delay_step)) = normal.step(damping) else {
                break;
            };
            length = normal.gradient.dot(&step) + normal.delay_gradient * delay_step;
            if length.is_nan()
                || damping > MOST_DAMPING
                || (length < SETTLED && damping < FREE)
                || blind == BLIND_STEPS
            {
                break;
            }
            let scale = (LONGEST / step.amax()).min(LONGEST_M / delay_step.abs()).min(1.0);
            let [x, z] = place.cosines;
            let candidate = Place {
                cosines: [x + step.x * scale, z + step.y * scale],
                delay_m: place.delay_m + delay_step * scale,
            };
            sums = self.evaluate::<X, Z, P>(&candidate);
            let next = total(&sums, &heeded);
            let near = length < ROUNDING * normal.energy && damping < FREE;
            if near || next.energy > normal.energy {
                (place, normal) = (candidate, next);
                damping *= 0.2;
                blind += u32::from(near);
                // Later changes would only make the energy jump.
                if iteration < CHOICES {
                    heeded = self::heeded(&sums);
                    normal = total(&sums, &heeded);
                }
            } else {
                damping = (damping * 8.0).max(1e-2);
            }
        }
        Fit {
            place,
            energy: normal.energy,
            information: normal.hessian,
            delay_information: normal.delay_hessian,
            settled: length < NEAR_ENOUGH,
            heeded,
        }
    }

    /// Sums of every symbol that was heard, with two over its noise variance.
    fn evaluate<const X: usize, const Z: usize, const P: usize>(&self, place: &Place) -> Weighted<SYMBOLS> {
        let mut all = [None; SYMBOLS];
        for ((slot, symbol), spectrum) in all.iter_mut().zip(self.schedule).zip(self.spectra) {
            *slot = spectrum.as_ref().map(|spectrum| {
                (
                    self.sums::<X, Z, P>(symbol, spectrum, place),
                    2.0 / spectrum.noise,
                )
            });
        }
        all
    }

    pub(super) fn sums<const X: usize, const Z: usize, const P: usize>(
        &self,
        symbol: &SquintSymbol,
        spectrum: &Spectrum<ACTIVE>,
        place: &Place,
    ) -> Sums {
        let mut sums = Sums::default();
        self.walk::<X, Z, P>(symbol, spectrum, place, |_, pattern, omega, y| {
            sums.add(&pattern, omega, y)
        });
        sums
    }

    /// Walks over the subcarriers of a symbol, `P` at a time: index of the first, pattern with its derivatives by the cosines, angular frequency per metre,
    /// and what was heard with the delay of `place` taken out.
    pub(super) fn walk<const X: usize, const Z: usize, const P: usize>(
        &self,
        symbol: &SquintSymbol,
        spectrum: &Spectrum<ACTIVE>,
        place: &Place,
        mut each: impl FnMut(usize, [f32; 3], f32, Complex<f32>),
    ) {
        let [sx, sz] = place.cosines;
        let band = self.band.decimated(P);
        let mut row = Row::new(symbol, 0, sx, &band);
        let mut column = Row::new(symbol, 1, sz, &band);
        let step = self.per_m_rad * P as f32;
        // Subcarriers counted from the middle of the band: its angular frequency then has little mean to take out.
        let mut omega = 0.5 * self.per_m_rad * (P as f32 - ACTIVE as f32);
        let mut spin = Spin::new(omega * place.delay_m, step * place.delay_m);
        // Scaled so that the noise of a sum is that of one.
        let scale = libm::sqrtf(1.0 / P as f32);
        for (index, bins) in spectrum.bins.as_chunks::<P>().0.iter().enumerate() {
            let ([x, dx], [z, dz]) = (row.next::<X>(), column.next::<Z>());
            let pattern = [x * z, dx * z, x * dz].map(|value| value / scale);
            let y = bins.iter().sum::<Complex<f32>>() * scale;
            each(index * P, pattern, omega, y * spin.next());
            omega += step;
        }
    }
}

type Weighted<const SYMBOLS: usize> = [Option<(Sums, f32)>; SYMBOLS];

/// Which symbols do not ask for too much gain.
fn heeded<const SYMBOLS: usize>(all: &Weighted<SYMBOLS>) -> [bool; SYMBOLS] {
    let (mut most, mut reference) = (0.0, 0.0);
    for (sums, weight) in all.iter().flatten() {
        let energy = sums.ry.norm_sqr() / sums.rr * weight;
        if energy > most {
            (most, reference) = (energy, sums.gain_power());
        }
    }
    // Not of the NaN of a pattern that is zero everywhere.
    all.map(|of| of.is_some_and(|(sums, _)| sums.gain_power() <= MOST_GAIN * MOST_GAIN * reference))
}

/// Adds up the symbols that are heeded.
fn total<const SYMBOLS: usize>(all: &Weighted<SYMBOLS>, heeded: &[bool; SYMBOLS]) -> Normal {
    let mut normal = Normal {
        energy: 0.0,
        gradient: Vector2::zeros(),
        hessian: Matrix2::zeros(),
        delay_gradient: 0.0,
        delay_hessian: 0.0,
    };
    for (of, _) in all.iter().zip(heeded).filter(|(_, heeded)| **heeded) {
        if let Some((sums, weight)) = of {
            normal.add(sums, *weight);
        }
    }
    normal
}

/// Sums over the subcarriers of a symbol: r is the pattern, x and z its derivatives, w the angular frequency per metre.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) rr: f32,
    pub(super) rx: f32,
    pub(super) rz: f32,
    xx: f32,
    xz: f32,
    zz: f32,
    pub(super) wrr: f32,
    wwrr: f32,
    pub(super) ry: Complex<f32>,
    xy: Complex<f32>,
    zy: Complex<f32>,
    wry: Complex<f32>,
}

impl Sums {
    /// Squared magnitude of the gain that fits best.
    pub(super) fn gain_power(&self) -> f32 {
        self.ry.norm_sqr() / (self.rr * self.rr)
    }

    fn add(&mut self, [r, x, z]: &[f32; 3], omega: f32, y: Complex<f32>) {
        self.rr += r * r;
        self.rx += r * x;
        self.rz += r * z;
        self.xx += x * x;
        self.xz += x * z;
        self.zz += z * z;
        let wr = omega * r;
        self.wrr += wr * r;
        self.wwrr += wr * wr;
        self.ry += y * *r;
        self.xy += y * *x;
        self.zy += y * *z;
        self.wry += y * wr;
    }
}

impl Normal {
    /// Adds a symbol with its gain eliminated. `weight`: two over the noise variance.
    fn add(&mut self, s: &Sums, weight: f32) {
        let gain = s.ry / s.rr;
        let power = gain.norm_sqr() * weight;
        let against = |y: Complex<f32>| (gain.conj() * y).re * weight;
        let (mx, mz, mw) = (s.rx / s.rr, s.rz / s.rr, s.wrr / s.rr);
        self.energy += 0.5 * power * s.rr;
        self.gradient += Vector2::new(against(s.xy - s.ry * mx), against(s.zy - s.ry * mz));
        let cross = s.xz - mx * s.rz;
        self.hessian += Matrix2::new(s.xx - mx * s.rx, cross, cross, s.zz - mz * s.rz) * power;
        // The model turns by -j w: its conjugate times y is +j.
        self.delay_gradient -= (gain.conj() * (s.wry - s.ry * mw)).im * weight;
        self.delay_hessian += (s.wwrr - mw * s.wrr) * power;
    }

    /// Damped step.
    fn step(&self, damping: f32) -> Option<(Vector2<f32>, f32)> {
        let mut matrix = self.hessian;
        matrix.m11 *= 1.0 + damping;
        matrix.m22 *= 1.0 + damping;
        let step = invert(&matrix)? * self.gradient;
        let delay_step = self.delay_gradient / (self.delay_hessian * (1.0 + damping));
        delay_step.is_finite().then_some((step, delay_step))
    }
}

/// Inverse of a positive definite matrix; none of any other.
pub(super) fn invert(matrix: &Matrix2<f32>) -> Option<Matrix2<f32>> {
    let determinant = matrix.m11 * matrix.m22 - matrix.m12 * matrix.m21;
    // Rounding of the products sets the limit.
    (determinant.is_finite() && determinant > LEAST_DETERMINANT * matrix.m11 * matrix.m22)
        .then(|| Matrix2::new(matrix.m22, -matrix.m12, -matrix.m21, matrix.m11) / determinant)
}
