//! Link states: estimated against true, sweep by sweep.

use serde::Serialize;

use super::figures::share;
use super::states::{PathClass, PathStateFigures, PathStates};
use crate::flight_log::FlightLog;

/// Figures of the link state. The states are 0 = outage, 1 = LOS, 2 = first-order, 3 = higher-order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LinkStateFigures {
    /// Share of sweeps whose state was told right; absent when the receiver tells none.
    pub accuracy: Option<f64>,
    /// Sweeps by true state (row) and estimated state (column).
    pub confusion: [[usize; 4]; 4],
    /// Sweeps by true state, whether the receiver told one or not.
    pub true_sweeps: [usize; 4],
    /// What was said of each measured path.
    pub measured: PathStateFigures,
    /// Sweeps in which a path was used as line of sight.
    pub los_used: usize,
    /// Sweeps in which one was used although there was none.
    pub los_used_wrongly: usize,
    /// Sweeps with line of sight.
    pub los_visible: usize,
}

/// Judges the link states.
pub(super) fn judge(log: &FlightLog) -> LinkStateFigures {
    let mut figures = LinkStateFigures::default();
    for sweep in &log.sweeps {
        figures.los_used += usize::from(sweep.estimate.los_used);
        let visible = sweep.truth.los_visible();
        figures.los_visible += usize::from(visible);
        figures.los_used_wrongly +=
            usize::from(sweep.estimate.los_used && !visible && sweep.truth.link.is_some());
        let Some(truth) = sweep.truth.link_state().map(usize::from) else {
            continue;
        };
        figures.true_sweeps[truth] += 1;
        if let Some(cell) = sweep
            .estimate
            .link
            .and_then(|link| figures.confusion[truth].get_mut(usize::from(link.state)))
        {
            *cell += 1;
        }
    }
    figures.measured = path_states(log);
    let told = figures.confusion.iter().flatten().sum();
    let right = (0..4).map(|k| figures.confusion[k][k]).sum();
    figures.accuracy = share(right, told);
    figures
}

/// What was said of the measured paths of known truth, against what they were.
fn path_states(log: &FlightLog) -> PathStateFigures {
    let mut states = PathStates::default();
    for sweep in &log.sweeps {
        let classes = PathClass::of_sweep(&sweep.truth);
        for (index, (path, class)) in sweep.estimate.paths.iter().zip(classes).enumerate() {
            if let (Some(probabilities), Some(class)) = (path.probabilities, class) {
                states.add(probabilities, class, index == 0);
            }
        }
    }
    states.figures()
}
