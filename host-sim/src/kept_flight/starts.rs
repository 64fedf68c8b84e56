//! Starts: the receiver is switched on somewhere in a flight, and is to find its pose without ever being sure of a wrong one.

use cslam_core::array::BeamReach;
use cslam_core::receiver::Config;

use super::{Changes, KeptFlight, pose_errors};
use crate::recording::Span;

/// A start is watched for so long, s.
pub const WATCHED_S: f64 = 40.0;
/// How the GMT is seen over so many first seconds says what kind of start it is.
const FIRST_S: f64 = 10.0;
/// Errors are read so long after the first pose, s.
const AFTER_S: f64 = 10.0;
/// A pose that is further off than so many standard deviations is wrong and does not say so.
pub const WRONG_SIGMAS: f64 = 5.0;

/// What the receiver meets when it is switched on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Conditions {
    /// Before take-off, at rest, with whatever is to be seen there.
    AtRest,
    /// In flight, and in most of the first ten seconds in sight of the GMT, within its beams.
    InSight,
    /// In flight, and in most of the first ten seconds in sight of the GMT, beyond its beams in half of them or more.
    BeyondBeams,
    /// Out of sight in half of the first ten seconds or more, at rest where these are left blind.
    WithoutSight,
}

/// What came of a start.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// What it met.
    pub conditions: Conditions,
    /// Time to the first pose, s; `None` when there was none.
    pub waited_s: Option<f64>,
    /// Errors ten seconds after the first pose: position, m, and attitude, deg; `None` without a pose then.
    pub settled: Option<[f64; 2]>,
    /// Longest time in a row in which position or attitude was further off than [`WRONG_SIGMAS`], s.
    pub wrong_s: f64,
}

/// When the receiver is switched on.
#[derive(Clone, Copy, Debug)]
pub struct SwitchOn {
    /// Time of the flight, s.
    pub at_s: f64,
    /// Whether the line of sight is left out for the first ten seconds.
    pub blind: bool,
}

/// Switches a receiver on in a flight, and watches it for [`WATCHED_S`].
///
/// # Errors
/// What stops a receiver from being built.
pub fn fly_start(flight: &KeptFlight<'_>, receiver: Config<'static>, on: SwitchOn) -> anyhow::Result<Start> {
    let first = Span {
        from_s: on.at_s,
        to_s: on.at_s + FIRST_S,
    };
    let changes = Changes {
        without_sight: Vec::from_iter(on.blind.then_some(first)),
        heard: Some(Span {
            to_s: on.at_s + WATCHED_S,
            ..first
        }),
        ..Changes::default()
    };
    let mut start = Start {
        conditions: conditions(flight, on, &first),
        waited_s: None,
        settled: None,
        wrong_s: 0.0,
    };
    let mut wrong_since_s = None;
    flight.again(
        &changes,
        receiver,
        |swept, truth| {
            let Some(pose) = &swept.report.pose else {
                wrong_since_s = None;
                return;
            };
            let time_s = pose.time_ns as f64 * 1e-9;
            let waited_s = *start.waited_s.get_or_insert(time_s - on.at_s);
            let errors = pose_errors(pose, truth);
            if start.settled.is_none() && time_s >= on.at_s + waited_s + AFTER_S {
                start.settled = Some([errors.position_m, errors.attitude_deg]);
            }
            if errors.position_mahalanobis.max(errors.attitude_mahalanobis) > WRONG_SIGMAS {
                let since_s = *wrong_since_s.get_or_insert(time_s);
                start.wrong_s = start.wrong_s.max(time_s - since_s);
            } else {
                wrong_since_s = None;
            }
        },
        |_| (),
    )?;
    Ok(start)
}

/// What the first seconds have.
fn conditions(flight: &KeptFlight<'_>, on: SwitchOn, first: &Span) -> Conditions {
    if on.at_s == 0.0 && !on.blind {
        return Conditions::AtRest;
    }
    let reach = BeamReach::default();
    let (mut sweeps, mut seen, mut beyond) = (0, 0, 0);
    for (sweep, sighted) in (0..).zip(flight.sights()) {
        let truth = flight.world().flight().sweep_truth(sweep);
        if !first.contains(truth.time_s) {
            continue;
        }
        sweeps += 1;
        if on.blind || !sighted {
            continue;
        }
        seen += 1;
        let way = truth.gmt_attitude.inverse() * (truth.uav.position_m - truth.gmt_position_m);
        beyond += usize::from(!reach.contains(way.normalize().z));
    }
    if 2 * seen <= sweeps {
        Conditions::WithoutSight
    } else if 2 * beyond >= seen {
        Conditions::BeyondBeams
    } else {
        Conditions::InSight
    }
}
