//! Errors at the converter, behind the gain control: leakage of the oscillator, a constant in every channel; noise that takes a
//! converter to its effective number of bits; and jitter of the sampling instants, which are off by sigma_t each on its own: a signal
//! of rms frequency f_rms becomes white noise of `(2 pi f_rms sigma_t)^2` of its power, f_rms that of the symbol's flat band, B/sqrt 12.

use cslam_core::signal::Waveform;

use super::Draw;
use crate::synthesis::adc::mean_power;
use crate::synthesis::antenna::phasor;
use crate::synthesis::noise::Gaussian;
use crate::synthesis::waves::Plane;
use crate::synthesis::{C64, FrontEndConfig, ReceiverErrors};

/// Full scale of an int16.
const FULL_SCALE: f64 = 32_768.0;

/// Errors of a device.
#[derive(Clone, Debug)]
pub(crate) struct Converter {
    /// Leakage of each channel, in LSB of 16 bits.
    leakage: Option<Vec<C64>>,
    /// Noise of each component, LSB of 16 bits rms.
    noise_rms: f64,
    /// Power that jitter makes noise, over that of a channel.
    jitter: f64,
}

impl Converter {
    /// Draws a device of so many channels; none when it has no error.
    pub(crate) fn draw(
        set: &ReceiverErrors,
        front_end: &FrontEndConfig,
        waveform: &Waveform,
        channels: usize,
        seed: u64,
    ) -> Option<Self> {
        let leakage = set.leakage_dbfs.map(|dbfs| {
            let mut stream = Draw::Leakage.stream(seed);
            let amplitude = FULL_SCALE * libm::exp10(dbfs / 20.0);
            let mut leak = || phasor(std::f64::consts::TAU * stream.uniform()) * amplitude;
            (0..channels).map(|_| leak()).collect()
        });
        // An ideal converter of b bits has noise of 2^(16-b) LSB over sqrt(12); what its rounding has is there already.
        let variance = |bits: f64| libm::exp2(2.0 * (16.0 - bits)) / 12.0;
        let own = variance(front_end.adc_bits.into());
        let noise = set.effective_bits.map_or(0.0, |bits| variance(bits) - own);
        let noise_rms = noise.max(0.0).sqrt();
        let rms_hz = waveform.active as f64 * waveform.spacing_hz() / 12.0_f64.sqrt();
        let turn_rad = std::f64::consts::TAU * rms_hz * set.aperture_jitter_ps * 1e-12;
        (leakage.is_some() || noise_rms > 0.0 || turn_rad > 0.0).then_some(Self {
            leakage,
            noise_rms,
            jitter: turn_rad * turn_rad,
        })
    }

    /// Adds the errors to a block whose exponent is chosen.
    pub(crate) fn apply(&self, planes: &mut [Plane], exponent: i32, gaussian: &mut Gaussian) {
        // Of what is sampled, before anything is added to it.
        let jittered: Vec<f64> = match self.jitter {
            0.0 => Vec::new(),
            jitter => planes
                .iter()
                .map(|plane| 0.5 * jitter * mean_power(plane))
                .collect(),
        };
        if let Some(leakage) = &self.leakage {
            for (plane, leakage) in planes.iter_mut().zip(leakage) {
                let [re, im] = [leakage.re, leakage.im].map(|x| libm::ldexp(x, exponent) as f32);
                plane.re.iter_mut().for_each(|x| *x += re);
                plane.im.iter_mut().for_each(|x| *x += im);
            }
        }
        if self.noise_rms > 0.0 || self.jitter > 0.0 {
            let own = libm::ldexp(self.noise_rms, exponent);
            for (channel, plane) in planes.iter_mut().enumerate() {
                let sigma = match jittered.get(channel) {
                    None => own,
                    Some(more) => (own * own + more).sqrt(),
                } as f32;
                gaussian.add_to(&mut plane.re, sigma);
                gaussian.add_to(&mut plane.im, sigma);
            }
        }
    }
}
