//! Reflections off mapped surfaces: the slots of the state, and the update of pose and surface together.
//!
//! Delay and both directions of a bounce leave one unknown of the six in position and reflection point: the plane's offset.
//! With the plane in the state the filter learns it while the position is still good, so the map need not be exact
//! (docs/localization.md, "The model"). Which surfaces made a path is data association's to say (`crate::association`).

use super::gate::chi_square;
use super::layout::{plane, planes};
use super::measurement::{MAX_BOUNCES, MappedPlane, ReflectedPath, Transmitter};
use super::watch::Step;
use super::{Filter, Slot};
use crate::geometry::Real;

/// Reflected paths that a sweep corrects the pose by at most, the strongest.
/// Capacity: a quarter of a million instructions of a Cortex-M7 each. What goes beyond is counted as rejected.
const MOST_PATHS: usize = 4;

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes the reflected paths of a sweep in, one after the other, each with what it says about its surfaces.
    pub(super) fn reflections(&mut self, gmt: &Transmitter, paths: &[ReflectedPath]) {
        for (index, path) in paths.iter().enumerate() {
            if index < MOST_PATHS && self.take_reflection(gmt, path) {
                self.counters.reflections = self.counters.reflections.saturating_add(1);
                self.last_aid_ns = self.nominal.time_ns;
            } else {
                self.counters.reflections_rejected = self.counters.reflections_rejected.saturating_add(1);
            }
        }
    }

    /// Surfaces in the state, as they are estimated now: mean and covariance.
    pub fn planes(&self) -> impl Iterator<Item = &MappedPlane> {
        self.slots.iter().map(|slot| &slot.plane)
    }

    /// Lets the surfaces in the state go: whoever lent them has them back. What the state knew of their errors together with the
    /// pose's is forgotten.
    pub fn release_planes(&mut self) {
        self.slots.clear();
    }

    fn take_reflection(&mut self, gmt: &Transmitter, reflected: &ReflectedPath) -> bool {
        let mut indices = heapless::Vec::<usize, MAX_BOUNCES>::new();
        for plane in &reflected.planes {
            let Some(index) = self.slot(plane, &indices) else {
                return false;
            };
            let _fits = indices.push(index);
        }
        let rows = {
            let mut bounces = heapless::Vec::<(&MappedPlane, usize), MAX_BOUNCES>::new();
            for &index in &indices {
                if let Some(slot) = self.slots.get(index) {
                    let _fits = bounces.push((&slot.plane, plane(index)));
                }
            }
            self.rows(gmt, &reflected.path, &bounces)
        };
        let Some(rows) = rows else {
            return false;
        };
        let gates = self.gates();
        let gate = if reflected.path.departure.is_some() {
            gates.five
        } else {
            gates.three
        };
        let chi2 = chi_square(&self.covariance, &rows);
        self.ratios.reflection = (chi2 / gate) as f32;
        // In this order a number that is none is refused.
        let fits = chi2 <= gate;
        if fits {
            self.take_rows(&rows);
        }
        fits
    }

    /// The slot of a plane in the state. The plane that was of no use for longest makes room, except those in `taken`.
    fn slot(&mut self, found: &MappedPlane, taken: &[usize]) -> Option<usize> {
        let time_ns = self.nominal.time_ns;
        let limit = planes(N).min(self.slots.capacity());
        if let Some((index, slot)) = self
            .slots
            .iter_mut()
            .enumerate()
            .find(|(_, slot)| slot.plane.id == found.id)
        {
            slot.used_ns = time_ns;
            return Some(index);
        }
        let entry = Slot {
            plane: *found,
            used_ns: time_ns,
        };
        self.tell(Step::Stands);
        let index = if self.slots.len() < limit {
            self.slots.push(entry).ok()?;
            self.slots.len() - 1
        } else {
            let (index, oldest) = self
                .slots
                .iter_mut()
                .enumerate()
                .filter(|(index, _)| !taken.contains(index))
                .min_by_key(|(_, slot)| slot.used_ns)?;
            *oldest = entry;
            index
        };
        let covariance = found.plane.covariance.map(|c| T::of(f64::from(c)));
        self.covariance.reset_block(plane(index), &covariance);
        self.tell(Step::Forgot {
            first: plane(index),
            count: 3,
        });
        Some(index)
    }
}

#[cfg(test)]
mod tests;
