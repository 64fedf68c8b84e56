//! A sweep of all transmit beams through channel and front end.

use cslam_core::constants::{BOLTZMANN_J_PER_K, NOISE_TEMPERATURE_K};
use cslam_core::signal::{BeamBlock, Iq, SAMPLES};

use super::bank::Bank;
use super::config::ChannelConfig;
use super::effects::carrier_offset::CarrierOffset;
use super::effects::converter::Converter;
use super::effects::interference::Neighbour;
use super::effects::quadrature::Quadrature;
use super::effects::rotors::Rotors;
use super::noise::Gaussian;
use super::radio::Radio;
use super::rays::{Instant, Ray, RayError, rays};
use super::reception::ReceiveArrays;
use super::streams::{CONVERTER, NOISE, stream};
use super::transmit::Transmitter;
use super::waves::{Plane, WaveMaker};
use super::{Calibration, adc};
use crate::paths::Link;

/// Streams of random numbers have room for the oscillators of so many arrays, beside the GMT's.
const MOST_ARRAYS: usize = 15;

/// Slots of pilots follow this one, those of the beams' first ones, then of the second ones.
const PILOTS: usize = 1024;

/// Samples of one transmit beam.
#[derive(Clone, Debug, PartialEq)]
pub struct Block<const CHANNELS: usize = 32> {
    /// Transmit beam.
    pub beam: u16,
    /// Amplitude in sqrt(W) = integer x 2^exponent, at the antenna (behind the implementation loss).
    pub exponent: i32,
    /// Samples by channel and sample.
    pub samples: Box<[[Iq; SAMPLES]; CHANNELS]>,
}

impl<const CHANNELS: usize> Block<CHANNELS> {
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

/// The blocks of one sweep, in beam order; lost beams are absent. A receiver is given them [`Self::strongest_first`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep<const CHANNELS: usize = 32> {
    /// Blocks.
    pub blocks: Vec<Block<CHANNELS>>,
}

/// Channel and front end of one UAV and one GMT. Immutable: sweeps may be made in any order, on any thread.
///
/// The UAV has `ARRAYS` linear arrays of `ELEMENTS` elements; its `CHANNELS` are array-major, `ELEMENTS` j + i.
#[derive(Clone, Debug)]
pub struct Simulator<const ARRAYS: usize = 4, const ELEMENTS: usize = 8, const CHANNELS: usize = 32> {
    pub(super) radio: Radio,
    pub(super) config: ChannelConfig,
    pub(super) seed: u64,
    pub(super) device: Calibration<ARRAYS, ELEMENTS>,
    pub(super) arrays: ReceiveArrays<ARRAYS, ELEMENTS>,
    pub(super) transmitter: Transmitter,
    pub(super) maker: WaveMaker,
    pub(super) carrier_offset: Option<CarrierOffset>,
    pub(super) rotors: Option<Rotors>,
    pub(super) neighbour: Option<Neighbour>,
    quadrature: Option<Quadrature>,
    converter: Option<Converter>,
    pub(super) bank: Bank,
    pub(super) gaussian: Gaussian,
}

impl Simulator {
    /// A simulator of the default radio; `seed` draws the device errors and all noise.
    pub fn new(config: ChannelConfig, seed: u64) -> Self {
        Self::with_radio(Radio::default(), config, seed)
    }
}

impl<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    Simulator<ARRAYS, ELEMENTS, CHANNELS>
{
    /// A simulator of a radio; `seed` draws the device errors and all noise.
    pub fn with_radio(radio: Radio, config: ChannelConfig, seed: u64) -> Self {
        const { assert!(CHANNELS == ARRAYS * ELEMENTS && CHANNELS > 0 && ARRAYS <= MOST_ARRAYS) }
        let impairments = &config.impairments;
        let device = Calibration::draw(impairments, &radio, seed);
        let arrays = ReceiveArrays::new(&radio, impairments, &device, seed);
        let maker = WaveMaker::new(radio.waveform, impairments.amplifier.as_ref());
        let front_end = &config.front_end;
        let converter = Converter::draw(&impairments.receiver, front_end, &radio.waveform, CHANNELS, seed);
        Self {
            carrier_offset: CarrierOffset::draw(&impairments.oscillators, seed),
            rotors: impairments.airframe.rotors.then(|| Rotors::draw(seed)),
            neighbour: impairments
                .interference
                .as_ref()
                .and_then(|_| Neighbour::draw(seed)),
            quadrature: Quadrature::draw(&impairments.receiver, CHANNELS, seed),
            converter,
            bank: Bank::new(&maker),
            maker,
            transmitter: Transmitter::new(&radio, &device),
            radio,
            config,
            seed,
            device,
            arrays,
            gaussian: Gaussian::new(),
        }
    }

    /// The radio.
    pub fn radio(&self) -> &Radio {
        &self.radio
    }

    /// Errors the device has.
    pub fn device(&self) -> &Calibration<ARRAYS, ELEMENTS> {
        &self.device
    }

    /// Beams of a full sweep.
    pub fn beams(&self) -> usize {
        self.transmitter.beams()
    }

    /// Slot of a beam's first or second pilot.
    pub(super) fn pilot_slot(&self, beam: usize, again: usize) -> usize {
        PILOTS + again * self.beams() + beam
    }

    /// Beam of a slot that is a pilot's, and whether it is the first (0) or the second one.
    pub(super) fn pilot_of(&self, slot: usize) -> Option<(usize, usize)> {
        let place = slot.checked_sub(PILOTS)?;
        Some((place % self.beams(), place / self.beams()))
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

    /// The rays of a link, in the order of its paths.
    pub(super) fn rays(&self, link: &Link, instant: &Instant) -> Result<Vec<Ray>, RayError> {
        rays(link, instant, self.maker.waveform().carrier_hz)
    }

    fn silence_dead_channels(&self, planes: &mut [Plane]) {
        for channel in &self.config.impairments.dead_channels {
            if let Some(plane) = planes.get_mut(usize::from(*channel)) {
                *plane = Plane::new();
            }
        }
    }

    /// The front end in a slot of a sweep: noise, mixers, dead channels, gain control, converter.
    pub(super) fn digitise(
        &self,
        planes: &mut [Plane],
        gaussian: &mut Gaussian,
        (index, slot): (u32, usize),
        beam: u16,
    ) -> Block<CHANNELS> {
        let front_end = &self.config.front_end;
        if front_end.noise {
            gaussian.restart(self.seed, stream(index, slot, NOISE));
            let sigma = (0.5 * self.noise_power_w()).sqrt() as f32;
            for plane in planes.iter_mut() {
                gaussian.add_to(&mut plane.re, sigma);
                gaussian.add_to(&mut plane.im, sigma);
            }
        }
        if let Some(quadrature) = &self.quadrature {
            quadrature.apply(planes);
        }
        self.silence_dead_channels(planes);
        let mut block = Block::zero(beam, adc::exponent(planes, front_end.agc_rms_dbfs));
        if let Some(converter) = &self.converter {
            gaussian.restart(self.seed, stream(index, slot, CONVERTER));
            converter.apply(planes, block.exponent, gaussian);
            self.silence_dead_channels(planes);
        }
        adc::convert(planes, block.exponent, front_end.adc_bits, &mut block.samples[..]);
        block
    }
}
