//! Merging of what the beams found: one path shows in many beams.
//!
//! Detections are taken strongest first. One that lies within the gates of a path already there (0.5 m and 6 degrees,
//! docs/signal-model.md, "Path estimation") is another look at it, unless the same beam has already resolved the two as different. Looks
//! that agree with the strongest one within their covariance are averaged by information; others are blends with a
//! neighbour that their beam could not resolve, and only tell that the path was seen there. So are those of beams that told fewer
//! paths apart than the strongest one's: a single fit of two paths is sure of a place where neither is, and surer than a joint fit of
//! where they are, which would agree with it.

use heapless::Vec;
use nalgebra::{Matrix2, Matrix3, Vector3};

use crate::geometry::{Body, Direction};

/// Gates: 0.5 m and 6 degrees.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const GATE_M: f32 = 0.5;
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md). 6 degrees.
const GATE_RAD: f32 = 0.104_72;
/// Squared Mahalanobis distance (3 degrees of freedom) up to which looks are averaged: one in 5e4 is beyond by chance.
/// Derived: one of honest looks in 25 000 is beyond by chance.
const AGREEMENT: f32 = 23.0;

/// A path as one beam saw it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detection {
    pub(super) c_tau_m: f32,
    pub(super) aoa: Direction<Body>,
    /// Covariance of (c tau in m, two tangent angles in rad).
    pub(super) covariance: Matrix3<f32>,
    /// Sum over the channels of the path's power at a tap's peak, amplitude units squared.
    pub(super) energy: f32,
    /// Noise variance of a tap, amplitude units squared.
    pub(super) noise: f32,
    /// What errors of the arrays add to it, in units of it: the same in all looks at a path.
    pub(super) errors: f32,
    pub(super) beam: u16,
    /// Paths that its beam told apart there, itself among them.
    pub(super) members: u8,
    /// Only the energy was measured, where a known path lies.
    pub(super) glance: bool,
    /// Path it belongs to after merging.
    pub(super) path: Option<u8>,
}

/// Detections of a sweep, strongest first, at most `MOST`: when full, the weakest gives way.
#[derive(Clone, Debug)]
pub(super) struct Detections<const MOST: usize> {
    sorted: Vec<Detection, MOST>,
    dropped: u32,
}

impl<const MOST: usize> Detections<MOST> {
    pub(super) const fn new() -> Self {
        Self {
            sorted: Vec::new(),
            dropped: 0,
        }
    }

    pub(super) fn clear(&mut self) {
        self.sorted.clear();
        self.dropped = 0;
    }

    /// Detections that found no place.
    pub(super) fn dropped(&self) -> u32 {
        self.dropped
    }

    pub(super) fn insert(&mut self, detection: Detection) {
        if self.sorted.is_full() {
            self.dropped += 1;
            match self.sorted.last() {
                Some(weakest) if weakest.energy < detection.energy => {
                    let _ = self.sorted.pop();
                }
                _ => return,
            }
        }
        let _ = self.sorted.push(detection);
        // Insertion from the end: swaps stop at the first stronger one.
        for i in (1..self.sorted.len()).rev() {
            if let Some([stronger, weaker]) = self.sorted.get_mut(i - 1..=i) {
                if stronger.energy >= weaker.energy {
                    break;
                }
                core::mem::swap(stronger, weaker);
            }
        }
    }

    /// Looks at path `index` after [`Self::merge`].
    pub(super) fn looks(&self, index: usize) -> impl Iterator<Item = &Detection> {
        self.sorted
            .iter()
            .filter(move |d| d.path.map(usize::from) == Some(index))
    }

    /// The `K` strongest paths with at least `share` of the strongest one's energy.
    pub(super) fn merge<const K: usize>(&mut self, share: f32) -> Vec<Merged, K> {
        let mut paths: Vec<Merged, K> = Vec::new();
        let whole = |d: &&Detection| !d.glance;
        let floor = self.sorted.iter().find(whole).map_or(0.0, |d| share * d.energy);
        // Glances belong to paths that others show.
        for glances in [false, true] {
            for i in 0..self.sorted.len() {
                let Some(detection) = self.sorted.get(i).copied() else {
                    break;
                };
                if detection.energy < floor {
                    break;
                }
                if detection.glance != glances {
                    continue;
                }
                let index = match self.nearest(&paths, &detection) {
                    Some(index) => {
                        if let Some(path) = paths.get_mut(index).filter(|_| !glances) {
                            path.look(&detection);
                        }
                        Some(index)
                    }
                    None if glances => None,
                    None => {
                        let index = paths.len();
                        paths.push(Merged::new(detection)).is_ok().then_some(index)
                    }
                };
                if let Some(slot) = self.sorted.get_mut(i) {
                    slot.path = index.map(|index| index as u8);
                }
            }
        }
        paths
    }

    /// Path within the gates that lies nearest and has no look from the same beam.
    fn nearest<const K: usize>(&self, paths: &Vec<Merged, K>, detection: &Detection) -> Option<usize> {
        let mut best = None;
        let mut least = f32::INFINITY;
        for (index, path) in paths.iter().enumerate() {
            let metres = (path.strongest.c_tau_m - detection.c_tau_m).abs() / GATE_M;
            let angle = path.strongest.aoa.angle_to_rad(&detection.aoa) / GATE_RAD;
            let distance = metres * metres + angle * angle;
            if metres < 1.0
                && angle < 1.0
                && distance < least
                && self.looks(index).all(|look| look.beam != detection.beam)
            {
                (best, least) = (Some(index), distance);
            }
        }
        best
    }
}

/// A path with all its looks: the strongest one, and the information of those that agree with it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Merged {
    pub(super) strongest: Detection,
    /// Sum of the looks' information, in units of 1 / `scale`.
    information: Matrix3<f32>,
    /// Sum of information times offset from the strongest look.
    pull: Vector3<f32>,
    /// Variance that keeps the numbers of the information near one.
    scale: f32,
}

impl Merged {
    fn new(strongest: Detection) -> Self {
        let scale = strongest.covariance.m22.max(f32::MIN_POSITIVE);
        Self {
            strongest,
            information: (strongest.covariance / scale)
                .try_inverse()
                .unwrap_or_else(Matrix3::zeros),
            pull: Vector3::zeros(),
            scale,
        }
    }

    fn look(&mut self, detection: &Detection) {
        if detection.members < self.strongest.members {
            return;
        }
        let (w1, w2) = self.strongest.aoa.tangents();
        let (b1, b2) = detection.aoa.tangents();
        let u = detection.aoa.vector();
        let offset = Vector3::new(detection.c_tau_m - self.strongest.c_tau_m, w1.dot(u), w2.dot(u));
        let turn = Matrix2::new(w1.dot(&b1), w1.dot(&b2), w2.dot(&b1), w2.dot(&b2));
        let mut lift = Matrix3::identity();
        lift.fixed_view_mut::<2, 2>(1, 1).copy_from(&turn);
        let covariance = lift * detection.covariance * lift.transpose() / self.scale;
        let of_difference = covariance + self.strongest.covariance / self.scale;
        let Some(inverse) = of_difference.try_inverse() else {
            return;
        };
        if offset.dot(&(inverse * offset)) < AGREEMENT * self.scale
            && let Some(information) = covariance.try_inverse()
        {
            self.information += information;
            self.pull += information * offset;
        }
    }

    /// Mean of the looks that agree: c tau in m, direction, covariance along its tangents. The arrays' errors are the strongest look's: no
    /// number of looks averages them out.
    pub(super) fn mean(&self) -> (f32, Direction<Body>, Matrix3<f32>) {
        let first = &self.strongest;
        let errors = first.covariance * first.errors;
        let Some(inverse) = self.information.try_inverse() else {
            return (first.c_tau_m, first.aoa, first.covariance + errors);
        };
        let offset = inverse * self.pull;
        let (w1, w2) = first.aoa.tangents();
        let u = first.aoa.vector() + w1 * offset.y + w2 * offset.z;
        let aoa = Direction::from_vector(u).unwrap_or(first.aoa);
        // The offset is a fraction of a standard deviation: the tangents hardly turn.
        (first.c_tau_m + offset.x, aoa, inverse * self.scale + errors)
    }
}

#[cfg(test)]
mod tests;
