//! Clusters of close paths that a sweep has resolved, recalled in the beams that follow.
//!
//! All beams hear the same paths, each with other gains. Telling three or four close paths apart takes joint fits from several
//! starts, with local optima between them; once one beam has done it, the next ones need the gains, and a few steps from
//! where the paths are known to lie. So the groups of a beam are remembered with how well their fit went, and where a candidate
//! shows, the remembered cluster that explains most is fitted first. What it leaves is searched for as ever.
//!
//! Where errors of the arrays' calibration leave more than noise beside a path, what passed for a path in one beam may be made of
//! them; recalled, it would pass in all. There nothing is recalled.

use heapless::Vec;

use super::beam::{Beam, Found, Search};
use super::cancel::{Change, taps_between};
use super::cholesky::regular;
use super::fit::{Fit, Place};
use super::group::{MEMBERS, is_sound, without};
use super::meter::{Meter, Stage, within};
use super::split::are_two_walls;
use super::starts::apart;
use super::window::Window;
use crate::bounded::gather;
use crate::waveform::SAMPLES;

/// Clusters remembered; when full, the one worth least gives way.
const MOST: usize = 8;
/// A candidate may belong to a cluster when one of its members is this near in delay, taps.
const NEAR_TAPS: f32 = 1.0;
/// Share of the energy that a recalled cluster may leave beyond noise: the search goes on from there, as it does from a path.
const LEFT: f32 = 0.01;
/// The same when the sweep has taken much already: the search could not do better any more.
const LEFT_THRIFTY: f32 = 0.1;
/// Steps from where the members are known to lie.
const STEPS: usize = 6;
/// Taps on both sides of a path over which what its fit left is measured.
const AROUND: i32 = 3;

/// Paths that were fitted together in one beam.
#[derive(Clone, Debug)]
struct Cluster {
    /// Delays in taps from tap `origin`.
    places: Vec<Place, MEMBERS>,
    origin: usize,
    /// Energy over what the fit left, in units of noise: the more, the better the places are known.
    weight: f32,
}

impl Cluster {
    /// Members with delays from another origin, the shorter way round the period.
    fn seen_from(&self, origin: usize) -> impl Iterator<Item = Place> + '_ {
        let between = taps_between(origin, self.origin);
        self.places.iter().map(move |place| Place {
            delay_taps: place.delay_taps + between,
            u: place.u,
        })
    }

    /// How far the member nearest to a delay is from it, taps.
    fn nearest(&self, origin: usize, delay_taps: f32) -> f32 {
        self.seen_from(origin)
            .map(|place| (place.delay_taps - delay_taps).abs())
            .fold(f32::INFINITY, f32::min)
    }
}

/// The clusters of a sweep so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Clusters {
    all: Vec<Cluster, MOST>,
}

impl Clusters {
    pub(super) fn clear(&mut self) {
        self.all.clear();
    }

    /// Remembers the groups of several paths that the search of a beam found. `profile` is what it left, `noise` the variance of a
    /// tap of one of `channels`, `scale` turns squared LSB into units that all beams share, and clusters nearer than `close_taps` in delay
    /// are the same one.
    pub(super) fn learn<const A: usize>(
        &mut self,
        found: &[Found<A>],
        profile: &[u64; SAMPLES],
        (noise, channels, scale): (f32, usize, f32),
        close_taps: f32,
    ) {
        for (index, first) in found.iter().enumerate() {
            let earlier = found.get(..index).unwrap_or_default();
            if first.remainder || earlier.iter().any(|f| f.group == first.group && !f.remainder) {
                continue;
            }
            let origin = first.source.origin;
            let mut places = Vec::new();
            let (mut power, mut left) = (0.0, 1.0_f32);
            for member in found.iter().filter(|f| f.group == first.group && !f.remainder) {
                let place = member.source.place(origin);
                power += member.source.power();
                left = left.max(around(profile, origin, place.delay_taps) / (channels as f32 * noise));
                // A group has no more members than a cluster.
                let _ = places.push(place);
            }
            if places.len() > 1 {
                let weight = power * scale / left;
                self.enter(
                    Cluster {
                        places,
                        origin,
                        weight,
                    },
                    close_taps,
                );
            }
        }
    }

    /// The best known of the clusters of two paths near a tap, delays from there.
    fn pair(&self, tap: usize) -> Option<[Place; 2]> {
        let near = |c: &&Cluster| c.places.len() == 2 && c.nearest(tap, 0.0) <= NEAR_TAPS;
        let best = self
            .all
            .iter()
            .filter(near)
            .max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        let mut places = best.seen_from(tap);
        Some([places.next()?, places.next()?])
    }

    /// Takes the place of a cluster of as many members at that delay, when it is worth more.
    fn enter(&mut self, new: Cluster, close_taps: f32) {
        let delay = new.places.first().map_or(0.0, |place| place.delay_taps);
        let same = self
            .all
            .iter_mut()
            .find(|c| c.places.len() == new.places.len() && c.nearest(new.origin, delay) < close_taps);
        if let Some(cluster) = same {
            if new.weight > cluster.weight {
                *cluster = new;
            }
        } else if let Err(new) = self.all.push(new) {
            let least = self.all.iter_mut().min_by(|a, b| a.weight.total_cmp(&b.weight));
            if let Some(least) = least.filter(|least| least.weight < new.weight) {
                *least = new;
            }
        }
    }
}

/// Mean power of the taps around a delay.
fn around(profile: &[u64; SAMPLES], origin: usize, delay_taps: f32) -> f32 {
    let middle = libm::roundf(delay_taps) as i32;
    let sum: f32 = (-AROUND..=AROUND)
        .map(|k| profile[origin.wrapping_add_signed((middle + k) as isize) & (SAMPLES - 1)] as f32)
        .sum();
    sum / (2 * AROUND + 1) as f32
}

impl<const A: usize, const E: usize, T: Meter> Search<'_, A, E, T> {
    /// Takes out the cluster that explains a candidate at `tap`, if one that the sweep knows does. Returns whether it did. Beside
    /// paths that this beam has shown already, a candidate joins them instead ([`super::group`]).
    pub(super) fn recall<const C: usize>(&self, beam: &mut Beam<'_, A, C>, tap: usize, noise: f32) -> bool {
        let close = |f: &Found<A>| !f.remainder && self.are_close(f.source.delay_from(tap));
        if beam.found.iter().any(close) {
            return false;
        }
        within(self.meter, Stage::JointFit, || {
            let mut best: Option<(f32, Vec<Place, MEMBERS>)> = None;
            for cluster in &self.clusters.all {
                if cluster.nearest(tap, 0.0) > NEAR_TAPS {
                    continue;
                }
                let mut places = gather(cluster.seen_from(tap));
                if let Some(left) = self.heard(beam, tap, &mut places, noise)
                    && best.as_ref().is_none_or(|(least, _)| left < *least)
                {
                    best = Some((left, places));
                }
            }
            match best.as_ref().map(|(_, places)| places.as_slice()) {
                Some(&[a, b]) => self.take_cluster::<2, 6, C>(beam, tap, [a, b], noise),
                Some(&[a, b, c]) => self.take_cluster::<3, 9, C>(beam, tap, [a, b, c], noise),
                Some(&[a, b, c, d]) => self.take_cluster::<4, 12, C>(beam, tap, [a, b, c, d], noise),
                _ => false,
            }
        })
    }

    /// Keeps of a cluster the members that this beam hears where they lie, and returns the share of the energy that they leave. None
    /// where errors of the arrays may pass for members.
    fn heard<const C: usize>(
        &self,
        beam: &Beam<'_, A, C>,
        tap: usize,
        places: &mut Vec<Place, MEMBERS>,
        noise: f32,
    ) -> Option<f32> {
        let mut window = Window::new();
        self.gather(&mut window, beam, tap, places, &[]);
        let content = window.content();
        if !self.arrays_are_exact(&content, noise) {
            return None;
        }
        let mut all = self.explained(&window, places, 0, noise);
        while places.len() > 1 {
            let mut least = self.worth_of_member(noise, all);
            let mut idle = None;
            for i in 0..places.len() {
                let others = without(places, i);
                let share = all - self.explained(&window, &others, 0, noise);
                if share < least {
                    (least, idle) = (share, Some(others));
                }
            }
            let Some(others) = idle else {
                break;
            };
            *places = others;
            all -= least;
        }
        Some((content.energy - all) / content.energy)
    }

    /// Fits a cluster's members from where they lie and takes them out, if that leaves little. Where it leaves more than noise, and four
    /// paths that beams which hear them less well take for a pair do not, those are taken ([`super::split`]).
    fn take_cluster<const L: usize, const D: usize, const C: usize>(
        &self,
        beam: &mut Beam<'_, A, C>,
        tap: usize,
        places: [Place; L],
        noise: f32,
    ) -> bool {
        if !beam.has_room(L) {
            return false;
        }
        let mut window = Window::new();
        self.gather(&mut window, beam, tap, &places, &[]);
        let mut fit: Fit<L, D, A> = self.fit(&window, places, noise, STEPS);
        if !regular(&fit.hessian) {
            fit = self.fit(&window, apart(&fit.places), noise, STEPS);
        }
        let content = window.content();
        let most = self.unexplained(&content, noise);
        if content.energy - fit.energy > most
            && !self.effort.is_spent()
            && beam.has_room(MEMBERS)
            && self.may_split(&content, noise)
            && let Some(pair) = self.clusters.pair(tap).filter(are_two_walls)
            && let Some(four) = self.both_split(&window, &content, &pair, noise)
        {
            self.take_fit(beam, tap, &four, noise);
            return true;
        }
        let share = if self.effort.is_thrifty() {
            LEFT_THRIFTY
        } else {
            LEFT
        };
        let little = content.energy - fit.energy <= most.max(share * content.energy);
        let taken = little && is_sound(&fit);
        if taken {
            self.take_fit(beam, tap, &fit, noise);
        }
        taken
    }

    /// Takes the paths of a fit out as a group of their own.
    fn take_fit<const L: usize, const D: usize, const C: usize>(
        &self,
        beam: &mut Beam<'_, A, C>,
        tap: usize,
        fit: &Fit<L, D, A>,
        noise: f32,
    ) {
        let group = beam.found.len() as u8;
        let found: [Found<A>; L] = core::array::from_fn(|i| self.found(fit, i, tap, noise, group));
        self.change(beam, &found, Change::Subtract);
        for found in found {
            // There is room: asked before the fit.
            let _ = beam.found.push(found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ltd::cancel::Source;
    use nalgebra::{Complex, Vector3};

    const CLOSE_TAPS: f32 = 3.3;

    fn member(origin: usize, delay_taps: f32, gain: f32, group: u8) -> Found<4> {
        Found {
            source: Source {
                origin,
                delay_taps,
                u: Vector3::x(),
                gains: [Complex::new(gain, 0.0); 4],
            },
            spread: [[0.0; 3]; 3],
            group,
            remainder: false,
            noise: 1.0,
        }
    }

    fn learn(clusters: &mut Clusters, found: &[Found<4>], left: u64) {
        clusters.learn(found, &[left; SAMPLES], (1.0, 32, 1.0), CLOSE_TAPS);
    }

    #[test]
    fn a_cluster_is_seen_round_the_end_of_the_period() {
        let mut clusters = Clusters::default();
        learn(
            &mut clusters,
            &[member(510, 0.5, 10.0, 0), member(1, -0.5, 10.0, 0)],
            32,
        );
        let [cluster] = clusters.all.as_slice() else {
            panic!("one cluster: {clusters:?}");
        };
        let delays: Vec<f32, 4> = gather(cluster.seen_from(2).map(|place| place.delay_taps));
        assert_eq!(delays, [-3.5, -1.5]);
        assert_eq!(cluster.nearest(511, 0.0), 0.5);
    }

    #[test]
    fn only_paths_that_were_told_apart_are_remembered() {
        let mut clusters = Clusters::default();
        let remainder = Found {
            remainder: true,
            ..member(100, 1.0, 10.0, 0)
        };
        learn(
            &mut clusters,
            &[member(100, 0.0, 10.0, 0), remainder, member(200, 0.0, 10.0, 2)],
            32,
        );
        assert!(clusters.all.is_empty(), "{clusters:?}");
    }

    /// The one of as many members whose energy stands out more of what its fit left; pairs and triples are kept beside each other.
    #[test]
    fn the_better_known_cluster_stays() {
        let pair = |delay: f32, gain: f32| [member(100, 0.0, gain, 0), member(100, delay, gain, 0)];
        let mut clusters = Clusters::default();
        let second = |clusters: &Clusters| clusters.all[0].places[1].delay_taps;
        learn(&mut clusters, &pair(0.5, 10.0), 32);
        learn(&mut clusters, &pair(0.6, 20.0), 32);
        assert_eq!((clusters.all.len(), second(&clusters)), (1, 0.6), "stronger");
        learn(&mut clusters, &pair(0.7, 30.0), 320);
        assert_eq!(
            second(&clusters),
            0.6,
            "stronger, but its fit left ten times the noise"
        );
        let [a, b] = pair(0.5, 1.0);
        learn(&mut clusters, &[a, b, member(101, 0.0, 1.0, 0)], 32);
        assert_eq!(clusters.all.len(), 2, "a triple says something else");
    }

    #[test]
    fn when_full_the_one_worth_least_gives_way() {
        let mut clusters = Clusters::default();
        for i in 0..MOST + 1 {
            let at = 50 * i;
            let gain = if i == 3 { 2.0 } else { 10.0 };
            learn(
                &mut clusters,
                &[member(at, 0.0, gain, 0), member(at, 1.0, gain, 0)],
                32,
            );
        }
        let origins: Vec<usize, MOST> = gather(clusters.all.iter().map(|c| c.origin));
        assert!(clusters.all.is_full() && !origins.contains(&150) && origins.contains(&400));
    }
}
