//! Reflections off mapped planes: which plane, which slot of the state, and the update of pose and plane together.
//!
//! Delay and both directions of a bounce leave one unknown of the six in position and reflection point: the plane's offset.
//! With the plane in the state the filter learns it while the position is still good, so the map need not be exact
//! (localization.md section 4).

use super::gate::chi_square;
use super::layout::{plane, planes};
use super::measurement::{MAX_BOUNCES, MappedPlane, PathMeasurement, Transmitter, image_m};
use super::nominal::{DELAY_PERIOD_M, wrap_delay_m};
use super::row::Row;
use super::{Filter, Slot};
use crate::geometry::Real;
use nalgebra::Vector3;

/// A reflection whose second-best explanation is not worse than this in chi-square is ambiguous.
const AMBIGUITY: f64 = 9.0;
/// Planes whose prediction is further off than this are not considered: delay m, angle rad.
const NEAR: (f64, f64) = (8.0, 0.15);
/// Square of the cosine of that angle, a chord of the unit sphere: `(1 - chord^2 / 2)^2`, a little less for rounding.
const NEAR_COSINE_SQUARE: f64 = (1.0 - 0.5001 * NEAR.1 * NEAR.1) * (1.0 - 0.5001 * NEAR.1 * NEAR.1);

/// Planes that a wave met, in its order.
type Bounces = heapless::Vec<MappedPlane, MAX_BOUNCES>;

impl<T: Real, const N: usize> Filter<T, N> {
    /// A path of one reflection: matched to a plane, gated, taken in together with what it says about that plane.
    pub(super) fn reflection(&mut self, gmt: &Transmitter, path: &PathMeasurement, known: &[MappedPlane]) {
        let mut found = Match::default();
        let view = self.view(path);
        for candidate in known {
            let image_m = self.as_known(candidate).image_m(&gmt.position_m);
            if view.may_be(&image_m) {
                self.weigh(gmt, path, &[candidate], &mut found);
            }
        }
        self.conclude(gmt, path, found);
    }

    /// A path of two reflections.
    pub(super) fn double_reflection(
        &mut self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        known: &[MappedPlane],
    ) {
        let mut found = Match::default();
        let view = self.view(path);
        for second in known {
            // The UAV looks at the front of the last plane: spares most pairs. Seen in that mirror, what is left is a path
            // of one reflection, so that no pair needs two images.
            let Some(mirrored) = view.in_mirror(self.as_known(second)) else {
                continue;
            };
            for first in known {
                let plane_now = self.as_known(first);
                if first.id != second.id
                    && plane_now.height_m(&gmt.position_m) > 0.0
                    && mirrored.may_be(&plane_now.image_m(&gmt.position_m))
                {
                    self.weigh(gmt, path, &[first, second], &mut found);
                }
            }
        }
        self.conclude(gmt, path, found);
    }

    /// Where a path seems to come from.
    fn view(&self, path: &PathMeasurement) -> View {
        let range = wrap_delay_m(path.c_tau_m - self.nominal.clock_offset_m);
        View {
            from_m: self.nominal.position_m,
            direction: self.nominal.attitude * path.aoa.vector(),
            range_m: if range < 0.0 {
                range + DELAY_PERIOD_M
            } else {
                range
            },
        }
    }

    /// A plane as it is estimated now: from the state if it is there.
    fn as_known<'a>(&'a self, candidate: &'a MappedPlane) -> &'a MappedPlane {
        self.slots
            .iter()
            .find(|slot| slot.plane.id == candidate.id)
            .map_or(candidate, |slot| &slot.plane)
    }

    /// Compares a path with one explanation.
    fn weigh(
        &self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        candidates: &[&MappedPlane],
        found: &mut Match,
    ) {
        let mut now = heapless::Vec::<&MappedPlane, MAX_BOUNCES>::new();
        for candidate in candidates {
            let _ = now.push(self.as_known(candidate));
        }
        let Some(image) = image_m(&gmt.position_m, &self.nominal.position_m, &now) else {
            return;
        };
        let way = image - self.nominal.position_m;
        let range = way.norm();
        let late = wrap_delay_m(path.c_tau_m - self.nominal.clock_offset_m - range);
        let seen: Vector3<f64> = self.nominal.attitude * path.aoa.vector();
        if late.is_nan() || late.abs() > NEAR.0 || (seen - way / range).norm() > NEAR.1 {
            return;
        }
        // A plane that is not in the state has its own uncertainty in the noise instead.
        let mut bounces = heapless::Vec::<(&MappedPlane, usize), MAX_BOUNCES>::new();
        for (k, plane_now) in now.iter().enumerate() {
            let held = self.slots.iter().position(|slot| slot.plane.id == plane_now.id);
            let _ = bounces.push((plane_now, held.map_or(N + 3 * k, plane)));
        }
        let Some(mut rows) = self.rows(gmt, path, &bounces) else {
            return;
        };
        for (plane_now, state) in bounces.iter().filter(|(_, state)| *state >= N) {
            rows.iter_mut().for_each(|row| widen(row, plane_now, *state));
        }
        let chi2 = chi_square(&self.covariance, &rows);
        if chi2 < found.least {
            (found.second, found.least) = (found.least, chi2);
            found.planes.clear();
            for plane_now in &now {
                let _ = found.planes.push(**plane_now);
            }
        } else {
            found.second = found.second.min(chi2);
        }
    }

    /// Takes a matched path in, and counts.
    fn conclude(&mut self, gmt: &Transmitter, path: &PathMeasurement, found: Match) {
        let gates = self.gates();
        let gate = if path.departure.is_some() {
            gates.five
        } else {
            gates.three
        };
        let clear = found.least <= gate && found.second > found.least + AMBIGUITY;
        if clear && self.take_reflection(gmt, path, &found.planes, gate) {
            self.counters.reflections = self.counters.reflections.saturating_add(1);
            self.last_aid_ns = self.nominal.time_ns;
        } else {
            self.counters.reflections_rejected = self.counters.reflections_rejected.saturating_add(1);
        }
    }

    fn take_reflection(
        &mut self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        found: &Bounces,
        gate: f64,
    ) -> bool {
        let mut indices = heapless::Vec::<usize, MAX_BOUNCES>::new();
        for plane in found {
            let Some(index) = self.slot(plane, &indices) else {
                return false;
            };
            let _ = indices.push(index);
        }
        let rows = {
            let mut bounces = heapless::Vec::<(&MappedPlane, usize), MAX_BOUNCES>::new();
            for &index in &indices {
                if let Some(slot) = self.slots.get(index) {
                    let _ = bounces.push((&slot.plane, plane(index)));
                }
            }
            self.rows(gmt, path, &bounces)
        };
        let Some(rows) = rows else {
            return false;
        };
        let chi2 = chi_square(&self.covariance, &rows);
        self.ratios.reflection = (chi2 / gate) as f32;
        if chi2 > gate {
            return false;
        }
        self.take_rows(&rows);
        true
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
        Some(index)
    }
}

/// Where a path seems to come from: a quick look before an explanation is weighed, without roots.
struct View {
    from_m: Vector3<f64>,
    direction: Vector3<f64>,
    range_m: f64,
}

impl View {
    /// Whether an image of the GMT may be the source: no image that [`Filter::weigh`] would keep is turned away.
    fn may_be(&self, image_m: &Vector3<f64>) -> bool {
        let way = image_m - self.from_m;
        let (square, along) = (way.dot(&way), self.direction.dot(&way));
        if along <= 0.0 || along * along < NEAR_COSINE_SQUARE * square {
            return false;
        }
        let (low, high) = (self.range_m - NEAR.0, self.range_m + NEAR.0);
        // Beyond this, the wrapped delay may be that of a longer way.
        let far = DELAY_PERIOD_M - 2.0 * NEAR.0;
        square > far * far || ((low <= 0.0 || square >= low * low) && square <= high * high)
    }

    /// The same, seen in a plane that the UAV looks at from its front; `None` for any other plane.
    fn in_mirror(&self, plane: &MappedPlane) -> Option<Self> {
        let normal = plane.plane.normal.vector().map(f64::from);
        let towards = normal.dot(&self.direction);
        // A direction that is off by the allowed angle may just meet the plane.
        if towards > NEAR.1 || plane.height_m(&self.from_m) <= 0.0 {
            return None;
        }
        Some(Self {
            from_m: plane.image_m(&self.from_m),
            direction: self.direction - normal * (2.0 * towards),
            range_m: self.range_m,
        })
    }
}

/// The best explanation of a path so far, and how good the second best is.
struct Match {
    planes: Bounces,
    least: f64,
    second: f64,
}

impl Default for Match {
    fn default() -> Self {
        Self {
            planes: Bounces::new(),
            least: f64::INFINITY,
            second: f64::INFINITY,
        }
    }
}

/// Counts the uncertainty of a plane that is not in the state, whose derivatives stand at `first`, as noise.
fn widen<T: Real>(row: &mut Row<T>, plane: &MappedPlane, first: usize) {
    let mut h = Vector3::zeros();
    for &(state, value) in row.entries() {
        if let Some(entry) = usize::from(state).checked_sub(first).and_then(|k| h.get_mut(k)) {
            *entry = value.to_f64();
        }
    }
    row.variance += T::of((plane.plane.covariance.map(f64::from) * h).dot(&h));
}
