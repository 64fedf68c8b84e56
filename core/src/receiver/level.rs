//! How a UAV at rest is turned, before anything is known of its place: reflections tell.
//!
//! Above its beams the GMT is heard without an angle of departure, but the walls beside send its beams up. At rest the body
//! knows which way is down. Take the first path for the line of sight: then each other one that was reflected once closes
//! a triangle of known sides, and the direction in which it left the GMT says by how much the level body is turned about
//! the vertical. Those that were reflected more often say anything at all; so three that agree, of which each left the GMT
//! by another way, prove that the first path was direct, and tell the yaw ten times better than a compass. A reflection
//! taken for the line of sight mirrors the picture, and turns every other path by another angle.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use super::PATHS;
use super::paths::MeasuredPath;
use super::receive::length_m;
use super::sight::{AT_ONCE_M, first_of};
use crate::estimator::{LevelYaw, Transmitter, rotation};
use crate::receiver::{Radio, Receiver};

/// Lengths of a line of sight that a start may come from, m.
/// Derived: the tilt of rest is known to 20 mrad, of a longer way the end to nothing that is of use.
const RANGE_M: (f64, f64) = (1.0, 80.0);
/// Angles of departure that count, standard deviation, rad.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const DEPARTURE_SIGMA_RAD: f32 = 0.012;
/// How far the elevation of a departure may be off that of its triangle, sine.
/// Derived: thrice the tilt of rest.
const ELEVATION: f64 = 0.06;
/// Least horizontal part of a direction that has an azimuth.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const LEAST_LEVEL: f64 = 0.5;
/// Yaws within this of one another agree, rad: tilt again.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const SAME_YAW_RAD: f64 = 0.03;
/// Departures further apart than this in azimuth are different ways, rad: not two images of one wall.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const APART_RAD: f64 = 0.17;
/// Ways that must agree in a sweep, and sweeps in a row.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const WAYS: usize = 3;
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const SWEEPS: u8 = 3;
/// Sweeps agree within these: time s, place m, yaw rad.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const SAME: (f64, f64, f64) = (1.2, 0.25, 0.02);
/// Standard deviation of the yaw, rad.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const YAW_SIGMA_RAD: f64 = 0.012;
/// A leg shorter than this has no direction, m.
/// Numerical: a guard of a division.
const LEAST_LEG_M: f64 = 0.1;

/// A place and a yaw that sweeps agree on.
#[derive(Clone, Copy, Debug)]
pub(super) struct LevelFix {
    time_ns: u64,
    place_m: Vector3<f64>,
    yaw_rad: f64,
    sweeps: u8,
}

/// What one path says, if it was reflected once.
#[derive(Clone, Copy, Debug)]
struct Way {
    yaw_rad: f64,
    /// Azimuth of its departure, rad.
    left_rad: f64,
}

/// An angle in (-pi, pi].
fn wrapped(angle_rad: f64) -> f64 {
    libm::atan2(libm::sin(angle_rad), libm::cos(angle_rad))
}

/// Whether a direction is level enough to have an azimuth.
fn has_azimuth(v: &Vector3<f64>) -> bool {
    libm::hypot(v.x, v.y) > LEAST_LEVEL
}

/// The triangle of a path of this length that came along `seen` and left along `left`, beside a straight one of `range_m` along
/// `sight`: directions of arrival in level axes, of departure in world axes.
fn way(
    sight: &Vector3<f64>,
    range_m: f64,
    seen: &Vector3<f64>,
    length_m: f64,
    left: &Vector3<f64>,
) -> Option<Way> {
    let last_m = (length_m * length_m - range_m * range_m) / (2.0 * (length_m - range_m * seen.dot(sight)));
    let first_m = length_m - last_m;
    if !(first_m > LEAST_LEG_M && last_m > LEAST_LEG_M) {
        return None;
    }
    let out = (seen * last_m - sight * range_m) / first_m;
    if !(has_azimuth(&out) && has_azimuth(left) && (out.z - left.z).abs() < ELEVATION) {
        return None;
    }
    let left_rad = libm::atan2(left.y, left.x);
    Some(Way {
        yaw_rad: wrapped(left_rad - libm::atan2(out.y, out.x)),
        left_rad,
    })
}

/// The yaw of a body that sees the GMT along `sight`, in level axes, by a wave that left it along `left`, in world axes.
fn straight_yaw(sight: &Vector3<f64>, left: &Vector3<f64>) -> Option<f64> {
    let straight = has_azimuth(sight) && has_azimuth(left) && (sight.z + left.z).abs() < ELEVATION;
    straight.then(|| wrapped(libm::atan2(-left.y, -left.x) - libm::atan2(sight.y, sight.x)))
}

/// The yaw on which the most different ways agree, when those are enough.
fn agreed_yaw(ways: &[Way]) -> Option<f64> {
    let mut best = (0, 0.0);
    for middle in ways {
        let mut different = Vec::<f64, PATHS>::new();
        let mut sum = 0.0;
        for way in ways {
            let apart_rad = wrapped(way.yaw_rad - middle.yaw_rad);
            let new = |left: &f64| wrapped(way.left_rad - left).abs() > APART_RAD;
            if apart_rad.abs() < SAME_YAW_RAD
                && different.iter().all(new)
                && different.push(way.left_rad).is_ok()
            {
                sum += apart_rad;
            }
        }
        if different.len() > best.0 {
            best = (different.len(), middle.yaw_rad + sum / different.len() as f64);
        }
    }
    (best.0 >= WAYS).then(|| wrapped(best.1))
}

/// The yaw that triangles agree on, or else that of the line of sight. What both say must be one: else the first path was no
/// line of sight.
fn told_yaw(agreed: Option<f64>, direct: Option<f64>) -> Option<f64> {
    match (agreed, direct) {
        (Some(agreed), Some(direct)) if wrapped(agreed - direct).abs() > SAME_YAW_RAD => None,
        (agreed, direct) => agreed.or(direct),
    }
}

impl LevelFix {
    /// This sweep's fix with what it shares with the one before.
    fn after(self, before: Option<&Self>) -> Self {
        let same = before.filter(|before| {
            let dt_s = self.time_ns.saturating_sub(before.time_ns) as f64 * 1e-9;
            dt_s < SAME.0
                && (self.place_m - before.place_m).norm() < SAME.1
                && wrapped(self.yaw_rad - before.yaw_rad).abs() < SAME.2
        });
        Self {
            sweeps: same.map_or(1, |before| before.sweeps.saturating_add(1)),
            ..self
        }
    }
}

impl<R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'_, R, VOXELS, STATES> {
    /// Index of the path that is the line of sight of a UAV at rest, and how the UAV is turned, when the last sweeps agree on it.
    pub(super) fn level_start(
        &mut self,
        measured: &[MeasuredPath],
        gmt: &Transmitter,
        time_ns: u64,
    ) -> Option<(usize, LevelYaw)> {
        let found = self
            .localizer
            .level()
            .and_then(|level| self.level_fix(measured, &level, gmt, time_ns));
        let before = self.level_fix.take();
        let (first, fix) = found?;
        let fix = fix.after(before.as_ref());
        self.level_fix = Some(fix);
        let yaw = LevelYaw {
            yaw_rad: fix.yaw_rad,
            sigma_rad: YAW_SIGMA_RAD,
        };
        (fix.sweeps >= SWEEPS).then_some((first, yaw))
    }

    /// Where this sweep alone puts the UAV.
    fn level_fix(
        &self,
        measured: &[MeasuredPath],
        level: &Matrix3<f64>,
        gmt: &Transmitter,
        time_ns: u64,
    ) -> Option<(usize, LevelFix)> {
        let offset_m = self.offset_m(time_ns)?;
        let period = self.delay_period();
        let length = |path: &MeasuredPath| length_m(path.estimated.path.c_tau_m, offset_m, &period);
        let seen = |path: &MeasuredPath| level * path.estimated.path.aoa.vector().map(f64::from);
        let first = first_of(measured.iter().map(length), measured)?;
        let (sight, range_m) = measured.get(first).map(|path| (seen(path), length(path)))?;
        if !(RANGE_M.0..RANGE_M.1).contains(&range_m) {
            return None;
        }
        let mut ways = Vec::<Way, PATHS>::new();
        for path in measured.iter().filter(|path| length(path) > range_m + AT_ONCE_M) {
            let sure = |sigma: f32| sigma < DEPARTURE_SIGMA_RAD;
            if let Some(departure) = path.estimated.path.aod.filter(|aod| sure(aod.sigma_rad))
                && let left = departure.direction.vector().map(f64::from)
                && let Some(way) = way(&sight, range_m, &seen(path), length(path), &left)
            {
                // There is room for every path.
                let _fits = ways.push(way);
            }
        }
        let direct = measured.get(first).and_then(|path| {
            let left = path
                .estimated
                .path
                .aod
                .filter(|aod| aod.sigma_rad < DEPARTURE_SIGMA_RAD)?;
            let unreflected = self.is_unreflected(path, range_m);
            let left = left.direction.vector().map(f64::from);
            unreflected.then(|| straight_yaw(&sight, &left)).flatten()
        });
        let yaw_rad = told_yaw(agreed_yaw(&ways), direct)?;
        let place_m = gmt.position_m - rotation(&Vector3::new(0.0, 0.0, yaw_rad)) * sight * range_m;
        let ground = self.config.accept.point.ground_z_m;
        let fix = LevelFix {
            time_ns,
            place_m,
            yaw_rad,
            sweeps: 1,
        };
        ground
            .is_none_or(|ground_z_m| place_m.z > f64::from(ground_z_m))
            .then_some((first, fix))
    }
}

#[cfg(test)]
mod tests;
