//! From a tour of straight lines to a smooth trajectory within the limits of the quadrotor.
//!
//! The tour is walked at a speed that is low at sharp corners; the places reached every knot interval, smoothed, are
//! the control points of the curve. Limits are checked on control differences and tilt on the curve; where one is
//! exceeded, or where the caller finds the curve too near a wall, the corners around are slowed and the tour is walked
//! again. As a corner's speed goes to zero the curve goes to the tour itself, which is free: the loop ends.

use core::f64::consts::PI;

use nalgebra::Vector3;

use super::knots::{KNOT_S, SMOOTHING, smooth, still};
use super::{Limits, Spline, Trajectory, heading};

/// Speed is integrated in this many steps a knot.
const STEPS: u32 = 8;
/// Lowest speed, m/s.
const CREEP_M_PER_S: f64 = 0.05;
/// Rounds of slowing before a tour is given up.
const ROUNDS: usize = 60;

/// A tour with the speed at each of its corners and on each of its lines.
#[derive(Clone, Debug)]
pub(super) struct Route {
    corners: Vec<Vector3<f64>>,
    /// Length of the tour up to each corner, m.
    along_m: Vec<f64>,
    corner_speed: Vec<f64>,
    line_speed: Vec<f64>,
}

impl Route {
    /// A route along `corners` at `cruise(line number)` m/s. `None` for fewer than two different corners.
    pub(super) fn new(
        corners: Vec<Vector3<f64>>,
        limits: &Limits,
        mut cruise: impl FnMut() -> f64,
    ) -> Option<Self> {
        let mut along_m = vec![0.0];
        for line in corners.windows(2) {
            let length = (line[1] - line[0]).norm();
            (length > 0.0).then_some(())?;
            along_m.push(along_m[along_m.len() - 1] + length);
        }
        (corners.len() > 1).then_some(())?;
        let line_speed: Vec<f64> = corners.windows(2).map(|_| cruise()).collect();
        // The turn of velocity, 2 v sin(angle / 2), is spread over a few knots: this leaves a margin to the limit.
        let turning = limits.acceleration_m_per_s2 * KNOT_S;
        let corner_speed = (0..corners.len())
            .map(|k| match (k.checked_sub(1), corners.get(k + 1)) {
                (Some(before), Some(after)) => {
                    let arriving = (corners[k] - corners[before]).normalize();
                    let leaving = (after - corners[k]).normalize();
                    let half_turn = 0.5 * (leaving - arriving).norm();
                    turning / half_turn.max(1e-3)
                }
                _ => CREEP_M_PER_S,
            })
            .collect();
        Some(Self {
            corners,
            along_m,
            corner_speed,
            line_speed,
        })
    }

    /// Length, m.
    fn length_m(&self) -> f64 {
        self.along_m[self.along_m.len() - 1]
    }

    /// Speed at each corner once acceleration along the tour is bounded too.
    fn reachable(&self, acceleration: f64) -> Vec<f64> {
        let mut speed = self.corner_speed.clone();
        for (k, speed) in speed.iter_mut().enumerate() {
            for line in [k.checked_sub(1), Some(k)].into_iter().flatten() {
                *speed = speed.min(self.line_speed.get(line).copied().unwrap_or(f64::INFINITY));
            }
        }
        let gain = |k: usize| 2.0 * acceleration * (self.along_m[k + 1] - self.along_m[k]);
        for k in 0..speed.len() - 1 {
            speed[k + 1] = speed[k + 1].min((speed[k] * speed[k] + gain(k)).sqrt());
        }
        for k in (0..speed.len() - 1).rev() {
            speed[k] = speed[k].min((speed[k + 1] * speed[k + 1] + gain(k)).sqrt());
        }
        speed
    }

    /// Walks the tour: its length at each of `count` control points, standing for the first `still` of them.
    fn walk(&self, acceleration: f64, still: usize, count: usize) -> Vec<f64> {
        let speed = self.reachable(acceleration);
        let step_s = KNOT_S / f64::from(STEPS);
        let (mut here, mut line) = (0.0, 0);
        let mut places = vec![0.0; still.min(count)];
        while places.len() < count {
            for _ in 0..STEPS {
                while line + 2 < self.along_m.len() && here >= self.along_m[line + 1] {
                    line += 1;
                }
                let from = 2.0 * acceleration * (here - self.along_m[line]).max(0.0);
                let to = 2.0 * acceleration * (self.along_m[line + 1] - here).max(0.0);
                let v = (speed[line] * speed[line] + from)
                    .min(speed[line + 1] * speed[line + 1] + to)
                    .sqrt()
                    .min(self.line_speed[line])
                    .max(CREEP_M_PER_S);
                here = (here + v * step_s).min(self.length_m());
            }
            places.push(here);
        }
        places
    }

    /// Point of the tour `along_m` from its start.
    fn point(&self, along_m: f64) -> Vector3<f64> {
        let line = self
            .along_m
            .partition_point(|&a| a <= along_m)
            .clamp(1, self.corners.len() - 1)
            - 1;
        let share = (along_m - self.along_m[line]) / (self.along_m[line + 1] - self.along_m[line]);
        self.corners[line] + (self.corners[line + 1] - self.corners[line]) * share.clamp(0.0, 1.0)
    }

    /// Slows the corners within `reach` control points of one that is at fault; the lines there when none is.
    fn slow(&mut self, places: &[f64], fault: usize, reach: usize) {
        let low = places[fault.saturating_sub(reach).min(places.len() - 1)] - 0.1;
        let high = places[(fault + reach).min(places.len() - 1)] + 0.1;
        let mut any = false;
        for (speed, &along) in self.corner_speed.iter_mut().zip(&self.along_m) {
            if (low..=high).contains(&along) && *speed > CREEP_M_PER_S {
                *speed = (*speed * 0.8).max(CREEP_M_PER_S);
                any = true;
            }
        }
        if !any {
            let along = places[fault.min(places.len() - 1)];
            let line = self
                .along_m
                .partition_point(|&a| a <= along)
                .clamp(1, self.corners.len() - 1)
                - 1;
            self.line_speed[line] = (self.line_speed[line] * 0.85).max(CREEP_M_PER_S);
        }
    }

    /// The trajectory of this route over `duration_s`, after standing for `rest_s`. `clear` tells whether the curve
    /// keeps its distance between two instants. `None` when no speed is slow enough or the tour is too short.
    pub(super) fn fly(
        mut self,
        limits: &Limits,
        drag_per_s: f64,
        rest_s: f64,
        duration_s: f64,
        clear: impl Fn(&Trajectory, f64, f64) -> bool,
    ) -> Option<Trajectory> {
        let count = (duration_s / KNOT_S) as usize + 8;
        let still = still(rest_s);
        for _ in 0..ROUNDS {
            let places = self.walk(0.5 * limits.acceleration_m_per_s2, still, count);
            if places[count - 1] >= self.length_m() {
                return None;
            }
            let mut control: Vec<Vector3<f64>> = places.iter().map(|&s| self.point(s)).collect();
            for _ in 0..SMOOTHING {
                control = smooth(&control);
            }
            let heading = heading::along(&control, limits)?;
            let trajectory = Trajectory::new(Spline::new(control, KNOT_S)?, heading, drag_per_s);
            let mut faults = over_limit(&trajectory, limits, duration_s);
            if faults.is_empty() {
                faults = too_near(&trajectory, duration_s, &clear);
            }
            if faults.is_empty() {
                return Some(trajectory);
            }
            for fault in faults {
                self.slow(&places, fault, 4 + 2 * SMOOTHING);
            }
        }
        None
    }
}

/// Control points at which a limit is exceeded, one for each stretch.
fn over_limit(trajectory: &Trajectory, limits: &Limits, duration_s: f64) -> Vec<usize> {
    let mut faults = Vec::new();
    let bounds = [
        limits.speed_m_per_s,
        limits.acceleration_m_per_s2,
        limits.jerk_m_per_s3,
    ];
    for (order, bound) in (1..).zip(bounds) {
        let over = trajectory.position_m().derivative_bounds(order);
        faults.extend(
            over.iter()
                .enumerate()
                .filter(|&(_, &size)| size > bound)
                .map(|(k, _)| k + order / 2),
        );
    }
    let tilt = limits.tilt_deg * PI / 180.0;
    let instants = (duration_s / 0.05) as u32;
    for k in 0..=instants {
        let time_s = f64::from(k) * 0.05;
        if trajectory.at(time_s).tilt_rad() > tilt {
            faults.push((time_s / KNOT_S) as usize + 2);
        }
    }
    stretches(faults)
}

/// Control points around which the curve comes too near an obstacle, one for each stretch.
fn too_near(
    trajectory: &Trajectory,
    duration_s: f64,
    clear: impl Fn(&Trajectory, f64, f64) -> bool,
) -> Vec<usize> {
    let step_s = KNOT_S / 2.0;
    let faults = (0..(duration_s / step_s) as u32 + 1)
        .map(|k| f64::from(k) * step_s)
        .filter(|&time_s| !clear(trajectory, time_s, time_s + step_s))
        .map(|time_s| (time_s / KNOT_S) as usize + 2);
    stretches(faults.collect())
}

/// Every third of a run of neighbouring faults: slowing works over several control points, once is enough.
fn stretches(mut faults: Vec<usize>) -> Vec<usize> {
    faults.sort_unstable();
    let mut kept: Vec<usize> = Vec::new();
    for fault in faults {
        if kept.last().is_none_or(|&last| fault >= last + 6) {
            kept.push(fault);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zigzag() -> Vec<Vector3<f64>> {
        (0..40)
            .map(|k| (f64::from(k), f64::from(k % 4)))
            .map(|(x, bend)| Vector3::new(6.0 * x, 9.0 * bend, 5.0 + 2.0 * libm::sin(x)))
            .collect()
    }

    fn fly(corners: Vec<Vector3<f64>>, limits: &Limits) -> Option<Trajectory> {
        Route::new(corners, limits, || 6.0)?.fly(limits, 0.15, 3.0, 60.0, |_, _, _| true)
    }

    #[test]
    fn limits_hold_between_the_samples_of_any_grid() {
        for limits in [
            Limits::default(),
            Limits {
                acceleration_m_per_s2: 1.0,
                jerk_m_per_s3: 2.0,
                ..Limits::default()
            },
            Limits {
                tilt_deg: 8.0,
                heading_rate_dps: 20.0,
                ..Limits::default()
            },
        ] {
            let flight = fly(zigzag(), &limits).expect("possible");
            let mut top_speed = 0.0f64;
            for k in 0..=30_000 {
                let at = flight.at(f64::from(k) * 0.002);
                top_speed = top_speed.max(at.velocity_m_per_s.norm());
                assert!(at.acceleration_m_per_s2.norm() <= limits.acceleration_m_per_s2);
                assert!(at.tilt_rad() <= limits.tilt_deg * PI / 180.0 + 1e-4);
            }
            assert!(
                top_speed <= limits.speed_m_per_s && top_speed > 1.0,
                "{top_speed}"
            );
            let jerk = flight
                .position_m()
                .derivative_bounds(3)
                .into_iter()
                .fold(0.0, f64::max);
            assert!(jerk <= limits.jerk_m_per_s3);
            for pair in (0..600).map(|k| f64::from(k) * 0.1) {
                let heading = |t| {
                    let x = flight.at(t).attitude.matrix().column(0).into_owned();
                    libm::atan2(x.y, x.x)
                };
                let turn = heading(pair + 0.1) - heading(pair);
                let turn = turn - 2.0 * PI * libm::floor(turn / (2.0 * PI) + 0.5);
                // Tilt turns the projected nose a little beyond the heading itself.
                assert!(
                    turn.abs() <= 0.1 * (limits.heading_rate_dps + 15.0) * PI / 180.0,
                    "{turn} at {pair}"
                );
            }
        }
    }

    #[test]
    fn it_rests_exactly_then_follows_the_tour_nose_first() {
        let corners = vec![
            Vector3::new(0.0, 0.0, 5.0),
            Vector3::new(100.0, 100.0, 5.0),
            Vector3::new(400.0, 100.0, 9.0),
        ];
        let flight = fly(corners, &Limits::default()).expect("possible");
        for k in 0..=300 {
            let at = flight.at(f64::from(k) * 0.01);
            assert!(at.velocity_m_per_s.norm() < 1e-12);
            assert!(at.rate_rad_per_s.norm() < 1e-12);
        }
        let cruising = flight.at(20.0);
        let nose = cruising.attitude * Vector3::x();
        assert!(cruising.velocity_m_per_s.norm() > 3.0);
        assert!((libm::atan2(nose.y, nose.x) - PI / 4.0).abs() < 1e-6);
    }

    #[test]
    fn a_narrow_corridor_slows_the_corners_until_the_curve_fits() {
        let corners = zigzag();
        let lines: Vec<_> = corners.windows(2).map(|w| (w[0], w[1])).collect();
        let off = |p: &Vector3<f64>| {
            lines.iter().fold(f64::INFINITY, |least, (a, b)| {
                let share = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                least.min((a + (b - a) * share - p).norm())
            })
        };
        let within = |width_m: f64| {
            let limits = Limits::default();
            let clear = |flight: &Trajectory, from: f64, _: f64| off(&flight.at(from).position_m) < width_m;
            let flight =
                Route::new(corners.clone(), &limits, || 6.0)?.fly(&limits, 0.15, 3.0, 60.0, clear)?;
            Some(
                (0..600)
                    .map(|k| off(&flight.at(f64::from(k) * 0.1).position_m))
                    .fold(0.0, f64::max),
            )
        };
        let free = within(1e3).expect("possible");
        let narrow = within(0.2).expect("possible");
        assert!(free > 0.3 && narrow < 0.22, "{free} {narrow}");
    }

    #[test]
    fn a_tour_that_is_too_short_is_refused() {
        let here = Vector3::new(0.0, 0.0, 5.0);
        assert!(fly(vec![here, here + Vector3::x() * 20.0], &Limits::default()).is_none());
        assert!(Route::new(vec![here], &Limits::default(), || 6.0).is_none());
        assert!(Route::new(vec![here, here], &Limits::default(), || 6.0).is_none());
    }
}
