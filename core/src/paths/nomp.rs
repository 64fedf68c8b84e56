//! Search of one transmit beam: Newtonized orthogonal matching pursuit with a local joint refinement.
//!
//! Peaks of the power-delay profile, strongest first: each is placed on a coarse grid of directions, scored off the grid and
//! cancelled; one near paths that are known already is fitted jointly with them ([`super::group`]). Near the strongest path a second
//! one is tried even where the residual stays under the threshold: a greedy single fit of two close paths is off by decimetres.
//! At the end every path that others' sidelobes could have pulled is refitted once with the others cancelled
//! (docs/signal-model.md, "Path estimation").

use heapless::Vec;

use super::cancel::Change;
use super::cholesky::regular;
use super::effort::Work;
use super::fit::{Fit, REACH};
use super::meter::{Meter, Stage, within};
use super::place::Place;
use super::search::{Beam, Found, SINGLE_STEPS, Search, lobes};
use super::window::{SINGLE, Window};
use crate::paths::early_termination::least_excess;
use crate::signal::SAMPLES;

/// Paths kept in a beam.
/// Capacity: memory and work of a beam.
const PATHS_PER_BEAM: usize = 5;
/// Candidates looked at in a beam; some only improve what was found before.
/// Capacity: work of a beam.
const ATTEMPTS: usize = 12;
/// Taps that are passed over in a beam: the beam ends with one more.
/// Capacity: work of a beam.
const MISSED: usize = 4;
/// Of these, taps at which a fit found no path.
/// Capacity: work of a beam.
const MOST_REFUSED: usize = 2;
/// Taps around the strongest path where a second one is tried.
/// Capacity: work of a trial.
const TRIAL_REACH: usize = 3;
/// A candidate stands out of the profile's noise by at least this many standard deviations.
/// Derived: half the beams of noise have one. The fit decides.
const CANDIDATE_SIGMAS: f32 = 3.0;
/// A candidate is not fitted off the grid when the coarse grid explains less than this share of the energy asked for. Measured.
/// Measured: it does for 95 % of the candidates under noise, and for 1 in 1000 that a fit would have accepted at -24 to -18 dB.
const COARSE_SHARE: f32 = 0.7;
/// A peak is a known path when that path's direction explains this share of what stands out of the noise.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const KNOWN_SHARE: f32 = 0.8;
/// Times the energy that makes a path at which its place is beyond doubt.
/// Measured: at -15 dB one in a thousand is in another lobe.
const SURE: f32 = 12.0;
/// Others' sidelobes that may stay under a path without a refit, in noise variances.
/// Numerical: a fiftieth of the noise moves no fit.
const LEAKAGE: f32 = 0.02;

impl<const A: usize, const E: usize, M: Meter> Search<'_, A, E, M> {
    /// Finds the paths of a beam with at least the floor's energy, and all that the sweep's work allows. Returns the noise variance of a
    /// tap that remains. `beam.found` must be empty.
    pub(super) fn run<const C: usize>(&self, beam: &mut Beam<'_, A, C>) -> f32 {
        let floor = self.levels.floor;
        let mut missed: Vec<usize, MISSED> = Vec::new();
        let mut refused = 0;
        let mut noise = self.settle(beam);
        for _ in 0..ATTEMPTS {
            let is_spent = self.effort.is_spent() && !beam.found.is_empty();
            if is_spent || beam.found.is_full() || beam.paths() >= PATHS_PER_BEAM {
                break;
            }
            let Some((tap, excess)) = candidate::<C>(beam.profile, 0..SAMPLES, noise, &missed) else {
                break;
            };
            if excess < least_excess(floor, noise, C as f32) {
                // The strongest candidate cannot reach the floor, so none does.
                break;
            }
            if excess < self.errors_of::<C>(beam.found.iter(), tap, 0.0) {
                // What errors of the arrays leave of the paths found there.
                if missed.push(tap).is_err() {
                    break;
                }
                continue;
            }
            let least = self.levels.threshold * noise;
            let found = self.single(beam, tap, noise, COARSE_SHARE * least.max(floor));
            let energy = found.map(|f| f.source.power() * C as f32);
            if energy.map_or(floor > least, |energy| energy < floor) {
                break;
            }
            let Some(found) = found.filter(|_| energy >= Some(least)) else {
                refused += 1;
                if refused > MOST_REFUSED || missed.push(tap).is_err() {
                    break;
                }
                continue;
            };
            match self.neighbours(beam, &found.source) {
                Some(group) => {
                    if !self.join(beam, group, &found.source, noise) {
                        self.take_out(
                            beam,
                            Found {
                                remainder: true,
                                ..found
                            },
                        );
                    }
                }
                None => {
                    self.take_out(beam, found);
                    if beam.found.len() == 1 && !self.effort.is_spent() {
                        self.trial(beam);
                    }
                }
            }
            noise = self.settle(beam);
        }
        if within(self.meter, Stage::Cyclic, || self.refit_pulled(beam)) {
            noise = self.settle(beam);
        }
        noise
    }

    /// Scores one path that shows at `tap`. None where its place cannot be told (one array alone sees only a cone), or where
    /// the coarse grid explains less energy than `least`.
    fn single<const C: usize>(
        &self,
        beam: &Beam<'_, A, C>,
        tap: usize,
        noise: f32,
        least: f32,
    ) -> Option<Found<A>> {
        let outer = self.meter.enter(Stage::CoarseGrid);
        self.effort.spend(Work::Grid);
        let mut window = Window::<C, SINGLE>::new();
        window.load(beam.taps, tap, -REACH, REACH, self.template.centre_turns());
        let at = |n: usize| beam.profile[n & (SAMPLES - 1)] as f32;
        let delay_taps = vertex([at(tap.wrapping_sub(1)), at(tap), at(tap.wrapping_add(1))]);
        let snapshot = window.snapshot(self.template, delay_taps);
        let all: f32 = snapshot.iter().map(|z| z.norm_sqr()).sum();
        let stands_out = all - C as f32 * noise;
        let enough = least.max(KNOWN_SHARE * stands_out);
        let sure = SURE * self.levels.threshold * noise;
        let start = self
            .known
            .near(tap, delay_taps, sure / self.levels.to_lsb)
            .filter(|known| self.model.explained::<C>(&snapshot, &known.u) >= enough)
            .or_else(|| {
                let u = self.grid.promising::<E, C>(&snapshot, least)?;
                Some(Place { delay_taps, u })
            });
        let found = start.and_then(|start| {
            self.meter.enter(Stage::Refine);
            let fit: Fit<1, 3, A> = self.fit::<1, 3, C, SINGLE>(&window, [start], noise, SINGLE_STEPS);
            // A group of its own.
            regular(&fit.hessian).then(|| self.found(&fit, 0, tap, noise, beam.found.len() as u8))
        });
        self.meter.enter(outer);
        found
    }

    /// Cancels a source and remembers it.
    fn take_out<const C: usize>(&self, beam: &mut Beam<'_, A, C>, found: Found<A>) {
        let reach = self.reach(found.source.amplitude(), found.noise);
        self.change(beam, &[found], reach, Change::Subtract);
        // The caller left room; a full list would only mean that the source is not reported.
        let _ = beam.found.push(found);
    }

    /// Tries a second path beside the first one found, from the residual's local peak.
    fn trial<const C: usize>(&self, beam: &mut Beam<'_, A, C>) {
        let Some(first) = beam.found.first().copied() else {
            return;
        };
        let start = first.source.origin.wrapping_sub(TRIAL_REACH) & (SAMPLES - 1);
        let noise = self.detector.noise(beam.profile);
        let around = start..start + 2 * TRIAL_REACH + 1;
        if let Some((tap, _)) = candidate::<C>(beam.profile, around, noise, &[])
            && let Some(second) = self.single(beam, tap, noise, 0.0)
            && self.neighbours(beam, &second.source) == Some(first.group)
        {
            self.join(beam, first.group, &second.source, noise);
        }
    }

    /// Refits, with everything else cancelled, each group with a path under which others' sidelobes stood out of the noise.
    /// Returns whether there was one.
    fn refit_pulled<const C: usize>(&self, beam: &mut Beam<'_, A, C>) -> bool {
        let mut pulled = false;
        for index in 0..beam.found.len() {
            let Some(found) = beam.found.get(index).copied() else {
                break;
            };
            if beam.is_first(index, found.group) && beam.pulled(found.group, self.template.occupancy()) {
                let noise = self.detector.noise(beam.profile);
                self.refit(beam, found.group, noise);
                pulled = true;
            }
        }
        pulled
    }
}

impl<const A: usize, const C: usize> Beam<'_, A, C> {
    /// Whether sidelobes of other groups at a path of this group exceed [`LEAKAGE`] before their cancellation.
    fn pulled(&self, group: u8, occupancy: f32) -> bool {
        self.found.iter().filter(|f| f.group == group).any(|path| {
            let others = self.found.iter().filter(|f| f.group != group);
            let leakage: f32 = others
                .map(|other| {
                    let apart = other.source.place(path.source.origin).delay_taps - path.source.delay_taps;
                    other.source.power() / lobes(occupancy * apart)
                })
                .sum();
            leakage > LEAKAGE * path.noise
        })
    }
}

/// Tap that stands out most, alone or with its neighbour (a path half-way between two shows in both), if it does so by
/// [`CANDIDATE_SIGMAS`], and what no two neighbouring taps exceed the noise's mean by. `taps` may run over the period's end.
fn candidate<const C: usize>(
    profile: &[u64; SAMPLES],
    taps: core::ops::Range<usize>,
    noise: f32,
    missed: &[usize],
) -> Option<(usize, f32)> {
    // Under noise a tap has mean C and standard deviation sqrt C noise variances; neighbours are nearly independent (their
    // correlation is D(1)^2 = 0.05).
    let mean = C as f32 * noise;
    let sigma = noise * libm::sqrtf(C as f32);
    let (alone, paired) = (1.0 / sigma, 1.0 / (core::f32::consts::SQRT_2 * sigma));
    let (mut best, mut most) = (None, CANDIDATE_SIGMAS);
    let power = |n: usize| profile[n & (SAMPLES - 1)];
    let excess = |power: u64| power as f32 - mean;
    // Few taps come near a score: two neighbours that both lie under this are passed over in integers, with a tenth of a standard
    // deviation to spare, and what rounding takes.
    let low =
        |score: f32| (mean + core::f32::consts::FRAC_1_SQRT_2 * (0.999_99 * score - 0.1) * sigma) as u64;
    let mut level = low(most);
    let mut next = power(taps.start);
    for n in taps {
        let here = next;
        next = power(n + 1);
        if here <= level && next <= level {
            continue;
        }
        let (here, next) = (excess(here), excess(next));
        let sum = (here + next) * paired;
        let (score, tap) = if sum > here * alone && here > next {
            (sum, n)
        } else if sum > here * alone {
            (sum, n + 1)
        } else {
            (here * alone, n)
        };
        if score > most && !missed.contains(&(tap & (SAMPLES - 1))) {
            (best, most) = (Some(tap & (SAMPLES - 1)), score);
            level = low(most);
        }
    }
    best.map(|tap| (tap, most / paired))
}

/// Vertex of the parabola through a peak and its neighbours, steps from the peak, -0.5..=0.5.
pub(super) fn vertex([before, here, after]: [f32; 3]) -> f32 {
    let bend = before - 2.0 * here + after;
    if bend < 0.0 {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}
