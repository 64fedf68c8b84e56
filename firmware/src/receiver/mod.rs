//! The receiver of a board: measurements in, packets out.
//!
//! Every measurement ends in the report of its sweep: as a point, or as the reason why there is none. Points go down in batches.
//! Records that were damaged on the way have nothing to say, so they are counted; the counts go down at the end of the stream.
//! Nothing is dropped without a counter.

mod counters;
mod error;
mod sweep;

use cslam_core::map::PointCloud;
use cslam_core::reflection::{Form, Gates, InputError, ReflectionPoint, Verdict, solve};
use cslam_core::telemetry::{
    Batch, HealthCounters, HealthReport, MAX_FRAME, Message, PathOutcome, PointReport, Sender,
};
use embedded_io::Write;

use crate::measurement::{self, PathRecord, Record, RecordError};
use crate::ring::{Consumer, SharedMemory};
use sweep::Sweeps;

pub use counters::Counters;
pub use error::ReceiveError;

/// The map that a board has room for: about 120 KiB of static memory.
pub type BoardMap = PointCloud<4096>;

/// Points wait until a batch is full: a list of measurements has no clock, and nobody who watches.
const PATIENCE_NS: u64 = u64::MAX;

/// What one call did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Step {
    /// Nothing was there to do.
    Idle,
    /// A measurement was judged: see [`Receiver::answer`].
    Answered,
    /// A damaged record was counted.
    Damaged(RecordError),
    /// The stream has ended and everything is sent.
    Ended,
}

/// What became of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Index of the link.
    pub link: u32,
    /// Index of the path in the link.
    pub path: u8,
    /// What the ground is told.
    pub outcome: PathOutcome,
    /// The point, when it is one.
    pub point: Option<ReflectionPoint>,
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
    sender: Sender,
    batch: Batch,
    sweeps: Sweeps,
    answer: Option<Answer>,
    counters: Counters,
}

impl<'m, const N: usize> Receiver<'m, N> {
    /// A receiver that adds to `map` and sends as `sender` does.
    #[must_use]
    pub fn new(map: &'m mut PointCloud<N>, form: Form, gates: Gates, sender: Sender) -> Self {
        Self {
            form,
            gates,
            map,
            sender,
            batch: Batch::new(PATIENCE_NS),
            sweeps: Sweeps::default(),
            answer: None,
            counters: Counters::default(),
        }
    }

    /// What became of the last measurement.
    #[must_use]
    pub fn answer(&self) -> Option<&Answer> {
        self.answer.as_ref()
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
                self.end(downlink)?;
                Ok(Step::Ended)
            }
            Err(error) => {
                self.counters.damaged(error);
                Ok(Step::Damaged(error))
            }
        }
    }

    /// Solves one measured path, puts its point into the map, and enters what became of it into the report of its sweep. What
    /// is complete goes down.
    ///
    /// # Errors
    /// [`ReceiveError::Downlink`] or [`ReceiveError::DownlinkStuck`] when a packet cannot be sent, after all of them were tried.
    /// The measurement is counted and in the map all the same.
    pub fn measure<W: Write>(
        &mut self,
        record: &PathRecord,
        downlink: &mut W,
    ) -> Result<(), ReceiveError<W::Error>> {
        let now_ns = Sweeps::time_ns(record.link);
        let closed = self.sweeps.turn(record);
        let due = closed.as_ref().and_then(|_| self.batch.due(now_ns));
        let (mut outcome, point) = self.judge(record);
        let mut full = None;
        if let Some(point) = point.filter(|_| outcome == PathOutcome::Point) {
            let report = PointReport {
                sweep: record.link,
                stop: self.sweeps.stop(),
                position_m: point.position.to_array(),
                sigma_m: point.sigma_m(),
                // The gates took it for certain: a record has nothing that a classifier could look at.
                probability: 1.0,
            };
            match self.batch.push(now_ns, &report) {
                Ok(closed) => full = closed,
                Err(_) => outcome = PathOutcome::PointOutOfRange,
            }
        }
        self.sweeps.enter(record.path, outcome);
        self.answer = Some(Answer {
            link: record.link,
            path: record.path,
            outcome,
            point,
        });
        let closed = closed.map(Message::Link);
        let points = [due, full].into_iter().flatten().map(Message::Points);
        self.send_all(closed.into_iter().chain(points), downlink)
    }

    /// Sends what is left, and the counters.
    fn end<W: Write>(&mut self, downlink: &mut W) -> Result<(), ReceiveError<W::Error>> {
        let link = self.sweeps.close().map(Message::Link);
        let points = self.batch.close().map(Message::Points);
        let result = self.send_all(link.into_iter().chain(points), downlink);
        let health = Message::Health(self.health());
        result.and(self.send_all([health].into_iter(), downlink))
    }

    /// Totals so far, as they go down at the end of a stream. Records stand for blocks: what came is what was judged.
    #[must_use]
    pub fn health(&self) -> HealthReport {
        let map = self.map.counters();
        let counters = &self.counters;
        HealthReport {
            counters: HealthCounters {
                blocks: counters.received().saturating_sub(counters.damaged_total()),
                blocks_damaged: counters.damaged_total(),
                blocks_lost: counters.missing,
                points: counters.points,
                rejected: counters.rejected,
                invalid: counters.invalid,
                map_points: u32::try_from(self.map.len()).unwrap_or(u32::MAX),
                map_dropped: map.dropped.saturating_add(map.out_of_range),
                packets_sent: counters.sent,
                packets_dropped: counters.unsent,
                ..HealthCounters::default()
            },
            ..HealthReport::default()
        }
    }

    fn judge(&mut self, record: &PathRecord) -> (PathOutcome, Option<ReflectionPoint>) {
        match self.solve(record) {
            Ok(Verdict::Accepted(point)) => {
                count(&mut self.counters.points);
                // The map counts what it does not take; the ground gets a point that had no room in any case.
                match self.map.insert(&point) {
                    Ok(_) => (PathOutcome::Point, Some(point)),
                    Err(_) => (PathOutcome::PointOutOfRange, Some(point)),
                }
            }
            Ok(Verdict::Rejected(reason)) => {
                count(&mut self.counters.rejected);
                (PathOutcome::Rejected(reason), None)
            }
            Err(error) => {
                count(&mut self.counters.invalid);
                (PathOutcome::Input(error), None)
            }
        }
    }

    fn solve(&self, record: &PathRecord) -> Result<Verdict, InputError> {
        let (ends, path) = record.measurement()?;
        solve(&ends, &path, self.form, &self.gates)
    }

    /// Sends every message; the first error is that of all.
    fn send_all<W: Write>(
        &mut self,
        messages: impl Iterator<Item = Message>,
        downlink: &mut W,
    ) -> Result<(), ReceiveError<W::Error>> {
        let mut result = Ok(());
        for message in messages {
            let sent = self.send(&message, downlink);
            count(if sent.is_ok() {
                &mut self.counters.sent
            } else {
                &mut self.counters.unsent
            });
            result = result.and(sent);
        }
        result
    }

    fn send<W: Write>(&mut self, message: &Message, downlink: &mut W) -> Result<(), ReceiveError<W::Error>> {
        let mut frame = [0; MAX_FRAME];
        let bytes = self.sender.encode(message, &mut frame);
        write_whole(bytes.map_err(ReceiveError::Encode)?, downlink)
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
