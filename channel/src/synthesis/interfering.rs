//! The waves of a jammer and of a neighbour in a slot.

use super::air::SweepState;
use super::impairments::{Jammer, JammerKind};
use super::noise::Gaussian;
use super::streams::{BURST_NOISE, JAMMED, stream};
use super::waves::{Plane, Shape, Wave, WaveMaker};

/// White noise of mean power one.
fn noise(gaussian: &mut Gaussian) -> Wave {
    let mut value = Plane::new();
    gaussian.add_to(&mut value.re, std::f32::consts::FRAC_1_SQRT_2);
    gaussian.add_to(&mut value.im, std::f32::consts::FRAC_1_SQRT_2);
    Wave {
        value,
        slope: Plane::new(),
    }
}

/// Silences a block that begins at `time_s` between the jammer's pulses.
fn keep_pulses(wave: &mut Wave, jammer: &Jammer, maker: &WaveMaker, time_s: f64) {
    let sample_s = 1.0 / maker.waveform().sample_rate_hz;
    let samples = wave.value.re.iter_mut().zip(&mut wave.value.im);
    for (n, (re, im)) in samples.enumerate() {
        let pulses = (time_s + n as f64 * sample_s) / jammer.pulse_interval_s;
        if pulses - pulses.floor() >= jammer.duty {
            (*re, *im) = (0.0, 0.0);
        }
    }
}

impl<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    SweepState<'_, ARRAYS, ELEMENTS, CHANNELS>
{
    /// What the jammer sends in a slot, if that is not always the same.
    pub(super) fn jam(&mut self, slot: usize) {
        let Some((jammer, reception)) = &self.jammer else {
            return;
        };
        let maker = &self.simulator.maker;
        let heard: [Wave; ARRAYS] = match jammer.kind {
            JammerKind::Tone => return,
            JammerKind::Noise | JammerKind::Pulsed => {
                self.gaussian
                    .restart(self.simulator.seed, stream(self.index, slot, JAMMED));
                let mut wave = noise(&mut self.gaussian);
                if jammer.kind == JammerKind::Pulsed {
                    keep_pulses(&mut wave, jammer, maker, self.time_s(slot));
                }
                // The arrays are a fifth of a sample apart: to them it is one noise.
                std::array::from_fn(|_| wave.clone())
            }
            JammerKind::Replay => {
                let turns = maker.turns(jammer.offset_hz + self.cfo_hz);
                let clock_s = self.clock_s(slot);
                let delays_s = reception.delay_s.map(|delay_s| delay_s + clock_s);
                let mut heard = std::array::from_fn(|_| Wave::silent());
                maker.make(delays_s, &turns, &Shape::WHOLE, heard.each_mut());
                heard
            }
        };
        let place = self.rays.len();
        for (waves, wave) in self.waves.iter_mut().zip(heard) {
            waves[place] = wave;
        }
    }

    /// What the neighbour sends in a slot.
    pub(super) fn interfere(&mut self, slot: usize) {
        let (Some(heard), Some(neighbour)) = (&self.neighbour, &self.simulator.neighbour) else {
            return;
        };
        let maker = &self.simulator.maker;
        self.gaussian
            .restart(self.simulator.seed, stream(self.index, slot, BURST_NOISE));
        let wave = neighbour.wave(
            &heard.bursts,
            self.time_s(slot),
            1.0 / maker.waveform().sample_rate_hz,
            maker.transform(),
            &mut self.gaussian,
        );
        // As with a jammer's noise, one noise to all arrays.
        let wave = wave.unwrap_or_else(Wave::silent);
        for waves in &mut self.waves {
            if let Some(last) = waves.last_mut() {
                *last = wave.clone();
            }
        }
    }
}
