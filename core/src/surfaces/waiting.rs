//! Reflections that wait until every surface of their chain is confirmed.

use heapless::Vec;

use super::SurfaceIds;
use crate::geometry::{Matrix3, Vector3};

/// A path whose points are not mapped yet. They are computed anew from the planes as they are when the last of them is
/// confirmed.
#[derive(Clone, Debug, PartialEq)]
pub struct Waiting {
    /// Sweep of the path.
    pub sweep: u32,
    /// Index of the path in the sweep.
    pub path: u8,
    /// Surfaces that reflected it, from the transmitter on.
    pub chain: SurfaceIds,
    /// Both ends as they were, m.
    pub transmitter_m: Vector3<f32>,
    /// Place of the UAV, m.
    pub uav_m: Vector3<f32>,
    /// Covariance of that, m^2.
    pub uav_covariance_m2: Matrix3<f32>,
}

/// At most `W` of them, the oldest first.
#[derive(Clone, Debug, Default)]
pub struct WaitingPoints<const W: usize> {
    paths: Vec<Waiting, W>,
}

impl<const W: usize> WaitingPoints<W> {
    /// Those that wait, the oldest first.
    #[must_use]
    pub fn paths(&self) -> &[Waiting] {
        &self.paths
    }

    /// Lets one wait. When full the oldest goes: whether it did.
    pub fn push(&mut self, waiting: Waiting) -> bool {
        let full = self.paths.is_full();
        if full {
            let _oldest = self.remove(0);
        }
        self.paths.push(waiting).is_err() || full
    }

    /// Takes the one of this index out; the others keep their order.
    #[inline(never)]
    pub fn remove(&mut self, index: usize) -> Option<Waiting> {
        let removed = self.paths.get(index)?.clone();
        let mut left = index;
        self.paths.retain(|_| {
            let stays = left != 0;
            left = left.wrapping_sub(1);
            stays
        });
        Some(removed)
    }

    /// Forgets those over a surface: how many.
    #[inline(never)]
    pub fn forget(&mut self, id: u16) -> usize {
        let before = self.paths.len();
        self.paths.retain(|waiting| !waiting.chain.contains(&id));
        before - self.paths.len()
    }

    /// Those over a surface are over another one now, which it was merged into.
    pub fn rename(&mut self, from: u16, to: u16) {
        for id in self.paths.iter_mut().flat_map(|waiting| &mut waiting.chain) {
            if *id == from {
                *id = to;
            }
        }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.paths.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waiting(sweep: u32, chain: &[u16]) -> Waiting {
        Waiting {
            sweep,
            path: 0,
            chain: SurfaceIds::from_slice(chain).expect("at most three"),
            transmitter_m: Vector3::zeros(),
            uav_m: Vector3::x(),
            uav_covariance_m2: Matrix3::identity(),
        }
    }

    #[test]
    fn the_oldest_goes_when_there_is_no_room() {
        let mut points = WaitingPoints::<2>::default();
        assert!(!points.push(waiting(1, &[4])));
        assert!(!points.push(waiting(2, &[4])));
        assert!(points.push(waiting(3, &[4])));
        assert_eq!(points.paths().first().map(|w| w.sweep), Some(2));
    }

    #[test]
    fn points_die_with_any_surface_of_their_chain_and_follow_a_merged_one() {
        let mut points = WaitingPoints::<4>::default();
        for (sweep, chain) in [(1, &[4_u16][..]), (2, &[4, 5]), (3, &[6])] {
            points.push(waiting(sweep, chain));
        }
        points.rename(6, 4);
        assert_eq!(points.forget(5), 1);
        points.push(waiting(4, &[7]));
        let of = |removed: Option<Waiting>| removed.map(|waiting| (waiting.sweep, waiting.chain[0]));
        assert_eq!(of(points.remove(1)), Some((3, 4)));
        assert_eq!(of(points.remove(1)), Some((4, 7)));
        assert_eq!(of(points.remove(0)), Some((1, 4)));
        assert!(points.remove(0).is_none());
    }
}
