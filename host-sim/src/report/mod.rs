//! The figures of a flight: `report.json`, a table for a terminal, and a page for a browser.

mod table;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::evaluation::{
    ClockFigures, Consistency, Evaluation, Fate, LinkStateFigures, MapFigures, TrajectoryFigures,
};
use crate::flight_log::{FlightLog, MeasuredPath};

pub use table::table;

/// `report.json`. Keys end in their unit; nested objects hold the figures of one part.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// `best` or `paper`, or the name of an ablation.
    pub mode: String,
    /// Scene or path list.
    pub scene: String,
    /// Profile of the simulated world; `None` when none was simulated.
    pub world: Option<String>,
    /// Seed of all errors.
    pub seed: u64,
    /// Whether the flight was ended before its last sweep.
    pub interrupted: bool,
    /// Sweeps flown.
    pub sweeps: usize,
    /// Time flown, s.
    pub flight_s: f64,
    /// Time the computation took, s.
    pub elapsed_s: f64,
    /// Paths measured.
    pub measurements: usize,
    /// Why measured paths became no points: reason, number.
    pub verdicts: BTreeMap<String, u64>,
    /// Whatever else the receiver counts: name, number.
    pub counters: BTreeMap<String, u64>,
    /// The receiver's own counters, all those of its last health packet: name, number.
    pub health: BTreeMap<String, u32>,
    /// What became of every measured path, by what it truly was.
    pub fates: Vec<Fate>,
    /// Figures of the trajectory.
    pub trajectory: TrajectoryFigures,
    /// Figures of the clock.
    pub clock: ClockFigures,
    /// Honesty of the covariances.
    pub consistency: Consistency,
    /// Figures of the map.
    pub map: MapFigures,
    /// Figures of the link state.
    pub link_state: LinkStateFigures,
    /// Figures of the downlink.
    pub telemetry: TelemetryFigures,
    /// The same flight smoothed, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smoothed: Option<SmoothedFigures>,
}

/// Figures of a smoothed flight: those of the same name on board stand beside them.
#[derive(Clone, Debug, Serialize)]
pub struct SmoothedFigures {
    /// Figures of the trajectory.
    pub trajectory: TrajectoryFigures,
    /// Figures of the clock.
    pub clock: ClockFigures,
    /// Honesty of the covariances.
    pub consistency: Consistency,
    /// Figures of the map that the smoothed poses make.
    pub map: MapFigures,
}

impl From<Evaluation> for SmoothedFigures {
    fn from(evaluation: Evaluation) -> Self {
        Self {
            trajectory: evaluation.trajectory,
            clock: evaluation.clock,
            consistency: evaluation.consistency,
            map: evaluation.map,
        }
    }
}

/// Figures of the downlink.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct TelemetryFigures {
    /// Packets sent.
    pub packets: u64,
    /// Bytes sent, framing included.
    pub bytes: u64,
    /// Bytes for each point that was sent: packets of points alone, framing and checksums included.
    pub bytes_per_point: Option<f64>,
    /// Bytes per second of flight.
    pub bytes_per_s: Option<f64>,
}

impl Report {
    /// The report of a flight that took `elapsed_s` to compute.
    pub fn new(log: &FlightLog, evaluation: &Evaluation, elapsed_s: f64) -> Self {
        let (flight_s, bytes) = (log.flight_s(), log.downlink.bytes);
        let mut verdicts = BTreeMap::new();
        for path in log
            .sweeps
            .iter()
            .flat_map(|s| &s.estimate.paths)
            .filter(|p| !MeasuredPath::is_accepted(&p.verdict))
        {
            *verdicts.entry(path.verdict.clone()).or_default() += 1;
        }
        // A receiver may count its verdicts too: once is enough.
        let mut counters = log.counters.clone();
        counters.retain(|name, _| !MeasuredPath::is_accepted(name) && !verdicts.contains_key(name));
        Self {
            mode: log.header.mode.clone(),
            scene: log.header.scene.clone(),
            world: log.header.world.clone(),
            seed: log.header.seed,
            interrupted: log.interrupted(),
            sweeps: log.sweeps.len(),
            flight_s,
            elapsed_s,
            measurements: log.sweeps.iter().map(|s| s.estimate.paths.len()).sum(),
            verdicts,
            counters,
            health: log.health.clone(),
            fates: evaluation.fates.clone(),
            trajectory: evaluation.trajectory.clone(),
            clock: evaluation.clock,
            consistency: evaluation.consistency,
            map: evaluation.map.clone(),
            link_state: evaluation.link_state,
            telemetry: TelemetryFigures {
                packets: log.downlink.packets,
                bytes,
                bytes_per_point: (log.downlink.points > 0)
                    .then(|| log.downlink.point_bytes as f64 / log.downlink.points as f64),
                bytes_per_s: (flight_s > 0.0).then(|| bytes as f64 / flight_s),
            },
            smoothed: None,
        }
    }
}
