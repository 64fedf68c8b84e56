//! Speed of the synthesis, on one core.

use std::time::Instant as Clock;

use cslam_core::geometry::{Direction, Rotation};

use super::rays::{Instant, Ray};
use super::{C64, ChannelConfig, Simulator};
use crate::random::Stream;

/// What a run measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SynthSpeed {
    /// Paths of the link.
    pub paths: usize,
    /// Beams of the sweep.
    pub beams: usize,
    /// Sweeps timed.
    pub sweeps: usize,
    /// Median time of a sweep, ms.
    pub median_ms: f64,
    /// Shortest, ms: what the work costs when nothing else runs.
    pub fastest_ms: f64,
    /// Longest, ms.
    pub longest_ms: f64,
}

/// Times whole sweeps (72 beams x 32 x 512 samples, noise, 12 bits) of a drawn link with `paths` paths through a channel, on
/// the calling thread.
pub fn synth(config: ChannelConfig, paths: usize, sweeps: usize) -> SynthSpeed {
    let simulator = Simulator::new(config, 1);
    let mut stream = Stream::new(1, 0);
    let mut direction = || {
        let zenith = (2.0 * stream.uniform() - 1.0).acos();
        (
            zenith,
            std::f64::consts::TAU * stream.uniform(),
            stream.uniform(),
            stream.normal(),
            stream.normal(),
        )
    };
    let ray = |_| {
        let (zenith, azimuth, place, re, im) = direction();
        let (departure_zenith, departure_azimuth, ..) = direction();
        Some(Ray {
            amplitude: C64::new(re, im) * 1e-5,
            across: C64::ZERO,
            delay_s: 1e-6 * place,
            arrival: Direction::from_zenith_azimuth(zenith, azimuth).ok()?,
            departure: Direction::from_zenith_azimuth(departure_zenith, departure_azimuth).ok()?,
            doppler_hz: 500.0 * im,
        })
    };
    let rays: Vec<Ray> = (0..paths).filter_map(ray).collect();
    let instant = Instant {
        attitude: Rotation::identity(),
        ..Instant::at_rest()
    };
    let mut times_ms: Vec<f64> = (0..sweeps)
        .map(|index| {
            let start = Clock::now();
            std::hint::black_box(simulator.sweep_rays(&rays, &instant, index as u32));
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times_ms.sort_by(f64::total_cmp);
    SynthSpeed {
        paths: rays.len(),
        beams: simulator.beams(),
        sweeps,
        median_ms: times_ms.get(sweeps / 2).copied().unwrap_or(0.0),
        fastest_ms: times_ms.first().copied().unwrap_or(0.0),
        longest_ms: times_ms.last().copied().unwrap_or(0.0),
    }
}
