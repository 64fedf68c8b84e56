//! What a flight left behind: the receiver's estimates and the world's truth, side by side and never mixed.
//!
//! The driver of a flight fills a [`FlightLog`] as it goes: a pose now and then, a sweep after every sweep, a point for
//! every accepted reflection, the map at the end. Each record keeps what the receiver said (`estimate`) and what was so
//! (`truth`) in types of their own, so a line that hands truth to the receiver shows in review. Everything that comes
//! after a flight - evaluation, files, pictures - starts from the log alone, and a log that ends early is a log.
//!
//! World frame ENU, metres; body frame FLU; quaternions are Hamilton [w, x, y, z] and turn body into world; time is the
//! GMT's clock from the start of the flight.

mod point;
mod pose;
mod sweep;

use std::borrow::Cow;
use std::collections::BTreeMap;

use cslam_core::telemetry::Message;
use serde::{Deserialize, Serialize};

pub use point::{MapVoxel, PointRecord};
pub use pose::{PoseEstimate, PoseRecord, PoseTruth};
pub use sweep::{
    Innovation, LinkEstimate, MeasuredPath, Measurement, SweepEstimate, SweepRecord, SweepTruth,
    link_state_of,
};

use crate::paths::LinkPath;

/// Which flight it was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// `best` or `paper`, or the name of an ablation.
    pub mode: String,
    /// Name of the scene or file.
    pub scene: String,
    /// Profile of the simulated world; `None` when none was simulated.
    #[serde(default)]
    pub world: Option<String>,
    /// Seed of the flight and of every error.
    pub seed: u64,
    /// Sweeps that were planned. Fewer in [`FlightLog::sweeps`] means that the flight was ended early.
    pub planned_sweeps: usize,
    /// Time from sweep to sweep, s.
    pub sweep_period_s: f64,
    /// Delays repeat after this length, m (c times the length of a block); `None` when they are absolute.
    pub delay_cycle_m: Option<f64>,
}

/// What went to the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Downlink {
    /// Packets sent.
    pub packets: u64,
    /// Bytes sent, framing and checksums included.
    pub bytes: u64,
    /// Points sent.
    pub points: u64,
    /// Bytes of the packets that carry points, framing and checksums included.
    pub point_bytes: u64,
}

impl Downlink {
    /// Counts a message that took this many bytes, framing and checksums included.
    pub fn enter(&mut self, message: &Message, bytes: u64) {
        self.packets += 1;
        self.bytes += bytes;
        if let Message::Points(points) = message {
            self.points += points.len() as u64;
            self.point_bytes += bytes;
        }
    }
}

/// A flight, or as much of it as was flown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlightLog {
    /// Which flight it was.
    pub header: Header,
    /// Poses in order of time, at any rate; may be left empty, then those of the sweeps stand in.
    pub poses: Vec<PoseRecord>,
    /// Sweeps in order.
    pub sweeps: Vec<SweepRecord>,
    /// Accepted reflection points, in the order in which they were accepted.
    pub points: Vec<PointRecord>,
    /// The receiver's map as it was last.
    pub map: Vec<MapVoxel>,
    /// Edge of the map's voxels, m.
    pub voxel_edge_m: f64,
    /// Whatever the receiver counts besides the verdicts of its paths: name, number.
    pub counters: BTreeMap<String, u64>,
    /// The receiver's own counters, as its last health packet said them: name, number. Empty when it sent none.
    pub health: BTreeMap<String, u32>,
    /// What went to the ground.
    pub downlink: Downlink,
}

impl FlightLog {
    /// The log of a flight that has not begun.
    pub fn new(header: Header, voxel_edge_m: f64) -> Self {
        Self {
            header,
            poses: Vec::new(),
            sweeps: Vec::new(),
            points: Vec::new(),
            map: Vec::new(),
            voxel_edge_m,
            counters: BTreeMap::new(),
            health: BTreeMap::new(),
            downlink: Downlink::default(),
        }
    }

    /// Whether the flight was ended before its last sweep.
    pub fn interrupted(&self) -> bool {
        self.sweeps.len() < self.header.planned_sweeps
    }

    /// Time flown, s: whole sweep periods.
    pub fn flight_s(&self) -> f64 {
        self.sweeps.len() as f64 * self.header.sweep_period_s
    }

    /// The poses, or those of the sweeps when none were logged between them.
    pub fn trajectory(&self) -> Cow<'_, [PoseRecord]> {
        if self.poses.is_empty() {
            self.sweeps.iter().map(SweepRecord::pose).collect()
        } else {
            Cow::Borrowed(&self.poses)
        }
    }

    /// The sweep that a point came from.
    pub fn sweep_of(&self, point: &PointRecord) -> Option<&SweepRecord> {
        self.sweeps.get(self.place_of(point)?)
    }

    /// Where the sweep of a point stands among the log's.
    pub(crate) fn place_of(&self, point: &PointRecord) -> Option<usize> {
        self.place_of_sweep(point.sweep)
    }

    /// The sweep with which a point came into the map, as far as is known.
    pub fn mapped_with(&self, point: &PointRecord) -> Option<&SweepRecord> {
        self.sweeps.get(self.place_of_sweep(point.mapped_sweep?)?)
    }

    /// Where the sweep of a number stands.
    fn place_of_sweep(&self, number: u32) -> Option<usize> {
        // Sweeps are numbered, and lie in order without a gap in an ordinary log.
        let place = number as usize;
        let is_there = self.sweeps.get(place).is_some_and(|s| s.sweep == number);
        if is_there {
            Some(place)
        } else {
            self.sweeps.iter().position(|s| s.sweep == number)
        }
    }

    /// The true path behind a point: `None` when the truth is not known, `Some(None)` when no true path was matched with
    /// the measured one (a ghost).
    pub fn truth_of(&self, point: &PointRecord) -> Option<Option<&LinkPath>> {
        let truth = &self.sweep_of(point)?.truth;
        let link = truth.link.as_ref()?;
        let matched = truth.matches.get(usize::from(point.path)).copied().flatten();
        let path = matched.and_then(|index| link.paths.get(index));
        match path {
            // A path of a list that does not say its order: nothing is known about it.
            Some(path) if path.order.is_none() => None,
            other => Some(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_flight::{log_of, measured, sweep, true_path};

    fn point(sweep: u32, path: u8) -> PointRecord {
        PointRecord {
            sweep,
            path,
            order: 1,
            reflection: 1,
            surface: None,
            mapped_sweep: None,
            time_s: 1.0,
            gmt_index: 0,
            position_m: [1.0, 2.0, 3.0],
            covariance_trace_m2: 0.02,
            probability: Some(0.9),
            snr_db: None,
        }
    }

    /// Sweeps 3 and 5: the log has a gap. Sweep 5 heard a ghost beside a first-order path; of sweep 3 nothing is known.
    fn gappy() -> FlightLog {
        let (mut unknown, mut known) = (sweep(3, [0.0; 3]), sweep(5, [9.0; 3]));
        unknown.truth.link = None;
        known.truth.link.as_mut().expect("known").paths = vec![true_path(1, 30.0, [1.0, 2.0])];
        known.estimate.paths = vec![measured(30.0, [1.0, 2.0]), measured(90.0, [1.0, 2.0])];
        known.truth.matches = vec![Some(0), None];
        log_of(vec![unknown, known])
    }

    #[test]
    fn a_point_has_a_true_path_or_is_a_ghost_or_nothing_is_known() {
        let mut log = gappy();
        assert_eq!(
            log.truth_of(&point(5, 0)).expect("known").expect("matched").order,
            Some(1)
        );
        assert_eq!(log.truth_of(&point(5, 1)), Some(None));
        assert_eq!(log.truth_of(&point(3, 0)), None);
        assert_eq!(log.truth_of(&point(4, 0)), None);
        log.sweeps[1].truth.link.as_mut().expect("known").paths[0].order = None;
        assert_eq!(log.truth_of(&point(5, 0)), None);
    }

    #[test]
    fn the_strongest_path_is_the_state_of_a_link() {
        let mut paths = vec![
            true_path(1, 30.0, [1.0, 0.0]),
            true_path(0, 20.0, [1.0, 0.0]),
            true_path(3, 50.0, [1.0, 0.0]),
        ];
        let link = |paths: &[LinkPath]| crate::paths::Link {
            tx: [0.0; 3],
            rx: [1.0; 3],
            paths: paths.to_vec(),
            ..crate::paths::Link::default()
        };
        assert_eq!(link_state_of(&link(&paths)), Some(2));
        paths[2].gain = Some([0.0, 2e-4]);
        assert_eq!(link_state_of(&link(&paths)), Some(3));
        paths[1].gain = Some([3e-4, 0.0]);
        assert_eq!(link_state_of(&link(&paths)), Some(1));
        paths.iter_mut().for_each(|p| p.gain = None);
        assert_eq!(link_state_of(&link(&paths)), Some(2));
        paths[0].order = None;
        assert_eq!(link_state_of(&link(&paths)), None);
        assert_eq!(link_state_of(&link(&[])), Some(0));
    }

    #[test]
    fn a_log_reads_back_as_it_was_written() {
        let mut log = gappy();
        log.points.push(point(5, 0));
        log.counters.insert("no excess".into(), 4);
        let text = serde_json::to_string(&log).expect("plain data");
        assert_eq!(serde_json::from_str::<FlightLog>(&text).expect("as written"), log);
        assert!(!log.interrupted());
        log.header.planned_sweeps = 9;
        assert!(log.interrupted());
        assert_eq!((log.flight_s(), log.trajectory().len()), (1.0, 2));
    }
}
