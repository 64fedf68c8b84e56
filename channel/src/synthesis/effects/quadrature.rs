//! Imbalance of a receiver's quadrature mixers: every channel hears `y + k y*` with `k = (g exp(j phi) - 1) / 2`.

use super::Draw;
use crate::synthesis::antenna::phasor;
use crate::synthesis::waves::Plane;
use crate::synthesis::{C64, ReceiverErrors};

/// `k` of every channel.
#[derive(Clone, Debug)]
pub(crate) struct Quadrature(pub(crate) Vec<C64>);

impl Quadrature {
    /// Draws a device of so many channels; none when it has no error.
    pub(crate) fn draw(set: &ReceiverErrors, channels: usize, seed: u64) -> Option<Self> {
        if set.iq_gain_rms_db == 0.0 && set.iq_phase_rms_deg == 0.0 {
            return None;
        }
        let mut stream = Draw::Quadrature.stream(seed);
        let mut image = || {
            let gain = libm::exp10(set.iq_gain_rms_db * stream.normal() / 20.0);
            let turn = phasor(set.iq_phase_rms_deg.to_radians() * stream.normal());
            (turn * gain - 1.0) * 0.5
        };
        Some(Self((0..channels).map(|_| image()).collect()))
    }

    /// Adds the images to the samples of all channels.
    pub(crate) fn apply(&self, planes: &mut [Plane]) {
        for (plane, k) in planes.iter_mut().zip(&self.0) {
            let [k_re, k_im] = [k.re as f32, k.im as f32];
            for (re, im) in plane.re.iter_mut().zip(&mut plane.im) {
                (*re, *im) = (*re + k_re * *re + k_im * *im, *im + k_im * *re - k_re * *im);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_of_a_decibel_and_two_degrees_leave_an_image_at_minus_32_db() {
        let set = ReceiverErrors {
            iq_gain_rms_db: 0.3,
            iq_phase_rms_deg: 2.0,
            ..ReceiverErrors::default()
        };
        let draws = 200;
        let of = |seed| Quadrature::draw(&set, 32, seed).expect("an image").0;
        let power: f64 = (0..draws).flat_map(of).map(|k| k.norm_sqr()).sum::<f64>() / (32.0 * draws as f64);
        let level_db = 10.0 * libm::log10(power);
        assert!((level_db + 32.2).abs() < 0.2, "{level_db}");
        assert!(Quadrature::draw(&ReceiverErrors::default(), 32, 1).is_none());
    }
}
