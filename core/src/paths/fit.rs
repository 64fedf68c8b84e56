//! Joint maximum-likelihood fit of one path, or of two close ones, in a window of taps.
//!
//! The free complex gain of every (path, array) is eliminated (variable projection), which leaves three parameters a path:
//! delay and two tangent angles. Per array, the columns `A` (the path), `W = dA/dw` (steering) and `T = dA/dd` (delay) are
//! products of a spatial and a temporal vector, so all inner products are products of small sums: the fit needs no
//! Jacobian in memory, only a Gram matrix of three columns a path. Eliminating the columns `A` from it gives
//! at once the gains, the energy explained, the gradient and the Gauss-Newton Hessian. With one path this is the Fisher
//! scoring of docs/signal-model.md, "Path estimation", with two the joint fit named there.
//!
//! Elements lie symmetrically about their array's centre and the kernel is real, so the Gram matrix is real: only the
//! correlations with the taps are complex.

mod planar;

use nalgebra::Complex;

use super::cholesky::solve;
use super::model::{ArrayModel, place, steering};
use super::place::Place;
use super::template::Template;
use super::window::{Content, Window};

/// Taps of the fit on both sides of a path.
/// Measured: costs 1.6 % of the delay's standard deviation against all taps, 0.5 % of the angles'; 4 would cost 2.9 %, 8 1.4 %.
pub(super) const REACH: i32 = 6;

/// Squared length of the last step of a single path's fit and of a joint one, in squared standard deviations.
/// Numerical: an end of an iteration.
const LAST_STEP: f32 = 0.1;
/// Numerical: an end of an iteration.
const LAST_STEP_JOINT: f32 = 0.02;
/// Squared length of a step, in squared standard deviations, that is none.
/// Numerical: an end of an iteration.
const STILL: f32 = 1e-3;
/// Damping under which a step is as long as without, and over which there is none.
/// Numerical: a guard of an iteration.
const FREE: f32 = 0.1;
/// See [`FREE`].
/// Numerical: a guard of an iteration.
const MOST_DAMPING: f32 = 1e4;
/// Share of an energy by which two that are equal differ.
/// Numerical: rounding of single precision.
const ROUNDING: f32 = 2e-7;
/// Power of a kernel in a window under which it is rounding; of a sound one it is near 1.2 E.
/// Numerical: a guard of a division.
const LEAST_POWER: f32 = 1e-3;

/// Result of a fit of `L` paths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit<const L: usize, const D: usize, const A: usize> {
    pub(super) places: [Place; L],
    /// Gain of each path at each array, LSB of a tap; phase reference is the window's origin.
    pub(super) gains: [[Complex<f32>; A]; L],
    /// Energy explained, squared LSB summed over the window and the channels.
    pub(super) energy: f32,
    /// Gauss-Newton Hessian of half the squared error over (delay in taps, angle 1, angle 2) of each path in turn.
    pub(super) hessian: [[f32; D]; D],
    /// Evaluations that it took.
    pub(super) evaluations: u32,
}

/// Everything one evaluation gives.
struct Normal<const L: usize, const D: usize, const A: usize> {
    energy: f32,
    gains: [[Complex<f32>; A]; L],
    hessian: [[f32; D]; D],
    gradient: [f32; D],
}

/// Fits `L` paths (`D` = 3 L parameters) from starting places. `noise` is the variance of a tap; the iteration ends when
/// a step is shorter than a thirtieth of a standard deviation, or after `most` steps. The last step is the first that is shorter
/// than a third of one (a seventh for pairs): what is left to do after it is less than a hundredth, and gains and Hessian from
/// before it differ by less than noise makes them. Where a joint fit leaves more than noise, because of errors of the arrays or of
/// paths that it does not have, the standard deviation is the one that this makes.
pub(super) fn fit<
    const L: usize,
    const D: usize,
    const A: usize,
    const E: usize,
    const C: usize,
    const W: usize,
>(
    model: &ArrayModel<A, E>,
    template: &Template,
    window: &Window<C, W>,
    start: [Place; L],
    noise: f32,
    most: usize,
) -> Fit<L, D, A> {
    const { assert!(D == 3 * L && C == A * E) };
    let mut places = start;
    let mut normal = normal_equations::<L, D, A, E, C, W>(model, template, window, &places);
    let mut damping = if L == 1 { 0.0 } else { 1e-3 };
    let (whole, samples) = if L == 1 {
        (0.0, 1)
    } else {
        let Content { energy, samples } = window.content();
        (energy, samples.max(1))
    };
    let freedom = template.occupancy() * samples as f32;
    let mut evaluations = 1;
    for _ in 0..most {
        // Errors of the model count as noise.
        let noise = noise.max((whole - normal.energy) / freedom);
        let step = solve(&normal.hessian, &normal.gradient, damping);
        let gain: f32 = step.iter().zip(&normal.gradient).map(|(s, g)| s * g).sum();
        // Twice the gain over the noise is the squared length of the step in standard deviations.
        if gain.is_nan() || (2.0 * gain < STILL * noise && damping < FREE) || damping > MOST_DAMPING {
            break;
        }
        let mut candidate = places;
        for (place, step) in candidate.iter_mut().zip(step.as_chunks::<3>().0) {
            *place = place.moved(*step);
        }
        let last = if L == 1 { LAST_STEP } else { LAST_STEP_JOINT };
        if damping < FREE && 2.0 * gain < last * noise {
            places = candidate;
            break;
        }
        let next = normal_equations::<L, D, A, E, C, W>(model, template, window, &candidate);
        evaluations += 1;
        // A single path's surface is benign and a step is cheap; pairs must not walk uphill.
        if L == 1 || next.energy > normal.energy * (1.0 - ROUNDING) {
            (places, normal) = (candidate, next);
            damping *= 0.2;
        } else {
            damping = (damping * 8.0).max(1e-3);
        }
    }
    Fit {
        places,
        gains: normal.gains,
        energy: normal.energy,
        hessian: normal.hessian,
        evaluations,
    }
}

impl<const L: usize, const D: usize, const A: usize> Normal<L, D, A> {
    fn zero() -> Self {
        Self {
            energy: 0.0,
            gains: [[Complex::new(0.0, 0.0); A]; L],
            hessian: [[0.0; D]; D],
            gradient: [0.0; D],
        }
    }
}

fn normal_equations<
    const L: usize,
    const D: usize,
    const A: usize,
    const E: usize,
    const C: usize,
    const W: usize,
>(
    model: &ArrayModel<A, E>,
    template: &Template,
    window: &Window<C, W>,
    places: &[Place; L],
) -> Normal<L, D, A> {
    if let Some(planar) = model.planar() {
        return planar::normal_equations::<L, D, A, E, C, W>(model, planar, template, window, places);
    }
    let tangents = places.map(|place| place.tangents());
    let mut normal = Normal::zero();
    let rows = window.rows().as_chunks::<E>().0;
    for (j, ((step, lead), rows)) in model.arrays().zip(rows).enumerate() {
        let slopes = tangents.map(|(e1, e2)| {
            const TURN: f32 = core::f32::consts::TAU;
            Slopes {
                steering: [TURN * step.dot(&e1), TURN * step.dot(&e2)],
                delay: [-lead.dot(&e1), -lead.dot(&e2)],
            }
        });
        let steering: [[Complex<f32>; E]; L] = places.each_ref().map(|place| steering(step.dot(&place.u)));
        let mut kernel = [[[0.0; 2]; W]; L];
        for (row, place) in kernel.iter_mut().zip(places) {
            let delay = place.delay_taps - lead.dot(&place.u);
            template.row(
                window.first() - delay,
                row.get_mut(..window.len()).unwrap_or_default(),
            );
        }
        let mut gram = gram::<L, D, E, W>(&steering, &kernel);
        let mut correlation = correlate::<L, D, E, W>(rows, &steering, &kernel);
        normal.energy += eliminate::<L, D>(&mut gram, &mut correlation);
        let gains: [Complex<f32>; L] = core::array::from_fn(|p| {
            let power = gram[p][p];
            if power > 0.0 {
                correlation[p] / power
            } else {
                Complex::new(0.0, 0.0)
            }
        });
        for (all, gain) in normal.gains.iter_mut().zip(gains) {
            if let Some(slot) = all.get_mut(j) {
                *slot = gain;
            }
        }
        accumulate::<L, D, A>(&mut normal, &gram, &correlation, &gains, &slopes);
    }
    // The upper triangle of blocks has been added up.
    for p in 0..L {
        for row in 3 * p..3 * p + 3 {
            for column in 0..3 * p {
                normal.hessian[row][column] = normal.hessian[column][row];
            }
        }
    }
    normal
}

/// Derivatives of a path's steering and delay at one array with respect to its two angles. With respect to the delay they
/// are 0 and 1.
struct Slopes {
    steering: [f32; 2],
    delay: [f32; 2],
}

/// Index of column kind k (0 = A, 1 = W, 2 = T) of path p.
const fn column<const L: usize>(kind: usize, path: usize) -> usize {
    kind * L + path
}

/// Inner products of all columns: element (r, s) is `r^H s`, real because places lie symmetrically.
fn gram<const L: usize, const D: usize, const E: usize, const W: usize>(
    steering: &[[Complex<f32>; E]; L],
    kernel: &[[[f32; 2]; W]; L],
) -> [[f32; D]; D] {
    let mut gram = [[0.0; D]; D];
    for p in 0..L {
        for q in p..L {
            let [t00, t01, t10, t11] = taps(&kernel[p], &kernel[q]);
            let [s0, s1, s2] = spatial(&steering[p], &steering[q]);
            let products = [
                [s0 * t00, -s1 * t00, -s0 * t01],
                [s1 * t00, s2 * t00, -s1 * t01],
                [-s0 * t10, s1 * t10, s0 * t11],
            ];
            for (k, products) in products.iter().enumerate() {
                for (l, product) in products.iter().enumerate() {
                    let (r, s) = (column::<L>(k, p), column::<L>(l, q));
                    gram[r][s] = *product;
                    gram[s][r] = *product;
                }
            }
        }
    }
    gram
}

/// Sums over the taps of two paths' kernels and slopes: both kernels, the second's slope, the first's, both slopes.
fn taps<const W: usize>(first: &[[f32; 2]; W], second: &[[f32; 2]; W]) -> [f32; 4] {
    let (mut t00, mut t01, mut t10, mut t11) = (0.0, 0.0, 0.0, 0.0);
    for ([a, da], [b, db]) in first.iter().zip(second) {
        t00 += a * b;
        t01 += a * db;
        t10 += da * b;
        t11 += da * db;
    }
    [t00, t01, t10, t11]
}

/// Sums over the elements of `cos`, `n sin` and `n^2 cos` of the phase `n w` between two paths, `n` the element's place: what
/// `n^0`, `n^1`, `n^2` times the product of their steering add up to. Both halves of an array give the same.
fn spatial<const E: usize>(a: &[Complex<f32>; E], b: &[Complex<f32>; E]) -> [f32; 3] {
    let mut sums = [if E.is_multiple_of(2) { 0.0 } else { 1.0 }, 0.0, 0.0];
    for (i, (a, b)) in a.iter().zip(b).enumerate().skip(E.div_ceil(2)) {
        let n = place::<E>(i);
        let cosine = a.re * b.re + a.im * b.im;
        let sine = n * (a.re * b.im - a.im * b.re);
        sums[0] += 2.0 * cosine;
        sums[1] += 2.0 * sine;
        sums[2] += 2.0 * n * n * cosine;
    }
    sums
}

/// `V^H y` of all columns of one array.
fn correlate<const L: usize, const D: usize, const E: usize, const W: usize>(
    rows: &[[Complex<f32>; W]; E],
    steering: &[[Complex<f32>; E]; L],
    kernel: &[[[f32; 2]; W]; L],
) -> [Complex<f32>; D] {
    let zero = Complex::new(0.0, 0.0);
    let mut out = [zero; D];
    for p in 0..L {
        // Time first: two real weights per complex tap, then space.
        let (mut a, mut w, mut t) = (zero, zero, zero);
        for (i, (row, s)) in rows.iter().zip(&steering[p]).enumerate() {
            let (mut value, mut slope) = (zero, zero);
            for (y, k) in row.iter().zip(&kernel[p]) {
                value += y * k[0];
                slope += y * k[1];
            }
            let (value, slope) = (s.conj() * value, s.conj() * slope);
            a += value;
            w += value * place::<E>(i);
            t -= slope;
        }
        out[column::<L>(0, p)] = a;
        out[column::<L>(1, p)] = Complex::new(w.im, -w.re);
        out[column::<L>(2, p)] = t;
    }
    out
}

/// Gauss-Jordan elimination of the columns A from the Gram matrix and the correlations. What remains of the other
/// columns is their part orthogonal to all A; of A's own, only the diagonal means anything then. Returns the energy that A
/// explains. Of two paths that coincide, the second explains nothing.
fn eliminate<const L: usize, const D: usize>(
    gram: &mut [[f32; D]; D],
    correlation: &mut [Complex<f32>; D],
) -> f32 {
    let mut energy = 0.0;
    for p in 0..L {
        let (pivot_row, pivot_value) = (gram[p], correlation[p]);
        let power = pivot_row[p];
        if power < LEAST_POWER {
            // The kernel's energy in a window is near 1.2 E: this is rounding.
            gram[p][p] = 0.0;
            continue;
        }
        let inverse = 1.0 / power;
        energy += pivot_value.norm_sqr() * inverse;
        for r in 0..D {
            if r == p {
                continue;
            }
            let factor = gram[r][p] * inverse;
            for s in p + 1..D {
                gram[r][s] -= factor * pivot_row[s];
            }
            correlation[r] -= pivot_value * factor;
        }
    }
    energy
}

/// Adds one array's part to gradient and Hessian, of which the blocks on and above the diagonal.
fn accumulate<const L: usize, const D: usize, const A: usize>(
    normal: &mut Normal<L, D, A>,
    gram: &[[f32; D]; D],
    correlation: &[Complex<f32>; D],
    gains: &[Complex<f32>; L],
    slopes: &[Slopes; L],
) {
    for p in 0..L {
        let Slopes {
            steering: [a1, a2],
            delay: [b1, b2],
        } = slopes[p];
        let (w, t) = (column::<L>(1, p), column::<L>(2, p));
        let [along_w, along_t] =
            [w, t].map(|r| gains[p].re * correlation[r].re + gains[p].im * correlation[r].im);
        normal.gradient[3 * p] += along_t;
        normal.gradient[3 * p + 1] += along_w * a1 + along_t * b1;
        normal.gradient[3 * p + 2] += along_w * a2 + along_t * b2;
        for q in p..L {
            let cross = gains[p].re * gains[q].re + gains[p].im * gains[q].im;
            // Weights of (W, T) of both paths, times the slopes of the second, then those of the first.
            let [with_w, with_t] = [w, t].map(|r| {
                let [with_w, with_t] = [1, 2].map(|kind| cross * gram[r][column::<L>(kind, q)]);
                let Slopes { steering, delay } = &slopes[q];
                [
                    with_t,
                    with_w * steering[0] + with_t * delay[0],
                    with_w * steering[1] + with_t * delay[1],
                ]
            });
            let rows = [[0.0, 1.0], [a1, b1], [a2, b2]];
            for (row, [of_w, of_t]) in normal.hessian.iter_mut().skip(3 * p).zip(rows) {
                for (sum, (x, y)) in row.iter_mut().skip(3 * q).zip(with_w.iter().zip(&with_t)) {
                    *sum += of_w * x + of_t * y;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
