//! The beacon against the filter: its claim passes the gate that every measurement passes, or the place before it stands.
//!
//! A line of sight tells where the GMT is, by the pose that inertial data predict: to centimetres between two sweeps. So a claim that
//! the GMT's own drive does not explain is refuted when the line of sight fits the place before it, and confirmed when it fits the
//! claim alone. What is slow, or was there from the start, moves the pose along instead, and nothing on board tells.

use super::Filter;
use super::beacon::{BeaconVerdict, GMT_PACE_M_PER_S, Place};
use super::gate::{APART_SIGMAS, chi_square};
use super::layout::POSITION;
use super::measurement::{PathMeasurement, PathRows, Transmitter};
use super::sweep_measurement::SweepMeasurement;
use crate::geometry::{Gmt, Real, Rotation, World};

/// The same for the mast, rad.
/// Derived: twenty times what it is off by.
const TURNED_RAD: f64 = 0.02;

/// What a beacon claims, and what is taken instead when it is not believed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    /// The GMT as it is taken so far.
    pub(super) taken: Transmitter,
    claimed: Transmitter,
    /// Where it was last, ageing.
    before: Option<Transmitter>,
    creeps: bool,
    believed: bool,
    /// A line of sight has changed what was taken.
    shown: bool,
}

/// Rows of a path, their gate, and their chi-square.
type Weighed<T> = (PathRows<T>, f64, f64);

impl<T: Real, const N: usize> Filter<T, N> {
    /// The GMT as it would be taken if it claimed this at `time_ns`.
    pub fn plausible(&self, time_ns: u64, claimed: &Transmitter) -> Transmitter {
        let mut taken = *claimed;
        if let Some(place) = self.beacon.place(time_ns, &claimed.position_m) {
            taken.position_m = place.position_m;
            taken.sigma_m = libm::hypot(claimed.sigma_m, place.sigma_m);
        }
        if let Some(mast) = self.refuted_mast {
            taken.attitude = mast;
        }
        taken
    }

    /// The GMT as it was taken at the last sweep.
    pub fn transmitter(&self) -> Option<&Transmitter> {
        self.last_gmt.as_ref().map(|(_, gmt)| gmt)
    }

    /// The first judgement, by what a vehicle can do.
    pub(super) fn judge_beacon(&mut self, sweep: &SweepMeasurement<'_>) -> Claim {
        let (time_ns, claimed) = (sweep.time_ns, sweep.gmt);
        let taken = self.plausible(time_ns, &claimed);
        let verdict = self.beacon.judge(time_ns, sweep.stop, &claimed.position_m);
        let mut claim = Claim {
            taken,
            claimed,
            before: self.last_gmt.map(|(since_ns, mut gmt)| {
                let aged_m = time_ns.saturating_sub(since_ns) as f64 * 1e-9 * GMT_PACE_M_PER_S;
                gmt.sigma_m = libm::hypot(gmt.sigma_m, aged_m);
                gmt
            }),
            creeps: verdict == BeaconVerdict::Creeping,
            believed: verdict != BeaconVerdict::Jumped && self.refuted_mast.is_none(),
            shown: false,
        };
        let finite = claimed.position_m.iter().all(|c| c.is_finite());
        if !claim.believed && !self.running && finite && self.config.beacon.setup.is_none() {
            // Nothing stands on the place before, and it may have been the wrong one.
            self.beacon.confirm(time_ns, &claimed.position_m);
            self.window.clear();
            (claim.taken, claim.believed) = (claimed, true);
            self.counters.beacons_refused = self.counters.beacons_refused.saturating_add(1);
        }
        claim
    }

    /// The second, by a line of sight: the rows of the path from where the GMT is taken to be then.
    pub(super) fn weigh_beacon(&self, claim: &mut Claim, path: &PathMeasurement) -> Option<Weighed<T>> {
        let weigh = |gmt: &Transmitter| {
            let rows = self.rows(gmt, path, &[])?;
            let gate = if rows.len() == 5 {
                self.gates().five
            } else {
                self.gates().three
            };
            let chi2 = chi_square(&self.covariance, &rows);
            Some((rows, gate, chi2))
        };
        let fits = |weighed: &Weighed<T>| weighed.2 <= weighed.1;
        let first = weigh(&claim.taken);
        if first.as_ref().is_none_or(fits) {
            return first;
        }
        let other = if claim.believed {
            claim.before
        } else {
            Some(claim.claimed)
        };
        let Some(other) = other else { return first };
        let apart_m = (other.position_m - claim.taken.position_m).norm();
        let turned = other.attitude.matrix() - claim.taken.attitude.matrix();
        // A claim must lie beyond what the GMT may have driven, and what the pose is unsure of fits everything.
        let unsure_m = if claim.believed {
            other.sigma_m
        } else {
            self.sigma(POSITION)
        };
        let told = apart_m > APART_SIGMAS * unsure_m || turned.norm() > TURNED_RAD;
        match weigh(&other).filter(|weighed| told && fits(weighed)) {
            Some(weighed) => {
                (claim.taken, claim.believed, claim.shown) = (other, !claim.believed, true);
                Some(weighed)
            }
            None => first,
        }
    }

    /// The end of it: what is remembered, counted and flagged.
    pub(super) fn settle_beacon(&mut self, claim: &Claim, time_ns: u64) {
        let (taken, claimed) = (&claim.taken, &claim.claimed);
        if claim.shown && claim.believed {
            self.beacon.confirm(time_ns, &claimed.position_m);
            self.refuted_mast = None;
        } else if claim.shown {
            let turned = (taken.attitude.matrix() - claimed.attitude.matrix()).norm() > TURNED_RAD;
            self.refuted_mast = turned.then_some(taken.attitude);
            let place = Place {
                position_m: taken.position_m,
                sigma_m: taken.sigma_m,
            };
            self.beacon.refute(time_ns, &claimed.position_m, &place);
        }
        let steady_m = if claim.believed {
            taken.steady_sigma_m(&self.config.radio)
        } else {
            self.counters.beacons_refused = self.counters.beacons_refused.saturating_add(1);
            // One error for as long as it lasts.
            taken.sigma_m
        };
        self.beacon_sigma_m = libm::hypot(steady_m, self.beacon.crept_m());
        if taken.position_m.iter().all(|c| c.is_finite()) {
            self.last_gmt = Some((time_ns, *taken));
        }
        self.health.beacon_implausible = !claim.believed || claim.creeps;
    }
}

/// Attitude of a mast.
pub(super) type Mast = Rotation<Gmt, World, f64>;
