//! The beacon against the filter: its claim passes the gate that every measurement passes, or the place before it stands.
//!
//! A line of sight tells where the GMT is, by the pose that inertial data predict: to centimetres between two sweeps. So a claim that
//! the GMT's own drive does not explain is refuted when the line of sight fits the place before it, and confirmed when it fits the
//! claim alone. What is small, or slow, or was there from the start, moves the pose along instead, and nothing on board tells.

use super::Filter;
use super::beacon::BeaconVerdict;
use super::gate::chi_square;
use super::layout::POSITION;
use super::measurement::{PathMeasurement, PathRows, Transmitter};
use super::sweep::{SweepMeasurement, SweepVerdict};
use crate::geometry::Real;

/// The GMT's pace between its stops, m/s: how fast the last trusted position ages.
const GMT_PACE_M_PER_S: f64 = 0.3;
/// A claim so many standard deviations from where the GMT was may be the wrong one of the two.
const APART_SIGMAS: f64 = 3.0;
/// The same for the mast, rad: twenty times what it is off by.
const TURNED_RAD: f64 = 0.02;

/// What a beacon claims, and what is taken instead when it is not believed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    verdict: BeaconVerdict,
    /// The GMT as it is taken so far.
    pub(super) taken: Transmitter,
    /// Where it was last, ageing.
    before: Option<Transmitter>,
    /// What became of the claim by the line of sight.
    shown: Option<Shown>,
}

/// What a line of sight says about a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Right,
    Wrong,
}

/// Rows of a path, their gate, and their chi-square.
type Weighed<T> = (PathRows<T>, f64, f64);

impl<T: Real, const N: usize> Filter<T, N> {
    /// The GMT as it would be taken if it claimed this at `time_ns`: an impossible place leaves the last possible one, ageing.
    pub fn plausible(&self, time_ns: u64, claimed: &Transmitter) -> Transmitter {
        if self.beacon.is_possible(time_ns, &claimed.position_m) {
            return *claimed;
        }
        self.before(time_ns, claimed).unwrap_or(*claimed)
    }

    /// The GMT as it was taken at the last sweep.
    pub fn transmitter(&self) -> Option<&Transmitter> {
        self.believed.as_ref()
    }

    /// Where the GMT was last, or was set up.
    fn before(&self, time_ns: u64, claimed: &Transmitter) -> Option<Transmitter> {
        if let Some((since, mut gmt)) = self.last_gmt {
            let moved = time_ns.saturating_sub(since) as f64 * 1e-9 * GMT_PACE_M_PER_S;
            gmt.sigma_m = libm::sqrt(gmt.sigma_m * gmt.sigma_m + moved * moved);
            return Some(gmt);
        }
        let setup = self.config.beacon.setup?;
        Some(Transmitter {
            position_m: setup.position_m,
            // Anywhere within.
            sigma_m: setup.within_m / libm::sqrt(3.0),
            ..*claimed
        })
    }

    /// The first judgement, by what a vehicle can do.
    pub(super) fn judge_beacon(&mut self, measurement: &SweepMeasurement<'_>) -> Claim {
        let (time_ns, claimed) = (measurement.time_ns, measurement.gmt);
        let before = self.before(time_ns, &claimed);
        let verdict = self.beacon.judge(time_ns, measurement.stop, &claimed.position_m);
        let taken = match (verdict, before) {
            (BeaconVerdict::Jumped, Some(before)) => {
                // Where it was set up ages from the first beacon on.
                self.last_gmt.get_or_insert((time_ns, before));
                before
            }
            _ => claimed,
        };
        Claim {
            verdict,
            taken,
            before,
            shown: None,
        }
    }

    /// The second, by a line of sight: the rows of the path from where the GMT is taken to be then.
    pub(super) fn weigh_beacon(
        &self,
        claim: &mut Claim,
        claimed: &Transmitter,
        path: &PathMeasurement,
    ) -> Option<Weighed<T>> {
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
        let Some(before) = claim.before else {
            return first;
        };
        let apart_m = (claimed.position_m - before.position_m).norm();
        if claim.verdict == BeaconVerdict::Jumped {
            // A pose that is not sure to less than the jump fits both.
            let told = APART_SIGMAS * self.sigma(POSITION) < apart_m;
            if told && let Some(weighed) = weigh(claimed).filter(fits) {
                (claim.taken, claim.shown) = (*claimed, Some(Shown::Right));
                return Some(weighed);
            }
            if first.as_ref().is_some_and(fits) {
                claim.shown = Some(Shown::Wrong);
            }
            return first;
        }
        if first.as_ref().is_none_or(fits) {
            return first;
        }
        let turned = claimed.attitude.matrix() - before.attitude.matrix();
        let doubtful =
            self.beacon_refuted || apart_m > APART_SIGMAS * before.sigma_m || turned.norm() > TURNED_RAD;
        match weigh(&before).filter(|weighed| doubtful && fits(weighed)) {
            Some(weighed) => {
                (claim.taken, claim.shown) = (before, Some(Shown::Wrong));
                Some(weighed)
            }
            None => first,
        }
    }

    /// The end of it: what is remembered, counted and flagged.
    pub(super) fn settle_beacon(
        &mut self,
        claim: &Claim,
        measurement: &SweepMeasurement<'_>,
        verdict: SweepVerdict,
    ) -> Transmitter {
        let (time_ns, claimed) = (measurement.time_ns, measurement.gmt);
        let jumped = claim.verdict == BeaconVerdict::Jumped;
        match claim.shown {
            Some(Shown::Right) => self.beacon.confirm(time_ns, &claimed.position_m),
            Some(Shown::Wrong) if verdict.is_taken() => self.beacon.refute(time_ns),
            _ => {}
        }
        if measurement.line_of_sight.is_some() {
            self.beacon_refuted = claim.shown == Some(Shown::Wrong);
        }
        let believed = match claim.shown {
            Some(shown) => shown == Shown::Right,
            None => !jumped || claim.before.is_none(),
        };
        if believed {
            self.last_gmt = Some((time_ns, claimed));
        } else {
            self.counters.beacons_refused = self.counters.beacons_refused.saturating_add(1);
        }
        self.health.beacon_implausible = !believed || claim.verdict == BeaconVerdict::Creeping;
        self.believed = Some(claim.taken);
        claim.taken
    }
}
