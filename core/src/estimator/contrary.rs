//! Signs that the whole pose is wrong, and a pose begun anew.
//!
//! A start may be an image: a wave that a wall has turned shows a place beyond the wall, with every number in order, and a filter
//! that believes it never looks at the true line of sight again. Two things tell. A magnetic heading, where there is one, contradicts
//! an attitude that is that of an image. And nothing arrives before the straight way: a path as strong as through free
//! space that is shorter than the pose allows proves the pose wrong, whatever the path is. A longer one proves nothing,
//! since the line of sight may be hidden behind a wall that reflects.
//! Where the sweeps that prove a pose wrong do not tell the right one, there is none: it is sought as at the start. So it is when a pose is lost
//! before it was confirmed.
//!
//! Confirmed is a pose whose lines of sight have been seen to turn: an image turns the other way, so that it would have contradicted
//! the gyroscope by twice the angle.

use nalgebra::{Matrix3, Vector3};

use super::layout::{ATTITUDE, CLOCK_OFFSET, POSITION};
use super::measurement::{LEAST_RANGE_M, PathMeasurement, Transmitter};
use super::sweep_measurement::SweepVerdict;
use super::tilt::CARRIED_NS;
use super::window::{Solution, WINDOW};
use super::{Filter, attitude};
use crate::geometry::Real;
use crate::inertial::{HeadingRefusal, MagneticField};

/// A magnetic field older than this says nothing of an attitude, ns.
/// Derived: a UAV turns by a degree in that time.
const FIELD_AGE_NS: u64 = 100_000_000;

/// An image in an upright wall is turned by more than this, rad: 18 degrees.
/// Measured: the images of 500 starts were turned by 23 and more, and the right windows that set a pose anew by 4 to 8 (tuning flights).
const IMAGE_TURN_RAD: f64 = 0.314;

/// Up to this standard deviation, norm of three axes, an attitude tells by the two ends of a path whether a wall has turned it, rad: 3 degrees.
/// Derived: six standard deviations are the turn of an image.
const TELLS_IMAGE_RAD: f64 = IMAGE_TURN_RAD / 6.0;

/// What speaks for the pose and what against it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Doubt {
    /// When the pose was set, ns.
    since_ns: u64,
    /// Sweeps in a row in which the magnetic heading contradicted it.
    misled: u32,
    /// Contrary sweeps in a row.
    contrary: u32,
    /// Direction from the GMT in the first sweep that agreed with the pose, and by how much it must turn to confirm it, rad.
    first: Option<(Vector3<f64>, f64)>,
    pub(super) confirmed: bool,
}

/// A sample of the magnetometer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Magnetic {
    time_ns: u64,
    field: MagneticField,
    seen_ut: Vector3<f32>,
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes note of the magnetic field (uT, body axes): a pose that is set anew must agree with its heading.
    pub fn magnetic(&mut self, time_ns: u64, field: &MagneticField, seen_ut: &Vector3<f32>) {
        self.magnetic = Some(Magnetic {
            time_ns,
            field: *field,
            seen_ut: *seen_ut,
        });
    }

    /// Whether the line of sight has turned by enough since the pose was set to tell it from an image.
    pub fn is_confirmed(&self) -> bool {
        self.running && self.doubt.confirmed
    }

    /// Whether the magnetic heading does not contradict an attitude of this covariance, rad^2, by a chi-square beyond `gate`. No heading, or
    /// a disturbed one, contradicts nothing.
    pub(super) fn heading_allows(
        &mut self,
        turned: &Matrix3<f64>,
        covariance: &Matrix3<f64>,
        gate: f64,
    ) -> bool {
        let (Some(magnetic), Some(attitude)) = (&self.magnetic, attitude(turned)) else {
            return true;
        };
        if self.nominal.time_ns.abs_diff(magnetic.time_ns) > FIELD_AGE_NS {
            return true;
        }
        let covariance = covariance.map(|c| c as f32);
        let heading = magnetic.field.heading(&magnetic.seen_ut, &attitude, &covariance);
        let allows = match heading {
            Ok(heading) => {
                let (off, own) = (f64::from(heading.yaw_error_rad), f64::from(heading.sigma_rad));
                let floor = self.config.radio.heading_rad;
                off * off <= gate * (own * own + floor * floor)
            }
            Err(HeadingRefusal::Tilted) => false,
            Err(HeadingRefusal::Disturbed | HeadingRefusal::NotFinite) => true,
        };
        if !allows {
            self.counters.starts_refused = self.counters.starts_refused.saturating_add(1);
        }
        allows
    }

    /// The pose was set: nothing speaks for it yet.
    pub(super) fn doubt_anew(&mut self) {
        self.doubt = Doubt {
            since_ns: self.nominal.time_ns,
            ..Doubt::default()
        };
    }

    /// A line of sight was taken in: it speaks for the pose.
    pub(super) fn sighted(&mut self, gmt: &Transmitter) {
        self.doubt.contrary = 0;
        let Some(way) = (self.nominal.position_m - gmt.position_m).try_normalize(LEAST_RANGE_M) else {
            return;
        };
        // An image turns by twice the angle against the gyroscope: beyond the gate of an attitude as unsure as this one.
        let gate = libm::sqrt(self.config.gates.three);
        let needed = 0.5 * gate * self.sigma(ATTITUDE);
        let (first, needed_rad) = *self.doubt.first.get_or_insert((way, needed));
        self.doubt.confirmed |= libm::atan2(first.cross(&way).norm(), first.dot(&way)) > needed_rad;
    }

    /// A sweep whose first path is as strong as through free space and not from where the pose has the GMT.
    pub(super) fn contrary(&mut self, gmt: &Transmitter, path: &PathMeasurement) -> SweepVerdict {
        if !(self.running && path.c_tau_m.is_finite() && path.c_tau_sigma_m.is_finite()) {
            return SweepVerdict::NoSight;
        }
        self.push_fix(gmt, path);
        if !self.late_of_gate(gmt, path).is_some_and(|late| late < -1.0) {
            return SweepVerdict::NoSight;
        }
        self.doubt.contrary = self.doubt.contrary.saturating_add(1);
        self.counters.contrary = self.counters.contrary.saturating_add(1);
        let patience = self.gates().refix_after;
        if self.doubt.contrary >= patience && self.begin_anew(gmt) {
            return SweepVerdict::Refixed;
        }
        // What a wrong pose has taught of the inertial sensor bends the window as well: from now on it learns without.
        if self.doubt.contrary >= 2 * patience {
            self.begin_without_pose();
        }
        SweepVerdict::Rejected
    }

    /// Asks again what was asked at the start, for as long as the inertial sensor carries an attitude on and nothing has confirmed it: whether
    /// the magnetic heading contradicts the attitude, which is better known by now. A pose that it contradicts sweep after sweep is given up; a
    /// field that is disturbed in passing costs none.
    pub(super) fn question_start(&mut self) {
        let age_ns = self.nominal.time_ns.saturating_sub(self.doubt.since_ns);
        if !self.running || self.doubt.confirmed || age_ns > CARRIED_NS {
            return;
        }
        let covariance = self.covariance.block(ATTITUDE, ATTITUDE).map(T::to_f64);
        let (attitude, gate) = (self.nominal.attitude, self.config.gates.one);
        if self.heading_allows(&attitude, &covariance, gate) {
            self.doubt.misled = 0;
            return;
        }
        self.doubt.misled = self.doubt.misled.saturating_add(1);
        if self.doubt.misled >= self.gates().refix_after {
            self.begin_without_pose();
        }
    }

    /// Gives up a pose that is lost before a sight has confirmed it, once its attitude does not tell an image by its two ends: it would follow
    /// the first one, and knows nothing that a start does not find.
    pub(super) fn give_up_lost(&mut self) {
        let lost = self.sigma(POSITION) > self.gates().lost_m && self.sigma(ATTITUDE) > TELLS_IMAGE_RAD;
        if self.running && lost && !self.doubt.confirmed {
            self.begin_without_pose();
        }
    }

    /// Whether the last sweeps may be of an image although they agree: nothing in them tells it, and either sights have confirmed the attitude
    /// that they contradict, or `path`, the last of them, is longer than the straight way, which proves nothing. Where they turn it about
    /// the vertical by as much as an image is turned, they or the pose are one, and that it is the pose only a path shorter than the straight way
    /// proves. (An image leans as well: accelerations are mirrored in it.)
    pub(super) fn may_be_image(
        &self,
        gmt: &Transmitter,
        path: &PathMeasurement,
        solution: &Solution,
    ) -> bool {
        let turn = self.turn(solution);
        let yawed_rad = libm::atan2(turn.m21 - turn.m12, turn.m11 + turn.m22).abs();
        let allowed = if yawed_rad > IMAGE_TURN_RAD { -1.0 } else { 1.0 };
        let late = || self.late_of_gate(gmt, path).is_some_and(|late| late > allowed);
        !solution.is_no_image && (self.doubt.confirmed || late())
    }

    /// By how much a path is longer than the straight way, in units of the gate of a scalar; `None` at the GMT.
    fn late_of_gate(&self, gmt: &Transmitter, path: &PathMeasurement) -> Option<f64> {
        let way = gmt.position_m - self.nominal.position_m;
        let l = way.try_normalize(LEAST_RANGE_M)?;
        let late_m = path.c_tau_m - self.nominal.clock_offset_m - way.norm();
        let late_m = self.nominal.delay_period.wrap_m(late_m);
        let along = self.covariance.block(POSITION, POSITION).map(T::to_f64) * l;
        let variance = l.dot(&along)
            + self.variance(CLOCK_OFFSET)
            + path.c_tau_sigma_m * path.c_tau_sigma_m
            + self.config.radio.delay_m * self.config.radio.delay_m
            + gmt.sigma_m * gmt.sigma_m;
        Some(late_m / libm::sqrt(self.config.gates.one * variance))
    }

    /// Forgets everything but the clock, what the sensors' errors were found to be included: a wrong pose has bent that too. The
    /// last sweeps set the pose, if they agree.
    fn begin_anew(&mut self, gmt: &Transmitter) -> bool {
        let Some(solution) = self.window.solve(WINDOW, None) else {
            return false;
        };
        if !self.is_acceptable(&solution) {
            return false;
        }
        let (off, departure) = (self.timing_is_off(), self.window.departure());
        self.begin_without_pose();
        self.set_pose(gmt, &solution);
        self.unlearn_accel_bias();
        if off && let Some(departure) = departure {
            self.doubt_timing(&departure);
        }
        self.running = true;
        self.counters.refixes = self.counters.refixes.saturating_add(1);
        true
    }

    /// Forgets everything but the clock.
    fn begin_without_pose(&mut self) {
        let (offset_m, bias_m) = (self.nominal.clock_offset_m, self.nominal.two_way_bias_m);
        let drift_m_per_s = self.nominal.clock_drift_m_per_s;
        self.restart();
        // The clock is two-way timing's, to its gate, whatever the pose was.
        let two_way_m = self.config.radio.two_way_m;
        self.set_clock(offset_m + bias_m, self.gates().one * two_way_m * two_way_m);
        self.nominal.clock_drift_m_per_s = drift_m_per_s;
        self.clock_known = true;
    }
}
