//! The GMT's transmit amplifier: Rapp's model with a phase that turns with the level.
//!
//! `y = x (1 + r^2p)^(-1/2p) exp(j phi 2 r^2 / (1 + r^2))` with `r = |x|` over the level of saturation, p = 2 and phi the
//! phase at saturation. All elements of a face have the same waveform, so all are distorted alike. What falls outside of
//! the active subcarriers is left to the transmitter's filter; the power is what the configuration says.

use cslam_core::signal::{SAMPLES, Waveform};
use serde::{Deserialize, Serialize};

use crate::input::{InputError, within};
use crate::synthesis::C64;
use crate::synthesis::antenna::phasor;
use crate::synthesis::spectrum::Transform;

/// Points between samples at which the waveform is distorted, the sample itself included: what the third and fifth order
/// spread does not fold back.
const OVERSAMPLING: usize = 4;

/// How the amplifier is driven.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Amplifier {
    /// Mean power under the level of saturation, dB, 0..=30.
    pub back_off_db: f64,
    /// Phase at saturation, deg, -45..=45.
    pub am_pm_deg: f64,
}

impl Default for Amplifier {
    /// As of amplifiers at 28 GHz.
    fn default() -> Self {
        Self {
            back_off_db: 6.0,
            am_pm_deg: 5.0,
        }
    }
}

impl Amplifier {
    pub(crate) fn check(&self) -> Result<(), InputError> {
        within(&[
            ("back_off_db", self.back_off_db, 0.0, 30.0),
            ("am_pm_deg", self.am_pm_deg, -45.0, 45.0),
        ])
    }

    /// Gain for an amplitude over that of saturation.
    fn gain(&self, r: f64) -> C64 {
        let square = r * r;
        let amplitude = 1.0 / (1.0 + square * square).sqrt().sqrt();
        phasor(self.am_pm_deg.to_radians() * 2.0 * square / (1.0 + square)) * amplitude
    }

    /// The active subcarriers behind the amplifier, of the same power: `symbols` has the sum of squares one.
    pub(crate) fn amplify(&self, symbols: &[C64], waveform: &Waveform) -> Vec<C64> {
        let transform = Transform::new();
        let saturation = libm::exp10(self.back_off_db / 20.0);
        let mut out = vec![C64::new(0.0, 0.0); symbols.len()];
        for part in 0..OVERSAMPLING {
            let shift = part as f64 / (OVERSAMPLING * SAMPLES) as f64;
            let turn = |i: usize| phasor(std::f64::consts::TAU * f64::from(waveform.offset(i)) * shift);
            let mut samples = [C64::new(0.0, 0.0); SAMPLES];
            for (i, symbol) in symbols.iter().enumerate() {
                samples[waveform.bin(i)] = symbol * turn(i);
            }
            transform.inverse(&mut samples);
            for x in &mut samples {
                *x *= self.gain(x.norm_sqr().sqrt() / saturation);
            }
            transform.forward(&mut samples);
            for (i, out) in out.iter_mut().enumerate() {
                *out += samples[waveform.bin(i)] * turn(i).conj();
            }
        }
        let power: f64 = out.iter().map(|x| x.norm_sqr()).sum();
        let scale = 1.0 / power.sqrt();
        out.iter().map(|x| x * scale).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn symbols(waveform: &Waveform) -> Vec<C64> {
        let scale = 1.0 / (waveform.active as f64).sqrt();
        (0..waveform.active)
            .map(|i| waveform.symbol::<f64>(i) * scale)
            .collect()
    }

    /// Power of what differs from a multiple of the known waveform, dB.
    fn distortion_db(amplifier: &Amplifier) -> f64 {
        let waveform = Waveform::default();
        let known = symbols(&waveform);
        let sent = amplifier.amplify(&known, &waveform);
        let inner: C64 = sent.iter().zip(&known).map(|(a, b)| a * b.conj()).sum();
        10.0 * libm::log10(1.0 - inner.norm_sqr())
    }

    #[test]
    fn gain_falls_by_one_db_where_rapp_says_and_saturates() {
        let amplifier = Amplifier::default();
        // (1 + r^4)^(1/4) = 10^(1/20).
        let one_db = libm::pow(libm::exp10(0.2) - 1.0, 0.25);
        let db = |r: f64| 20.0 * libm::log10(amplifier.gain(r).norm());
        assert!((db(one_db) + 1.0).abs() < 1e-12, "{}", db(one_db));
        assert!((db(1.0) + 20.0 * libm::log10(2.0) / 4.0).abs() < 1e-12);
        assert!((100.0 * amplifier.gain(100.0).norm() - 1.0).abs() < 1e-6);
        assert!((amplifier.gain(1.0).arg().to_degrees() - 5.0).abs() < 1e-12);
    }

    #[test]
    fn distortion_follows_the_back_off_and_the_power_stays() {
        let at = |back_off_db| Amplifier {
            back_off_db,
            ..Amplifier::default()
        };
        let usual = distortion_db(&Amplifier::default());
        // The envelope of the sequence is nearly constant (a peak of 2.8 dB): less than of other waveforms.
        assert!((-45.0..-41.0).contains(&usual), "{usual}");
        assert!(distortion_db(&at(3.0)) > usual + 3.0);
        // Third order: 2 dB a dB, of which AM to PM has part.
        assert!(
            distortion_db(&at(26.0)) < usual - 30.0,
            "{}",
            distortion_db(&at(26.0))
        );
        let waveform = Waveform::default();
        let sent = Amplifier::default().amplify(&symbols(&waveform), &waveform);
        let power: f64 = sent.iter().map(|x| x.norm_sqr()).sum();
        assert!((power - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_constant_envelope_only_gets_a_gain() {
        let (waveform, amplifier) = (Waveform::default(), Amplifier::default());
        let mut tone = vec![C64::new(0.0, 0.0); waveform.active];
        tone[17] = C64::new(0.6, 0.8);
        let sent = amplifier.amplify(&tone, &waveform);
        let expected = amplifier.gain(libm::exp10(-6.0 / 20.0));
        let expected = tone[17] * expected / expected.norm();
        assert!((sent[17] - expected).norm() < 1e-12, "{} {expected}", sent[17]);
        assert!(sent.iter().enumerate().all(|(i, x)| i == 17 || x.norm() < 1e-12));
    }
}
