//! The waves that pieces of scattered waves are made of.

use cslam_core::signal::{SAMPLES, Waveform};

use super::waves::{Plane, WaveMaker};

/// Waves for delays within a sample.
pub(super) const PHASES: usize = 32;

/// The waveform at every delay within a sample, twice over, so that a delay of whole samples is a place to begin at.
#[derive(Clone, Debug)]
pub(super) struct Bank {
    waves: Vec<[Vec<f32>; 2]>,
    sample_rate_hz: f64,
}

impl Bank {
    pub(super) fn new(maker: &WaveMaker) -> Self {
        let Waveform { sample_rate_hz, .. } = *maker.waveform();
        let wave = |phase: usize| {
            let delay_s = phase as f64 / (PHASES as f64 * sample_rate_hz);
            let Plane { re, im } = maker.wave(delay_s, &maker.turns(0.0)).value;
            [re, im].map(|part| [part, part].concat())
        };
        Self {
            waves: (0..PHASES).map(wave).collect(),
            sample_rate_hz,
        }
    }

    /// Real and imaginary part of the wave of a delay.
    pub(super) fn wave(&self, delay_s: f64) -> [&[f32]; 2] {
        let steps = libm::floor(delay_s * self.sample_rate_hz * PHASES as f64 + 0.5) as i64;
        let [samples, phase] = [steps.div_euclid(PHASES as i64), steps.rem_euclid(PHASES as i64)];
        let start = (-samples).rem_euclid(SAMPLES as i64) as usize;
        let [re, im] = &self.waves[phase as usize];
        [re, im].map(|part| &part[start..start + SAMPLES])
    }
}
