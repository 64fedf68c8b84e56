//! The log of a flight with another map in it: the same sweeps, mapped again.

use cslam_core::association::POINTS;
use cslam_core::map::PointCloud;
use cslam_core::receiver::{MappedPoint, Outcome, SurfaceChanges};

use super::logbook::{Logbook, outcome};
use crate::flight_log::{FlightLog, PoseEstimate};

/// What a sweep puts into a map.
#[derive(Debug, Default)]
pub(crate) struct Remapped {
    /// What becomes of each path; empty when nothing is mapped of the sweep.
    pub(crate) outcomes: Vec<Outcome>,
    /// Points, of this sweep and of earlier ones.
    pub(crate) points: heapless::Vec<MappedPoint, POINTS>,
    /// What happens to the surfaces of all points, after these.
    pub(crate) surfaces: SurfaceChanges,
}

/// Such a log in the making.
pub(crate) struct Remap(Logbook);

impl Remap {
    /// Of a flight whose map is forgotten.
    pub(crate) fn new(mut log: FlightLog) -> Self {
        log.points.clear();
        log.map.clear();
        Self(Logbook::over(log))
    }

    /// Enters what a sweep maps now; `pose` makes its pose another one.
    pub(crate) fn sweep(
        &mut self,
        sweep: u32,
        pose: impl FnOnce(&mut Option<PoseEstimate>),
        mapped: &Remapped,
    ) {
        if let Some(record) = self.0.sweep_mut(sweep) {
            pose(&mut record.estimate.pose);
            for (path, of) in record.estimate.paths.iter_mut().zip(&mapped.outcomes) {
                path.verdict = outcome(of);
            }
        }
        self.0.map(sweep, &mapped.points, &mapped.surfaces);
    }

    /// The log with this map.
    pub(crate) fn close<const N: usize>(self, map: &PointCloud<N>) -> FlightLog {
        self.0.with_map(map)
    }
}
