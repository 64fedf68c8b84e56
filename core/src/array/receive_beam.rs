//! A receive beam of one array: towards a path, with nulls where other paths come from.
//!
//! Its weights are made in floats and used in Q15: of the array's channels one is made, in integers, before the transform, which is linear.

use heapless::Vec;
use nalgebra::Complex;

use crate::kernels::{Channel, Iq};

/// Share of its power that a path, or a null, must keep beside the nulls before it (-35 dB): one that keeps less is nearly one of them.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const LEAST_KEPT: f32 = 3e-4;
/// One, Q15.
/// Given: the format Q15.
const Q15_ONE: f32 = 32_767.0;

/// Where a beam is to hear nothing from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Null<const E: usize> {
    /// Steering vector of it.
    pub(crate) steering: [Complex<f32>; E],
    /// Share of its power that the path must keep beside this null, or the beam does without.
    pub(crate) least_kept: f32,
}

/// Conjugate weights, Q15, whose magnitudes add up to one at most.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceiveBeam<const E: usize> {
    weights: [Iq; E],
    kept: f32,
}

impl<const E: usize> ReceiveBeam<E> {
    /// A beam that hears nothing.
    pub(crate) const DEAF: Self = Self {
        weights: [Iq::ZERO; E],
        kept: 0.0,
    };
    /// What a path's amplitude is multiplied with to be that of weights of norm one.
    pub(crate) fn gain() -> f32 {
        libm::sqrtf(E as f32)
    }

    /// A beam towards a path, given by its steering vector, with at most `NULLS` nulls, the first ones first.
    #[inline(never)]
    pub(crate) fn new<const NULLS: usize>(
        path: &[Complex<f32>; E],
        nulls: impl Iterator<Item = Null<E>>,
    ) -> Self {
        let mut basis: Vec<[Complex<f32>; E], NULLS> = Vec::new();
        let without = |vector: &[Complex<f32>; E], basis: &[[Complex<f32>; E]]| {
            let mut vector = *vector;
            let kept = purge(&mut vector, basis);
            (vector, kept)
        };
        for null in nulls {
            let (vector, apart) = without(&null.steering, &basis);
            let usable = apart > LEAST_KEPT && basis.push(vector).is_ok();
            if usable && without(path, &basis).1 < null.least_kept {
                let _masks = basis.pop();
            }
        }
        let (vector, kept) = without(path, &basis);
        let scale = Q15_ONE / Self::gain();
        Self {
            weights: vector.map(|v| Iq::new((v.re * scale) as i16, (-v.im * scale) as i16)),
            kept,
        }
    }

    /// Whether the path keeps enough of its power beside the nulls.
    pub(crate) fn keeps(&self) -> bool {
        self.kept > LEAST_KEPT
    }

    /// The beam's channel.
    #[inline(never)]
    pub(crate) fn hear(&self, channels: &[Channel; E], out: &mut Channel) {
        for (n, sum) in out.iter_mut().enumerate() {
            let samples = core::array::from_fn(|i| {
                channels
                    .get(i)
                    .and_then(|channel| channel.get(n))
                    .copied()
                    .unwrap_or(Iq::ZERO)
            });
            *sum = Iq::weighted_sum(samples, &self.weights);
        }
    }
}

/// Takes the parts along an orthonormal basis out of a vector and scales the rest to norm one; returns the share of the
/// power that it kept.
fn purge<const E: usize>(vector: &mut [Complex<f32>; E], basis: &[[Complex<f32>; E]]) -> f32 {
    let power = |v: &[Complex<f32>; E]| v.iter().map(Complex::norm_sqr).sum::<f32>();
    let before = power(vector);
    for b in basis {
        let along: Complex<f32> = b.iter().zip(vector.iter()).map(|(b, v)| b.conj() * v).sum();
        for (v, b) in vector.iter_mut().zip(b) {
            *v -= b * along;
        }
    }
    let after = power(vector);
    let scale = if after > 0.0 {
        1.0 / libm::sqrtf(after)
    } else {
        0.0
    };
    for v in vector.iter_mut() {
        *v *= scale;
    }
    if before > 0.0 { after / before } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{SAMPLES, phasor};

    fn steering(turns: f32) -> [Complex<f32>; 8] {
        core::array::from_fn(|i| phasor(turns * (i as f32 - 3.5)))
    }

    /// What a beam makes of a path of this amplitude.
    fn heard(beam: &ReceiveBeam<8>, turns: f32, amplitude: f32) -> f32 {
        let channels = steering(turns).map(|s| {
            let value = s * amplitude;
            [Iq::new(value.re as i16, value.im as i16); SAMPLES]
        });
        let mut out = [Iq::ZERO; SAMPLES];
        beam.hear(&channels, &mut out);
        libm::hypotf(f32::from(out[7].re()), f32::from(out[7].im())) / amplitude
    }

    #[test]
    fn a_path_keeps_its_amplitude_and_a_null_nothing() {
        let null = |turns, least_kept| Null {
            steering: steering(turns),
            least_kept,
        };
        let alone = ReceiveBeam::new::<2>(&steering(0.1), core::iter::empty());
        assert!((heard(&alone, 0.1, 20_000.0) - 1.0).abs() < 2e-3 && alone.kept == 1.0);
        let beside = ReceiveBeam::new::<2>(&steering(0.1), [null(0.3, 0.0), null(-0.2, 0.0)].into_iter());
        assert!(heard(&beside, 0.3, 20_000.0) < 1e-3 && heard(&beside, -0.2, 20_000.0) < 1e-3);
        let kept = libm::sqrtf(beside.kept);
        assert!((heard(&beside, 0.1, 20_000.0) - kept).abs() < 2e-3 && kept > 0.9);
    }

    #[test]
    fn a_null_that_would_hide_the_path_is_left_out() {
        let near = Null {
            steering: steering(0.11),
            least_kept: 0.25,
        };
        let beam = ReceiveBeam::new::<2>(&steering(0.1), [near].into_iter());
        assert!(beam.kept == 1.0);
        let insisted = Null {
            least_kept: 0.0,
            ..near
        };
        assert!(ReceiveBeam::new::<2>(&steering(0.1), [insisted].into_iter()).kept < 0.05);
    }
}
