//! Discrete Fourier transform of a block in `f64`.
//!
//! Own code, not a library's: those choose their instructions by the processor, and with them the last bit.

use cslam_core::waveform::SAMPLES;

use super::C64;
use super::antenna::phasor;

/// A block of complex numbers.
pub(crate) type Samples = [C64; SAMPLES];

/// Radix-2 transform with its table of twiddle factors.
#[derive(Clone, Debug)]
pub(crate) struct Transform {
    /// For each stage, of blocks of 2, 4 ... N: `exp(+j 2 pi k / block)`, k < block/2.
    stages: Vec<Vec<C64>>,
}

impl Transform {
    /// Makes the table.
    pub(crate) fn new() -> Self {
        let root = |k| phasor(std::f64::consts::TAU * k as f64 / SAMPLES as f64);
        let stage = |bits: u32| {
            let stride = SAMPLES >> (bits + 1);
            (0..1 << bits).map(|k| root(k * stride)).collect()
        };
        Self {
            stages: (0..SAMPLES.trailing_zeros()).map(stage).collect(),
        }
    }

    /// `x[n] = sum_k X[k] exp(+j 2 pi k n / N)`, in place, unscaled.
    pub(crate) fn inverse(&self, data: &mut Samples) {
        let bits = SAMPLES.trailing_zeros();
        for i in 0..SAMPLES {
            let j = i.reverse_bits() >> (usize::BITS - bits);
            if i < j {
                data.swap(i, j);
            }
        }
        for roots in &self.stages {
            for block in data.chunks_exact_mut(2 * roots.len()) {
                let (low, high) = block.split_at_mut(roots.len());
                for ((a, b), root) in low.iter_mut().zip(high).zip(roots) {
                    let t = *b * root;
                    *b = *a - t;
                    *a += t;
                }
            }
        }
    }

    /// `X[k] = sum_n x[n] exp(-j 2 pi k n / N)`, in place.
    pub(crate) fn forward(&self, data: &mut Samples) {
        self.inverse(data);
        data[1..].reverse();
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
