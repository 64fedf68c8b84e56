//! How GMT and UAV hear each other over a flight, by geometry alone.

use nalgebra::Vector3;

use super::{GmtTrack, Obstacles, Schedule, Trajectory};

/// How GMT and UAV hear each other over the sweeps of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Share of sweeps with line of sight, 0..=1.
    pub visible_share: f64,
    /// Longest time without, s.
    pub longest_outage_s: f64,
    /// Line of sight in all sweeps up to this time, s.
    pub visible_start_s: f64,
    /// The same, and the UAV no higher above the GMT than wanted for a start, s.
    pub low_start_s: f64,
    /// Share of the sweeps without line of sight in which a path of one reflection is left, 0..=1; 1 when there are none.
    pub reflected_share: f64,
}

/// Angle of the UAV above the horizon of the GMT, deg.
pub(super) fn elevation_deg(gmt: &Vector3<f64>, uav: &Vector3<f64>) -> f64 {
    let way = uav - gmt;
    libm::atan2(way.z, libm::hypot(way.x, way.y)).to_degrees()
}

/// How both ends hear each other in a sweep.
pub(super) enum Sight {
    /// They see each other; the UAV higher above the GMT than wanted for a start, or not.
    Line { high: bool },
    /// They do not; a path of one reflection is left, or not.
    None { reflected: bool },
}

impl Contact {
    /// Of all sweeps of a flight, from the first on.
    pub(super) fn of(sights: impl Iterator<Item = Sight>, schedule: Schedule, duration_s: f64) -> Self {
        let (mut sweeps, mut visible, mut outage, mut longest, mut reflected) =
            (0u32, 0u32, 0u32, 0u32, 0u32);
        let (mut start, mut low_start) = (None, None);
        for sight in sights {
            let before_s = schedule.sweep_time_s(sweeps) - schedule.sweep_period_s;
            sweeps += 1;
            match sight {
                Sight::None { reflected: one } => {
                    outage += 1;
                    longest = longest.max(outage);
                    start.get_or_insert(before_s);
                    low_start.get_or_insert(before_s);
                    reflected += u32::from(one);
                }
                Sight::Line { high } => {
                    visible += 1;
                    outage = 0;
                    if high {
                        low_start.get_or_insert(before_s);
                    }
                }
            }
        }
        Self {
            visible_share: f64::from(visible) / f64::from(sweeps.max(1)),
            longest_outage_s: f64::from(longest) * schedule.sweep_period_s,
            visible_start_s: start.unwrap_or(duration_s),
            low_start_s: low_start.unwrap_or(duration_s),
            reflected_share: if visible == sweeps {
                1.0
            } else {
                f64::from(reflected) / f64::from(sweeps - visible)
            },
        }
    }
}

/// Contact at every sweep of a flight.
pub(super) fn contact(
    world: &dyn Obstacles,
    uav: &Trajectory,
    gmt: &GmtTrack,
    schedule: Schedule,
    duration_s: f64,
    start_elevation_deg: f64,
) -> Contact {
    let sights = (0..schedule.sweeps_until(duration_s)).map(|sweep| {
        let time_s = schedule.sweep_time_s(sweep);
        let (there, here) = (gmt.at(time_s).0, uav.place_m(time_s));
        if world.blocked(there.into(), here.into()) {
            Sight::None {
                reflected: world.reflected(there.into(), here.into()),
            }
        } else {
            Sight::Line {
                high: elevation_deg(&there, &here) > start_elevation_deg,
            }
        }
    });
    Contact::of(sights, schedule, duration_s)
}
