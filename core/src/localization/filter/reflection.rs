//! Reflections off mapped planes: which plane, which slot of the state, and the update of pose and plane together.
//!
//! Delay and both directions of a bounce leave one unknown of the six in position and reflection point: the plane's offset.
//! With the plane in the state the filter learns it while the position is still good, so the map need not be exact
//! (docs/localization.md, "The model").

use super::gate::{chi_square, chi_square_up_to};
use super::layout::{ATTITUDE, CLOCK_OFFSET, POSITION, plane, planes};
use super::measurement::{MAX_BOUNCES, MappedPlane, PathMeasurement, Transmitter, image_m};
use super::nominal::{DELAY_PERIOD_M, range_of_delay_m, wrap_delay_m};
use super::row::Row;
use super::{Filter, Slot, SweepMeasurement};
use crate::geometry::Real;
use nalgebra::Vector3;

/// A reflection whose second-best explanation is not worse than this in chi-square is ambiguous.
const AMBIGUITY: f64 = 9.0;
/// Share of its gate that a path of two reflections is given. Any pair of planes may explain it, and a path of three may be explained
/// by a pair as well, by chance and badly; by the chi-square law, 98 of 100 true ones stay below it.
const DOUBLE_SHARE: f64 = 0.5;
/// Planes whose prediction is further off than this are not considered: delay m, angle rad.
const NEAR: (f64, f64) = (8.0, 0.15);
/// Square of the cosine of that angle, a chord of the unit sphere: `(1 - chord^2 / 2)^2`, a little less for rounding.
const NEAR_COSINE_SQUARE: f64 = (1.0 - 0.5001 * NEAR.1 * NEAR.1) * (1.0 - 0.5001 * NEAR.1 * NEAR.1);
/// Work that the reflections of a sweep may cause, in units of some 14 000 instructions of a Cortex-M7 with four planes in the
/// state: a million a sweep. What would go beyond is left out.
const EFFORT: u32 = 60;
/// Of that, an explanation that delay and departure rule out; one that they do not costs this twice.
const WEIGHING: u32 = 1;
/// Of that, taking a path in, after a look whether it may be the line of sight.
const TAKING: u32 = 16;
/// Standard deviation of an angle of arrival by the arrays' calibration and by noise, rad: at most.
const ARRIVAL_RAD: f64 = 0.006;
/// Standard deviation of a delay by noise, m: at most.
const DELAY_M: f64 = 0.05;

/// Planes of a map that are considered in a sweep.
const MOST_PLANES: usize = 64;

/// The images of the GMT in all planes that it stands in front of.
type Images<'a> = heapless::Vec<Image<'a>, MOST_PLANES>;

/// An image of the GMT.
struct Image<'a> {
    of: &'a MappedPlane,
    place_m: Vector3<f64>,
    sigma_m: f64,
}

/// Planes that a wave met, in its order.
type Bounces = heapless::Vec<MappedPlane, MAX_BOUNCES>;

impl<T: Real, const N: usize> Filter<T, N> {
    /// The reflections of a sweep: those of one plane first, each kind in its order (strongest first), as far as there is time.
    pub(super) fn reflections(&mut self, gmt: &Transmitter, measurement: &SweepMeasurement<'_>) {
        let mut effort = EFFORT;
        let mut images = Images::new();
        for candidate in measurement.planes {
            let plane_now = self.as_known(candidate);
            if plane_now.height_m(&gmt.position_m) > 0.0 {
                // There is room for the planes of any map; what a larger one has beyond is left out.
                let _fits = images.push(Image {
                    of: candidate,
                    place_m: plane_now.image_m(&gmt.position_m),
                    sigma_m: image_sigma_m(plane_now, &gmt.position_m),
                });
            }
        }
        for path in measurement.reflections {
            self.reflection(gmt, path, &images, &mut effort);
        }
        for path in measurement.double_reflections {
            self.double_reflection(gmt, path, &images, measurement.planes, &mut effort);
        }
    }

    /// A path of one reflection: matched to a plane, gated, taken in together with what it says about that plane.
    fn reflection(
        &mut self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        images: &Images<'_>,
        effort: &mut u32,
    ) {
        let mut found = Match::default();
        let view = self.view(path);
        for image in images {
            if view.is_near(&image.place_m) && view.may_be(&image.place_m, image.sigma_m) {
                self.weigh(gmt, path, &[image.of], &mut found, effort);
            }
        }
        self.conclude(gmt, path, &view, found, effort);
    }

    /// A path of two reflections.
    fn double_reflection(
        &mut self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        images: &Images<'_>,
        known: &[MappedPlane],
        effort: &mut u32,
    ) {
        let mut found = Match::default();
        let view = self.view(path);
        for second in known {
            // The UAV looks at the front of the last plane: spares most pairs. Seen in that mirror, what is left is a path
            // of one reflection, so that no pair needs two images.
            let Some(mirrored) = view.in_mirror(self.as_known(second)) else {
                continue;
            };
            for image in images {
                if image.of.id == second.id || !mirrored.is_near(&image.place_m) {
                    continue;
                }
                let sigma_m = image.sigma_m + image_sigma_m(self.as_known(second), &image.place_m);
                if mirrored.may_be(&image.place_m, sigma_m) {
                    self.weigh(gmt, path, &[image.of, second], &mut found, effort);
                }
            }
        }
        self.conclude(gmt, path, &view, found, effort);
    }

    /// Where a path seems to come from.
    fn view(&self, path: &PathMeasurement) -> View {
        View {
            from_m: self.nominal.position_m,
            direction: self.nominal.attitude * path.aoa.vector(),
            range_m: range_of_delay_m(path.c_tau_m - self.nominal.clock_offset_m),
            deviations: libm::sqrt(self.gates().five + AMBIGUITY),
            place_sigma_m: self.sigma(POSITION),
            delay_sigma_m: libm::sqrt(self.variance(CLOCK_OFFSET).max(0.0)) + path.c_tau_sigma_m + DELAY_M,
            arrival_sigma_rad: self.sigma(ATTITUDE) + path.aoa_sigma_rad + ARRIVAL_RAD,
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
        effort: &mut u32,
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
        let Some(left) = effort.checked_sub(WEIGHING) else {
            found.unfinished = true;
            return;
        };
        *effort = left;
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
        let chi2 = chi_square_up_to(&self.covariance, &rows, self.gates().five + AMBIGUITY);
        if chi2.is_finite() {
            *effort = effort.saturating_sub(WEIGHING);
        }
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
    fn conclude(
        &mut self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        view: &View,
        found: Match,
        effort: &mut u32,
    ) {
        let gates = self.gates();
        let share = if found.planes.len() > 1 { DOUBLE_SHARE } else { 1.0 };
        let gate = share
            * if path.departure.is_some() {
                gates.five
            } else {
                gates.three
            };
        let clear = found.least <= gate && found.second > found.least + AMBIGUITY && !found.unfinished;
        if clear
            && !self.may_be_straight(gmt, path, view, found.least + AMBIGUITY)
            && let Some(left) = effort.checked_sub(TAKING)
            && self.take_reflection(gmt, path, &found, gate)
        {
            *effort = left;
            self.counters.reflections = self.counters.reflections.saturating_add(1);
            self.last_aid_ns = self.nominal.time_ns;
        } else {
            self.counters.reflections_rejected = self.counters.reflections_rejected.saturating_add(1);
        }
    }

    /// Whether the line of sight explains a path within `most`: after an outage, when the place is not known, it may do so as well as a
    /// mirror does, and whoever takes it for a reflection is metres off for as long as no line of sight is recognised.
    fn may_be_straight(&self, gmt: &Transmitter, path: &PathMeasurement, view: &View, most: f64) -> bool {
        // A filter that knows its place sees at a glance where the path does not come from.
        let placed = self.sigma(POSITION) < self.gates().trusted_m;
        if placed && !(view.is_near(&gmt.position_m) && view.may_be(&gmt.position_m, gmt.sigma_m)) {
            return false;
        }
        self.rows(gmt, path, &[])
            .is_some_and(|rows| chi_square_up_to(&self.covariance, &rows, most).is_finite())
    }

    fn take_reflection(
        &mut self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        found: &Match,
        gate: f64,
    ) -> bool {
        let known = found
            .planes
            .iter()
            .all(|plane| self.slots.iter().any(|slot| slot.plane.id == plane.id));
        let mut indices = heapless::Vec::<usize, MAX_BOUNCES>::new();
        for plane in &found.planes {
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
        // A plane that has just come into the state is correlated with nothing any more: that may change the verdict.
        let chi2 = if known {
            found.least
        } else {
            chi_square(&self.covariance, &rows)
        };
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
    /// This many standard deviations off in a single number, and an explanation is neither kept nor makes another ambiguous.
    deviations: f64,
    /// Standard deviations: position, the rest of the delay, the rest of the arrival.
    place_sigma_m: f64,
    delay_sigma_m: f64,
    arrival_sigma_rad: f64,
}

impl View {
    /// Whether an image of the GMT is anywhere near where the path points: cheap, because most are not.
    fn is_near(&self, image_m: &Vector3<f64>) -> bool {
        let way = image_m - self.from_m;
        let along = self.direction.dot(&way);
        along > 0.0 && along * along >= NEAR_COSINE_SQUARE * way.dot(&way)
    }

    /// Whether an image of the GMT, known to `image_sigma_m`, may be the source: none that [`Filter::conclude`] would look at
    /// is turned away. Standard deviations are added, not their squares: errors may be correlated.
    fn may_be(&self, image_m: &Vector3<f64>, image_sigma_m: f64) -> bool {
        let way = image_m - self.from_m;
        let (square, along) = (way.dot(&way), self.direction.dot(&way));
        let apart_m = self.place_sigma_m + image_sigma_m;
        let late_m = (self.deviations * (apart_m + self.delay_sigma_m)).min(NEAR.0);
        let (low, high) = (self.range_m - late_m, self.range_m + late_m);
        let angle = apart_m / self.range_m.max(1.0) + self.arrival_sigma_rad;
        let chord = (self.deviations * angle).min(NEAR.1);
        // Cosine of that chord of the unit sphere, a little less for rounding.
        let cosine = 1.0 - 0.5001 * chord * chord;
        if along <= 0.0 || along * along < cosine * cosine * square {
            return false;
        }
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
            ..*self
        })
    }
}

/// Standard deviation of a point's image by the error of the plane, m: at most.
fn image_sigma_m(plane: &MappedPlane, point_m: &Vector3<f64>) -> f64 {
    let covariance = &plane.plane.covariance;
    let (offset, tilt) = (covariance.m11, covariance.m22 + covariance.m33);
    let lever = point_m - plane.plane.centre.vector().map(f64::from);
    2.0 * (libm::sqrt(f64::from(offset.max(0.0))) + libm::sqrt(f64::from(tilt.max(0.0))) * lever.norm())
}

/// The best explanation of a path so far, and how good the second best is.
struct Match {
    planes: Bounces,
    least: f64,
    second: f64,
    /// Some were not looked at.
    unfinished: bool,
}

impl Default for Match {
    fn default() -> Self {
        Self {
            planes: Bounces::new(),
            least: f64::INFINITY,
            second: f64::INFINITY,
            unfinished: false,
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

#[cfg(test)]
mod tests;
