//! A sweep: line of sight, or what is left without it.

use super::Filter;
use super::Slot;
use super::beacon::BeaconVerdict;
use super::gate::{Innovation, chi_square};
use super::layout::{ATTITUDE, POSITION, VELOCITY, plane, planes};
use super::measurement::{MappedPlane, PathMeasurement, PathRows, Transmitter};
use super::row::Row;
use super::start::START_FIXES;
use crate::geometry::Real;

/// The GMT's pace between its stops, m/s: how fast the last trusted position ages.
const GMT_PACE_M_PER_S: f64 = 0.3;
/// Without aid from outside for this long, the pose is dead reckoning, ns.
const DEAD_AFTER_NS: u64 = 2_000_000_000;
/// A reflection whose second-best plane is not worse than this in chi-square is ambiguous.
const AMBIGUITY: f64 = 9.0;
/// Planes whose prediction is further off than this are not considered: delay m, angle rad.
const NEAR_PLANE: (f64, f64) = (8.0, 0.15);

/// What a sweep brought.
#[derive(Clone, Copy, Debug)]
pub struct SweepMeasurement<'a> {
    /// UAV clock at the start of the sweep, ns.
    pub time_ns: u64,
    /// The GMT by its beacon.
    pub gmt: Transmitter,
    /// Number of the stop that the GMT stands at; sweeps of one stop share it.
    pub stop: u32,
    /// The line-of-sight path, if the link state says so.
    pub line_of_sight: Option<PathMeasurement>,
    /// Paths of one reflection.
    pub reflections: &'a [PathMeasurement],
    /// Planes of the map that a reflection may come from.
    pub planes: &'a [MappedPlane],
}

/// What became of a sweep's line of sight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepVerdict {
    /// No line of sight in it.
    NoSight,
    /// Taken in.
    Accepted,
    /// Taken in after the covariance was inflated: the vote says the filter was wrong.
    Inflated,
    /// Not taken in: it contradicts the filter.
    Rejected,
    /// The pose was set anew from the last sweeps.
    Refixed,
    /// The pose was set for the first time.
    Started,
    /// Kept for the start.
    Waiting,
    /// Its time stamp lies before the horizon.
    TooLate,
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes in a sweep at its own time stamp. Sweeps come in order; they may come late by the length of the history.
    pub fn sweep(&mut self, measurement: &SweepMeasurement<'_>) -> SweepVerdict {
        if measurement.time_ns < self.nominal.time_ns {
            self.counters.too_late = self.counters.too_late.saturating_add(1);
            return SweepVerdict::TooLate;
        }
        self.advance_to(measurement.time_ns);
        let gmt = self.judge_beacon(measurement);
        let verdict = match &measurement.line_of_sight {
            Some(path) => self.line_of_sight(&gmt, path),
            None => SweepVerdict::NoSight,
        };
        let sighted = matches!(
            verdict,
            SweepVerdict::Accepted | SweepVerdict::Inflated | SweepVerdict::Refixed | SweepVerdict::Started
        );
        if sighted {
            self.last_sight_ns = measurement.time_ns;
            self.last_aid_ns = measurement.time_ns;
        } else if self.running {
            for path in measurement.reflections {
                self.reflection(&gmt, path, measurement.planes);
            }
        }
        self.health.starting = !self.running;
        self.health.contested = verdict == SweepVerdict::Rejected;
        self.health.dead_reckoning = measurement.time_ns.saturating_sub(self.last_aid_ns) > DEAD_AFTER_NS;
        self.health.lost = self.running && self.sigma(POSITION) > self.gates().lost_m;
        self.health.attitude_lost = self.running && self.sigma(ATTITUDE) > self.gates().attitude_lost_rad;
        self.renew_head();
        verdict
    }

    /// The GMT as it is to be believed: an impossible beacon leaves the last possible place, ageing.
    fn judge_beacon(&mut self, measurement: &SweepMeasurement<'_>) -> Transmitter {
        let verdict = self
            .beacon
            .judge(measurement.time_ns, measurement.stop, &measurement.gmt.position_m);
        self.health.beacon_implausible = verdict != BeaconVerdict::Plausible;
        match (verdict, self.last_gmt) {
            (BeaconVerdict::Jumped, Some((since, mut gmt))) => {
                let moved = measurement.time_ns.saturating_sub(since) as f64 * 1e-9 * GMT_PACE_M_PER_S;
                gmt.sigma_m = libm::sqrt(gmt.sigma_m * gmt.sigma_m + moved * moved);
                gmt
            }
            _ => {
                self.last_gmt = Some((measurement.time_ns, measurement.gmt));
                measurement.gmt
            }
        }
    }

    fn line_of_sight(&mut self, gmt: &Transmitter, path: &PathMeasurement) -> SweepVerdict {
        let finite = path.c_tau_m + path.aoa_sigma_rad + path.c_tau_sigma_m;
        if !finite.is_finite() {
            return SweepVerdict::Rejected;
        }
        self.push_fix(gmt, path);
        if !self.running {
            return if self.try_start() {
                SweepVerdict::Started
            } else {
                SweepVerdict::Waiting
            };
        }
        let gates = self.gates();
        // Beyond this no linear correction finds the attitude back: the window does.
        if self.sigma(ATTITUDE) > gates.attitude_lost_rad && self.try_refix(START_FIXES) {
            return SweepVerdict::Refixed;
        }
        let Some(mut rows) = self.model.rows::<T>(&self.nominal, gmt, path, None) else {
            return SweepVerdict::Rejected;
        };
        let gate = if rows.len() == 5 { gates.five } else { gates.three };
        let mut chi2 = chi_square(&self.covariance, &rows);
        if chi2 > gate
            && self.delay_stepped(&rows)
            && let Some(again) = self.model.rows::<T>(&self.nominal, gmt, path, None)
        {
            rows = again;
            chi2 = chi_square(&self.covariance, &rows);
        }
        self.ratios.line_of_sight = (chi2 / gate) as f32;
        let innovation = Innovation::of(self.nominal.time_ns, &rows);
        let range = (gmt.position_m - self.nominal.position_m).norm();
        let agrees = self
            .last_innovation
            .is_some_and(|before| before.agrees(&innovation, self.sigma(VELOCITY), range));
        let sigma = self.sigma(POSITION);
        // Whether the filter was sure of itself when the contradiction began: what grows while it rejects does not count.
        if self.contested == 0 {
            self.sure = sigma < gates.trusted_m;
        }
        let trusted = self.sure;
        // With the angle of departure a path proves itself: of five numbers only three are needed for the position.
        let proven = rows.len() == 5;
        self.last_innovation = Some(innovation);

        let verdict = if chi2 <= gate && (trusted || proven || agrees) {
            SweepVerdict::Accepted
        } else if chi2 > gate && !trusted && agrees {
            // The filter was wrong: its uncertainty of pose and motion is raised to what the sweep says.
            let factor = libm::sqrt(chi2.min(1e6) / rows.len() as f64);
            self.covariance.inflate(ATTITUDE + 3, T::of(factor));
            self.counters.inflations = self.counters.inflations.saturating_add(1);
            SweepVerdict::Inflated
        } else {
            SweepVerdict::Rejected
        };
        if verdict != SweepVerdict::Rejected {
            self.take_rows(&rows);
            self.contested = 0;
            // What is left of the innovation after the update.
            self.last_innovation = None;
            self.counters.accepted = self.counters.accepted.saturating_add(1);
            return verdict;
        }
        self.counters.rejected = self.counters.rejected.saturating_add(1);
        self.contested = self.contested.saturating_add(1);
        let needed = if sigma > gates.lost_m {
            gates.refix_lost_after
        } else {
            gates.refix_after
        };
        if self.contested >= needed && self.try_refix(needed as usize) {
            return SweepVerdict::Refixed;
        }
        SweepVerdict::Rejected
    }

    /// Whether the delay alone is wrong and two-way timing says why.
    fn delay_stepped(&mut self, rows: &PathRows<T>) -> bool {
        let residual = rows.first().map_or(0.0, |row| row.residual.to_f64());
        self.clock_step_by_delay(residual)
    }

    /// Takes in the rows of one path, one after the other.
    fn take_rows(&mut self, rows: &[Row<T>]) {
        let mut dx = [T::zero(); N];
        for row in rows {
            let rest = row.residual - row.dot(&dx);
            if let Some(gain) = self.covariance.update(row) {
                for (x, k) in dx.iter_mut().zip(&gain) {
                    *x += *k * rest;
                }
            }
        }
        self.correct(&dx);
    }

    /// A path of one reflection: matched to a plane, gated, taken in together with what it says about that plane.
    fn reflection(&mut self, gmt: &Transmitter, path: &PathMeasurement, known: &[MappedPlane]) {
        let taken = self
            .match_plane(gmt, path, known)
            .and_then(|found| self.slot(found))
            .is_some_and(|slot| self.take_reflection(gmt, path, slot));
        if taken {
            self.counters.reflections = self.counters.reflections.saturating_add(1);
            self.last_aid_ns = self.nominal.time_ns;
        } else {
            self.counters.reflections_rejected = self.counters.reflections_rejected.saturating_add(1);
        }
    }

    fn take_reflection(&mut self, gmt: &Transmitter, path: &PathMeasurement, index: usize) -> bool {
        let Some(slot) = self.slots.get(index) else {
            return false;
        };
        let Some(rows) = self
            .model
            .rows::<T>(&self.nominal, gmt, path, Some((&slot.plane, plane(index))))
        else {
            return false;
        };
        let gates = self.gates();
        let gate = if rows.len() == 5 { gates.five } else { gates.three };
        let chi2 = chi_square(&self.covariance, &rows);
        self.ratios.reflection = (chi2 / gate) as f32;
        if chi2 > gate {
            return false;
        }
        self.take_rows(&rows);
        true
    }

    /// The one plane that the path can have come from; `None` when there is none or more than one.
    fn match_plane(
        &self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        known: &[MappedPlane],
    ) -> Option<MappedPlane> {
        let gates = self.gates();
        let (mut best, mut second) = (None, f64::INFINITY);
        let mut least = f64::INFINITY;
        for candidate in known {
            let held = self.slots.iter().position(|slot| slot.plane.id == candidate.id);
            let plane_now = held
                .and_then(|k| self.slots.get(k))
                .map_or(candidate, |slot| &slot.plane);
            // Both ends stand in front of the wall.
            if plane_now.height_m(&gmt.position_m) * plane_now.height_m(&self.nominal.position_m) <= 0.0 {
                continue;
            }
            let state = held.map_or(N, plane);
            let Some(mut rows) = self
                .model
                .rows::<T>(&self.nominal, gmt, path, Some((plane_now, state)))
            else {
                continue;
            };
            let far =
                |k: usize, limit: f64| rows.get(k).is_some_and(|row| row.residual.to_f64().abs() > limit);
            if far(0, NEAR_PLANE.0) || far(1, NEAR_PLANE.1) || far(2, NEAR_PLANE.1) {
                continue;
            }
            if held.is_none() {
                rows.iter_mut().for_each(|row| widen(row, candidate, N));
            }
            let chi2 = chi_square(&self.covariance, &rows);
            if chi2 < least {
                (second, least) = (least, chi2);
                best = Some(*plane_now);
            } else {
                second = second.min(chi2);
            }
        }
        let gate = if path.departure.is_some() {
            gates.five
        } else {
            gates.three
        };
        best.filter(|_| least <= gate && second > least + AMBIGUITY)
    }

    /// The slot of a plane in the state; the plane that was of no use for longest makes room.
    fn slot(&mut self, found: MappedPlane) -> Option<usize> {
        let time_ns = self.nominal.time_ns;
        let limit = planes(N).min(self.slots.capacity());
        let held = self.slots.iter().position(|slot| slot.plane.id == found.id);
        let index = match held {
            Some(index) => index,
            None => {
                let entry = Slot {
                    plane: found,
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
                        .min_by_key(|(_, slot)| slot.used_ns)?;
                    *oldest = entry;
                    index
                };
                self.covariance
                    .reset_block(plane(index), &found.plane.covariance.map(|c| T::of(f64::from(c))));
                index
            }
        };
        if let Some(slot) = self.slots.get_mut(index) {
            slot.used_ns = time_ns;
        }
        Some(index)
    }
}

/// Counts the uncertainty of a plane that is not in the state as noise.
fn widen<T: Real>(row: &mut Row<T>, plane: &MappedPlane, first: usize) {
    let mut h = nalgebra::Vector3::zeros();
    for &(state, value) in row.entries() {
        if let Some(entry) = usize::from(state).checked_sub(first).and_then(|k| h.get_mut(k)) {
            *entry = value.to_f64();
        }
    }
    row.variance += T::of((plane.plane.covariance.map(f64::from) * h).dot(&h));
}
