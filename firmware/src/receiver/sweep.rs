//! What the ground is told of a sweep: the outcomes of its paths, gathered as they come.

use cslam_core::localization::filter::{Health, SweepVerdict};
use cslam_core::lscn::LinkState;
use cslam_core::reflection::Rejection;
use cslam_core::telemetry::{LinkReport, MAX_OUTCOMES, PathOutcome};

use crate::measurement::PathRecord;

/// Time from one link of a path list to the next, ns: two sweeps a second.
const PERIOD_NS: u64 = 500_000_000;

/// The sweeps of a stream of measurements.
#[derive(Clone, Debug, Default)]
pub(super) struct Sweeps {
    open: Option<LinkReport>,
    stop: u16,
    gmt_m: Option<[f32; 3]>,
}

impl Sweeps {
    /// When a link was heard.
    pub(super) fn time_ns(link: u32) -> u64 {
        u64::from(link) * PERIOD_NS
    }

    /// Number of the place that the GMT has now.
    pub(super) fn stop(&self) -> u16 {
        self.stop
    }

    /// Makes room for the path of a record, and gives the report that had to be closed for it, if one had.
    pub(super) fn turn(&mut self, record: &PathRecord) -> Option<LinkReport> {
        let fits = self.open.as_ref().is_some_and(|open| {
            let place = usize::from(record.path).checked_sub(usize::from(open.first_path));
            open.sweep == record.link
                && place.is_some_and(|place| place >= open.outcomes.len() && place < MAX_OUTCOMES)
        });
        if fits {
            return None;
        }
        let closed = self.open.take();
        if self.gmt_m.is_some_and(|gmt_m| gmt_m != record.gmt_m) {
            self.stop = self.stop.saturating_add(1);
        }
        self.gmt_m = Some(record.gmt_m);
        let known = record
            .gmt_m
            .iter()
            .all(|coordinate| coordinate.abs() < FARTHEST_M);
        self.open = Some(LinkReport {
            sweep: record.link,
            time_ns: Self::time_ns(record.link),
            state: LinkState::Outage,
            verdict: SweepVerdict::NoSight,
            beams: 0,
            snr_db: None,
            gmt_m: known.then(|| record.gmt_m.map(f64::from)),
            stop: self.stop,
            health: Health::default(),
            first_path: if closed.as_ref().is_some_and(|closed| closed.sweep == record.link) {
                record.path
            } else {
                first_of(record.path)
            },
            outcomes: heapless::Vec::new(),
        });
        closed
    }

    /// Enters what became of the path that [`Sweeps::turn`] made room for. The paths before it that never came are missing.
    pub(super) fn enter(&mut self, path: u8, outcome: PathOutcome) {
        let Some(open) = &mut self.open else { return };
        let place = usize::from(path.saturating_sub(open.first_path));
        while open.outcomes.len() < place {
            if open.outcomes.push(PathOutcome::Missing).is_err() {
                return;
            }
        }
        if path == 0 {
            open.state = state(outcome);
        }
        let _made_room = open.outcomes.push(outcome);
    }

    /// The report in hand, at the end of a stream.
    pub(super) fn close(&mut self) -> Option<LinkReport> {
        self.open.take()
    }
}

/// Coordinates up to here can be sent, m.
const FARTHEST_M: f32 = 2.0e6;

/// Number of the first path of a report that has room for `path`: 0 when it is among the first.
fn first_of(path: u8) -> u8 {
    if usize::from(path) < MAX_OUTCOMES { 0 } else { path }
}

/// State of a link whose strongest path became this. Records hold no signal, so geometry alone says what it is.
fn state(strongest: PathOutcome) -> LinkState {
    match strongest {
        PathOutcome::Missing | PathOutcome::Input(_) => LinkState::Outage,
        PathOutcome::LineOfSight | PathOutcome::Rejected(Rejection::LineOfSight) => LinkState::LineOfSight,
        PathOutcome::Point | PathOutcome::PointOutOfRange => LinkState::FirstOrder,
        _ => LinkState::HigherOrder,
    }
}
