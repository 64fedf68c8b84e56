//! The same application on the host: what it writes beside its packets.

use std::fmt::Write as _;

use cslam_core::cslam::{PATHS, SweepReport};
use cslam_firmware::app::{Map, Observer, PointLine, SweepLine};
use cslam_host_sim::raw_flight::BoardReceiver;

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

/// Takes what waits for the radio.
pub(crate) fn drain(receiver: &mut BoardReceiver<'_>, packets: &mut Vec<u8>) {
    let downlink = receiver.downlink();
    let before = packets.len();
    packets.resize(before + downlink.waiting(), 0);
    downlink.take(&mut packets[before..]);
}
