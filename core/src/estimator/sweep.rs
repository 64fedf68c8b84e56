//! A sweep: line of sight, or what is left without it.

use super::Filter;
use super::claim::Claim;
use super::gate::{Innovation, chi_square};
use super::layout::{ATTITUDE, POSITION, VELOCITY};
use super::measurement::{LEAST_RANGE_M, MappedPlane, PATH_ROWS, PathMeasurement, PathRows, Transmitter};
use super::row::Row;
use super::sweep_measurement::{SweepMeasurement, SweepVerdict};
use super::watch::Step;
use super::window::WINDOW;
use crate::geometry::Real;
use nalgebra::Vector3;

/// Without aid from outside for this long, the pose is dead reckoning, ns.
/// Given: what the state is called; nothing is reckoned with it.
const DEAD_AFTER_NS: u64 = 2_000_000_000;
/// Fixes that tell a place and a velocity.
/// Derived: two tell a line, the third that they are right.
const PLACE_FIXES: u32 = 3;
/// Gates up to which a contradiction is small: it has grown little by little.
/// Derived: what runs off passes the gate's standard deviations in one sweep, and has not doubled them by the next.
const SMALL: f64 = 4.0;
/// Without a line of sight, believed or not, for this long, the filter lives on reflections and inertial data, ns.
/// Derived: of sweeps twice a second, two without one.
pub(super) const BLIND_AFTER_NS: u64 = 1_200_000_000;

/// Chi-square of three and of five rows that one sight in twenty is beyond.
/// Derived: quantiles of the chi-square.
const USUAL: (f64, f64) = (7.81, 11.07);

impl SweepVerdict {
    /// The verdict in words.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::NoSight => "no line of sight",
            Self::Accepted => "taken",
            Self::Held => "held until the next sweep agrees",
            Self::Rejected => "contradicts the filter",
            Self::Refixed => "set anew",
            Self::Started => "set for the first time",
            Self::Waiting => "kept for the start",
            Self::TooLate => "too late",
        }
    }

    /// Whether the line of sight corrected the pose, or set it.
    pub fn is_taken(self) -> bool {
        matches!(self, Self::Accepted | Self::Refixed | Self::Started)
    }
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes in a sweep at its own time stamp. Sweeps come in order; they may come late by the length of the history.
    pub fn sweep(&mut self, measurement: &SweepMeasurement<'_>) -> SweepVerdict {
        if measurement.time_ns < self.nominal.time_ns {
            self.counters.too_late = self.counters.too_late.saturating_add(1);
            return SweepVerdict::TooLate;
        }
        self.advance_to(measurement.time_ns);
        self.give_up_lost();
        self.question_start();
        let mut beacon = self.judge_beacon(measurement);
        let verdict = match &measurement.line_of_sight {
            Some(path) => self.line_of_sight(&mut beacon, path, measurement),
            None => match &measurement.contrary {
                Some(path) => self.contrary(&beacon.taken, path),
                None => SweepVerdict::NoSight,
            },
        };
        self.settle_beacon(&beacon, measurement.time_ns);
        let gmt = beacon.taken;
        if measurement.line_of_sight.is_some() {
            self.last_line_ns = measurement.time_ns;
        }
        let (lengths, moved_m) = self.lengths(&gmt, measurement);
        let sighted = verdict.is_taken();
        if sighted && measurement.line_of_sight.is_some() {
            self.sighted(&gmt);
        }
        if sighted {
            self.last_sight_ns = measurement.time_ns;
            self.last_aid_ns = measurement.time_ns;
        } else if self.running {
            self.reflections(&gmt, measurement.reflections);
            if measurement.delta_ranges {
                self.delta_ranges(&lengths, moved_m);
            }
        }
        if self.running {
            self.range_rates(measurement);
        }
        self.health.starting = !self.running;
        self.health.contested = verdict == SweepVerdict::Rejected;
        self.health.dead_reckoning = measurement.time_ns.saturating_sub(self.last_aid_ns) > DEAD_AFTER_NS;
        self.health.lost = self.running && self.sigma(POSITION) > self.gates().lost_m;
        self.health.attitude_lost = self.running && self.sigma(ATTITUDE) > self.gates().attitude_lost_rad;
        self.renew_head();
        self.tell(Step::Stands);
        verdict
    }

    fn line_of_sight(
        &mut self,
        beacon: &mut Claim,
        path: &PathMeasurement,
        sweep: &SweepMeasurement<'_>,
    ) -> SweepVerdict {
        let finite = path.c_tau_m + path.aoa_sigma_rad + path.c_tau_sigma_m;
        if !finite.is_finite() {
            return SweepVerdict::Rejected;
        }
        if !self.running {
            let gmt = &beacon.taken;
            self.push_fix(gmt, path);
            let started = self.has_clock() && self.try_start(gmt);
            return if started {
                SweepVerdict::Started
            } else {
                SweepVerdict::Waiting
            };
        }
        let weighed = self.weigh_beacon(beacon, path);
        let gmt = &beacon.taken;
        self.push_fix(gmt, path);
        let gates = self.gates();
        // Beyond this no linear correction finds the attitude back: the window does.
        if self.sigma(ATTITUDE) > gates.attitude_lost_rad && self.try_refix(gmt) {
            return SweepVerdict::Refixed;
        }
        let Some((mut rows, gate, mut chi2)) = weighed else {
            return SweepVerdict::Rejected;
        };
        if chi2 > gate
            && self.delay_stepped(&rows)
            && let Some(again) = self.rows(gmt, path, &[])
        {
            rows = again;
            chi2 = chi_square(&self.covariance, &rows);
        }
        self.ratios.line_of_sight = (chi2 / gate) as f32;
        let Some(innovation) = self.innovation(gmt, path) else {
            return SweepVerdict::Rejected;
        };
        let range = (gmt.position_m - self.nominal.position_m - innovation.offset_m).norm();
        let agrees = self
            .last_innovation
            .is_some_and(|before| before.agrees(&innovation, self.sigma(VELOCITY), range));
        let sigma = self.sigma(POSITION);
        let blind = sweep.time_ns.saturating_sub(self.last_line_ns) > BLIND_AFTER_NS;
        // Whether the filter was sure of itself when the contradiction began: what grows while it rejects does not count.
        if self.contested == 0 {
            self.sure = sigma < gates.trusted_m;
            let small = chi2 < SMALL * gate;
            self.doubtful = small && (blind || !self.sure);
            let in_sight = sweep.time_ns.saturating_sub(self.last_sight_ns) <= BLIND_AFTER_NS;
            self.parted = small && self.sure && in_sight;
        }
        self.last_innovation = Some(innovation);
        if chi2 <= gate {
            self.contested = 0;
            // After an outage almost any place is possible: one sweep is no proof, a consistent fix elsewhere may be a lie.
            let sure_enough = self.sure || agrees || sweep.self_consistent && blind;
            if !sure_enough && self.held < gates.refix_after {
                self.counters.held = self.counters.held.saturating_add(1);
                self.held = self.held.saturating_add(1);
                return SweepVerdict::Held;
            }
            let usual = if rows.len() == PATH_ROWS { USUAL.1 } else { USUAL.0 };
            if chi2 < usual {
                self.refute_timing(gmt);
            }
            self.take_rows(&rows);
            self.held = 0;
            self.last_innovation = Some(Innovation::none(self.nominal.time_ns));
            self.counters.accepted = self.counters.accepted.saturating_add(1);
            return SweepVerdict::Accepted;
        }
        self.counters.rejected = self.counters.rejected.saturating_add(1);
        self.contested = self.contested.saturating_add(1);
        if self.refixed(gmt, path) {
            return SweepVerdict::Refixed;
        }
        SweepVerdict::Rejected
    }

    /// How a path differs from the filter; a lost attitude is left out of it.
    fn innovation(&self, gmt: &Transmitter, path: &PathMeasurement) -> Option<Innovation> {
        let place = self.model.place(&self.nominal, gmt, path, &[])?;
        let turn_rad = if self.sigma(ATTITUDE) > self.gates().attitude_lost_rad {
            Vector3::zeros()
        } else {
            let seen = self.nominal.attitude * self.model.corrected(&path.aoa, &self.nominal);
            seen - (gmt.position_m - place).try_normalize(LEAST_RANGE_M)?
        };
        let range_m = (gmt.position_m - place).norm();
        // Without a departure the arrival tells the place, and no turn.
        let (across_sigma_rad, turn_sigma_rad) = match &path.departure {
            Some(departure) => {
                let left = departure.sigma_along(&((place - gmt.position_m) / range_m));
                (left, left.map(|sigma| libm::hypot(path.aoa_sigma_rad, sigma)))
            }
            None => (Vector3::repeat(path.aoa_sigma_rad), Vector3::zeros()),
        };
        Some(Innovation {
            time_ns: self.nominal.time_ns,
            offset_m: place - self.nominal.position_m,
            turn_rad,
            sigma: [
                across_sigma_rad.map(|sigma| libm::hypot(range_m * sigma, path.c_tau_sigma_m)),
                turn_sigma_rad,
            ],
        })
    }

    /// Patience is over: the last sweeps set the pose, if they agree. There is more of it than any run of equal outliers is long; but what
    /// contradicts a doubtful filter a little is believed as soon as sweeps can tell a place. An attitude that agrees with them is kept: after an outage the filter does not know its position, but still its attitude, and sweeps whose
    /// departures other paths have drawn aside contradict a filter that is right.
    fn refixed(&mut self, gmt: &Transmitter, path: &PathMeasurement) -> bool {
        let fixes = if self.doubtful {
            PLACE_FIXES
        } else {
            self.gates().refix_after
        };
        if self.contested < fixes {
            return false;
        }
        // Of a longer patience the window keeps the end.
        let refixed = self.try_refix_contested(gmt, path, (fixes as usize).min(WINDOW));
        if refixed
            && self.parted
            && !self.timing_contradicts()
            && let Some(departure) = self.window.departure()
        {
            self.doubt_timing(&departure);
        }
        refixed
    }

    /// Whether the delay alone is wrong and two-way timing says why.
    fn delay_stepped(&mut self, rows: &PathRows<T>) -> bool {
        let residual = rows.first().map_or(0.0, |row| row.residual.to_f64());
        self.clock_step_by_delay(residual)
    }

    /// The rows of a path, linearised about the state, or where the path puts the UAV when the state is not sure of that. Without
    /// those of arrival when the attitude is lost.
    pub(super) fn rows(
        &self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        bounces: &[(&MappedPlane, usize)],
    ) -> Option<PathRows<T>> {
        let gates = self.gates();
        let mut rows = if self.sigma(POSITION) > gates.trusted_m {
            self.model.rows_from_afar(&self.nominal, gmt, path, bounces)?
        } else {
            self.model.rows(&self.nominal, gmt, path, bounces)?
        };
        if self.sigma(ATTITUDE) > gates.attitude_lost_rad && rows.len() == PATH_ROWS {
            // No linear correction finds a lost attitude back, but a wrong one can be made to look sure. Where the UAV is, delay
            // and departure tell by themselves; the window finds the attitude.
            let mut without = PathRows::new();
            for row in rows.iter().take(1).chain(rows.iter().skip(3)) {
                without.push(*row).ok()?;
            }
            rows = without;
        }
        Some(rows)
    }

    /// Takes in the rows of one path, one after the other.
    pub(super) fn take_rows(&mut self, rows: &[Row<T>]) {
        let mut dx = [T::zero(); N];
        for row in rows {
            let rest = row.residual - row.dot(&dx);
            if let Some(gain) = self.covariance.update(row) {
                for (x, k) in dx.iter_mut().zip(&gain) {
                    *x += *k * rest;
                }
                if row.origin_sigma() > T::zero() {
                    self.covariance.spread(&gain.map(|k| k * row.origin_sigma()));
                }
            }
        }
        self.correct(&dx);
    }
}
