//! Search of one transmit beam: peaks, strongest first, each scored off the grid and cancelled; close pairs jointly.
//!
//! The loop is that of signal.md section 3.1. A peak near a path that is already known (4 m in delay) is fitted
//! together with it, and near the strongest path a second one is tried even where the residual stays under the
//! threshold: a greedy single fit of two close paths is off by decimetres (section 3.3). A second path stays only when
//! it explains enough energy. Afterwards every path that others' sidelobes could have pulled is refitted once with the
//! others cancelled.

use heapless::Vec;


use super::cancel::{Change, Source, change};
use super::detector::Detector;
use super::fit::{Fit, Place, REACH, fit, solve};
use super::grid::AngleGrid;
use super::model::ArrayModel;
use super::stages::Channel;
use super::tables::SAMPLES;
use super::template::Template;
use super::window::{PAIR, SINGLE, Window};

/// Paths kept in a beam.
pub(super) const PATHS_PER_BEAM: usize = 5;
/// Sources cancelled in a beam: paths, and remains of paths that the arrays' errors leave behind.
pub(super) const SOURCES: usize = 8;

/// Paths nearer than this in delay are fitted jointly, whatever their directions: a single array sees only a cone, so
/// even opposite directions mix. (signal.md section 3.1 asks for 3 m and 45 degrees; that leaves false paths beside
/// two strong ones of equal delay.)
const CLOSE_M: f32 = 4.0;
/// Taps around the strongest path where a second one is tried.
const TRIAL_REACH: usize = 3;
/// A candidate stands out of the profile's noise by at least this many standard deviations: half the beams of noise have
/// one. The fit decides.
const CANDIDATE_SIGMAS: f32 = 3.0;
/// A second path must explain this many times the noise variance (log-likelihood). Eleven more parameters explain 5.5 on
/// average, and under 20 in all but one of 1e4 cases, the search over the window included.
const PAIR_GAIN: f32 = 25.0;
/// And this share of the first one's energy: 30 dB, where 2 degrees of element phase error put the remains of a path.
const PAIR_SHARE: f32 = 1e-3;
/// Residual of a joint fit beyond noise, in standard deviations, that asks for another start.
const RESIDUAL_SIGMAS: f32 = 4.0;
/// Others' sidelobes that may stay under a path without a refit, in noise variances.
const LEAKAGE: f32 = 0.02;

/// Steps of a single and of a joint fit.
const SINGLE_STEPS: usize = 6;
const JOINT_STEPS: usize = 24;

/// A path found in a beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found<const A: usize> {
    pub(super) source: Source<A>,
    /// Inverse Hessian over (delay in taps, two angles in rad); times noise / (2 occupancy) it is the covariance.
    pub(super) spread: [[f32; 3]; 3],
    /// The other one of a jointly fitted pair.
    partner: Option<usize>,
    /// Not a path: what a path's model could not explain.
    pub(super) remainder: bool,
    /// Noise that set the reach of its cancellation.
    noise: f32,
}

/// Immutable tools of the search.
#[derive(Clone, Copy)]
pub(super) struct Search<'a, const A: usize, const E: usize> {
    pub(super) model: &'a ArrayModel<A, E>,
    pub(super) template: &'a Template,
    pub(super) grid: &'a AngleGrid<A>,
    /// Noise floor of the profile.
    pub(super) detector: &'a Detector,
    /// A candidate is a path when its fit explains this many noise variances.
    pub(super) threshold: f32,
}

/// The beam under search: residual taps, their profile, and what was found.
pub(super) struct Beam<'a, const A: usize, const C: usize> {
    pub(super) taps: &'a mut [Channel; C],
    pub(super) profile: &'a mut [u64; SAMPLES],
    pub(super) found: &'a mut Vec<Found<A>, SOURCES>,
}

impl<const A: usize, const E: usize> Search<'_, A, E> {
    /// Finds the paths of a beam with at least `floor` of energy (squared LSB over all channels). Returns the noise
    /// variance of a tap that remains. `beam.found` must be empty.
    pub(super) fn run<const C: usize>(&self, beam: &mut Beam<'_, A, C>, floor: f32) -> f32 {
        while beam.found.len() < SOURCES && beam.paths() < PATHS_PER_BEAM {
            let noise = self.detector.noise(beam.profile);
            let Some(tap) = candidate::<C>(beam.profile, 0..SAMPLES, noise) else {
                break;
            };
            let source = self.single(beam, tap, noise);
            let energy = source.source.power() * C as f32;
            if energy < floor || energy < self.threshold * noise {
                break;
            }
            match beam.neighbour(&source.source, self.model.metres_per_tap()) {
                Some(near) => {
                    if !self.try_pair(beam, near, &source.source, noise) {
                        let remainder = Found {
                            remainder: true,
                            ..source
                        };
                        self.take_out(beam, remainder);
                    }
                }
                None => {
                    self.take_out(beam, source);
                    if beam.found.len() == 1 {
                        self.trial(beam);
                    }
                }
            }
        }
        self.refit_pulled(beam);
        self.detector.noise(beam.profile)
    }

    /// Scores one path that shows at `tap`.
    fn single<const C: usize>(&self, beam: &Beam<'_, A, C>, tap: usize, noise: f32) -> Found<A> {
        let window = self.window::<C, SINGLE>(beam, tap, -REACH, REACH);
        let delay_taps = vertex(beam.profile, tap);
        let snapshot = window.snapshot(self.template, delay_taps);
        let u = self.grid.strongest::<E, C>(&snapshot);
        self.score(&window, Place { delay_taps, u }, noise)
    }

    fn score<const C: usize, const W: usize>(
        &self,
        window: &Window<C, W>,
        start: Place,
        noise: f32,
    ) -> Found<A> {
        let fit: Fit<1, 3, A> =
            fit::<1, 3, A, E, C, W>(self.model, self.template, window, [start], noise, SINGLE_STEPS);
        self.found(&fit, 0, window.origin(), noise)
    }

    fn found<const L: usize, const D: usize>(
        &self,
        fit: &Fit<L, D, A>,
        index: usize,
        origin: usize,
        noise: f32,
    ) -> Found<A> {
        let place = fit.places[index];
        Found {
            source: Source {
                origin,
                delay_taps: place.delay_taps,
                u: place.u,
                gains: fit.gains[index],
            },
            spread: spread(&fit.hessian, index),
            partner: None,
            remainder: false,
            noise,
        }
    }

    fn window<const C: usize, const W: usize>(
        &self,
        beam: &Beam<'_, A, C>,
        origin: usize,
        first: i32,
        last: i32,
    ) -> Window<C, W> {
        Window::load(beam.taps, origin, first, last, self.template.centre_turns())
    }

    /// Cancels a source and remembers it.
    fn take_out<const C: usize>(&self, beam: &mut Beam<'_, A, C>, found: Found<A>) {
        self.change(beam, &found, Change::Subtract);
        // The caller left room; a full list would only mean that the source is not reported.
        let _ = beam.found.push(found);
    }

    fn change<const C: usize>(&self, beam: &mut Beam<'_, A, C>, found: &Found<A>, way: Change) {
        change(
            self.model,
            self.template,
            beam.taps,
            beam.profile,
            &found.source,
            found.noise,
            way,
        );
    }

    /// Tries a second path beside the first one found, from the residual's local peak.
    fn trial<const C: usize>(&self, beam: &mut Beam<'_, A, C>) {
        let Some(first) = beam.found.first().copied() else {
            return;
        };
        let start = first.source.origin.wrapping_sub(TRIAL_REACH) & (SAMPLES - 1);
        let noise = self.detector.noise(beam.profile);
        if let Some(tap) = candidate::<C>(beam.profile, start..start + 2 * TRIAL_REACH + 1, noise) {
            let second = self.single(beam, tap, noise);
            if beam
                .neighbour(&second.source, self.model.metres_per_tap())
                .is_some()
            {
                self.try_pair(beam, 0, &second.source, noise);
            }
        }
    }

    /// Fits path `first` together with a second source. Both are cancelled and kept when the second one explains enough;
    /// otherwise the beam is as it was.
    fn try_pair<const C: usize>(
        &self,
        beam: &mut Beam<'_, A, C>,
        first: usize,
        second: &Source<A>,
        noise: f32,
    ) -> bool {
        let Some(old) = beam.found.get(first).copied() else {
            return false;
        };
        self.change(beam, &old, Change::Add);
        let start = [old.source, *second].map(|s| s.place(old.source.origin));
        let window = self.pair_window(beam, old.source.origin, &start);
        let alone: Fit<1, 3, A> = fit::<1, 3, A, E, C, PAIR>(
            self.model,
            self.template,
            &window,
            [start[0]],
            noise,
            SINGLE_STEPS,
        );
        let both = self.best_pair(&window, start, noise);
        let gain = both.energy - alone.energy;
        let [a, b] = [0, 1].map(|i| self.found(&both, i, old.source.origin, noise));
        let enough = gain > PAIR_GAIN * noise / self.template.occupancy() && gain > PAIR_SHARE * alone.energy;
        let inside = [a, b].iter().all(|f| f.source.delay_taps.abs() < PAIR as f32);
        if !(enough && inside) || beam.found.is_full() {
            self.change(beam, &old, Change::Subtract);
            return false;
        }
        let index = beam.found.len();
        for (found, partner) in [(a, index), (b, first)] {
            self.change(beam, &found, Change::Subtract);
            let found = Found {
                partner: Some(partner),
                ..found
            };
            if partner == index {
                if let Some(slot) = beam.found.get_mut(first) {
                    *slot = found;
                }
            } else {
                let _ = beam.found.push(found);
            }
        }
        true
    }

    /// Joint fit from a start; where it leaves more than noise, also from other starts.
    fn best_pair<const C: usize>(
        &self,
        window: &Window<C, PAIR>,
        start: [Place; 2],
        noise: f32,
    ) -> Fit<2, 6, A> {
        let run = |start| fit::<2, 6, A, E, C, PAIR>(self.model, self.template, window, start, noise, JOINT_STEPS);
        let mut best = run(start);
        let (energy, samples) = window.energy();
        // Mean and standard deviation of noise that is oversampled by 1 / occupancy.
        let mean = samples as f32 * noise;
        let most = mean + RESIDUAL_SIGMAS * noise * libm::sqrtf(samples as f32 / self.template.occupancy());
        let [first, _] = start;
        let mut other = 0;
        while energy - best.energy > most && other < 3 {
            let at = |late: f32, u| Place { delay_taps: first.delay_taps + late, u };
            let start = match other {
                0 => {
                    let snapshot = window.snapshot(self.template, first.delay_taps);
                    let [a, b] = self.grid.strongest_pair::<E, C>(self.model, &snapshot);
                    [at(0.0, a), at(0.0, b)]
                }
                1 => [at(-0.2, first.u), at(0.2, first.u)],
                _ => [at(0.0, first.u), at(0.0, -first.u)],
            };
            let fit = run(start);
            if fit.energy > best.energy {
                best = fit;
            }
            other += 1;
        }
        best
    }

    fn pair_window<const C: usize>(
        &self,
        beam: &Beam<'_, A, C>,
        origin: usize,
        places: &[Place; 2],
    ) -> Window<C, PAIR> {
        let [a, b] = places.map(|place| place.delay_taps);
        let (first, last) = (a.min(b) as i32 - REACH, a.max(b) as i32 + 1 + REACH);
        self.window(beam, origin, first, last)
    }

    /// Refits, with everything else cancelled, each path under which others' sidelobes stood out of the noise.
    fn refit_pulled<const C: usize>(&self, beam: &mut Beam<'_, A, C>) {
        for index in 0..beam.found.len() {
            let Some(old) = beam.found.get(index).copied() else {
                return;
            };
            let other = old
                .partner
                .and_then(|p| beam.found.get(p).copied().map(|found| (p, found)));
            if other.is_some_and(|(p, _)| p < index) || !beam.pulled(index, self.template.occupancy()) {
                continue;
            }
            let origin = old.source.origin;
            self.change(beam, &old, Change::Add);
            match other {
                None => {
                    let place = old.source.place(origin);
                    let window = self.window::<C, SINGLE>(beam, origin, -REACH, REACH);
                    let new = Found {
                        remainder: old.remainder,
                        ..self.score(&window, place, old.noise)
                    };
                    self.put(beam, index, new);
                }
                Some((partner, second)) => {
                    self.change(beam, &second, Change::Add);
                    let start = [old.source, second.source].map(|s| s.place(origin));
                    let window = self.pair_window(beam, origin, &start);
                    let both: Fit<2, 6, A> = fit::<2, 6, A, E, C, PAIR>(
                        self.model,
                        self.template,
                        &window,
                        start,
                        old.noise,
                        JOINT_STEPS,
                    );
                    for (i, (slot, partner)) in [(index, partner), (partner, index)].into_iter().enumerate() {
                        let new = self.found(&both, i, origin, old.noise);
                        self.put(
                            beam,
                            slot,
                            Found {
                                partner: Some(partner),
                                ..new
                            },
                        );
                    }
                }
            }
        }
    }

    /// Cancels a refitted source and puts it in its old place.
    fn put<const C: usize>(&self, beam: &mut Beam<'_, A, C>, index: usize, found: Found<A>) {
        self.change(beam, &found, Change::Subtract);
        if let Some(slot) = beam.found.get_mut(index) {
            *slot = found;
        }
    }
}

impl<const A: usize, const C: usize> Beam<'_, A, C> {
    /// Paths found so far, without remainders.
    fn paths(&self) -> usize {
        self.found.iter().filter(|f| !f.remainder).count()
    }

    /// The strongest path that is close to a source.
    fn neighbour(&self, source: &Source<A>, metres_per_tap: f32) -> Option<usize> {
        let near = |f: &Found<A>| {
            let apart = source.place(f.source.origin).delay_taps - f.source.delay_taps;
            !f.remainder && apart.abs() * metres_per_tap < CLOSE_M
        };
        self.found.iter().position(near)
    }

    /// Whether others' sidelobes at a path's place exceed [`LEAKAGE`] before their cancellation. A pair counts as one.
    fn pulled(&self, index: usize, occupancy: f32) -> bool {
        let Some(path) = self.found.get(index) else {
            return false;
        };
        let mut leakage = 0.0;
        for (other, found) in self.found.iter().enumerate() {
            if other == index || path.partner == Some(other) {
                continue;
            }
            let apart = found.source.place(path.source.origin).delay_taps - path.source.delay_taps;
            let lobes = (core::f32::consts::PI * occupancy * apart.abs()).max(1.0);
            leakage += found.source.power() / (lobes * lobes);
        }
        leakage > LEAKAGE * path.noise
    }
}

impl<const A: usize> Source<A> {
    /// Place in the coordinates of another origin, the shorter way round the period.
    fn place(&self, origin: usize) -> Place {
        let half = SAMPLES / 2;
        let between =
            (self.origin.wrapping_sub(origin).wrapping_add(half) & (SAMPLES - 1)) as i32 - half as i32;
        Place {
            delay_taps: self.delay_taps + between as f32,
            u: self.u,
        }
    }
}

/// Three columns of the inverse Hessian that belong to path `index`.
fn spread<const D: usize>(hessian: &[[f32; D]; D], index: usize) -> [[f32; 3]; 3] {
    core::array::from_fn(|column| {
        let mut unit = [0.0; D];
        if let Some(one) = unit.get_mut(3 * index + column) {
            *one = 1.0;
        }
        let solved = solve(hessian, &unit, 0.0);
        core::array::from_fn(|row| solved.get(3 * index + row).copied().unwrap_or(0.0))
    })
}

/// Tap that stands out most, alone or with its neighbour (a path half-way between two shows in both), if it does so by
/// [`CANDIDATE_SIGMAS`]. `taps` may run over the period's end.
fn candidate<const C: usize>(profile: &[u64; SAMPLES], taps: core::ops::Range<usize>, noise: f32) -> Option<usize> {
    // Under noise a tap has mean C and standard deviation sqrt C noise variances; neighbours are nearly independent (their
    // correlation is D(1)^2 = 0.05).
    let mean = C as f32 * noise;
    let sigma = noise * libm::sqrtf(C as f32);
    let (alone, paired) = (1.0 / sigma, 1.0 / (core::f32::consts::SQRT_2 * sigma));
    let (mut best, mut most) = (None, CANDIDATE_SIGMAS);
    let excess = |n: usize| profile[n & (SAMPLES - 1)] as f32 - mean;
    let mut here = excess(taps.start);
    for n in taps {
        let next = excess(n + 1);
        let sum = (here + next) * paired;
        let (score, tap) = if sum > here * alone && here > next {
            (sum, n)
        } else if sum > here * alone {
            (sum, n + 1)
        } else {
            (here * alone, n)
        };
        if score > most {
            (best, most) = (Some(tap & (SAMPLES - 1)), score);
        }
        here = next;
    }
    best
}

/// Vertex of the parabola through a tap's power and its neighbours', taps from that tap, -0.5..=0.5.
fn vertex(profile: &[u64; SAMPLES], tap: usize) -> f32 {
    let at = |n: usize| profile[n & (SAMPLES - 1)] as f32;
    let (before, here, after) = (at(tap.wrapping_sub(1)), at(tap), at(tap.wrapping_add(1)));
    let bend = before - 2.0 * here + after;
    if bend < 0.0 {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}
