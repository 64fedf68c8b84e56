//! Groups: paths so close in delay that they must be fitted jointly, at most four.
//!
//! A candidate near a group is tried as one more member: all members are put back, refitted with and without it, and it
//! stays when it explains enough more, in noise variances and against what errors of the arrays' calibration would leave
//! beside the others. Two close paths have local optima: where a joint fit leaves more than noise, it is started again from
//! other places ([`super::starts`]).

use super::cancel::{Change, Source};
use super::cholesky::regular;
use super::fit::{Fit, REACH};
use super::meter::{Meter, Stage, within};
use super::place::Place;
use super::search::{Beam, Found, SINGLE_STEPS, Search};
use super::window::{JOINT, Window};
use crate::paths::multi_start::JOINT_STEPS;

/// Paths nearer than this in delay form a group, whatever their directions: a single array sees only a cone, so even
/// opposite directions mix. (3 m and 45 degrees would suit two paths alone; that leaves false paths beside two strong
/// ones of equal delay.)
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const CLOSE_M: f32 = 4.0;
/// One more path must explain this many times the noise variance (log-likelihood).
/// Derived: eleven more parameters explain 5.5 on average, and of noise one in 1.6 million explains as much (chi-square, 50).
const MEMBER_GAIN: f32 = 25.0;
/// Factor by which the noise may have fallen since a joint fit.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const UNSETTLED: f32 = 1.3;

impl<const A: usize, const E: usize, T: Meter> Search<'_, A, E, T> {
    /// Whether paths so far apart in delay are fitted jointly.
    fn are_close(&self, apart_taps: f32) -> bool {
        apart_taps.abs() * self.model.metres_per_tap() < CLOSE_M
    }

    /// The group to which a source is close: to all of its members.
    pub(super) fn neighbours<const C: usize>(&self, beam: &Beam<'_, A, C>, source: &Source<A>) -> Option<u8> {
        let close = |f: &Found<A>| self.are_close(source.delay_from(f.source.origin) - f.source.delay_taps);
        let paths = || beam.found.iter().filter(|f| !f.remainder);
        paths()
            .map(|f| f.group)
            .find(|group| paths().filter(|f| f.group == *group).all(close))
    }

    /// Fits the members of a group together with one more source, which stays when it explains enough. Returns whether
    /// anything changed; otherwise the beam is as it was.
    pub(super) fn join<const C: usize>(
        &self,
        beam: &mut Beam<'_, A, C>,
        group: u8,
        source: &Source<A>,
        noise: f32,
    ) -> bool {
        let members = beam.members(group);
        if self.effort.is_spent() || (members.len() > 1 && !self.effort.allows_large_groups()) {
            return false;
        }
        within(self.meter, Stage::JointFit, || match *members.as_slice() {
            [a] => self.extend::<1, 3, 2, 6, C>(beam, [a], source, noise),
            [a, b] => self.extend::<2, 6, 3, 9, C>(beam, [a, b], source, noise),
            [a, b, c] => self.extend::<3, 9, 4, 12, C>(beam, [a, b, c], source, noise),
            _ => false,
        })
    }

    /// Refits the members of a group.
    pub(super) fn refit<const C: usize>(&self, beam: &mut Beam<'_, A, C>, group: u8, noise: f32) {
        let members = beam.members(group);
        match *members.as_slice() {
            [a] => self.again::<1, 3, C>(beam, [a], noise),
            [a, b] => self.again::<2, 6, C>(beam, [a, b], noise),
            [a, b, c] => self.again::<3, 9, C>(beam, [a, b, c], noise),
            [a, b, c, d] => self.again::<4, 12, C>(beam, [a, b, c, d], noise),
            _ => {}
        }
    }

    /// Refits the groups of several members that were fitted when the sidelobes of what was not yet cancelled passed for
    /// noise: their fits ended too early, or in a local optimum that nothing told from the noise. Returns the noise that remains.
    pub(super) fn settle<const C: usize>(&self, beam: &mut Beam<'_, A, C>) -> f32 {
        let mut noise = self.detector.noise(beam.profile);
        for index in 0..beam.found.len() {
            let Some(found) = beam.found.get(index).copied() else {
                break;
            };
            let several = || beam.members(found.group).len() > 1;
            if found.noise > UNSETTLED * noise && beam.is_first(index, found.group) && several() {
                self.refit(beam, found.group, noise);
                noise = self.detector.noise(beam.profile);
            }
        }
        noise
    }

    fn extend<const L: usize, const D: usize, const M: usize, const N: usize, const C: usize>(
        &self,
        beam: &mut Beam<'_, A, C>,
        members: [usize; L],
        source: &Source<A>,
        noise: f32,
    ) -> bool {
        const { assert!(M == L + 1) };
        let Some(old) = beam.all(members) else {
            return false;
        };
        let origin = old[0].source.origin;
        let before: [Place; L] = old.map(|f| f.source.place(origin));
        let start: [Place; M] =
            core::array::from_fn(|i| before.get(i).copied().unwrap_or_else(|| source.place(origin)));
        let mut window = Window::new();
        self.gather(&mut window, beam, origin, &start, &old);
        let without: Fit<L, D, A> = self.fit(&window, before, noise, JOINT_STEPS);
        let Place { delay_taps, .. } = source.place(origin);
        let errors = self.errors_of::<C>(old.iter(), origin, delay_taps);
        let worth = (MEMBER_GAIN * noise / self.template.occupancy()).max(errors);
        // One more member explains at most what is left.
        if window.content().energy - without.energy <= worth {
            return false;
        }
        let with: Fit<M, N, A> = self.best(&window, start, noise);
        let is_worth_it = with.energy - without.energy > worth && is_sound(&with);
        if is_worth_it {
            self.replace(beam, &members, &with, &old, noise);
        }
        is_worth_it
    }

    /// Cancels the paths of a fit in the stead of a group's members and puts them in their places, a further one behind.
    fn replace<const L: usize, const D: usize, const M: usize, const C: usize>(
        &self,
        beam: &mut Beam<'_, A, C>,
        members: &[usize],
        fit: &Fit<L, D, A>,
        old: &[Found<A>; M],
        noise: f32,
    ) {
        let first = &old[0];
        let found: [Found<A>; L] =
            core::array::from_fn(|i| self.found(fit, i, first.source.origin, noise, first.group));
        // What changes is the difference: a member that hardly moves changes no far sidelobe.
        let amplitude = found.iter().enumerate().map(|(i, new)| match old.get(i) {
            Some(old) => new.source.difference(&old.source, self.model, self.template),
            None => new.source.amplitude(),
        });
        let reach = self.reach(amplitude.fold(0.0, f32::max), noise);
        if let ([new], [old]) = (found.as_slice(), old.as_slice()) {
            // In one go.
            let mut back = *old;
            back.source.gains = back.source.gains.map(|gain| -gain);
            self.change(beam, &[*new, back], reach, Change::Subtract);
        } else {
            self.change(beam, old, reach, Change::Add);
            self.change(beam, &found, reach, Change::Subtract);
        }
        for (i, found) in found.into_iter().enumerate() {
            match members.get(i).and_then(|index| beam.found.get_mut(*index)) {
                Some(slot) => *slot = found,
                None => {
                    // There is room: the search asks before it fits one more.
                    let _ = beam.found.push(found);
                }
            }
        }
    }

    fn again<const L: usize, const D: usize, const C: usize>(
        &self,
        beam: &mut Beam<'_, A, C>,
        members: [usize; L],
        noise: f32,
    ) {
        let Some(old) = beam.all(members) else {
            return;
        };
        let origin = old[0].source.origin;
        let start = old.map(|f| f.source.place(origin));
        let mut window = Window::new();
        self.gather(&mut window, beam, origin, &start, &old);
        let steps = if L == 1 { SINGLE_STEPS } else { JOINT_STEPS };
        let mut fit: Fit<L, D, A> = self.fit(&window, start, noise, steps);
        if L > 1 && self.arrays_are_exact(&window.content(), noise) {
            fit = self.better(&window, fit, noise);
        }
        if !regular(&fit.hessian) {
            return;
        }
        self.replace(beam, &members, &fit, &old, noise);
        for (index, old) in members.into_iter().zip(old) {
            if let Some(found) = beam.found.get_mut(index) {
                found.remainder = old.remainder;
            }
        }
    }

    /// Takes taps around some places into an empty window, with a group's members put back.
    fn gather<const M: usize, const C: usize>(
        &self,
        window: &mut Window<C, JOINT>,
        beam: &Beam<'_, A, C>,
        origin: usize,
        places: &[Place],
        members: &[Found<A>; M],
    ) {
        let (mut first, mut last) = (f32::INFINITY, f32::NEG_INFINITY);
        for place in places {
            first = first.min(place.delay_taps);
            last = last.max(place.delay_taps);
        }
        // The casts cut towards zero: never short by a tap on the side that matters.
        let (first, last) = (first as i32 - REACH, last as i32 + 1 + REACH);
        window.load(beam.taps, origin, first, last, self.template.centre_turns());
        for member in members {
            let (_, gains) = member.source.seen_from(origin, self.template.centre_turns());
            window.add(self.model, self.template, &member.source.place(origin), &gains);
        }
    }
}

/// Whether a fit ended in its window, with members that can be told apart.
fn is_sound<const L: usize, const D: usize, const A: usize>(fit: &Fit<L, D, A>) -> bool {
    fit.places.iter().all(|p| p.delay_taps.abs() < JOINT as f32) && regular(&fit.hessian)
}
