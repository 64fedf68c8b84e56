//! Collects points until it is worth a packet.

use super::{BatchError, PointBatch, PointReport};

/// Points on their way into a packet. A batch is closed when it is full or when its oldest point has waited long enough: the
/// longer it may wait, the fewer bytes a point takes, and the later the ground sees it.
#[derive(Clone, Debug)]
pub struct Batch {
    limit_ns: u64,
    oldest_ns: u64,
    points: PointBatch,
}

impl Batch {
    /// How long a point waits by default, ns: 8 s. From a dozen points on, one costs less than 8 bytes.
    pub const LIMIT_NS: u64 = 8_000_000_000;

    /// An empty batch whose points wait no longer than `limit_ns`.
    #[must_use]
    pub const fn new(limit_ns: u64) -> Self {
        Self {
            limit_ns,
            oldest_ns: 0,
            points: PointBatch::new(),
        }
    }

    /// Adds a point and returns the batch that had to be closed for it, if one had.
    ///
    /// # Errors
    /// [`BatchError::OutOfRange`]: the point cannot be sent.
    pub fn push(&mut self, now_ns: u64, point: &PointReport) -> Result<Option<PointBatch>, BatchError> {
        let closed = match self.points.push(point) {
            Ok(()) => None,
            Err(BatchError::OutOfRange) => return Err(BatchError::OutOfRange),
            Err(BatchError::Full | BatchError::Order) => {
                let closed = self.close();
                self.points.push(point)?;
                closed
            }
        };
        if self.points.len() == 1 {
            self.oldest_ns = now_ns;
        }
        Ok(closed)
    }

    /// The batch, when it is full or its oldest point has waited long enough. Ask after each sweep.
    pub fn due(&mut self, now_ns: u64) -> Option<PointBatch> {
        let old = now_ns.saturating_sub(self.oldest_ns) >= self.limit_ns;
        if old || self.points.is_full() {
            self.close()
        } else {
            None
        }
    }

    /// The batch as it is, unless it is empty.
    pub fn close(&mut self) -> Option<PointBatch> {
        let points = core::mem::take(&mut self.points);
        (!points.is_empty()).then_some(points)
    }
}

impl Default for Batch {
    fn default() -> Self {
        Self::new(Self::LIMIT_NS)
    }
}
