//! A voxel: what each surface put into it, kept apart, and their mean.

use cslam_core::map::Voxel;

use super::MapPoint;
use crate::ground::surfaces::SurfaceId;

/// Most surfaces that are kept apart beside the first; what comes of a further one is fused with the last of them and goes with it.
const MOST_OTHERS: usize = 7;

/// What one surface of one UAV, or all UAVs that name none, put into a voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    /// The surface.
    pub(super) surface: Option<SurfaceId>,
    /// Number of the last packet that added to it.
    pub(super) counter: u32,
    /// Mean of what came.
    pub(super) point: MapPoint,
}

/// A voxel.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    pub(super) voxel: Voxel,
    first: Option<Part>,
    others: Vec<Part>,
}

impl Cell {
    /// A voxel with its first part.
    pub(super) fn new(voxel: Voxel, part: Part) -> Self {
        Self {
            voxel,
            first: Some(part),
            others: Vec::new(),
        }
    }

    /// Everything in it.
    pub(super) fn parts(&self) -> impl Iterator<Item = &Part> {
        self.first.iter().chain(&self.others)
    }

    /// Whether nothing is left in it.
    pub(super) fn is_empty(&self) -> bool {
        self.first.is_none()
    }

    /// The mean of its parts. An empty one has none and is not in the map; it is at the origin.
    pub(super) fn point(&self) -> MapPoint {
        let points = self.parts().map(|part| part.point);
        points.reduce(|one, other| fuse(&one, &other)).unwrap_or_default()
    }

    /// Adds a part: whether it is one of its own.
    pub(super) fn add(&mut self, new: Part) -> bool {
        if self.first.is_none() {
            self.first = Some(new);
            return true;
        }
        let is_full = self.others.len() == MOST_OTHERS;
        let mut parts = self.first.iter_mut().chain(&mut self.others);
        let same = match parts.find(|part| part.surface == new.surface) {
            None if is_full => self.others.last_mut(),
            same => same,
        };
        let Some(part) = same else {
            self.others.push(new);
            return true;
        };
        part.counter = part.counter.max(new.counter);
        part.point = fuse(&part.point, &new.point);
        false
    }

    /// Takes out the part of a surface if all of it came in packets before one.
    pub(super) fn take(&mut self, surface: SurfaceId, before: u32) -> Option<Part> {
        let is_it = |part: &Part| part.surface == Some(surface) && part.counter < before;
        if self.first.as_ref().is_some_and(is_it) {
            let next = self.others.pop();
            return std::mem::replace(&mut self.first, next);
        }
        let place = self.others.iter().position(is_it)?;
        Some(self.others.swap_remove(place))
    }
}

/// Mean of two points of a voxel, weighted by their variances. What is said of the last reflection is said by the newer one.
fn fuse(one: &MapPoint, other: &MapPoint) -> MapPoint {
    let weight = one.variance_m2 / (one.variance_m2 + other.variance_m2);
    let mean = |i: usize| one.position_m[i] + (other.position_m[i] - one.position_m[i]) * weight;
    let newer = if one.seen_s > other.seen_s { one } else { other };
    MapPoint {
        position_m: std::array::from_fn(mean),
        variance_m2: (one.variance_m2 * (1.0 - weight)).max(f32::MIN_POSITIVE),
        hits: one.hits.saturating_add(other.hits),
        probability: one.probability.max(other.probability),
        ..*newer
    }
}
