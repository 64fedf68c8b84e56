//! Gain control and converter.

use cslam_core::signal::{Iq, SAMPLES};

use super::lanes::in_widest_lanes;
use super::waves::Plane;

/// Exponent of a block without any signal.
const SILENT_EXPONENT: i32 = -126;

/// Gain control: the least exponent at which the strongest channel's complex rms, in LSB of 16 bits, stays at or under
/// `rms_dbfs` of 32 768.
pub(crate) fn exponent(planes: &[Plane], rms_dbfs: f64) -> i32 {
    let strongest = planes.iter().map(mean_power).fold(0.0, f64::max);
    if strongest == 0.0 {
        return SILENT_EXPONENT;
    }
    let target = 32_768.0 * libm::exp10(rms_dbfs / 20.0);
    libm::ceil(0.5 * libm::log2(strongest / (target * target))) as i32
}

/// Mean |x|^2 of a channel.
pub(crate) fn mean_power(plane: &Plane) -> f64 {
    // Sums of 16, then of those: fast, and in a fixed order.
    let square = |x: &[f32; SAMPLES]| {
        let mut lanes = [0.0_f32; 16];
        for chunk in x.as_chunks::<16>().0 {
            for (sum, x) in lanes.iter_mut().zip(chunk) {
                *sum += x * x;
            }
        }
        lanes.iter().map(|s| f64::from(*s)).sum::<f64>()
    };
    (square(&plane.re) + square(&plane.im)) / SAMPLES as f64
}

/// Converts to `bits` bits, left-aligned in 16, round half up, clipping at full scale. Amplitude = integer x 2^exponent.
pub(crate) fn convert(planes: &[Plane], exponent: i32, bits: u8, out: &mut [[Iq; SAMPLES]]) {
    in_widest_lanes(
        #[inline(always)]
        || convert_all(planes, exponent, bits, out),
    );
}

#[inline(always)]
fn convert_all(planes: &[Plane], exponent: i32, bits: u8, out: &mut [[Iq; SAMPLES]]) {
    let shift = 16 - u32::from(bits);
    // In steps of the converter; a power of two, so the product is exact.
    let gain = libm::ldexp(1.0, -exponent - shift as i32) as f32;
    let limit = f32::from(1_u16 << (bits - 1));
    let step = |x: f32| {
        let x = (x * gain + 0.5).clamp(-limit, limit - 1.0);
        let cut = x as i32;
        // Towards minus infinity: the cast went towards zero.
        let floor = cut - i32::from(cut as f32 > x);
        (floor << shift) as i16
    };
    for (plane, out) in planes.iter().zip(out.iter_mut()) {
        for ((re, im), out) in plane.re.iter().zip(&plane.im).zip(out.iter_mut()) {
            *out = Iq::new(step(*re), step(*im));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNELS: usize = 32;

    fn converted(values: &[f32], exponent: i32, bits: u8) -> Vec<i16> {
        let mut planes = vec![Plane::new(); CHANNELS];
        planes[3].re[..values.len()].copy_from_slice(values);
        let mut out = Box::new([[Iq::ZERO; SAMPLES]; CHANNELS]);
        convert(&planes, exponent, bits, &mut out[..]);
        out[3][..values.len()].iter().map(|x| x.re()).collect()
    }

    #[test]
    fn rounds_half_up_and_clips_at_full_scale() {
        let values = [0.5, -0.5, 0.499, -0.51, 1.5, -1.5, 40_000.0, -40_000.0];
        assert_eq!(converted(&values, 0, 16), [1, 0, 0, -1, 2, -1, 32_767, -32_768]);
    }

    #[test]
    fn narrow_words_are_left_aligned() {
        // 12 bits: steps of 16; full scale 2047 steps.
        let values = [8.0, 7.9, -8.0, -8.1, 40_000.0, -40_000.0];
        assert_eq!(converted(&values, 0, 12), [16, 0, 0, -16, 32_752, -32_768]);
        assert_eq!(converted(&[1.0], -8, 8), [256]);
    }

    #[test]
    fn gain_control_stays_within_one_step_under_its_level() {
        let target = 32_768.0 * libm::exp10(-12.0 / 20.0);
        for amplitude in [3e-7_f32, 1.0, 1.9, 2.1, 1e4] {
            let mut planes = vec![Plane::new(); CHANNELS];
            planes[7].re.fill(amplitude);
            planes[9].im.fill(amplitude / 3.0);
            let e = exponent(&planes, -12.0);
            let level = f64::from(amplitude) * libm::exp2(-f64::from(e)) / target;
            assert!((0.5..=1.0).contains(&level), "{amplitude}: {level}");
        }
        assert_eq!(exponent(&vec![Plane::new(); CHANNELS], -12.0), SILENT_EXPONENT);
    }
}
