//! Phases of a flight: what the receiver has to hold its pose with, sweep by sweep, and how far off the pose is in each.
//!
//! Truth says whether there is a line of sight, the receiver what it took in. Within an outage the phase only climbs, by the boldest aid
//! that was taken since its first sweep: an error stays in the pose until the line of sight comes back.

use cslam_core::estimator::Counters;
use cslam_core::receiver::{Config, Outcome, PATHS, SweepReport};

use super::straight::is_straight;
use super::{Changes, KeptFlight, PoseErrors, pose_errors};
use crate::evaluation::SETTLING_S;
use crate::raw_flight::Swept;
use crate::sensors::Truth;

/// A pose is starting for so long after the first, s.
pub const STARTING_S: f64 = 10.0;

/// What a sweep is counted as. Each is one of these: the first one that fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// There is no pose.
    WithoutPose,
    /// Less than [`STARTING_S`] after the first pose, or after the first one of a filter that had begun anew.
    Starting,
    /// The line of sight is there and taken, and was before.
    InSight,
    /// It is there and taken, less than [`SETTLING_S`] after the first time since an outage.
    Regained,
    /// It is there and not taken.
    Missed,
    /// It is not there, and since it went nothing has been taken.
    Coasting,
    /// Delta ranges or range rates have been taken since.
    Ranges,
    /// Reflections have.
    Reflections,
    /// A path along the straight way: it was bent round an edge, or went through leaves or a pane.
    Bent,
    /// Another path, which the receiver believed to be the line of sight.
    FalseSight,
}

impl Phase {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::WithoutPose,
        Self::Starting,
        Self::InSight,
        Self::Regained,
        Self::Missed,
        Self::Coasting,
        Self::Ranges,
        Self::Reflections,
        Self::Bent,
        Self::FalseSight,
    ];
}

/// A sweep of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhasedSweep {
    /// What it is counted as.
    pub phase: Phase,
    /// Errors of its pose, with the sweep taken in; `None` without one.
    pub errors: Option<PoseErrors>,
}

/// The path that was taken for the line of sight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sight {
    /// Along the straight way between GMT and UAV.
    Straight,
    /// Another one.
    Elsewhere,
}

/// What says in which phase a sweep is.
#[derive(Clone, Copy, Debug)]
struct Aids {
    time_s: f64,
    has_pose: bool,
    /// Whether there is a line of sight in truth.
    in_sight: bool,
    taken: Option<Sight>,
    reflections: bool,
    /// Delta ranges or range rates.
    ranges: bool,
}

/// Follows the phases of a flight, sweep by sweep.
#[derive(Clone, Copy, Debug, Default)]
struct Phases {
    /// First of the poses without a gap.
    started_s: Option<f64>,
    /// Of the outage that the line of sight has not ended yet: the boldest aid.
    outage: Option<Phase>,
    /// When the line of sight was taken again after the last one.
    regained_s: Option<f64>,
}

impl Phases {
    /// Phase of the next sweep.
    fn next(&mut self, aids: &Aids) -> Phase {
        let sight = self.sight(aids);
        if !aids.has_pose {
            self.started_s = None;
            return Phase::WithoutPose;
        }
        let since_s = aids.time_s - *self.started_s.get_or_insert(aids.time_s);
        if since_s < STARTING_S {
            Phase::Starting
        } else {
            sight
        }
    }

    /// Phase by what is seen and taken alone.
    fn sight(&mut self, aids: &Aids) -> Phase {
        if !aids.in_sight {
            let taken = match aids.taken {
                Some(Sight::Elsewhere) => Phase::FalseSight,
                Some(Sight::Straight) => Phase::Bent,
                None if aids.reflections => Phase::Reflections,
                None if aids.ranges => Phase::Ranges,
                None => Phase::Coasting,
            };
            let boldest = self.outage.map_or(taken, |before| before.max(taken));
            self.outage = Some(boldest);
            return boldest;
        }
        if aids.taken != Some(Sight::Straight) {
            return Phase::Missed;
        }
        if self.outage.take().is_some() {
            self.regained_s = Some(aids.time_s);
        }
        match self.regained_s {
            Some(since_s) if aids.time_s - since_s < SETTLING_S => Phase::Regained,
            _ => Phase::InSight,
        }
    }
}

/// Flies with a receiver that is configured so: every sweep that has ended, with its phase.
///
/// # Errors
/// What stops a receiver from being built.
pub fn fly_phases(flight: &KeptFlight<'_>, receiver: Config<'static>) -> anyhow::Result<Vec<PhasedSweep>> {
    let sights = flight.sights();
    let mut phases = Phases::default();
    let mut before = Counters::default();
    let mut sweeps = Vec::new();
    flight.again(
        &Changes::default(),
        receiver,
        |swept, truth| {
            let in_sight = sights
                .get(swept.report.sweep as usize)
                .copied()
                .unwrap_or_default();
            let aids = aids(swept, truth, in_sight, &before);
            before = swept.filter;
            let pose = swept.report.pose.as_ref();
            sweeps.push(PhasedSweep {
                phase: phases.next(&aids),
                errors: pose.map(|pose| pose_errors(pose, truth)),
            });
        },
        |_| (),
    )?;
    Ok(sweeps)
}

/// What a sweep gave, after a filter whose counters were these before it.
fn aids(swept: &Swept<'_>, truth: &Truth, in_sight: bool, before: &Counters) -> Aids {
    let (report, filter) = (swept.report, &swept.filter);
    Aids {
        time_s: report.time_ns as f64 * 1e-9,
        has_pose: report.pose.is_some(),
        in_sight,
        taken: sight(report, truth),
        reflections: filter.reflections != before.reflections,
        ranges: filter.delta_ranges != before.delta_ranges || filter.range_rates != before.range_rates,
    }
}

/// The path that corrected the pose as line of sight.
fn sight(report: &SweepReport<PATHS>, truth: &Truth) -> Option<Sight> {
    if !report.verdict.is_taken() {
        return None;
    }
    let mut named = report
        .paths
        .iter()
        .filter(|path| path.outcome == Outcome::LineOfSight);
    // A first path that proved the pose wrong is not named.
    let is_straight = named.next().map_or_else(
        || {
            report
                .paths
                .iter()
                .any(|path| is_straight(&path.estimated, truth))
        },
        |path| is_straight(&path.estimated, truth),
    );
    Some(if is_straight {
        Sight::Straight
    } else {
        Sight::Elsewhere
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOTHING: Aids = Aids {
        time_s: 0.0,
        has_pose: true,
        in_sight: false,
        taken: None,
        reflections: false,
        ranges: false,
    };
    const SEEN: Aids = Aids {
        in_sight: true,
        taken: Some(Sight::Straight),
        ..NOTHING
    };

    /// Phases of sweeps twice a second, after 20 sweeps with a pose.
    fn phases(sweeps: &[Aids]) -> Vec<Phase> {
        let mut phases = Phases::default();
        let all = std::iter::repeat_n(&SEEN, 20).chain(sweeps).enumerate();
        let each = all.map(|(k, aids)| {
            phases.next(&Aids {
                time_s: k as f64 * 0.5,
                ..*aids
            })
        });
        let all: Vec<_> = each.collect();
        assert_eq!(all[..20], [Phase::Starting; 20]);
        all[20..].to_vec()
    }

    #[test]
    fn an_outage_is_named_after_the_boldest_aid_in_it() {
        let ranges = Aids {
            ranges: true,
            ..NOTHING
        };
        let reflections = Aids {
            reflections: true,
            ..ranges
        };
        let bent = Aids {
            taken: Some(Sight::Straight),
            ..NOTHING
        };
        let wrong = Aids {
            taken: Some(Sight::Elsewhere),
            ..NOTHING
        };
        let outage = [
            SEEN,
            NOTHING,
            ranges,
            NOTHING,
            reflections,
            ranges,
            bent,
            wrong,
            bent,
        ];
        assert_eq!(
            phases(&outage),
            [
                Phase::InSight,
                Phase::Coasting,
                Phase::Ranges,
                Phase::Ranges,
                Phase::Reflections,
                Phase::Reflections,
                Phase::Bent,
                Phase::FalseSight,
                Phase::FalseSight,
            ]
        );
        // The next outage begins with nothing.
        assert_eq!(phases(&[reflections, SEEN, NOTHING])[2], Phase::Coasting);
    }

    #[test]
    fn sight_settles_after_it_was_taken_again() {
        let missed = Aids { taken: None, ..SEEN };
        let mistaken = Aids {
            taken: Some(Sight::Elsewhere),
            ..SEEN
        };
        let sweeps = [NOTHING, missed, mistaken, SEEN, SEEN, missed, SEEN, SEEN, NOTHING];
        assert_eq!(
            phases(&sweeps),
            [
                Phase::Coasting,
                Phase::Missed,
                Phase::Missed,
                Phase::Regained,
                Phase::Regained,
                Phase::Missed,
                Phase::InSight,
                Phase::InSight,
                Phase::Coasting,
            ]
        );
        // Line of sight that was there and not taken is no outage of its own.
        assert_eq!(phases(&[missed, SEEN])[1], Phase::InSight);
    }

    #[test]
    fn a_pose_that_was_lost_starts_again() {
        let lost = Aids {
            has_pose: false,
            ..SEEN
        };
        let again = phases(&[SEEN, lost, SEEN, NOTHING]);
        assert_eq!(
            again,
            [
                Phase::InSight,
                Phase::WithoutPose,
                Phase::Starting,
                Phase::Starting
            ]
        );
    }
}
