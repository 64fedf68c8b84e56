//! Starts at rest and in flight: how long they take, and whether a receiver is ever sure of a wrong pose.

use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::figures;
use crate::kept_flight::{Conditions, KeptFlight, Start, SwitchOn, fly_start};
use crate::raw_flight::board_config;
use crate::statistics::{median, quantile};

/// Columns.
pub(super) const HEADER: [&str; 7] = [
    "starts",
    "number",
    "with a pose",
    "after, s: median, 90 %",
    "position 10 s later, m: median, 90 %, most",
    "attitude, deg: median, 90 %, most",
    "sure and wrong",
];
/// Time between two starts in a flight, s.
const APART_S: f64 = 10.0;
/// The last start is so long before the end of its flight, s.
const LEAST_S: f64 = 30.0;
/// One start of so many has no line of sight in its first ten seconds, whatever is there.
const BLIND: usize = 3;
/// A receiver that is sure of a wrong pose for longer than this has started falsely, s.
const FALSE_S: f64 = 10.0;

/// A row of the table.
#[derive(Serialize)]
pub(super) struct Line {
    conditions: &'static str,
    starts: usize,
    started: usize,
    /// Time to the first pose, s: median and 90 %.
    waited_s: [Option<f64>; 2],
    /// Position error ten seconds after the first pose: median, 90 % and most.
    position_m: [Option<f64>; 3],
    /// Attitude error then.
    attitude_deg: [Option<f64>; 3],
    /// Starts after which the pose was further off than five standard deviations for more than ten seconds.
    wrong: usize,
}

impl Line {
    fn of(conditions: &'static str, starts: &[&Start]) -> Self {
        let waited_s: Vec<f64> = starts.iter().filter_map(|start| start.waited_s).collect();
        let settled = |which: usize| -> [Option<f64>; 3] {
            let errors: Vec<f64> = (starts.iter())
                .filter_map(|start| start.settled.map(|errors| errors[which]))
                .collect();
            [0.5, 0.9, 1.0].map(|share| quantile(&errors, share))
        };
        Self {
            conditions,
            starts: starts.len(),
            started: waited_s.len(),
            waited_s: [median(&waited_s), quantile(&waited_s, 0.9)],
            position_m: settled(0),
            attitude_deg: settled(1),
            wrong: starts.iter().filter(|start| start.wrong_s > FALSE_S).count(),
        }
    }

    pub(super) fn cells(&self) -> Vec<String> {
        vec![
            self.conditions.into(),
            self.starts.to_string(),
            self.started.to_string(),
            figures(&self.waited_s, 1),
            figures(&self.position_m, 2),
            figures(&self.attitude_deg, 2),
            self.wrong.to_string(),
        ]
    }
}

/// When the receiver is switched on in these flights.
fn planned<'a, 's>(flights: &'a [KeptFlight<'s>]) -> Vec<(&'a KeptFlight<'s>, SwitchOn)> {
    let of_flight = |flight: &'a KeptFlight<'s>| {
        let last_s = flight.world().flight().plan().duration_s() - LEAST_S;
        (0..)
            .map(|k| f64::from(k) * APART_S)
            .take_while(move |at_s| *at_s <= last_s)
            .map(move |at_s| (flight, at_s))
    };
    let every = flights.iter().flat_map(of_flight).enumerate();
    every
        .map(|(k, (flight, at_s))| {
            let blind = k % BLIND == BLIND - 1;
            (flight, SwitchOn { at_s, blind })
        })
        .collect()
}

/// Starts the board's receiver every ten seconds of each flight, each time from nothing.
pub(super) fn fly(flights: &[KeptFlight<'_>], bar: &ProgressBar) -> anyhow::Result<Vec<Line>> {
    let starts = planned(flights)
        .par_iter()
        .map(|(flight, on)| fly_start(flight, board_config()?, *on))
        .collect::<anyhow::Result<Vec<_>>>()?;
    bar.inc(1);
    let rows = [
        ("at rest", Some(Conditions::AtRest)),
        ("in flight, in sight", Some(Conditions::InSight)),
        ("in flight, above the beams", Some(Conditions::BeyondBeams)),
        ("without sight for half of 10 s", Some(Conditions::WithoutSight)),
        ("all", None),
    ];
    let of_row = |(name, conditions): (&'static str, Option<Conditions>)| {
        let of_kind = |start: &&Start| conditions.is_none_or(|kind| start.conditions == kind);
        Line::of(name, &starts.iter().filter(of_kind).collect::<Vec<_>>())
    };
    Ok(rows.map(of_row).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_is_false_when_it_is_sure_and_wrong_for_longer_than_ten_seconds() {
        let start = |wrong_s| Start {
            conditions: Conditions::AtRest,
            waited_s: Some(2.0),
            settled: Some([0.2, 1.0]),
            wrong_s,
        };
        let never = Start {
            waited_s: None,
            settled: None,
            ..start(0.0)
        };
        let line = Line::of("", &[&start(10.0), &start(10.5), &never]);
        assert_eq!((line.starts, line.started, line.wrong), (3, 2, 1));
        assert_eq!(line.position_m, [Some(0.2); 3]);
        assert_eq!(line.cells().len(), HEADER.len());
        assert_eq!(Line::of("", &[]).cells()[3], "-, -");
    }
}
