//! What became of the frames.

use super::error::FrameError;
use super::sequence::Arrival;

/// Counters of a link since it was made, saturating.
///
/// Of every session, `ok + late + lost` is exactly the numbers from 0 to the newest. A damaged frame does not tell its
/// number reliably, so `damaged` counts events: the number itself is in `lost` as soon as a newer frame has come, and
/// leaves it for `late` should a sound copy follow. `overrun`, the front end's own count, is a part of `lost` too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Whole frames, newest when they came.
    pub ok: u32,
    /// Whole frames that came after a newer one, within the window.
    pub late: u32,
    /// Numbers of which no whole frame has come.
    pub lost: u32,
    /// Whole frames that had come before; not given on.
    pub repeated: u32,
    /// Whole frames from before the window; not given on, and still among the lost.
    pub stale: u32,
    /// Frames whose header made no sense.
    pub damaged_header: u32,
    /// Frames whose samples did not match their checksum.
    pub damaged_payload: u32,
    /// Frames of another session.
    pub foreign: u32,
    /// Frames that the front end dropped because the receiver took none.
    pub overrun: u32,
    /// Frames that the receiver's own link hardware cut (overrun of its FIFO, a DMA error). See
    /// [`FrontEnd::cut`](super::FrontEnd::cut).
    pub cut: u32,
}

impl Counters {
    /// Frames damaged on the way, wherever the damage was found.
    #[must_use]
    pub const fn damaged(&self) -> u32 {
        self.damaged_header
            .saturating_add(self.damaged_payload)
            .saturating_add(self.cut)
    }

    pub(super) fn arrived(&mut self, arrival: Arrival) {
        match arrival {
            Arrival::Newest { missing } => {
                add(&mut self.ok, 1);
                add(&mut self.lost, missing);
            }
            Arrival::Late => {
                add(&mut self.late, 1);
                self.lost = self.lost.saturating_sub(1);
            }
        }
    }

    pub(super) fn refused(&mut self, error: FrameError) {
        let counter = match error {
            FrameError::Session { .. } => &mut self.foreign,
            FrameError::PayloadChecksum { .. } => &mut self.damaged_payload,
            FrameError::Repeated { .. } => &mut self.repeated,
            FrameError::Stale { .. } => &mut self.stale,
            _ => &mut self.damaged_header,
        };
        add(counter, 1);
    }

    pub(super) fn dropped(&mut self, frames: u32) {
        add(&mut self.overrun, frames);
    }

    pub(super) fn cut(&mut self) {
        add(&mut self.cut, 1);
    }
}

fn add(counter: &mut u32, n: u32) {
    *counter = counter.saturating_add(n);
}
