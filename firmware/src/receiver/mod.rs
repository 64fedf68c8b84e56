//! The receiver of a board: measurements in, packets out.
//!
//! Every measurement leads to a packet: a point, or the reason why there is none. Records that were damaged on the way
//! have nothing to say, so they are counted; the counts go down at the end of the stream. Nothing is dropped without a
//! counter.

mod counters;
mod error;

use cslam_core::map::PointCloud;
use cslam_core::reflection::{Form, Gates, InputError, Verdict, solve};
use cslam_core::telemetry::{
    Encoder, InputReport, MAX_FRAME, Message, PointReport, RejectionReport, Summary,
};
use embedded_io::Write;

use crate::measurement::{self, PathRecord, Record, RecordError};
use crate::ring::{Consumer, SharedMemory};

pub use counters::Counters;
pub use error::ReceiveError;

/// The map that a board has room for: about 120 KiB of static memory.
pub type BoardMap = PointCloud<4096>;

/// What one call did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Step {
    /// Nothing was there to do.
    Idle,
    /// A measurement was answered by a packet.
    Answered,
    /// A damaged record was counted.
    Damaged(RecordError),
    /// The stream has ended and its summary is sent.
    Ended,
}

/// How a board judges: the vector form, the design's gates, and the ground at height 0.
#[must_use]
pub fn board_gates() -> Gates {
    Gates {
        ground_z_m: Some(0.0),
        ..Gates::default()
    }
}

/// The receiver with a map of `N` voxels. The map is the only large part; it lives where its owner wants it, in static
/// memory on a board.
#[derive(Debug)]
pub struct Receiver<'m, const N: usize> {
    form: Form,
    gates: Gates,
    map: &'m mut PointCloud<N>,
    encoder: Encoder,
    counters: Counters,
}

impl<'m, const N: usize> Receiver<'m, N> {
    /// A receiver that adds to `map`; its packets count from 0.
    #[must_use]
    pub fn new(map: &'m mut PointCloud<N>, form: Form, gates: Gates) -> Self {
        Self {
            form,
            gates,
            map,
            encoder: Encoder::new(),
            counters: Counters::default(),
        }
    }

    /// The map so far.
    #[must_use]
    pub fn map(&self) -> &PointCloud<N> {
        self.map
    }

    /// What became of everything received so far.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Takes one record from the ring, if there is one, and answers it.
    ///
    /// # Errors
    /// [`ReceiveError::Ring`] when the ring cannot be used any more; else as [`Receiver::receive`].
    pub fn step<M: SharedMemory, W: Write>(
        &mut self,
        ring: &mut Consumer<M, { measurement::LENGTH }>,
        downlink: &mut W,
    ) -> Result<Step, ReceiveError<W::Error>> {
        let mut record = [0; measurement::LENGTH];
        if !ring.pop(&mut record)? {
            return Ok(Step::Idle);
        }
        self.receive(&record, downlink)
    }

    /// Answers the bytes of one record.
    ///
    /// # Errors
    /// As [`Receiver::measure`].
    pub fn receive<W: Write>(
        &mut self,
        record: &[u8],
        downlink: &mut W,
    ) -> Result<Step, ReceiveError<W::Error>> {
        match Record::decode(record) {
            Ok(Record::Path(path)) => {
                self.measure(&path, downlink)?;
                Ok(Step::Answered)
            }
            Ok(Record::End { sent }) => {
                self.counters.ended(sent);
                self.send(&Message::Summary(self.summary()), downlink)?;
                Ok(Step::Ended)
            }
            Err(error) => {
                self.counters.damaged(error);
                Ok(Step::Damaged(error))
            }
        }
    }

    /// Solves one measured path, puts its point into the map, and sends a packet that says what became of it.
    ///
    /// # Errors
    /// [`ReceiveError::Downlink`] or [`ReceiveError::DownlinkStuck`] when the packet cannot be sent. The measurement is counted and in the map all the same.
    pub fn measure<W: Write>(
        &mut self,
        record: &PathRecord,
        downlink: &mut W,
    ) -> Result<(), ReceiveError<W::Error>> {
        let message = self.judge(record);
        self.send(&message, downlink)
    }

    /// Totals so far, as they go down at the end of a stream.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let map = self.map.counters();
        Summary {
            points: self.counters.points,
            rejected: self.counters.rejected,
            invalid: self.counters.invalid,
            damaged: self.counters.damaged_total(),
            map_points: u32::try_from(self.map.len()).unwrap_or(u32::MAX),
            map_dropped: map.dropped.saturating_add(map.out_of_range),
        }
    }

    fn judge(&mut self, record: &PathRecord) -> Message {
        let (link, path) = (record.link, record.path);
        match self.solve(record) {
            Ok(Verdict::Accepted(point)) => {
                count(&mut self.counters.points);
                // The map counts what it does not take; the ground gets the point in any case.
                let _counted_by_the_map = self.map.insert(&point);
                let position_m = point.position.to_array();
                Message::Point(PointReport {
                    link,
                    path,
                    position_m,
                    sigma_m: point.sigma_m(),
                })
            }
            Ok(Verdict::Rejected(reason)) => {
                count(&mut self.counters.rejected);
                Message::Rejection(RejectionReport { link, path, reason })
            }
            Err(error) => {
                count(&mut self.counters.invalid);
                Message::Input(InputReport { link, path, error })
            }
        }
    }

    fn solve(&self, record: &PathRecord) -> Result<Verdict, InputError> {
        let (ends, path) = record.measurement()?;
        solve(&ends, &path, self.form, &self.gates)
    }

    fn send<W: Write>(&mut self, message: &Message, downlink: &mut W) -> Result<(), ReceiveError<W::Error>> {
        let mut frame = [0; MAX_FRAME];
        let result = match self.encoder.encode(message, &mut frame) {
            Ok(bytes) => write_whole(bytes, downlink),
            Err(error) => Err(ReceiveError::Encode(error)),
        };
        count(if result.is_ok() {
            &mut self.counters.sent
        } else {
            &mut self.counters.unsent
        });
        result
    }
}

/// Writes all of a packet. The trait's own `write_all` panics when a driver says that it wrote nothing, or more than it
/// was given; in flight that is an error like any other.
fn write_whole<W: Write>(mut bytes: &[u8], downlink: &mut W) -> Result<(), ReceiveError<W::Error>> {
    while !bytes.is_empty() {
        let written = downlink.write(bytes).map_err(ReceiveError::Downlink)?;
        bytes = match bytes.get(written..) {
            Some(rest) if written > 0 => rest,
            _ => return Err(ReceiveError::DownlinkStuck),
        };
    }
    Ok(())
}

fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
