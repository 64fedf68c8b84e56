//! The hot product: rays through gains and steering to the samples of an array.

use cslam_core::signal::SAMPLES;

use super::C64;
use super::waves::{Plane, Wave};

/// Rays under this share of the strongest one's power (30 dB) take no delays of elements: those would add -58 dB.
pub(super) const STRONG_POWER: f64 = 1e-3;

/// Samples handled at a time: the sums of one element stay in registers.
const LANES: usize = 16;

/// What a ray brings to one array in one beam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gain {
    /// Factor of the wave.
    pub(crate) value: C64,
    /// Factor of its slope, s.
    pub(crate) slope: C64,
}

type Lanes = [f32; LANES];

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
    scratch: &mut Vec<[Lanes; 2]>,
    out: &mut [Plane],
) {
    let with_slope = gains.iter().any(|g| g.slope != C64::new(0.0, 0.0));
    let single = |c: C64| [c.re as f32, c.im as f32];
    let mut all: Vec<[[f32; 2]; ELEMENTS]> = steering.iter().map(|s| s.map(single)).collect();
    // Where elements have delays, the slopes of what counts are further waves, with a steering of their own.
    let late: Vec<usize> = delays_s.map_or_else(Vec::new, |delays_s| strong(gains, steering, delays_s.len()));
    if let Some(delays_s) = delays_s {
        all.extend(late.iter().map(|l| {
            let (s, d) = (&steering[*l], &delays_s[*l]);
            std::array::from_fn(|i| single(s[i] * -d[i]))
        }));
    }
    scratch.resize(all.len(), [[0.0; LANES]; 2]);
    for start in (0..SAMPLES).step_by(LANES) {
        for ((wave, gain), at) in waves.iter().zip(gains).zip(scratch.iter_mut()) {
            let [g_re, g_im] = single(gain.value);
            let (re, im) = (lanes(&wave.value.re, start), lanes(&wave.value.im, start));
            for k in 0..LANES {
                at[0][k] = g_re * re[k] - g_im * im[k];
                at[1][k] = g_re * im[k] + g_im * re[k];
            }
            if with_slope {
                // The slope is large and its factor small: both fit f32, and so does the product.
                let [g_re, g_im] = single(gain.slope);
                let (re, im) = (lanes(&wave.slope.re, start), lanes(&wave.slope.im, start));
                for k in 0..LANES {
                    at[0][k] += g_re * re[k] - g_im * im[k];
                    at[1][k] += g_re * im[k] + g_im * re[k];
                }
            }
        }
        for (l, at) in late.iter().zip(scratch.iter_mut().skip(waves.len())) {
            let (wave, gain) = (&waves[*l], &gains[*l]);
            let [g_re, g_im] = single(gain.value);
            let (re, im) = (lanes(&wave.slope.re, start), lanes(&wave.slope.im, start));
            for k in 0..LANES {
                at[0][k] = g_re * re[k] - g_im * im[k];
                at[1][k] = g_re * im[k] + g_im * re[k];
            }
        }
        for (i, plane) in out.iter_mut().enumerate() {
            let (mut sum_re, mut sum_im) = ([0.0; LANES], [0.0; LANES]);
            for (s, [re, im]) in all.iter().zip(scratch.iter()) {
                let [a_re, a_im] = s[i];
                for k in 0..LANES {
                    sum_re[k] += a_re * re[k] - a_im * im[k];
                    sum_im[k] += a_re * im[k] + a_im * re[k];
                }
            }
            plane.re[start..start + LANES].copy_from_slice(&sum_re);
            plane.im[start..start + LANES].copy_from_slice(&sum_im);
        }
    }
}

/// The first `count` rays but those far under the strongest.
fn strong<const ELEMENTS: usize>(gains: &[Gain], steering: &[[C64; ELEMENTS]], count: usize) -> Vec<usize> {
    let power = |l: usize| gains[l].value.norm_sqr() * steering[l][0].norm_sqr();
    let most = (0..count).map(power).fold(0.0, f64::max);
    (0..count).filter(|l| power(*l) > STRONG_POWER * most).collect()
}

/// `LANES` values from `start`, a multiple of `LANES`.
fn lanes(plane: &[f32; SAMPLES], start: usize) -> &Lanes {
    &plane.as_chunks::<LANES>().0[start / LANES]
}
