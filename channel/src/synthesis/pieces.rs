//! The pieces of diffusely scattered waves: hundreds of weak rays, made at a fraction of the price of a ray.
//!
//! A piece is some 40 dB under the strongest path. Its delay is rounded to a 32nd of a sample, so that its wave is a shifted one of 32
//! that are made once (4 cm at most of an error of 1.2 m cells; -28 dB of the piece at the band's edge), its frequency shift turns
//! whole blocks, and beams that see it 25 dB weaker than its best do not hear it. The UAV's body and rotors do nothing to it. Beam squint
//! symbols hear the strongest pieces alone, as rays.

use cslam_core::signal::SAMPLES;
use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::C64;
use super::bank::Bank;
use super::lanes::{add_up, in_widest_lanes, sum};
use super::rays::Ray;
use super::reception::{ElementErrors, Reception};
use super::simulator::Simulator;
use super::waves::Plane;

/// A beam that sees a piece so much weaker than its best does not hear it, dB.
const BEAM_RANGE_DB: f64 = 25.0;

/// Divides the rays of a link into those of waves of their own and the pieces of scattered ones; `scattered` says which are which.
pub(super) fn divide(rays: Vec<Ray>, scattered: impl Fn(usize) -> bool) -> (Vec<Ray>, Vec<Ray>) {
    let (mut own, mut pieces) = (Vec::new(), Vec::new());
    for (place, ray) in rays.into_iter().enumerate() {
        if scattered(place) {
            pieces.push(ray);
        } else {
            own.push(ray);
        }
    }
    (own, pieces)
}

/// A piece at the receive arrays.
struct Piece<const ARRAYS: usize, const ELEMENTS: usize> {
    amplitude: C64,
    /// Frequency shift at each array.
    doppler_hz: [f64; ARRAYS],
    reception: Reception<ARRAYS, ELEMENTS>,
    /// Field of each transmit beam towards it; none where it is too weak to be heard.
    fields: Vec<Option<C64>>,
}

/// The pieces of a sweep.
pub(super) struct Pieces<'a, const ARRAYS: usize, const ELEMENTS: usize> {
    bank: &'a Bank,
    all: Vec<Piece<ARRAYS, ELEMENTS>>,
}

/// What all pieces share in a block.
pub(super) struct Slot<F: Fn(f64) -> C64> {
    pub(super) beam: usize,
    pub(super) clock_s: f64,
    /// Amplitude and phase of everything but the piece.
    pub(super) common: C64,
    /// Turn of a frequency shift since the first block.
    pub(super) turn: F,
}

impl<'a, const ARRAYS: usize, const ELEMENTS: usize> Pieces<'a, ARRAYS, ELEMENTS> {
    pub(super) fn new<const CHANNELS: usize>(
        simulator: &'a Simulator<ARRAYS, ELEMENTS, CHANNELS>,
        rays: &[Ray],
        errors: &ElementErrors<ARRAYS, ELEMENTS>,
        turn_rad_per_s: &Vector3<f64>,
    ) -> Self {
        let cut = libm::exp10(-BEAM_RANGE_DB / 10.0);
        let piece = |ray: &Ray| {
            let fields = simulator.transmitter.fields(&ray.departure, &simulator.device);
            let powers = || fields.iter().map(|beam| beam.field.norm_sqr());
            let least = cut * powers().fold(0.0, f64::max);
            let heard = |(field, power): (C64, f64)| (power > least).then_some(field);
            Piece {
                amplitude: ray.amplitude,
                doppler_hz: simulator
                    .arrays
                    .turning_hz(&ray.arrival, turn_rad_per_s)
                    .map(|turning_hz| ray.doppler_hz + turning_hz),
                reception: simulator
                    .arrays
                    .reception(&ray.arrival, ray.delay_s, ray.across, errors),
                fields: fields
                    .iter()
                    .map(|beam| beam.field)
                    .zip(powers())
                    .map(heard)
                    .collect(),
            }
        };
        Self {
            bank: &simulator.bank,
            all: rays.iter().map(piece).collect(),
        }
    }

    /// Adds what array `j` hears of them in a block.
    pub(super) fn add<F: Fn(f64) -> C64>(&self, j: usize, slot: &Slot<F>, planes: &mut [Plane]) {
        debug_assert!(j < ARRAYS);
        let single = |c: C64| [c.re as f32, c.im as f32];
        let heard: Vec<Heard<'_, ELEMENTS>> = self
            .all
            .iter()
            .filter_map(|piece| {
                let field = piece.fields.get(slot.beam).copied().flatten()?;
                let at = &piece.reception;
                let gain =
                    piece.amplitude * field * (slot.turn)(piece.doppler_hz[j]) * at.carrier[j] * slot.common;
                let steering = at.steering[j].map(|element| single(element * gain));
                Some((steering, self.bank.wave(at.delay_s[j] + slot.clock_s)))
            })
            .collect();
        in_widest_lanes(Adding(&heard, planes));
    }
}

/// A piece as an array hears it: what each element turns it by, real and imaginary parts of its wave.
type Heard<'w, const ELEMENTS: usize> = ([[f32; 2]; ELEMENTS], [&'w [f32]; 2]);

/// Adds pieces to what the elements of an array hear.
struct Adding<'a, const ELEMENTS: usize>(&'a [Heard<'a, ELEMENTS>], &'a mut [Plane]);

impl<const ELEMENTS: usize> WithSimd for Adding<'_, ELEMENTS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self(heard, planes) = self;
        for chunk in 0..SAMPLES / S::F32_LANES {
            let rays = heard.iter().map(|(steering, [re, im])| {
                (
                    steering,
                    [S::as_simd_f32s(re).0[chunk], S::as_simd_f32s(im).0[chunk]],
                )
            });
            add_up(simd, rays, |element, more| {
                if let Some(plane) = planes.get_mut(element) {
                    plane.put_lanes::<S>(chunk, sum(simd, plane.lanes::<S>(chunk), more));
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paths::{Interaction, Kind, Link};
    use crate::synthesis::probe::noiseless;
    use crate::synthesis::{Impairments, Instant, Sweep};

    fn simulator() -> Simulator {
        let impairments = Impairments {
            clock_offset_s: 3e-7,
            cfo_hz: 4e3,
            ..Impairments::budget()
        };
        Simulator::new(noiseless(impairments), 4)
    }

    /// Links of one path at a few lengths, as a ray or as a piece.
    fn link(length_m: f64, scattered: bool) -> Link {
        let mut link = crate::synthesis::probe::one_path(length_m, [1.4, 0.3], [1.35, 0.25]);
        link.paths[0].order = Some(1);
        link.paths[0].kind = scattered.then(|| Kind::of(&[Interaction::Scattering]).expect("one"));
        link
    }

    /// Samples of all channels of a block, sqrt(W).
    fn samples(sweep: &Sweep, beam: u16) -> Vec<C64> {
        let block = crate::synthesis::probe::block(sweep, beam);
        let scale = libm::ldexp(1.0, block.exponent);
        let channels = block.samples.iter().flatten();
        channels
            .map(|iq| C64::new(f64::from(iq.re()), f64::from(iq.im())) * scale)
            .collect()
    }

    #[test]
    fn a_piece_is_the_ray_within_its_stated_error() {
        let simulator = simulator();
        for length_m in [20.0, 61.3, 311.7] {
            let [ray, piece] = [false, true].map(|scattered| {
                let heard = simulator.sweep(&link(length_m, scattered), &Instant::at_rest(), 7);
                heard.expect("complete path")
            });
            let power = |beam| samples(&ray, beam).iter().map(C64::norm_sqr).sum::<f64>();
            let best = (0..72)
                .max_by(|a, b| power(*a).total_cmp(&power(*b)))
                .expect("beams");
            let error: f64 = samples(&ray, best)
                .iter()
                .zip(&samples(&piece, best))
                .map(|(a, b)| (a - b).norm_sqr())
                .sum();
            // At most a 64th of a sample (-33 dB over the band), a block's turn by the offset of the carrier (-36 dB), and the
            // delays of the GMT's elements, which a ray has and a piece has not (-38 dB).
            let error_db = 10.0 * libm::log10(error / power(best));
            assert!(error_db < -28.0, "{length_m} m: {error_db} dB");
            // And 25 dB under the best beam, silence.
            let silent = (0..72).filter(|m| samples(&piece, *m).iter().all(|s| s.norm_sqr() == 0.0));
            let weak = (0..72).filter(|m| power(*m) < 1e-3 * power(best));
            let (silent, weak): (Vec<u16>, Vec<u16>) = (silent.collect(), weak.collect());
            assert!(
                weak.len() > 10 && weak.iter().all(|m| silent.contains(m)),
                "{silent:?} {weak:?}"
            );
        }
    }

    #[test]
    fn pieces_add_to_rays_and_none_changes_nothing() {
        let simulator = simulator();
        let both = Link {
            paths: [link(30.0, false).paths, link(47.0, true).paths].concat(),
            ..link(30.0, false)
        };
        let at = |link: &Link| {
            simulator
                .sweep(link, &Instant::at_rest(), 7)
                .expect("complete paths")
        };
        let [ray, piece, sum] = [link(30.0, false), link(47.0, true), both].map(|link| at(&link));
        let [ray, piece, sum] = [&ray, &piece, &sum].map(|sweep| samples(sweep, 0));
        let error: f64 = (0..sum.len())
            .map(|k| (sum[k] - ray[k] - piece[k]).norm_sqr())
            .sum();
        let power: f64 = sum.iter().map(C64::norm_sqr).sum();
        assert!(error < 1e-7 * power, "{error} {power}");
    }
}
