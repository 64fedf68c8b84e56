//! What goes to the ground: messages into signed frames, frames into a bounded queue.
//!
//! The queue holds whole frames. A frame that finds no room is dropped and counted, and so is every message that cannot be sent;
//! the receiver never waits for its radio. Points wait in a batch, since many together cost less than each alone. What became of
//! a surface goes out behind the points that it concerns, and is told again with every report of health ([`SurfaceNews`]).

use cslam_core::telemetry::{Batch, Key, MAX_FRAME, Message, PointReport, Sender};
use heapless::Deque;

use super::counters::count;
use super::surface_news::SurfaceNews;

/// Bytes that may wait for the radio: 0.7 s of a 57 600 baud link.
pub const QUEUE: usize = 4096;

/// Frames on their way to the ground.
#[derive(Debug)]
pub struct Downlink {
    sender: Sender,
    batch: Batch,
    news: SurfaceNews,
    queue: Deque<u8, QUEUE>,
    sent: u32,
    dropped: u32,
}

impl Downlink {
    /// The link of a UAV, whose first packet has counter `first`.
    #[must_use]
    pub fn new(uav: u8, key: &Key, first: u32) -> Self {
        Self {
            sender: Sender::new(uav, key, first),
            batch: Batch::default(),
            news: SurfaceNews::new(),
            queue: Deque::new(),
            sent: 0,
            dropped: 0,
        }
    }

    /// The sender: its counter has to survive a reset.
    pub fn sender(&mut self) -> &mut Sender {
        &mut self.sender
    }

    /// Takes bytes for the radio out of the queue and returns how many.
    pub fn take(&mut self, bytes: &mut [u8]) -> usize {
        let mut taken = 0;
        for slot in bytes {
            let Some(byte) = self.queue.pop_front() else { break };
            *slot = byte;
            taken += 1;
        }
        taken
    }

    /// Bytes that wait.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.queue.len()
    }

    /// Packets that went into the queue, and packets that did not.
    #[must_use]
    pub fn sent_and_dropped(&self) -> [u32; 2] {
        [self.sent, self.dropped]
    }

    /// How long a point may wait for others.
    pub(super) fn set_patience_ns(&mut self, limit_ns: u64) {
        self.close_batch();
        self.batch = Batch::new(limit_ns);
    }

    /// Sends a message: an event of a surface behind the points that wait, a report of health with such an event of before.
    pub(super) fn send(&mut self, message: &Message) {
        if let Message::Event(report) = message
            && self.news.keep(report)
        {
            self.close_batch();
        }
        self.queue(message);
        if let Message::Health(_) = message
            && let Some(report) = self.news.next()
        {
            self.queue(&Message::Event(report));
        }
    }

    /// Queues a message.
    fn queue(&mut self, message: &Message) {
        let mut frame = [0; MAX_FRAME];
        let queue = &mut self.queue;
        let queued = match self.sender.encode(message, &mut frame) {
            Ok(bytes) if bytes.len() <= queue.capacity() - queue.len() => {
                bytes.iter().all(|byte| queue.push_back(*byte).is_ok())
            }
            _ => false,
        };
        count(if queued { &mut self.sent } else { &mut self.dropped });
    }

    /// Adds a point to the batch.
    pub(super) fn point(&mut self, now_ns: u64, point: &PointReport) {
        // A withdrawal that came after this point would take it away.
        for _ in 0..self.news.until_withdrawn(point.surface) {
            if let Some(report) = self.news.forget_oldest() {
                self.queue(&Message::Event(report));
            }
        }
        match self.batch.push(now_ns, point) {
            Ok(Some(closed)) => self.queue(&Message::Points(closed)),
            Ok(None) => {}
            // Beyond what the format can say, and then beyond the map.
            Err(_) => count(&mut self.dropped),
        }
    }

    /// Sends the batch if it is time.
    pub(super) fn points_if_due(&mut self, now_ns: u64) {
        if let Some(due) = self.batch.due(now_ns) {
            self.queue(&Message::Points(due));
        }
    }

    /// Sends the batch as it is.
    pub(super) fn close_batch(&mut self) {
        if let Some(points) = self.batch.close() {
            self.queue(&Message::Points(points));
        }
    }
}
