//! What others send into the band: a jammer, and a neighbour's bursts.

use cslam_core::geometry::Direction;

use super::impairments::Jammer;
use super::rays::Instant;
use super::reception::{ElementErrors, Reception};
use super::simulator::Simulator;
use super::streams::{BURSTS, stream};
use crate::random::Stream;

/// A neighbour at the arrays.
pub(super) struct HeardNeighbour<const ARRAYS: usize, const ELEMENTS: usize> {
    pub(super) reception: Reception<ARRAYS, ELEMENTS>,
    /// Its bursts over the sweep, s.
    pub(super) bursts: Vec<[f64; 2]>,
    /// Amplitude at an isotropic antenna, sqrt(W).
    pub(super) amplitude: f64,
}

/// The jammer of a sweep at the arrays.
pub(super) fn jammer<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>(
    simulator: &Simulator<ARRAYS, ELEMENTS, CHANNELS>,
    instant: &Instant,
    errors: &ElementErrors<ARRAYS, ELEMENTS>,
) -> Option<(Jammer, Reception<ARRAYS, ELEMENTS>)> {
    let jammer = simulator.config.impairments.jammer.as_ref()?;
    let (zenith, azimuth) = (jammer.zenith_deg.to_radians(), jammer.azimuth_deg.to_radians());
    let world = Direction::from_zenith_azimuth(zenith, azimuth).ok()?;
    let body = instant.attitude.inverse().apply(world);
    let reception = simulator
        .arrays
        .reception(&body, jammer.delay_s, super::C64::ZERO, errors);
    Some((jammer.clone(), reception))
}

/// The neighbour of a sweep at the arrays.
pub(super) fn neighbour<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>(
    simulator: &Simulator<ARRAYS, ELEMENTS, CHANNELS>,
    instant: &Instant,
    errors: &ElementErrors<ARRAYS, ELEMENTS>,
    index: u32,
) -> Option<HeardNeighbour<ARRAYS, ELEMENTS>> {
    let neighbour = simulator.neighbour.as_ref()?;
    let interference = simulator.config.impairments.interference.as_ref()?;
    let body = instant.attitude.inverse().apply(neighbour.direction);
    // As long as the beams and the squint symbols of either scheme take.
    let span_s = 2.0 * simulator.maker.waveform().beam_period_s() * simulator.beams() as f64;
    let stream = Stream::new(simulator.seed, stream(index, 0, BURSTS));
    Some(HeardNeighbour {
        reception: simulator.arrays.reception(&body, 0.0, super::C64::ZERO, errors),
        bursts: interference.bursts(span_s, stream),
        amplitude: libm::exp10((interference.power_dbm - 30.0) / 20.0),
    })
}
