//! The line of sight and its ground bounce, fitted together.
//!
//! A wave that flat ground reflects comes to the UAV a fraction of a metre later, from a degree or two below: no array of eight
//! elements parts the two, and a null that would costs most of the signal and leaves what the arrays' errors let through. But the
//! bounce left the GMT downwards, and where it left is known from where the line of sight left: the mirrored way. So every
//! symbol is fitted with two patterns, each with a gain of its own; that of the bounce is held near nothing by a prior, for
//! it is no stronger than the line of sight. Where the two ways leave within a beam of each other, the symbols cannot tell them
//! apart, and the covariance says so.

use heapless::Vec;
use nalgebra::{Complex, Matrix2, Matrix3, Vector2, Vector3};

use super::fit::{
    BLIND_STEPS, FREE, Fit, LEAST_DETERMINANT, LONGEST_M, MOST_DAMPING, NEAR_ENOUGH, Place, ROUNDING,
    ReceivedSymbols, SETTLED,
};
use super::pattern::{Row, Spin};
use super::reception::Spectrum;
use super::robust::BLOCKS;
use crate::array::SquintSymbol;

/// Subcarriers added up to one sample.
/// Numerical: neither the patterns nor the bounce's phase turn over so few.
const STRIDE: usize = 4;
/// Samples.
/// Derived: up to 512 subcarriers.
const SAMPLES: usize = 128;
/// Symbols heard with less than this share of the best one's energy say nothing.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const LEAST_SHARE: f32 = 0.03;
/// Prior standard deviation of the bounce's amplitude against that of the line of sight.
/// Given: what the ground reflects at 30 GHz (docs/beam-squint.md).
const BOUNCE: f32 = 0.7;
/// Iterations at most, and the longest step.
/// Capacity: work of a fit.
const ITERATIONS: usize = 12;
/// Numerical: a step of an iteration.
const LONGEST: f32 = 0.03;

/// Flat ground under the GMT, and how far the UAV is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mirror {
    /// The vertical along the face's row, its column and its normal.
    pub(super) up: [f32; 3],
    /// Height of the antenna over the ground, m.
    pub(super) height_m: f32,
    /// Length of the line of sight, m.
    pub(super) range_m: f32,
}

/// Where the bounce left, and how that moves with the line of sight.
#[derive(Clone, Copy, Debug)]
struct Image {
    cosines: [f32; 2],
    /// Derivative of the cosines (row) over those of the line of sight (column).
    by: Matrix2<f32>,
    /// How much longer its way is, m, and the derivative of that.
    later_m: f32,
    later_by: Vector2<f32>,
}

impl Mirror {
    /// The bounce of a line of sight that left along `[x, z]`: to the UAV's image under the ground.
    fn image(&self, [x, z]: [f32; 2]) -> Option<Image> {
        let [ux, uz, un] = self.up;
        let (rho, h) = (self.range_m, self.height_m);
        let ahead = libm::sqrtf(1.0 - x * x - z * z);
        if ahead.is_nan() || ahead <= 0.0 {
            return None;
        }
        let rise = x * ux + z * uz + ahead * un;
        let rise_by = Vector2::new(ux - x / ahead * un, uz - z / ahead * un);
        let length = libm::sqrtf(rho * rho + 4.0 * h * (rho * rise + h));
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        let down = 2.0 * (rho * rise + h);
        let (s, k) = (Vector2::new(x, z), Vector2::new(ux, uz));
        let cosines = (s * rho - k * down) / length;
        let later_by = rise_by * (2.0 * h * rho / length);
        let by = (Matrix2::identity() * rho - k * rise_by.transpose() * (2.0 * rho)) / length
            - cosines * later_by.transpose() / length;
        Some(Image {
            cosines: [cosines.x, cosines.y],
            by,
            later_m: length - rho,
            later_by,
        })
    }
}

/// A fit of both.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint {
    pub(super) place: Place,
    /// Covariance of the cosines by noise, widened by what the fit leaves over.
    pub(super) covariance: Matrix2<f32>,
    /// The same of the delay, m^2.
    pub(super) delay_m2: f32,
    /// Whether the steps died out.
    pub(super) settled: bool,
}

/// A symbol that is fitted.
struct Heeded<'a, const ACTIVE: usize> {
    symbol: &'a SquintSymbol,
    spectrum: &'a Spectrum<ACTIVE>,
    /// Two over the noise variance of a sample.
    weight: f32,
}

/// Every [`STRIDE`] subcarriers of a symbol in one: both patterns with their derivatives.
#[derive(Clone, Copy)]
struct Sample {
    direct: [f32; 3],
    /// Of the bounce, turned by its delay.
    bounce: [Complex<f32>; 3],
    omega: f32,
    y: Complex<f32>,
    /// What the gains make of it, by the cosines and the delay.
    slopes: [Complex<f32>; 3],
}

type Samples = Vec<Sample, SAMPLES>;

/// Inner products of a symbol's two patterns: of the line of sight's with itself, with the bounce's, and of that with itself.
#[derive(Clone, Copy)]
struct Gram {
    rr: f32,
    rq: Complex<f32>,
    qq: f32,
}

impl Gram {
    /// What of the two patterns explains best something whose inner products with them are `r` and `q`.
    fn solve(&self, r: Complex<f32>, q: Complex<f32>) -> [Complex<f32>; 2] {
        let determinant = self.rr * self.qq - self.rq.norm_sqr();
        [
            (r * self.qq - self.rq * q) / determinant,
            (q * self.rr - self.rq.conj() * r) / determinant,
        ]
    }
}

/// Sums over all symbols, in noise variances.
#[derive(Clone, Copy, Default)]
struct Normal {
    energy: f32,
    /// Over the cosines and the delay.
    gradient: Vector3<f32>,
    hessian: Matrix3<f32>,
    /// Sum over blocks of subcarriers of the squared gradient.
    meat: Matrix3<f32>,
}

impl Normal {
    /// Inverse of the damped matrix, by one of unit diagonal: the parameters' units differ.
    fn inverse(&self, damping: f32) -> Option<Matrix3<f32>> {
        let scale = self.hessian.diagonal().map(|d| 1.0 / libm::sqrtf(d));
        let scaled = self.hessian.component_mul(&(scale * scale.transpose()));
        let damped = scaled + Matrix3::identity() * damping;
        // Rounding of the products sets the limit.
        let usable = damped.determinant() > LEAST_DETERMINANT;
        let inverse = damped.try_inverse().filter(|_| usable)?;
        Some(inverse.component_mul(&(scale * scale.transpose())))
    }
}

impl<const SYMBOLS: usize, const ACTIVE: usize> ReceivedSymbols<'_, SYMBOLS, ACTIVE> {
    /// Goes on from the fit of one path. `None` where a way leads behind the face, or where nothing tells the place.
    pub(super) fn fit_both<const X: usize, const Z: usize>(
        &self,
        start: &Fit<SYMBOLS>,
        mirror: &Mirror,
    ) -> Option<Joint> {
        let (heeded, gain_power) = self.heeded::<X, Z>(start);
        let prior = 1.0 / (BOUNCE * BOUNCE * gain_power);
        let mut place = start.place;
        let evaluate = |place: &Place| self.both::<X, Z>(&heeded, mirror, place, prior);
        let mut normal = evaluate(&place)?;
        let mut damping = 1e-3;
        let (mut blind, mut length) = (0, f32::INFINITY);
        for _ in 0..ITERATIONS {
            let step = normal.inverse(damping)? * normal.gradient;
            length = normal.gradient.dot(&step);
            if length.is_nan()
                || damping > MOST_DAMPING
                || (length < SETTLED && damping < FREE)
                || blind == BLIND_STEPS
            {
                break;
            }
            let across = step.x.abs().max(step.y.abs());
            let scale = (LONGEST / across).min(LONGEST_M / step.z.abs()).min(1.0);
            let [x, z] = place.cosines;
            let candidate = Place {
                cosines: [x + step.x * scale, z + step.y * scale],
                delay_m: place.delay_m + step.z * scale,
            };
            let near = length < ROUNDING * normal.energy && damping < FREE;
            match evaluate(&candidate) {
                Some(next) if near || next.energy > normal.energy => {
                    (place, normal) = (candidate, next);
                    damping *= 0.2;
                    blind += u32::from(near);
                }
                _ => damping = (damping * 8.0).max(1e-2),
            }
        }
        let noise = normal.inverse(0.0)?;
        let wide = noise * normal.meat * noise;
        let factor = (wide.m11 / noise.m11).max(wide.m22 / noise.m22).max(1.0);
        Some(Joint {
            place,
            covariance: noise.fixed_view::<2, 2>(0, 0) * factor,
            delay_m2: wide.m33.max(noise.m33),
            settled: length < NEAR_ENOUGH,
        })
    }

    /// The symbols that are worth it, and the square of the best one's gain.
    fn heeded<const X: usize, const Z: usize>(
        &self,
        fit: &Fit<SYMBOLS>,
    ) -> (Vec<Heeded<'_, ACTIVE>, SYMBOLS>, f32) {
        let energies = core::array::from_fn::<_, SYMBOLS, _>(|index| {
            let slot = self.schedule.get(index).zip(self.spectra.get(index)?.as_ref());
            let heeded = fit.heeded.get(index).copied().unwrap_or(false);
            let (symbol, spectrum) = slot.filter(|_| heeded)?;
            let sums = self.sums::<X, Z, STRIDE>(symbol, spectrum, &fit.place);
            Some((sums.ry.norm_sqr() / sums.rr / spectrum.noise, sums.gain_power()))
        });
        let (most, gain_power) = energies
            .iter()
            .flatten()
            .fold((0.0, 0.0), |best, of| if of.0 > best.0 { *of } else { best });
        let mut all = Vec::new();
        for ((symbol, spectrum), energy) in self.schedule.iter().zip(self.spectra).zip(&energies) {
            if let (Some(spectrum), Some((energy, _))) = (spectrum, energy)
                && *energy > LEAST_SHARE * most
            {
                let heeded = Heeded {
                    symbol,
                    spectrum,
                    weight: 2.0 / (spectrum.noise * STRIDE as f32),
                };
                // There is room for every symbol.
                let _fits = all.push(heeded);
            }
        }
        (all, gain_power)
    }

    fn both<const X: usize, const Z: usize>(
        &self,
        heeded: &[Heeded<'_, ACTIVE>],
        mirror: &Mirror,
        place: &Place,
        prior: f32,
    ) -> Option<Normal> {
        let image = mirror.image(place.cosines)?;
        let mut normal = Normal::default();
        for symbol in heeded {
            self.add::<X, Z>(symbol, place, &image, prior, &mut normal);
        }
        Some(normal)
    }

    /// Adds a symbol with both gains eliminated.
    fn add<const X: usize, const Z: usize>(
        &self,
        heeded: &Heeded<'_, ACTIVE>,
        place: &Place,
        image: &Image,
        prior: f32,
        normal: &mut Normal,
    ) {
        let mut samples = Samples::new();
        self.sample::<X, Z>(heeded, place, image, &mut samples);
        let zero = Complex::new(0.0, 0.0);
        let mut gram = Gram {
            rr: 0.0,
            rq: zero,
            qq: 2.0 * prior / heeded.weight,
        };
        let (mut ry, mut qy) = (zero, zero);
        for s in &samples {
            let ([r, ..], [q, ..]) = (s.direct, s.bounce);
            gram.rr += r * r;
            gram.rq += q * r;
            gram.qq += q.norm_sqr();
            ry += s.y * r;
            qy += q.conj() * s.y;
        }
        let [g, h] = gram.solve(ry, qy);
        for s in &mut samples {
            let ([r, x, z], [q, qx, qz]) = (s.direct, s.bounce);
            let late = Complex::new(0.0, -s.omega);
            let of =
                |own: f32, bx: f32, bz: f32, later: f32| g * own + h * (qx * bx + qz * bz + late * q * later);
            s.slopes = [
                of(x, image.by.m11, image.by.m21, image.later_by.x),
                of(z, image.by.m12, image.by.m22, image.later_by.y),
                late * (g * r + h * q),
            ];
        }
        let (mut along_r, mut along_q) = ([zero; 3], [zero; 3]);
        for s in &samples {
            let ([r, ..], [q, ..]) = (s.direct, s.bounce);
            for ((slope, r_sum), q_sum) in s.slopes.iter().zip(&mut along_r).zip(&mut along_q) {
                *r_sum += slope * r;
                *q_sum += q.conj() * slope;
            }
        }
        let along: [[Complex<f32>; 2]; 3] = core::array::from_fn(|i| {
            let of = |sums: &[Complex<f32>; 3]| sums.get(i).copied().unwrap_or(zero);
            gram.solve(of(&along_r), of(&along_q))
        });
        let mut pulls = [Vector3::zeros(); BLOCKS];
        let block = samples.len().div_ceil(BLOCKS).max(1);
        let mut hessian = Matrix3::zeros();
        for (index, s) in samples.iter().enumerate() {
            let ([r, ..], [q, ..]) = (s.direct, s.bounce);
            let mut free = s.slopes;
            for (slope, [a, b]) in free.iter_mut().zip(&along) {
                *slope -= a * r + b * q;
            }
            let over = s.y - g * r - h * q;
            let real = Vector3::from(free.map(|slope| slope.re));
            let imaginary = Vector3::from(free.map(|slope| slope.im));
            hessian += real * real.transpose() + imaginary * imaginary.transpose();
            if let Some(pull) = pulls.get_mut(index / block) {
                *pull += real * over.re + imaginary * over.im;
            }
        }
        let weight = heeded.weight;
        normal.energy += 0.5 * weight * (g.conj() * ry + h.conj() * qy).re;
        normal.hessian += hessian * weight;
        for pull in pulls {
            let pull = pull * weight;
            normal.gradient += pull;
            normal.meat += pull * pull.transpose();
        }
    }

    /// The samples of a symbol, the delay of `place` taken out.
    fn sample<const X: usize, const Z: usize>(
        &self,
        heeded: &Heeded<'_, ACTIVE>,
        place: &Place,
        image: &Image,
        samples: &mut Samples,
    ) {
        let band = self.band.decimated(STRIDE);
        let row = |axis: usize, [x, z]: [f32; 2]| {
            Row::new(heeded.symbol, axis, if axis == 0 { x } else { z }, &band)
        };
        let (mut x, mut z) = (row(0, place.cosines), row(1, place.cosines));
        let (mut image_x, mut image_z) = (row(0, image.cosines), row(1, image.cosines));
        let step = self.per_m_rad * STRIDE as f32;
        // From the middle of the band, and of the first stride.
        let mut omega = self.per_m_rad * 0.5 * (STRIDE as f32 - ACTIVE as f32);
        let mut spin = Spin::new(-omega * image.later_m, -step * image.later_m);
        let mut back = Spin::new(omega * place.delay_m, step * place.delay_m);
        for bins in heeded.spectrum.bins.as_chunks::<STRIDE>().0 {
            let turn = spin.next();
            let sample = Sample {
                direct: pattern::<X, Z>(&mut x, &mut z),
                bounce: pattern::<X, Z>(&mut image_x, &mut image_z).map(|value| turn * value),
                omega,
                y: bins.iter().sum::<Complex<f32>>() * back.next(),
                slopes: [Complex::new(0.0, 0.0); 3],
            };
            omega += step;
            // What is beyond 512 subcarriers is left out.
            let _fits = samples.push(sample);
        }
    }
}

/// A stride's pattern with its derivatives by the cosines; moves on.
fn pattern<const X: usize, const Z: usize>(row: &mut Row, column: &mut Row) -> [f32; 3] {
    let ([x, dx], [z, dz]) = (row.next::<X>(), column.next::<Z>());
    [x * z, dx * z, x * dz].map(|value| value * STRIDE as f32)
}

#[cfg(test)]
mod tests;
