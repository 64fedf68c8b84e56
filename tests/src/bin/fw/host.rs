//! The same application on the host: what it writes beside its packets.

use std::fmt::Write as _;

use cslam_core::receiver::{PATHS, SweepReport};
use cslam_firmware::app::{Map, Observer, PointLine, SweepLine};

/// What the board writes to its file.
#[derive(Default)]
pub(crate) struct Lines {
    pub(crate) text: String,
    pub(crate) sweeps: u32,
}

impl Lines {
    /// The map, at the end.
    pub(crate) fn map(&mut self, map: &Map) {
        for point in map.points() {
            let _infallible = writeln!(self.text, "{}", PointLine(point));
        }
    }
}

impl Observer for Lines {
    fn swept(&mut self, report: &SweepReport<PATHS>) {
        let _infallible = writeln!(self.text, "{}", SweepLine(report));
        self.sweeps += 1;
    }
}
