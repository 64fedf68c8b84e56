//! Paths that a sweep has shown already, recognised in a beam from an eighth of the work.
//!
//! One path shows in many beams, most of which see it less well than an earlier one did. Where it lies is known then; what such
//! a beam adds is how strong it is there, for the angle of departure. That much a few channels and the even subcarriers tell:
//! the gains of all known paths are fitted jointly to the folded taps, each path's free gain per array, and the paths are
//! taken out. A beam in which none of them is stronger than ever before, and that shows nothing else, need not be transformed.

mod matched;

use heapless::Vec;
use nalgebra::Vector3;

use self::matched::{Match, separate};
use super::effort::{Effort, Work};
use super::model::ArrayModel;
use super::place::Place;
use super::template::Template;
use crate::signal::{FOLDED_CHANNELS, FOLDED_TAPS, Folded};

/// Paths remembered: the strongest.
/// Capacity: twice what a sweep reports, for pairs and for what a path looks like through a neighbour.
const MOST: usize = 18;
/// Paths fitted to one beam: the strongest in it; what is left of others counts as unknown.
/// Capacity: work of a beam.
pub(super) const FITTED: usize = 10;
/// Gates within which a path is the same one.
/// Derived: 0.4 taps (0.5 m) and 6 degrees, as in the merge.
const GATE_TAPS: f32 = 0.41;
/// Derived: the cosine of 6 degrees, as in the merge.
const GATE_COSINE: f32 = 0.994_5;
/// A peak may be a known path whose delay is this near, taps.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const NEAR_TAPS: f32 = 0.75;
/// Paths are taken out when they may hold this share of the energy asked for.
/// Derived: what is left in makes a path at the floor look half a decibel stronger at most.
const SHARE: f32 = 0.125;
/// Power that a path half-way between two taps shows in each.
/// Derived: the square of `sinc(1/2)`, `(2 / pi)^2`.
const HALF_WAY: f32 = 0.4;
/// A path is worth another transform where it is stronger than in any beam before by this factor, 1 dB.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const BETTER: f32 = 1.26;

/// A path of this sweep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// Delay at the body origin, taps of the full period.
    pub(super) delay_taps: f32,
    pub(super) u: Vector3<f32>,
    /// Energy in the beam that told most of it, as [`super::merge::Detection::energy`].
    pub(super) energy: f32,
    /// That beam.
    beam: u16,
}

/// What a beam is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    /// Energy of the weakest path worth reporting, squared LSB of a full tap.
    pub(super) floor: f32,
    /// Variance of a full tap, squared LSB.
    pub(super) noise: f32,
    /// Turns energies of the sweep into squared LSB.
    pub(super) to_lsb: f32,
    /// A candidate is a path when its fit explains this many noise variances.
    pub(super) threshold: f32,
}

/// A known path in a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    /// Index among the known paths.
    pub(super) index: usize,
    /// Energy, sum over all channels at a tap's peak, squared LSB of a full tap. Noise's share is taken off.
    pub(super) energy: f32,
}

/// The paths of a sweep so far.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownPaths {
    paths: Vec<Known, MOST>,
}

impl KnownPaths {
    pub(super) fn clear(&mut self) {
        self.paths.clear();
    }

    /// The strongest path near a delay, if a beam has shown it with this much energy: its place. Delays are seen from tap
    /// `origin`.
    pub(super) fn near(&self, origin: usize, delay_taps: f32, energy: f32) -> Option<Place> {
        let period = 2.0 * FOLDED_TAPS as f32;
        let away = |known: &Known| {
            let away = known.delay_taps - origin as f32;
            if away < -0.5 * period {
                away + period
            } else if away > 0.5 * period {
                away - period
            } else {
                away
            }
        };
        self.paths
            .iter()
            .filter(|known| known.energy >= energy && (away(known) - delay_taps).abs() < NEAR_TAPS)
            .max_by(|a, b| a.energy.total_cmp(&b.energy))
            .map(|known| Place {
                delay_taps: away(known),
                u: known.u,
            })
    }

    pub(super) fn get(&self, index: usize) -> Option<&Known> {
        self.paths.get(index)
    }

    /// Remembers a path of a beam, its delay in taps within half a period of 0 or within one after it. Where it is known, the beam that shows it best tells where it lies; two paths of one beam
    /// are never the same.
    pub(super) fn learn(&mut self, delay_taps: f32, u: Vector3<f32>, energy: f32, beam: u16) {
        let period = 2.0 * FOLDED_TAPS as f32;
        let delay_taps = if delay_taps < 0.0 {
            delay_taps + period
        } else {
            delay_taps
        };
        let new = Known {
            delay_taps,
            u,
            energy,
            beam,
        };
        let same = self.paths.iter_mut().find(|known| {
            let apart = (known.delay_taps - delay_taps).abs();
            apart.min(period - apart) < GATE_TAPS && known.u.dot(&u) > GATE_COSINE && known.beam != beam
        });
        if let Some(known) = same {
            if energy > known.energy {
                *known = new;
            }
        } else if let Err(new) = self.paths.push(new) {
            let weakest = self.paths.iter_mut().min_by(|a, b| a.energy.total_cmp(&b.energy));
            if let Some(weakest) = weakest.filter(|weakest| weakest.energy < new.energy) {
                *weakest = new;
            }
        }
    }

    /// Finds the known paths in a beam's folded taps, those of `channels` out of the `C` of the arrays, and takes them out, where
    /// they may matter to a search for paths of the floor's energy. None when one of them is stronger by [`BETTER`] than in any
    /// beam before.
    pub(super) fn recognise<const A: usize, const E: usize, const C: usize>(
        &self,
        model: &ArrayModel<A, E>,
        template: &Template,
        channels: &[u8],
        folded: &mut Folded<'_>,
        levels: &Levels,
        effort: &Effort,
    ) -> Option<Vec<Seen, FITTED>> {
        const { assert!(C == A * E) };
        let Levels {
            floor, noise, to_lsb, ..
        } = *levels;
        // Channels, and arrays that have one of them: each as many.
        let count = channels.len().clamp(1, FOLDED_CHANNELS);
        let arrays = count.min(A);
        let each = (count / arrays) as f32;
        // Amplitudes are half as large in the folded taps, and only some channels add up.
        let to_full = 4.0 * C as f32 / count as f32;
        let least = SHARE * floor / to_full;
        // Each array's gain has the noise of its channels' mean, half as strong as in full taps.
        let of_noise = 0.5 * arrays as f32 * noise;
        let mut matches: Vec<Match<A, E>, FITTED> = Vec::new();
        for (index, known) in self.paths.iter().enumerate() {
            // A path half-way between two taps shows 0.4 of its power in each.
            let near = known.delay_taps as usize;
            let power = |n: usize| folded.profile[n & (FOLDED_TAPS - 1)];
            // What no beam has shown over the floor is not expected to matter here: often it is a blend, which a joint fit would
            // set against the paths that it blends. Were it strong here, it would remain.
            if known.energy * to_lsb < floor || (power(near).max(power(near + 1)) as f32) < HALF_WAY * least {
                continue;
            }
            let found = Match::new(model, template, channels, folded, index, known);
            if each * found.power() < least + of_noise {
                continue;
            }
            if let Err(found) = matches.push(found) {
                let weakest = matches.iter_mut().min_by(|a, b| a.power().total_cmp(&b.power()));
                if let Some(weakest) = weakest.filter(|weakest| weakest.power() < found.power()) {
                    *weakest = found;
                }
            }
        }
        for array in 0..A {
            separate(template, channels, array, &mut matches);
        }
        let mut seen = Vec::new();
        for found in &matches {
            let energy = to_full * (each * found.power() - of_noise).max(0.0);
            let before = self
                .paths
                .get(found.index)
                .map_or(0.0, |known| known.energy * to_lsb);
            if energy > floor.max(BETTER * before) {
                return None;
            }
            // As many as matches.
            let _ = seen.push(Seen {
                index: found.index,
                energy,
            });
        }
        let mut taps = 0;
        for found in &matches {
            taps += found.take_out(template, channels, folded, 0.25 * floor / C as f32);
        }
        effort.spend(Work::Recognise {
            paths: matches.len(),
            taps,
        });
        Some(seen)
    }
}

#[cfg(test)]
mod tests;
