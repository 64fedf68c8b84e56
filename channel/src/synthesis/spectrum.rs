//! Discrete Fourier transform of a block in `f64`.
//!
//! Own code, not a library's: those choose their instructions by the processor, and with them the last bit.

use std::array::from_fn;

use cslam_core::signal::SAMPLES;

use super::C64;
use super::antenna::phasor;
use super::lanes::in_widest_lanes;

/// A block of complex numbers.
pub type Samples = [C64; SAMPLES];

/// Real or imaginary parts of several blocks side by side.
pub(crate) type Parts<const BLOCKS: usize> = [[f64; BLOCKS]; SAMPLES];

/// Radix-2 transform with its table of twiddle factors.
#[derive(Clone, Debug)]
pub struct Transform {
    /// For each stage, of blocks of 2, 4 ... N: `exp(+j 2 pi k / block)`, k < block/2.
    stages: Vec<Vec<C64>>,
}

impl Transform {
    /// Makes the table.
    #[must_use]
    pub fn new() -> Self {
        let root = |k| phasor(std::f64::consts::TAU * k as f64 / SAMPLES as f64);
        let stage = |bits: u32| {
            let stride = SAMPLES >> (bits + 1);
            (0..1 << bits).map(|k| root(k * stride)).collect()
        };
        Self {
            stages: (0..SAMPLES.trailing_zeros()).map(stage).collect(),
        }
    }

    /// Where [`Self::inverse_of`] wants bin k: its bits reversed.
    pub(crate) fn place(bin: usize) -> usize {
        bin.reverse_bits() >> (usize::BITS - SAMPLES.trailing_zeros())
    }

    /// `x[n] = sum_k X[k] exp(+j 2 pi k n / N)`, unscaled, in place, of several blocks side by side: what is done to one is done to
    /// all, in the lanes of the machine, and the result does not depend on how many there are. X[k] is at [`Self::place`] of k.
    pub(crate) fn inverse_of<const BLOCKS: usize>(&self, [re, im]: [&mut Parts<BLOCKS>; 2]) {
        in_widest_lanes(
            #[inline(always)]
            || self.butterflies([re, im]),
        );
    }

    #[inline(always)]
    fn butterflies<const BLOCKS: usize>(&self, [re, im]: [&mut Parts<BLOCKS>; 2]) {
        for roots in &self.stages {
            let half = roots.len();
            let blocks = re.chunks_exact_mut(2 * half).zip(im.chunks_exact_mut(2 * half));
            for (re, im) in blocks {
                let ((low_re, high_re), (low_im, high_im)) = (re.split_at_mut(half), im.split_at_mut(half));
                let low = low_re.iter_mut().zip(low_im);
                let high = high_re.iter_mut().zip(high_im);
                for (((low_re, low_im), (high_re, high_im)), root) in low.zip(high).zip(roots) {
                    let (a_re, a_im, b_re, b_im) = (*low_re, *low_im, *high_re, *high_im);
                    let t_re: [f64; BLOCKS] = from_fn(|k| b_re[k] * root.re - b_im[k] * root.im);
                    let t_im: [f64; BLOCKS] = from_fn(|k| b_re[k] * root.im + b_im[k] * root.re);
                    *high_re = from_fn(|k| a_re[k] - t_re[k]);
                    *high_im = from_fn(|k| a_im[k] - t_im[k]);
                    *low_re = from_fn(|k| a_re[k] + t_re[k]);
                    *low_im = from_fn(|k| a_im[k] + t_im[k]);
                }
            }
        }
    }

    /// The same for one block, in the order of its bins.
    pub fn inverse(&self, data: &mut Samples) {
        let mut re: Parts<1> = from_fn(|i| [data[Self::place(i)].re]);
        let mut im: Parts<1> = from_fn(|i| [data[Self::place(i)].im]);
        self.inverse_of([&mut re, &mut im]);
        for (x, ([re], [im])) in data.iter_mut().zip(re.iter().zip(&im)) {
            *x = C64::new(*re, *im);
        }
    }

    /// `X[k] = sum_n x[n] exp(-j 2 pi k n / N)`, in place.
    pub fn forward(&self, data: &mut Samples) {
        self.inverse(data);
        data[1..].reverse();
    }
}

impl Default for Transform {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transform_follows_its_definition_and_back() {
        let mut x = [C64::new(0.0, 0.0); SAMPLES];
        for (n, x) in x.iter_mut().enumerate() {
            *x = C64::new(((n * n + 7) % 31) as f64, ((3 * n) % 17) as f64);
        }
        let transform = Transform::new();
        let mut y = x;
        transform.inverse(&mut y);
        for n in [0, 1, 100, 511] {
            let expected: C64 = (0..SAMPLES)
                .map(|k| x[k] * phasor(std::f64::consts::TAU * ((k * n) % SAMPLES) as f64 / SAMPLES as f64))
                .sum();
            assert!((y[n] - expected).norm() < 1e-9);
        }
        transform.forward(&mut y);
        assert!(
            x.iter()
                .zip(&y)
                .all(|(a, b)| (a * SAMPLES as f64 - b).norm() < 1e-8)
        );
    }
}
