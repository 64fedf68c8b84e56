//! Bursts of a neighbour in the band: Gaussian noise of 100 MHz out of one direction.

use cslam_core::geometry::{Direction, World};
use cslam_core::signal::SAMPLES;
use serde::{Deserialize, Serialize};

use super::Draw;
use crate::input::{InputError, within};
use crate::random::Stream;
use crate::synthesis::C64;
use crate::synthesis::noise::Gaussian;
use crate::synthesis::spectrum::Transform;
use crate::synthesis::waves::{Plane, Wave};

/// Bins of 480 kHz of a burst: 100 MHz; its middle is up to as many bins off the carrier as leave it in the active band.
const BINS: i32 = 208;
/// Shortest and longest burst, s.
const BURST_S: [f64; 2] = [20e-6, 200e-6];
/// Elevations of neighbours, deg.
const ELEVATION_DEG: [f64; 2] = [-5.0, 20.0];

/// What a neighbour sends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Interference {
    /// Power an isotropic antenna at the UAV receives during a burst, dBm, -200..=60.
    pub power_dbm: f64,
    /// Share of the time in which it sends, 0..=0.5.
    pub duty: f64,
}

impl Default for Interference {
    fn default() -> Self {
        Self {
            power_dbm: -100.0,
            duty: 0.05,
        }
    }
}

impl Interference {
    pub(crate) fn check(&self) -> Result<(), InputError> {
        within(&[
            ("power_dbm", self.power_dbm, -200.0, 60.0),
            ("duty", self.duty, 0.0, 0.5),
        ])
    }

    /// Bursts of the first `span_s` of a sweep: starts and ends, s. They begin at random, on average one a mean burst over
    /// the duty, from so early on that the first may have begun before the sweep.
    pub(crate) fn bursts(&self, span_s: f64, mut stream: Stream) -> Vec<[f64; 2]> {
        let mut bursts = Vec::new();
        if self.duty == 0.0 {
            return bursts;
        }
        let interval_s = 0.5 * (BURST_S[0] + BURST_S[1]) / self.duty;
        let mut start_s = -BURST_S[1];
        loop {
            start_s -= interval_s * libm::log(1.0 - stream.uniform());
            if start_s >= span_s {
                return bursts;
            }
            let length_s = BURST_S[0] + (BURST_S[1] - BURST_S[0]) * stream.uniform();
            bursts.push([start_s, start_s + length_s]);
        }
    }
}

/// A neighbour of a flight.
#[derive(Clone, Debug)]
pub(crate) struct Neighbour {
    /// Where it is.
    pub(crate) direction: Direction<World, f64>,
    /// Middle of its band, bins off the carrier.
    middle: i32,
}

impl Neighbour {
    /// Draws a flight's neighbour.
    pub(crate) fn draw(seed: u64) -> Option<Self> {
        let mut stream = Draw::Neighbour.stream(seed);
        let azimuth_rad = std::f64::consts::TAU * stream.uniform();
        let elevation_deg = ELEVATION_DEG[0] + (ELEVATION_DEG[1] - ELEVATION_DEG[0]) * stream.uniform();
        let direction = Direction::from_zenith_azimuth((90.0 - elevation_deg).to_radians(), azimuth_rad);
        let middle = libm::floor(f64::from(BINS) * (stream.uniform() - 0.5)) as i32;
        Some(Self {
            direction: direction.ok()?,
            middle,
        })
    }

    /// What it sends in a block that begins at `time_s`, of mean power one while a burst lasts; none between the bursts.
    pub(crate) fn wave(
        &self,
        bursts: &[[f64; 2]],
        time_s: f64,
        sample_s: f64,
        transform: &Transform,
        gaussian: &mut Gaussian,
    ) -> Option<Wave> {
        let end_s = time_s + SAMPLES as f64 * sample_s;
        bursts.iter().find(|[from, to]| *from < end_s && *to > time_s)?;
        let mut parts = [0.0_f32; 2 * BINS as usize];
        gaussian.add_to(&mut parts, (0.5 / BINS as f32).sqrt());
        let mut samples = [C64::new(0.0, 0.0); SAMPLES];
        for (k, part) in (0..BINS).zip(parts.as_chunks::<2>().0) {
            let bin = (self.middle - BINS / 2 + k).rem_euclid(SAMPLES as i32);
            samples[bin as usize] = C64::new(part[0].into(), part[1].into());
        }
        transform.inverse(&mut samples);
        for (n, x) in samples.iter_mut().enumerate() {
            let at_s = time_s + n as f64 * sample_s;
            if !bursts.iter().any(|[from, to]| (*from..*to).contains(&at_s)) {
                *x = C64::new(0.0, 0.0);
            }
        }
        Some(Wave {
            value: Plane::of(&samples),
            slope: Plane::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bursts_fill_their_duty_and_keep_their_lengths() {
        let (mut on_s, mut span) = (0.0, 0.0);
        let set = Interference::default();
        for seed in 0..4000 {
            for [from, to] in set.bursts(440e-6, Stream::new(seed, 0)) {
                assert!((19.9e-6..200.1e-6).contains(&(to - from)));
                on_s += (to.min(440e-6) - from.max(0.0)).max(0.0);
            }
            span += 440e-6;
        }
        assert!((on_s / span - 0.05).abs() < 0.006, "{}", on_s / span);
        let none = Interference { duty: 0.0, ..set };
        assert!(none.bursts(440e-6, Stream::new(1, 0)).is_empty());
    }

    #[test]
    fn a_burst_is_noise_of_power_one_in_its_band_while_it_lasts() {
        let neighbour = Neighbour::draw(4).expect("a direction");
        let (transform, mut gaussian, sample_s) = (Transform::new(), Gaussian::new(), 1.0 / 245.76e6);
        let mut wave =
            |bursts: &[[f64; 2]]| neighbour.wave(bursts, 1e-4, sample_s, &transform, &mut gaussian);
        assert!(wave(&[[0.0, 9e-5], [1.1e-4, 2e-4]]).is_none());
        let (mut power, mut inside, blocks) = (0.0, 0.0, 200.0);
        for _ in 0..200 {
            let wave = wave(&[[0.0, 1.0]]).expect("on");
            let mut x: [C64; SAMPLES] =
                std::array::from_fn(|n| C64::new(wave.value.re[n].into(), wave.value.im[n].into()));
            power += x.iter().map(|x| x.norm_sqr()).sum::<f64>() / (512.0 * blocks);
            transform.forward(&mut x);
            let band = (-104..104).map(|k| (neighbour.middle + k).rem_euclid(512) as usize);
            inside += band.map(|k| x[k].norm_sqr()).sum::<f64>() / (512.0 * 512.0 * blocks);
        }
        assert!((power - 1.0).abs() < 0.03, "{power}");
        assert!((inside / power - 1.0).abs() < 1e-5, "{inside}");
        // From the hundredth sample on.
        let late = wave(&[[1e-4 + 99.5 * sample_s, 1.0]]).expect("on");
        assert!((0..SAMPLES).all(|n| (late.value.re[n] != 0.0) == (n >= 100)));
    }
}
