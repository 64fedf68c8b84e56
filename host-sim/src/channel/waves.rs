//! The waveform as each array hears it over each ray: delayed, turned by Doppler and carrier offset.
//!
//! These do not depend on the beam, so a sweep makes them once (again when a drifting clock has moved on).

use cslam_core::waveform::{SAMPLES, Waveform};

use super::C64;
use super::antenna::phasor;
use super::effects::amplifier::Amplifier;
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

    pub(super) fn of(samples: &Samples) -> Self {
        Self {
            re: std::array::from_fn(|n| samples[n].re as f32),
            im: std::array::from_fn(|n| samples[n].im as f32),
        }
    }
}

impl Wave {
    /// No wave.
    pub(super) fn silent() -> Self {
        Self {
            value: Plane::new(),
            slope: Plane::new(),
        }
    }
}

/// A frequency shift, sample by sample; none of 0 Hz.
#[derive(Clone, Debug)]
pub(crate) struct Turns(Option<Box<Samples>>);

/// Makes waves.
#[derive(Clone, Debug)]
pub(crate) struct WaveMaker {
    waveform: Waveform,
    transform: Transform,
    symbols: Vec<C64>,
}

impl WaveMaker {
    /// The waveform as the amplifier leaves it; a linear one without.
    pub(crate) fn new(waveform: Waveform, amplifier: Option<&Amplifier>) -> Self {
        let scale = 1.0 / (waveform.active as f64).sqrt();
        let symbols: Vec<C64> = (0..waveform.active)
            .map(|i| waveform.symbol::<f64>(i) * scale)
            .collect();
        Self {
            symbols: match amplifier {
                None => symbols,
                Some(amplifier) => amplifier.amplify(&symbols, &waveform),
            },
            transform: Transform::new(),
            waveform,
        }
    }

    pub(super) fn transform(&self) -> &Transform {
        &self.transform
    }

    pub(crate) fn waveform(&self) -> &Waveform {
        &self.waveform
    }

    /// What a frequency that is off by `shift_hz` turns the samples by; phase 0 at sample 0.
    pub(crate) fn turns(&self, shift_hz: f64) -> Turns {
        if shift_hz == 0.0 {
            return Turns(None);
        }
        let step = phasor(std::f64::consts::TAU * shift_hz / self.waveform.sample_rate_hz);
        let mut phase = C64::new(1.0, 0.0);
        Turns(Some(Box::new(std::array::from_fn(|_| {
            let now = phase;
            phase *= step;
            now
        }))))
    }

    /// A wave of the given delay whose frequency is off.
    pub(crate) fn wave(&self, delay_s: f64, turns: &Turns) -> Wave {
        self.of_spectrum(self.spectrum(delay_s), turns)
    }

    fn of_spectrum(&self, mut value: Samples, turns: &Turns) -> Wave {
        let mut slope = value;
        for i in 0..self.symbols.len() {
            let offset = f64::from(self.waveform.offset(i));
            slope[self.waveform.bin(i)] *=
                C64::new(0.0, std::f64::consts::TAU * self.waveform.spacing_hz() * offset);
        }
        self.to_time(&mut value, turns);
        self.to_time(&mut slope, turns);
        Wave {
            value: Plane::of(&value),
            slope: Plane::of(&slope),
        }
    }

    /// The same through a frequency response, one value an active subcarrier; its slope is made if it is asked for.
    pub(crate) fn through(&self, delay_s: f64, turns: &Turns, response: &[C64], with_slope: bool) -> Wave {
        let mut value = self.spectrum(delay_s);
        for (i, response) in response.iter().enumerate() {
            value[self.waveform.bin(i)] *= response;
        }
        if with_slope {
            return self.of_spectrum(value, turns);
        }
        self.to_time(&mut value, turns);
        Wave {
            value: Plane::of(&value),
            slope: Plane::new(),
        }
    }

    /// Spectrum of the delayed waveform, scaled so that the unscaled inverse transform has mean power one.
    fn spectrum(&self, delay_s: f64) -> Samples {
        let mut out = [C64::new(0.0, 0.0); SAMPLES];
        // Turns per subcarrier, reduced: the block is cyclic.
        let turns = delay_s * self.waveform.spacing_hz();
        let turns = turns - turns.floor();
        let step = phasor(-std::f64::consts::TAU * turns);
        let mut phase = phasor(-std::f64::consts::TAU * turns * f64::from(self.waveform.offset(0)));
        for (i, symbol) in self.symbols.iter().enumerate() {
            out[self.waveform.bin(i)] = symbol * phase;
            phase *= step;
        }
        out
    }

    fn to_time(&self, data: &mut Samples, turns: &Turns) {
        self.transform.inverse(data);
        if let Some(turns) = &turns.0 {
            for (x, turn) in data.iter_mut().zip(turns.iter()) {
                *x *= turn;
            }
        }
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

    fn wave(delay_s: f64) -> Wave {
        let maker = WaveMaker::new(Waveform::default(), None);
        maker.wave(delay_s, &maker.turns(0.0))
    }

    #[test]
    fn a_whole_sample_of_delay_rotates_the_block_and_power_is_one() {
        let (now, later) = (wave(0.0).value, wave(37.0 / 245.76e6).value);
        for n in 0..SAMPLES {
            assert!((later.re[(n + 37) % SAMPLES] - now.re[n]).abs() < 1e-6);
            assert!((later.im[(n + 37) % SAMPLES] - now.im[n]).abs() < 1e-6);
        }
        let power: f32 = now.re.iter().chain(&now.im).map(|x| x * x).sum::<f32>() / SAMPLES as f32;
        assert!((power - 1.0).abs() < 1e-5);
    }

    #[test]
    fn slope_is_the_derivative() {
        let d = 1e-10;
        let [early, middle, late] = [1e-7 - d, 1e-7, 1e-7 + d].map(wave);
        let largest = middle.slope.re.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        for n in 0..SAMPLES {
            let difference = (early.value.re[n] - late.value.re[n]) / (2.0 * d as f32);
            assert!((difference - middle.slope.re[n]).abs() < 3e-3 * largest, "{n}");
        }
    }

    #[test]
    fn a_flat_response_changes_nothing_but_its_factor() {
        let maker = WaveMaker::new(Waveform::default(), None);
        let shift = maker.turns(2e4);
        let (plain, turned) = (
            maker.wave(1e-7, &shift),
            maker.through(1e-7, &shift, &[C64::new(0.0, 2.0); 416], true),
        );
        for n in 0..SAMPLES {
            assert!((turned.value.im[n] - 2.0 * plain.value.re[n]).abs() < 1e-5);
            assert!((turned.slope.im[n] - 2.0 * plain.slope.re[n]).abs() < 1e-6 * 4e8);
        }
    }
}
