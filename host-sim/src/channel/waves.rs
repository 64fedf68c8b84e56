//! The waveform as each array hears it over each ray: delayed, turned by Doppler and carrier offset.
//!
//! These do not depend on the beam, so a sweep makes them once (again when a drifting clock has moved on).

use cslam_core::array::phasor;
use cslam_core::waveform::{SAMPLES, Waveform};

use super::C64;
use super::spectrum::{Samples, Transform};

/// Complex samples as two planes, for arithmetic in lanes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plane {
    pub(crate) re: [f32; SAMPLES],
    pub(crate) im: [f32; SAMPLES],
}

/// One ray at one array: the waveform of mean power one, and its derivative over time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Wave {
    pub(crate) value: Plane,
    /// d/dt, 1/s, so that a further delay d adds `-d slope`.
    pub(crate) slope: Plane,
}

impl Plane {
    pub(crate) fn new() -> Self {
        Self {
            re: [0.0; SAMPLES],
            im: [0.0; SAMPLES],
        }
    }

    fn of(samples: &Samples) -> Self {
        Self {
            re: std::array::from_fn(|n| samples[n].re as f32),
            im: std::array::from_fn(|n| samples[n].im as f32),
        }
    }
}

/// Makes waves.
#[derive(Clone, Debug)]
pub(crate) struct WaveMaker {
    waveform: Waveform,
    transform: Transform,
    symbols: Vec<C64>,
}

impl WaveMaker {
    pub(crate) fn new(waveform: Waveform) -> Self {
        let scale = 1.0 / (waveform.active as f64).sqrt();
        Self {
            symbols: (0..waveform.active)
                .map(|i| waveform.symbol::<f64>(i) * scale)
                .collect(),
            transform: Transform::new(),
            waveform,
        }
    }

    pub(crate) fn waveform(&self) -> &Waveform {
        &self.waveform
    }

    /// A wave of the given delay whose frequency is off by `shift_hz`; phase 0 of the shift at sample 0.
    pub(crate) fn wave(&self, delay_s: f64, shift_hz: f64) -> Wave {
        let unit = C64::new(1.0, 0.0);
        let (value, slope) = self.samples(delay_s, shift_hz, std::iter::repeat_n(unit, self.symbols.len()));
        Wave {
            value: Plane::of(&value),
            slope: Plane::of(&slope),
        }
    }

    /// The same through a frequency response, one value an active subcarrier; without the derivative.
    pub(crate) fn through(&self, delay_s: f64, shift_hz: f64, response: &[C64]) -> Plane {
        Plane::of(&self.samples(delay_s, shift_hz, response.iter().copied()).0)
    }

    /// Samples and their derivative, in `f64`.
    pub(crate) fn samples(
        &self,
        delay_s: f64,
        shift_hz: f64,
        response: impl Iterator<Item = C64>,
    ) -> (Samples, Samples) {
        let zero = C64::new(0.0, 0.0);
        let (mut value, mut slope) = ([zero; SAMPLES], [zero; SAMPLES]);
        // Turns per subcarrier, reduced: the block is cyclic.
        let turns = delay_s * self.waveform.spacing_hz();
        let turns = turns - turns.floor();
        let step = phasor(-std::f64::consts::TAU * turns);
        let mut phase = phasor(-std::f64::consts::TAU * turns * f64::from(self.waveform.offset(0)));
        for (i, (symbol, response)) in self.symbols.iter().zip(response).enumerate() {
            let x = symbol * phase * response;
            let omega =
                std::f64::consts::TAU * self.waveform.spacing_hz() * f64::from(self.waveform.offset(i));
            value[self.waveform.bin(i)] = x;
            slope[self.waveform.bin(i)] = C64::new(-omega * x.im, omega * x.re);
            phase *= step;
        }
        self.transform.inverse(&mut value);
        self.transform.inverse(&mut slope);
        if shift_hz != 0.0 {
            let step = phasor(std::f64::consts::TAU * shift_hz / self.waveform.sample_rate_hz);
            let mut phase = C64::new(1.0, 0.0);
            for (v, s) in value.iter_mut().zip(&mut slope) {
                *v *= phase;
                *s *= phase;
                phase *= step;
            }
        }
        (value, slope)
    }

    /// A bare tone of mean power one.
    pub(crate) fn tone(&self, offset_hz: f64) -> Wave {
        let mut value = Plane::new();
        let step = phasor(std::f64::consts::TAU * offset_hz / self.waveform.sample_rate_hz);
        let mut phase = C64::new(1.0, 0.0);
        for (re, im) in value.re.iter_mut().zip(&mut value.im) {
            (*re, *im) = (phase.re as f32, phase.im as f32);
            phase *= step;
        }
        Wave {
            value,
            slope: Plane::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(delay_s: f64) -> (Samples, Samples) {
        let maker = WaveMaker::new(Waveform::default());
        maker.samples(delay_s, 0.0, std::iter::repeat_n(C64::new(1.0, 0.0), 416))
    }

    #[test]
    fn a_whole_sample_of_delay_rotates_the_block_and_power_is_one() {
        let (now, _) = samples(0.0);
        let (later, _) = samples(37.0 / 245.76e6);
        for n in 0..SAMPLES {
            assert!((later[(n + 37) % SAMPLES] - now[n]).norm() < 1e-11);
        }
        let power: f64 = now.iter().map(|x| x.norm_sqr()).sum::<f64>() / SAMPLES as f64;
        assert!((power - 1.0).abs() < 1e-12);
    }

    #[test]
    fn slope_is_the_derivative() {
        let d = 1e-12;
        let ((early, _), (middle, slope), (late, _)) = (samples(1e-7 - d), samples(1e-7), samples(1e-7 + d));
        for n in 0..SAMPLES {
            let difference = (early[n] - late[n]) / (2.0 * d);
            assert!(
                (difference - slope[n]).norm() < 1e-4 * slope[n].norm().max(1e8),
                "{n}"
            );
        }
        assert!(middle[0].norm() > 0.0);
    }
}
