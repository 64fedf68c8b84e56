//! The hot product: rays through gains and steering to the samples of an array.

use cslam_core::signal::SAMPLES;
use pulp::{Simd, WithSimd};

use super::C64;
use super::lanes::{add_up, in_widest_lanes, product, sum};
use super::waves::{Plane, Wave};

/// Rays under this share of the strongest one's power (30 dB) take no delays of elements: those would add -58 dB.
pub(super) const STRONG_POWER: f64 = 1e-3;

/// What a ray brings to one array in one beam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gain {
    /// Factor of the wave.
    pub(crate) value: C64,
    /// Factor of its slope, s.
    pub(crate) slope: C64,
}

/// `out[i] = sum_l steering[l][i] (gain[l].value wave[l] + gain[l].slope wave'[l])`, and for the first rays, whose
/// elements have delays of their own, less `steering[l][i] delay_s[l][i] gain[l].value wave'[l]` (second order: -63 dB at
/// the edge of band and array).
///
/// Sums run over the rays in order, sample by sample: the result does not depend on how wide the machine's lanes are.
pub(crate) fn mix<const ELEMENTS: usize>(
    waves: &[Wave],
    gains: &[Gain],
    steering: &[[C64; ELEMENTS]],
    delays_s: Option<&[[f64; ELEMENTS]]>,
    out: &mut [Plane],
) {
    let mut all: Vec<[[f32; 2]; ELEMENTS]> = steering.iter().map(|s| s.map(single)).collect();
    // Where elements have delays, the slopes of what counts are further waves, with a steering of their own.
    let late: Vec<usize> = delays_s.map_or_else(Vec::new, |delays_s| strong(gains, steering, delays_s.len()));
    if let Some(delays_s) = delays_s {
        all.extend(late.iter().map(|l| {
            let (s, d) = (&steering[*l], &delays_s[*l]);
            std::array::from_fn(|i| single(s[i] * -d[i]))
        }));
    }
    in_widest_lanes(Mix {
        waves,
        gains,
        steering: &all,
        late: &late,
        out,
    });
}

/// The products and sums of [`mix`].
struct Mix<'a, const ELEMENTS: usize> {
    waves: &'a [Wave],
    gains: &'a [Gain],
    /// Of each wave, and then of the slope of each that is `late`.
    steering: &'a [[[f32; 2]; ELEMENTS]],
    late: &'a [usize],
    out: &'a mut [Plane],
}

impl<const ELEMENTS: usize> WithSimd for Mix<'_, ELEMENTS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let with_slope = self.gains.iter().any(|g| g.slope != C64::new(0.0, 0.0));
        // What arrives of each wave in some samples, before the elements are told apart.
        let mut arrived = Vec::with_capacity(self.steering.len());
        for chunk in 0..SAMPLES / S::F32_LANES {
            // Loops, not iterators' closures: those would not be inlined, and called for every number.
            arrived.clear();
            for (wave, gain) in self.waves.iter().zip(self.gains) {
                let mut value = product(simd, single(gain.value), wave.value.lanes::<S>(chunk));
                if with_slope {
                    // The slope is large and its factor small: both fit f32, and so does the product.
                    let slope = product(simd, single(gain.slope), wave.slope.lanes::<S>(chunk));
                    value = sum(simd, value, slope);
                }
                arrived.push(value);
            }
            for l in self.late {
                let slope = self.waves[*l].slope.lanes::<S>(chunk);
                arrived.push(product(simd, single(self.gains[*l].value), slope));
            }
            let rays = self.steering.iter().zip(arrived.iter().copied());
            add_up(simd, rays, |element, heard| {
                if let Some(plane) = self.out.get_mut(element) {
                    plane.put_lanes::<S>(chunk, heard);
                }
            });
        }
    }
}

/// A complex number in single precision.
#[inline(always)]
fn single(c: C64) -> [f32; 2] {
    [c.re as f32, c.im as f32]
}

/// The first `count` rays but those far under the strongest.
fn strong<const ELEMENTS: usize>(gains: &[Gain], steering: &[[C64; ELEMENTS]], count: usize) -> Vec<usize> {
    let power = |l: usize| gains[l].value.norm_sqr() * steering[l][0].norm_sqr();
    let most = (0..count).map(power).fold(0.0, f64::max);
    (0..count).filter(|l| power(*l) > STRONG_POWER * most).collect()
}
