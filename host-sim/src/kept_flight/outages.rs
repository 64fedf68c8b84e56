//! Planned outages: the line of sight is blocked in a flight that has it.

use cslam_core::receiver::{Config, Localization};
use nalgebra::Vector3;

use super::{Blocked, Changes, KeptFlight, pose_errors};
use crate::flight_log::FlightLog;
use crate::raw_flight::Swept;
use crate::recording::Span;
use crate::sensors::Truth;

/// No outage begins before this, s: the flight has settled, and has seen some surfaces.
const FIRST_S: f64 = 30.0;
/// Line of sight is looked for over so many sweeps before an outage, and most of them must have it.
const BEFORE: (usize, usize) = (30, 25);

/// The end of an outage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutageEnd {
    /// Position error at its last sweep, m; infinite without a pose.
    pub error_m: f64,
    /// The same in standard deviations.
    pub sigmas: f64,
    /// Position error of the smoothed trajectory at the last pose of the outage, m; `None` without a filter or a pose.
    pub smoothed_m: Option<f64>,
    /// Sweeps in the outage in which a path was taken for the line of sight, which was not there.
    pub false_sights: usize,
}

/// When an outage of `length_s` may begin, s: the first time after half a minute with line of sight in the last two sweeps and in most of
/// those before. `None` when the flight has no such time, or ends before the outage does.
#[must_use]
pub fn outage_start_s(flight: &KeptFlight<'_>, length_s: f64) -> Option<f64> {
    let period_s = flight.world().flight().plan().schedule().sweep_period_s;
    let sights = flight.sights();
    let sweeps = |time_s: f64| (time_s / period_s).ceil() as usize;
    let last = sights.len().checked_sub(sweeps(length_s) + 2)?;
    let (window, most) = BEFORE;
    (sweeps(FIRST_S).max(window)..last)
        .find(|&k| {
            let seen = sights[k - window..k].iter().filter(|seen| **seen).count();
            seen >= most && sights[k - 1] && sights[k - 2]
        })
        // Between two sweeps: sweep k begins at k + 1 periods.
        .map(|k| (k as f64 + 0.5) * period_s)
}

/// Flies with the line of sight blocked, with a receiver that is configured so, and smooths the flight where there is a filter.
///
/// # Errors
/// What stops a receiver from being built.
pub fn fly_outage(
    flight: &KeptFlight<'_>,
    receiver: Config<'static>,
    blocked: &Blocked,
) -> anyhow::Result<OutageEnd> {
    let span = blocked.span;
    let changes = Changes {
        blocked: Some(blocked.clone()),
        ..Changes::default()
    };
    let mut end = OutageEnd::default();
    let smooths = matches!(receiver.localization, Localization::Filter(_));
    let swept = |swept: &Swept<'_>, truth: &Truth| {
        let report = swept.report;
        let time_s = report.time_ns as f64 * 1e-9;
        if !span.contains(time_s) {
            return;
        }
        let errors = report.pose.as_ref().map(|pose| pose_errors(pose, truth));
        end.error_m = errors.map_or(f64::INFINITY, |errors| errors.position_m);
        end.sigmas = errors.map_or(f64::INFINITY, |errors| errors.position_sigmas);
        end.false_sights += usize::from(report.verdict.is_taken());
    };
    if smooths {
        let [_, smoothed] = flight.smoothed(&changes, receiver, swept)?;
        end.smoothed_m = last_error_m(&smoothed, &span);
    } else {
        flight.again(&changes, receiver, swept, |_| ())?;
    }
    Ok(end)
}

/// Position error of the last pose within a span of time, m.
fn last_error_m(log: &FlightLog, span: &Span) -> Option<f64> {
    let last = log
        .poses
        .iter()
        .rev()
        .find(|record| span.contains(record.time_s))?;
    let [found_m, true_m] = [last.estimate?.position_m, last.truth?.position_m].map(Vector3::from);
    Some((found_m - true_m).norm())
}
