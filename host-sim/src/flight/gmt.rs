//! The drive of the GMT: from stop to stop on the ground, standing still whenever it sounds.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// When the GMT sounds and moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Schedule {
    /// Time from sweep to sweep, s.
    pub sweep_period_s: f64,
    /// The GMT moves once every this many sweeps (T_c of the paper).
    pub sweeps_per_stop: u32,
}

impl Default for Schedule {
    fn default() -> Self {
        Self {
            sweep_period_s: 0.5,
            sweeps_per_stop: 2,
        }
    }
}

impl Schedule {
    /// Start of sweep `sweep` (from 0) by the GMT clock, s. The first one is a period after the flight begins.
    pub fn sweep_time_s(&self, sweep: u32) -> f64 {
        (f64::from(sweep) + 1.0) * self.sweep_period_s
    }

    /// Number of sweeps that start up to `time_s`.
    pub fn sweeps_until(&self, time_s: f64) -> u32 {
        // Sweeps at exactly the end count although the quotient may be rounded down.
        (time_s / self.sweep_period_s + 1e-9).max(0.0) as u32
    }
}

/// The GMT stays for this long after the start of a sweep and is back at rest as long before the next one, s: sweep,
/// beam squint symbols and beacon last about a millisecond.
const STANDING_S: f64 = 0.01;

/// Stops of the GMT, one for every `sweeps_per_stop` sweeps.
#[derive(Clone, Debug, PartialEq)]
pub struct GmtTrack {
    stops_m: Vec<Vector3<f64>>,
    schedule: Schedule,
}

impl GmtTrack {
    /// A track over antenna positions; the last stop is kept for ever. `None` without a stop.
    pub fn new(stops_m: Vec<Vector3<f64>>, schedule: Schedule) -> Option<Self> {
        (!stops_m.is_empty()).then_some(Self { stops_m, schedule })
    }

    /// Stops every `step_m` along a way, as many as asked; the last point of the way is kept when it is too short.
    pub(super) fn along(way: &[Vector3<f64>], step_m: f64, stops: usize, schedule: Schedule) -> Option<Self> {
        let mut left_m = 0.0;
        let mut stops_m: Vec<Vector3<f64>> = way.first().copied().into_iter().collect();
        for line in way.windows(2) {
            let length = (line[1] - line[0]).norm();
            let mut along_m = step_m - left_m;
            while along_m <= length && stops_m.len() < stops && step_m > 0.0 {
                stops_m.push(line[0] + (line[1] - line[0]) * (along_m / length));
                along_m += step_m;
            }
            left_m = length - (along_m - step_m);
        }
        Self::new(stops_m, schedule)
    }

    /// The same track with each stop elsewhere.
    #[must_use]
    pub(super) fn with_stops(self, at: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Self {
        let stops_m = self.stops_m.iter().map(at).collect();
        Self { stops_m, ..self }
    }

    /// Antenna positions of the stops, m.
    pub fn stops_m(&self) -> &[Vector3<f64>] {
        &self.stops_m
    }

    /// Position (m) and velocity (m/s) of the antenna at `time_s`.
    pub fn at(&self, time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let period_s = self.schedule.sweep_period_s;
        let per_stop = self.schedule.sweeps_per_stop.max(1) as usize;
        // Sweeps that have begun; the tolerance keeps a sweep's own instant on its side.
        let begun = (time_s / period_s + 1e-9).max(0.0) as usize;
        let stop = begun.saturating_sub(1) / per_stop;
        let here = self.stop(stop);
        if begun == 0 || !begun.is_multiple_of(per_stop) {
            return (here, Vector3::zeros());
        }
        let standing_s = STANDING_S.min(period_s / 4.0);
        let drive_s = period_s - 2.0 * standing_s;
        let u = ((time_s - begun as f64 * period_s - standing_s) / drive_s).clamp(0.0, 1.0);
        // Rest to rest with continuous acceleration: 10 u^3 - 15 u^4 + 6 u^5.
        let share = u * u * u * (10.0 + u * (6.0 * u - 15.0));
        let rate = 30.0 * u * u * (1.0 - u) * (1.0 - u) / drive_s;
        let way = self.stop(stop + 1) - here;
        (here + way * share, way * rate)
    }

    fn stop(&self, number: usize) -> Vector3<f64> {
        let last = self.stops_m.len() - 1;
        self.stops_m[number.min(last)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track() -> GmtTrack {
        let way = [
            Vector3::new(0.0, 0.0, 1.5),
            Vector3::new(0.5, 0.0, 1.5),
            Vector3::new(0.5, 5.0, 1.5),
        ];
        GmtTrack::along(&way, 0.2, 10, Schedule::default()).expect("stops")
    }

    #[test]
    fn stops_are_a_step_apart_along_the_way() {
        let track = track();
        assert_eq!(track.stops_m().len(), 10);
        assert!((track.stops_m()[2] - Vector3::new(0.4, 0.0, 1.5)).norm() < 1e-12);
        // 0.6 m along the way: a corner at 0.5 m lies behind.
        assert!((track.stops_m()[3] - Vector3::new(0.5, 0.1, 1.5)).norm() < 1e-12);
        assert!((track.stops_m()[9] - Vector3::new(0.5, 1.3, 1.5)).norm() < 1e-12);
    }

    #[test]
    fn it_stands_still_in_every_sweep_and_moves_every_t_c() {
        let (track, schedule) = (track(), Schedule::default());
        for sweep in 0..20u32 {
            let start = schedule.sweep_time_s(sweep);
            for after in [0.0, 0.0003, 0.005] {
                let (position, velocity) = track.at(start + after);
                assert_eq!(position, track.stops_m()[(sweep / 2) as usize], "sweep {sweep}");
                assert_eq!(velocity, Vector3::zeros(), "sweep {sweep}");
            }
        }
        assert_eq!(track.at(0.0).0, track.stops_m()[0]);
        assert_eq!(track.at(1e3).0, track.stops_m()[9]);
    }

    #[test]
    fn the_drive_is_continuous_and_its_velocity_is_the_derivative() {
        let (track, h) = (track(), 1e-6);
        let mut moved = false;
        for k in 1..4000 {
            let t = f64::from(k) * 0.001 + 0.0005;
            let (before, after) = (track.at(t - h).0, track.at(t + h).0);
            let velocity = track.at(t).1;
            assert!(((after - before) / (2.0 * h) - velocity).norm() < 1e-4, "at {t}");
            moved |= velocity.norm() > 0.5;
        }
        assert!(moved);
    }

    #[test]
    fn sweeps_are_counted_to_the_end() {
        let schedule = Schedule::default();
        assert_eq!(schedule.sweeps_until(120.0), 240);
        assert_eq!(schedule.sweeps_until(0.49), 0);
        let odd = Schedule {
            sweep_period_s: 0.1,
            sweeps_per_stop: 3,
        };
        assert_eq!(odd.sweeps_until(0.3), 3);
        assert_eq!(GmtTrack::new(Vec::new(), odd), None);
    }
}
