//! The waveform as each array hears it over each ray: delayed, turned by Doppler and carrier offset.
//!
//! These do not depend on the beam, so a sweep makes them once (again when a drifting clock has moved on).

use std::array::from_fn;

use cslam_core::signal::{SAMPLES, Waveform};
use pulp::Simd;

use super::C64;
use super::antenna::phasor;
use super::effects::amplifier::Amplifier;
use super::lanes::in_widest_lanes;
use super::spectrum::{Parts, Samples, Transform};

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
            re: from_fn(|n| samples[n].re as f32),
            im: from_fn(|n| samples[n].im as f32),
        }
    }

    /// As many samples as there are lanes, real and imaginary parts: those of this place.
    #[inline(always)]
    pub(super) fn lanes<S: Simd>(&self, chunk: usize) -> [S::f32s; 2] {
        [
            S::as_simd_f32s(&self.re).0[chunk],
            S::as_simd_f32s(&self.im).0[chunk],
        ]
    }

    /// Puts them there.
    #[inline(always)]
    pub(super) fn put_lanes<S: Simd>(&mut self, chunk: usize, [re, im]: [S::f32s; 2]) {
        S::as_mut_simd_f32s(&mut self.re).0[chunk] = re;
        S::as_mut_simd_f32s(&mut self.im).0[chunk] = im;
    }

    /// Takes one of several blocks.
    #[inline(always)]
    fn set<const BLOCKS: usize>(&mut self, re: &Parts<BLOCKS>, im: &Parts<BLOCKS>, block: usize) {
        self.re = from_fn(|n| re[n][block] as f32);
        self.im = from_fn(|n| im[n][block] as f32);
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

/// What a wave went through besides delay and frequency shift, and what of it is wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape<'a> {
    /// A frequency response, one value an active subcarrier; flat if none.
    pub(crate) response: Option<&'a [C64]>,
    /// Whether the slope is made; it is zero else.
    pub(crate) with_slope: bool,
}

impl Shape<'_> {
    /// The waveform as it is, with its slope.
    pub(crate) const WHOLE: Self = Self {
        response: None,
        with_slope: true,
    };
}

/// Makes waves.
#[derive(Clone, Debug)]
pub(crate) struct WaveMaker {
    waveform: Waveform,
    transform: Transform,
    subcarriers: Vec<Subcarrier>,
}

/// An active subcarrier.
#[derive(Clone, Copy, Debug)]
struct Subcarrier {
    symbol: C64,
    /// Where the transform wants it.
    place: usize,
    /// `2 pi` times its offset from the carrier, rad/s.
    rad_per_s: f64,
}

impl WaveMaker {
    /// The waveform as the amplifier leaves it; a linear one without.
    pub(crate) fn new(waveform: Waveform, amplifier: Option<&Amplifier>) -> Self {
        let scale = 1.0 / (waveform.active as f64).sqrt();
        let symbols: Vec<C64> = (0..waveform.active)
            .map(|i| waveform.symbol::<f64>(i) * scale)
            .collect();
        let symbols = match amplifier {
            None => symbols,
            Some(amplifier) => amplifier.amplify(&symbols, &waveform),
        };
        let subcarrier = |(i, symbol)| Subcarrier {
            symbol,
            place: Transform::place(waveform.bin(i)),
            rad_per_s: std::f64::consts::TAU * waveform.spacing_hz() * f64::from(waveform.offset(i)),
        };
        Self {
            subcarriers: symbols.into_iter().enumerate().map(subcarrier).collect(),
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
        Turns(Some(Box::new(from_fn(|_| {
            let now = phase;
            phase *= step;
            now
        }))))
    }

    /// A wave of the given delay whose frequency is off.
    pub(crate) fn wave(&self, delay_s: f64, turns: &Turns) -> Wave {
        let mut wave = Wave::silent();
        self.make([delay_s], turns, &Shape::WHOLE, [&mut wave]);
        wave
    }

    /// Makes the wave of one ray at every array, of the given delays, whose frequency is off.
    pub(crate) fn make<const ARRAYS: usize>(
        &self,
        delays_s: [f64; ARRAYS],
        turns: &Turns,
        shape: &Shape<'_>,
        out: [&mut Wave; ARRAYS],
    ) {
        in_widest_lanes(
            #[inline(always)]
            || self.make_all(delays_s, turns, shape, out),
        );
    }

    #[inline(always)]
    fn make_all<const ARRAYS: usize>(
        &self,
        delays_s: [f64; ARRAYS],
        turns: &Turns,
        shape: &Shape<'_>,
        out: [&mut Wave; ARRAYS],
    ) {
        let (mut re, mut im) = self.spectra(delays_s);
        if let Some(response) = shape.response {
            for (at, response) in self.subcarriers.iter().zip(response) {
                turn([&mut re[at.place], &mut im[at.place]], *response);
            }
        }
        let slopes = shape.with_slope.then(|| {
            let (mut slope_re, mut slope_im) = ([[0.0; ARRAYS]; SAMPLES], [[0.0; ARRAYS]; SAMPLES]);
            for at in &self.subcarriers {
                slope_re[at.place] = im[at.place].map(|im| -(im * at.rad_per_s));
                slope_im[at.place] = re[at.place].map(|re| re * at.rad_per_s);
            }
            self.to_time([&mut slope_re, &mut slope_im], turns);
            (slope_re, slope_im)
        });
        self.to_time([&mut re, &mut im], turns);
        for (j, wave) in out.into_iter().enumerate() {
            wave.value.set(&re, &im, j);
            match &slopes {
                Some((re, im)) => wave.slope.set(re, im, j),
                None => wave.slope = Plane::new(),
            }
        }
    }

    /// Spectra of the waveform at several delays, scaled so that the unscaled inverse transform has mean power one.
    #[inline(always)]
    fn spectra<const ARRAYS: usize>(&self, delays_s: [f64; ARRAYS]) -> (Parts<ARRAYS>, Parts<ARRAYS>) {
        let (mut re, mut im) = ([[0.0; ARRAYS]; SAMPLES], [[0.0; ARRAYS]; SAMPLES]);
        // Turns per subcarrier, reduced: the block is cyclic.
        let turns = delays_s.map(|delay_s| delay_s * self.waveform.spacing_hz());
        let turns = turns.map(|turns| turns - turns.floor());
        let step = turns.map(|turns| phasor(-std::f64::consts::TAU * turns));
        let first = f64::from(self.waveform.offset(0));
        let phase = turns.map(|turns| phasor(-std::f64::consts::TAU * turns * first));
        let (step_re, step_im) = (step.map(|c| c.re), step.map(|c| c.im));
        let (mut at_re, mut at_im) = (phase.map(|c| c.re), phase.map(|c| c.im));
        for at in &self.subcarriers {
            (re[at.place], im[at.place]) = (at_re, at_im);
            turn([&mut re[at.place], &mut im[at.place]], at.symbol);
            (at_re, at_im) = (
                from_fn(|j| at_re[j] * step_re[j] - at_im[j] * step_im[j]),
                from_fn(|j| at_re[j] * step_im[j] + at_im[j] * step_re[j]),
            );
        }
        (re, im)
    }

    #[inline(always)]
    fn to_time<const ARRAYS: usize>(&self, [re, im]: [&mut Parts<ARRAYS>; 2], turns: &Turns) {
        self.transform.inverse_of([re, im]);
        if let Some(turns) = &turns.0 {
            for ((re, im), factor) in re.iter_mut().zip(im).zip(turns.iter()) {
                turn([re, im], *factor);
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

/// Multiplies the values of all arrays by a factor.
#[inline(always)]
fn turn<const ARRAYS: usize>([re, im]: [&mut [f64; ARRAYS]; 2], factor: C64) {
    let (a_re, a_im) = (*re, *im);
    *re = from_fn(|j| a_re[j] * factor.re - a_im[j] * factor.im);
    *im = from_fn(|j| a_re[j] * factor.im + a_im[j] * factor.re);
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
        let delays_s = [1e-7, 3e-7, 0.0, 1.7e-6];
        let mut turned: [Wave; 4] = from_fn(|_| Wave::silent());
        let shape = Shape {
            response: Some(&[C64::new(0.0, 2.0); 416]),
            with_slope: true,
        };
        maker.make(delays_s, &shift, &shape, turned.each_mut());
        for (turned, delay_s) in turned.iter().zip(delays_s) {
            let plain = maker.wave(delay_s, &shift);
            for n in 0..SAMPLES {
                assert!((turned.value.im[n] - 2.0 * plain.value.re[n]).abs() < 1e-5);
                assert!((turned.slope.im[n] - 2.0 * plain.slope.re[n]).abs() < 1e-6 * 4e8);
            }
        }
    }
}
