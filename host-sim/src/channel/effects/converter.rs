//! Errors at the converter, behind the gain control: leakage of the oscillator, a constant in every channel, and noise that
//! takes a converter to its effective number of bits.

use super::Draw;
use crate::channel::antenna::phasor;
use crate::channel::noise::Gaussian;
use crate::channel::waves::Plane;
use crate::channel::{C64, CHANNELS, FrontEndConfig, ReceiverErrors};

/// Full scale of an int16.
const FULL_SCALE: f64 = 32_768.0;

/// Errors of a device.
#[derive(Clone, Debug)]
pub(in crate::channel) struct Converter {
    /// Leakage of each channel, in LSB of 16 bits.
    leakage: Option<[C64; CHANNELS]>,
    /// Noise of each component, LSB of 16 bits rms.
    noise_rms: f64,
}

impl Converter {
    /// Draws a device; none when it has no error.
    pub(in crate::channel) fn draw(
        set: &ReceiverErrors,
        front_end: &FrontEndConfig,
        seed: u64,
    ) -> Option<Self> {
        let leakage = set.leakage_dbfs.map(|dbfs| {
            let mut stream = Draw::Leakage.stream(seed);
            let amplitude = FULL_SCALE * libm::exp10(dbfs / 20.0);
            std::array::from_fn(|_| phasor(std::f64::consts::TAU * stream.uniform()) * amplitude)
        });
        // An ideal converter of b bits has noise of 2^(16-b) LSB over sqrt(12); what its rounding has is there already.
        let variance = |bits: f64| libm::exp2(2.0 * (16.0 - bits)) / 12.0;
        let own = variance(front_end.adc_bits.into());
        let noise = set.effective_bits.map_or(0.0, |bits| variance(bits) - own);
        let noise_rms = noise.max(0.0).sqrt();
        (leakage.is_some() || noise_rms > 0.0).then_some(Self { leakage, noise_rms })
    }

    /// Adds the errors to a block whose exponent is chosen.
    pub(in crate::channel) fn apply(&self, planes: &mut [Plane], exponent: i32, gaussian: &mut Gaussian) {
        if let Some(leakage) = &self.leakage {
            for (plane, leakage) in planes.iter_mut().zip(leakage) {
                let [re, im] = [leakage.re, leakage.im].map(|x| libm::ldexp(x, exponent) as f32);
                plane.re.iter_mut().for_each(|x| *x += re);
                plane.im.iter_mut().for_each(|x| *x += im);
            }
        }
        if self.noise_rms > 0.0 {
            let sigma = libm::ldexp(self.noise_rms, exponent) as f32;
            for plane in planes {
                gaussian.add_to(&mut plane.re, sigma);
                gaussian.add_to(&mut plane.im, sigma);
            }
        }
    }
}
