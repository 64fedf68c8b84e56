//! A sweep of all transmit beams through channel and front end.

use cslam_core::array::{Codebook, UavArrays, phasor};
use cslam_core::block::BeamBlock;
use cslam_core::constants::{BOLTZMANN_J_PER_K, NOISE_TEMPERATURE_K, SPEED_OF_LIGHT_M_PER_S};
use cslam_core::geometry::Direction;
use cslam_core::ltd::Iq;
use cslam_core::waveform::{SAMPLES, Waveform};

use super::config::{ChannelConfig, Jammer};
use super::mix::{Gain, mix};
use super::noise::Gaussian;
use super::rays::{Instant, Ray, RayError, rays};
use super::transmit::{BeamField, Transmitter};
use super::waves::{Plane, Wave, WaveMaker};
use super::{ARRAYS, C64, Calibration, ELEMENTS, adc};
use crate::paths::Link;
use crate::random::Stream;

/// Channels of the receiver, array-major (8 j + i).
pub const CHANNELS: usize = ARRAYS * ELEMENTS;

/// A clock that has drifted this far since the waves were made gets new ones, s; in between, their slope serves
/// (second order: -60 dB at the band edge).
const REMAKE_AFTER_S: f64 = 50e-12;

/// Samples of one transmit beam.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Transmit beam.
    pub beam: u16,
    /// Amplitude in sqrt(W) = integer x 2^exponent, at the antenna (behind the implementation loss).
    pub exponent: i32,
    /// Samples, [channel][sample].
    pub samples: Box<[[Iq; SAMPLES]; CHANNELS]>,
}

impl Block {
    /// As the receiver takes it.
    pub fn view(&mut self) -> BeamBlock<'_, CHANNELS> {
        BeamBlock {
            samples: &mut self.samples,
            beam: self.beam,
            exponent: self.exponent,
        }
    }

    /// A block of zeros.
    pub fn zero(beam: u16, exponent: i32) -> Self {
        // By way of the heap: 64 KiB are much for a stack.
        let samples: Box<[[Iq; SAMPLES]]> = vec![[Iq::ZERO; SAMPLES]; CHANNELS].into();
        let samples = samples
            .try_into()
            .unwrap_or_else(|_| unreachable!("made of CHANNELS channels"));
        Self {
            beam,
            exponent,
            samples,
        }
    }
}

/// The blocks of one sweep, in beam order; lost beams are absent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep {
    /// Blocks.
    pub blocks: Vec<Block>,
}

/// Channel and front end of one UAV and one GMT. Immutable: sweeps may be made in any order, on any thread.
#[derive(Clone, Debug)]
pub struct Simulator {
    pub(super) config: ChannelConfig,
    pub(super) seed: u64,
    pub(super) device: Calibration,
    pub(super) arrays: UavArrays<f64>,
    pub(super) transmitter: Transmitter,
    pub(super) maker: WaveMaker,
    pub(super) gaussian: Gaussian,
}

/// A ray at the receive arrays.
pub(super) struct Reception {
    /// Element pattern, steering and errors of each array's elements.
    pub(super) steering: [[C64; ELEMENTS]; ARRAYS],
    /// Delay at each array, s; lever arm and delay error included, clock not.
    pub(super) delay_s: [f64; ARRAYS],
    /// Carrier phase of the lever arm.
    pub(super) carrier: [C64; ARRAYS],
}

impl Simulator {
    /// A simulator; `seed` draws the device errors and all noise.
    pub fn new(config: ChannelConfig, seed: u64) -> Self {
        let device = Calibration::draw(&config.impairments, seed);
        let mut arrays = UavArrays::<f64>::default();
        for (array, [along, across]) in arrays.arrays_mut().iter_mut().zip(device.uav_axis_rad) {
            let tangent = array.normal.cross(&array.axis);
            array.axis = (array.axis + array.normal * along + tangent * across).normalize();
        }
        Self {
            config,
            seed,
            device,
            arrays,
            transmitter: Transmitter::new(Codebook::default()),
            maker: WaveMaker::new(Waveform::default()),
            gaussian: Gaussian::new(),
        }
    }

    /// Errors the device has.
    pub fn device(&self) -> &Calibration {
        &self.device
    }

    /// Beams of a full sweep.
    pub fn beams(&self) -> usize {
        self.transmitter.beams()
    }

    /// Configuration.
    pub fn config(&self) -> &ChannelConfig {
        &self.config
    }

    /// Variance of a noise sample, W: thermal noise over the sample rate times the noise figure.
    pub fn noise_power_w(&self) -> f64 {
        let figure = libm::exp10(self.config.front_end.noise_figure_db / 10.0);
        BOLTZMANN_J_PER_K * NOISE_TEMPERATURE_K * figure * self.maker.waveform().sample_rate_hz
    }

    /// Amplitude of a signal behind a channel of gain one, sqrt(W).
    pub fn signal_amplitude(&self) -> f64 {
        let f = &self.config.front_end;
        let dbm = f.transmit_power_dbm - f.implementation_loss_db + f.snr_offset_db;
        libm::exp10((dbm - 30.0) / 20.0)
    }

    /// The sweep over a link at an instant. `index` numbers the sweeps of a run: it chooses the noise.
    ///
    /// # Errors
    /// [`RayError`] when a path of the link cannot be synthesised.
    pub fn sweep(&self, link: &Link, instant: &Instant, index: u32) -> Result<Sweep, RayError> {
        let rays = rays(link, instant, self.maker.waveform().carrier_hz)?;
        Ok(self.sweep_rays(&rays, instant, index))
    }

    /// The sweep of rays that are already in the frames of the arrays.
    pub fn sweep_rays(&self, rays: &[Ray], instant: &Instant, index: u32) -> Sweep {
        let mut state = SweepState::new(self, rays, instant, index);
        let mut sweep = Sweep::default();
        for beam in 0..self.beams() {
            let listed = self.config.impairments.dropped_beams.contains(&(beam as u16));
            if state.air(beam, listed, |state, ray| state.fields[ray][beam]) {
                sweep.blocks.push(state.digitise(beam, beam as u16));
            }
        }
        sweep
    }

    pub(super) fn receive(&self, ray: &Ray) -> Reception {
        self.reception(&ray.arrival, ray.delay_s)
    }

    fn reception(&self, arrival: &Direction<cslam_core::geometry::Body, f64>, delay_s: f64) -> Reception {
        let carrier_hz = self.maker.waveform().carrier_hz;
        let (steps, amplitudes) = (
            self.arrays.phase_step_rad(arrival),
            self.arrays.amplitude(arrival),
        );
        let lead_s = self.arrays.lead_m(arrival).map(|m| m / SPEED_OF_LIGHT_M_PER_S);
        Reception {
            steering: std::array::from_fn(|j| {
                let clean = UavArrays::<f64>::steering(steps[j]);
                std::array::from_fn(|i| clean[i] * self.device.uav_element[j][i] * amplitudes[j])
            }),
            delay_s: std::array::from_fn(|j| delay_s - lead_s[j] + self.device.uav_delay_s[j]),
            carrier: lead_s.map(|s| phasor(std::f64::consts::TAU * carrier_hz * s)),
        }
    }
}

/// Streams of a sweep: its noise, and what is drawn per beam.
pub(super) fn stream(index: u32, symbol: usize, kind: u64) -> u64 {
    (kind << 56) | (u64::from(index) << 16) | symbol as u64
}
pub(super) const NOISE: u64 = 0;
const PER_BEAM: u64 = 1;

/// What a sweep keeps between its beams.
pub(super) struct SweepState<'a> {
    pub(super) simulator: &'a Simulator,
    instant: &'a Instant,
    index: u32,
    pub(super) rays: &'a [Ray],
    pub(super) receptions: Vec<Reception>,
    fields: Vec<Vec<BeamField>>,
    /// Per array, a wave for each ray and one for the jammer.
    pub(super) waves: [Vec<Wave>; ARRAYS],
    steering: [Vec<[C64; ELEMENTS]>; ARRAYS],
    /// Clock offset the waves were made with, s.
    pub(super) made_at_s: f64,
    jammer: Option<(Jammer, Reception)>,
    planes: Vec<Plane>,
    scratch: Vec<[[f32; 16]; 2]>,
    gaussian: Gaussian,
}

impl<'a> SweepState<'a> {
    pub(super) fn new(simulator: &'a Simulator, rays: &'a [Ray], instant: &'a Instant, index: u32) -> Self {
        let impairments = &simulator.config.impairments;
        let jammer = impairments.jammer.as_ref().and_then(|jammer| {
            let (zenith, azimuth) = (jammer.zenith_deg.to_radians(), jammer.azimuth_deg.to_radians());
            let world = Direction::from_zenith_azimuth(zenith, azimuth).ok()?;
            let body = instant.attitude.inverse().apply(world);
            Some((jammer.clone(), simulator.reception(&body, 0.0)))
        });
        let receptions: Vec<_> = rays.iter().map(|ray| simulator.receive(ray)).collect();
        let steering = std::array::from_fn(|j| {
            let all = receptions.iter().chain(jammer.as_ref().map(|(_, r)| r));
            all.map(|r| r.steering[j]).collect()
        });
        let fields = rays
            .iter()
            .map(|r| simulator.transmitter.fields(&r.departure, &simulator.device));
        let mut state = Self {
            fields: fields.collect(),
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
            waves.extend(
                self.jammer
                    .iter()
                    .map(|(jammer, _)| maker.tone(jammer.offset_hz + cfo_hz)),
            );
        }
        self.made_at_s = clock_s;
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
            mix(waves, &gains, &self.steering[j], &mut self.scratch, planes);
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

impl Simulator {
    /// The front end: noise of a stream, dead channels, gain control, converter.
    fn digitise(&self, planes: &mut [Plane], gaussian: &mut Gaussian, stream: u64, beam: u16) -> Block {
        let front_end = &self.config.front_end;
        if front_end.noise {
            gaussian.restart(self.seed, stream);
            let sigma = (0.5 * self.noise_power_w()).sqrt() as f32;
            for plane in planes.iter_mut() {
                gaussian.add_to(&mut plane.re, sigma);
                gaussian.add_to(&mut plane.im, sigma);
            }
        }
        for channel in &self.config.impairments.dead_channels {
            if let Some(plane) = planes.get_mut(usize::from(*channel)) {
                *plane = Plane::new();
            }
        }
        let mut block = Block::zero(beam, adc::exponent(planes, front_end.agc_rms_dbfs));
        adc::convert(planes, block.exponent, front_end.adc_bits, &mut block.samples);
        block
    }
}
