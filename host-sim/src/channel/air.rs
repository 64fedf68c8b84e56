//! What arrives at the antennas, slot by slot: rays, array phases, clock and jammer, before noise.

use std::borrow::Cow;

use cslam_core::geometry::Direction;

use super::antenna::phasor;
use super::config::{Jammer, JammerKind};
use super::effects::airframe;
use super::mix::{Gain, mix};
use super::noise::Gaussian;
use super::rays::{Instant, Ray};
use super::reception::Reception;
use super::simulator::{Block, CHANNELS, Simulator};
use super::transmit::BeamField;
use super::waves::{Plane, Wave, WaveMaker};
use super::{ARRAYS, C64, ELEMENTS};
use crate::random::Stream;

/// A clock that has drifted this far since the waves were made gets new ones, s; in between, their slope serves
/// (second order: -60 dB at the band edge).
const REMAKE_AFTER_S: f64 = 50e-12;

/// Streams of a sweep: its noise, and what is drawn per beam.
pub(super) fn stream(index: u32, symbol: usize, kind: u64) -> u64 {
    (kind << 56) | (u64::from(index) << 16) | symbol as u64
}
pub(super) const NOISE: u64 = 0;
const PER_BEAM: u64 = 1;
const JAMMED: u64 = 2;

/// What a sweep keeps between its beams.
pub(super) struct SweepState<'a> {
    pub(super) simulator: &'a Simulator,
    instant: &'a Instant,
    index: u32,
    pub(super) rays: Cow<'a, [Ray]>,
    pub(super) receptions: Vec<Reception>,
    pub(super) fields: Vec<Vec<BeamField>>,
    /// Per array, a wave for each ray and one for the jammer.
    pub(super) waves: [Vec<Wave>; ARRAYS],
    steering: [Vec<[C64; ELEMENTS]>; ARRAYS],
    /// Delays of the elements in their arrays, s; none where these count as one place.
    element_delay_s: Option<[Vec<[f64; ELEMENTS]>; ARRAYS]>,
    /// Clock offset the waves were made with, s.
    pub(super) made_at_s: f64,
    jammer: Option<(Jammer, Reception)>,
    planes: Vec<Plane>,
    scratch: Vec<[[f32; 16]; 2]>,
    gaussian: Gaussian,
}

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

impl<'a> SweepState<'a> {
    pub(super) fn new(simulator: &'a Simulator, rays: &'a [Ray], instant: &'a Instant, index: u32) -> Self {
        let impairments = &simulator.config.impairments;
        let mut rays = Cow::Borrowed(rays);
        if impairments.airframe.shadow {
            let copies = airframe::copies(&rays);
            rays.to_mut().extend(copies);
        }
        let errors = simulator.arrays.errors_at(instant.time_s);
        let jammer = impairments.jammer.as_ref().and_then(|jammer| {
            let (zenith, azimuth) = (jammer.zenith_deg.to_radians(), jammer.azimuth_deg.to_radians());
            let world = Direction::from_zenith_azimuth(zenith, azimuth).ok()?;
            let body = instant.attitude.inverse().apply(world);
            let reception = simulator.arrays.reception(&body, jammer.delay_s, &errors);
            Some((jammer.clone(), reception))
        });
        let receptions: Vec<_> = rays
            .iter()
            .map(|ray| simulator.arrays.reception(&ray.arrival, ray.delay_s, &errors))
            .collect();
        let all = || receptions.iter().chain(jammer.as_ref().map(|(_, r)| r));
        let steering = std::array::from_fn(|j| all().map(|r| r.steering[j]).collect());
        let delays = || std::array::from_fn(|j| all().map(|r| r.element_delay_s[j]).collect());
        let element_delay_s = simulator.arrays.squints().then(delays);
        let fields = rays
            .iter()
            .map(|r| simulator.transmitter.fields(&r.departure, &simulator.device));
        let mut state = Self {
            fields: fields.collect(),
            element_delay_s,
            simulator,
            instant,
            index,
            rays,
            receptions,
            waves: std::array::from_fn(|_| Vec::new()),
            steering,
            made_at_s: 0.0,
            jammer,
            planes: vec![Plane::new(); CHANNELS],
            scratch: Vec::new(),
            gaussian: simulator.gaussian.clone(),
        };
        state.make_waves(state.clock_s(0));
        state
    }

    /// Clock offset in a slot, s.
    pub(super) fn clock_s(&self, slot: usize) -> f64 {
        let i = &self.simulator.config.impairments;
        i.clock_offset_s
            + self.instant.clock_offset_s
            + (i.clock_drift + self.instant.clock_drift) * self.time_s(slot)
    }

    /// Time of a slot's block since the first one, s.
    fn time_s(&self, slot: usize) -> f64 {
        self.simulator.maker.waveform().beam_period_s() * slot as f64
    }

    fn make_waves(&mut self, clock_s: f64) {
        let maker = &self.simulator.maker;
        let cfo_hz = self.simulator.config.impairments.cfo_hz;
        for (j, waves) in self.waves.iter_mut().enumerate() {
            waves.clear();
            for (ray, r) in self.rays.iter().zip(&self.receptions) {
                waves.push(maker.wave(r.delay_s[j] + clock_s, ray.doppler_hz + cfo_hz));
            }
            // Any but a tone is made anew in every slot.
            waves.extend(
                self.jammer
                    .iter()
                    .map(|(jammer, _)| maker.tone(jammer.offset_hz + cfo_hz)),
            );
        }
        self.made_at_s = clock_s;
    }

    /// What the jammer sends in a slot, if that is not always the same.
    fn jam(&mut self, slot: usize) {
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
                let shift_hz = jammer.offset_hz + self.simulator.config.impairments.cfo_hz;
                let clock_s = self.clock_s(slot);
                reception
                    .delay_s
                    .map(|delay_s| maker.wave(delay_s + clock_s, shift_hz))
            }
        };
        for (waves, wave) in self.waves.iter_mut().zip(heard) {
            if let Some(last) = waves.last_mut() {
                *last = wave;
            }
        }
    }

    /// The field that arrives in a slot (of a beam period) of a transmitter whose field towards each ray is given, into
    /// `planes`, without noise. False when the block is lost: by chance, or because the caller says so.
    pub(super) fn air(&mut self, slot: usize, lost: bool, field: impl Fn(&Self, usize) -> BeamField) -> bool {
        let simulator = self.simulator;
        let impairments = &simulator.config.impairments;
        let mut draws = Stream::new(simulator.seed, stream(self.index, slot, PER_BEAM));
        // Drawn whether used or not, so that one setting does not move another's.
        let lost = (draws.uniform() < impairments.dropped_beam_probability) || lost;
        let array_phase: [C64; ARRAYS] =
            std::array::from_fn(|_| phasor(std::f64::consts::TAU * draws.uniform()));
        let jammer_phase = phasor(std::f64::consts::TAU * draws.uniform());
        if lost {
            return false;
        }
        let time_s = self.time_s(slot);
        let clock_s = self.clock_s(slot);
        if (clock_s - self.made_at_s).abs() > REMAKE_AFTER_S {
            self.make_waves(clock_s);
        }
        self.jam(slot);
        let late_s = clock_s - self.made_at_s;
        let turn = |shift_hz: f64| {
            let turns = shift_hz * time_s;
            phasor(std::f64::consts::TAU * (turns - turns.floor()))
        };
        let amplitude = simulator.signal_amplitude();
        for (j, waves) in self.waves.iter().enumerate() {
            let lo = if impairments.free_array_phase {
                array_phase[j]
            } else {
                C64::new(1.0, 0.0)
            };
            let of_rays = self
                .rays
                .iter()
                .zip(&self.receptions)
                .enumerate()
                .map(|(index, (ray, r))| {
                    let common = ray.amplitude
                        * turn(ray.doppler_hz + impairments.cfo_hz)
                        * r.carrier[j]
                        * lo
                        * amplitude;
                    let BeamField { field, slope_s } = field(self, index);
                    Gain {
                        value: common * field,
                        slope: -common * (field * late_s + slope_s),
                    }
                });
            let of_jammer = self.jammer.iter().map(|(jammer, r)| Gain {
                value: jammer_phase
                    * turn(jammer.offset_hz + impairments.cfo_hz)
                    * r.carrier[j]
                    * lo
                    * libm::exp10((jammer.power_dbm - 30.0) / 20.0),
                slope: C64::new(0.0, 0.0),
            });
            let gains: Vec<Gain> = of_rays.chain(of_jammer).collect();
            let planes = &mut self.planes[j * ELEMENTS..(j + 1) * ELEMENTS];
            let delays = self
                .element_delay_s
                .as_ref()
                .map(|of_arrays| of_arrays[j].as_slice());
            mix(
                waves,
                &gains,
                &self.steering[j],
                delays,
                &mut self.scratch,
                planes,
            );
        }
        true
    }

    /// Noise and front end over `planes`.
    pub(super) fn digitise(&mut self, slot: usize, beam: u16) -> Block {
        let simulator = self.simulator;
        simulator.digitise(
            &mut self.planes,
            &mut self.gaussian,
            stream(self.index, slot, NOISE),
            beam,
        )
    }
}
