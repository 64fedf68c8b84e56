//! The reading end.

use super::header::{HEAD_AT, Header, TAIL_AT};
use super::{RingError, SharedMemory};

/// The reading end of a ring whose slots have `SLOT` bytes.
#[derive(Debug)]
pub struct Consumer<M, const SLOT: usize> {
    header: Header<M, SLOT>,
    tail: u32,
}

impl<M: SharedMemory, const SLOT: usize> Consumer<M, SLOT> {
    /// Opens the ring that the producer made, at the first record that no consumer has taken.
    ///
    /// # Errors
    /// [`RingError::NotReady`] while there is none, and the other variants for a ring that is not ours to read.
    pub fn open(memory: M) -> Result<Self, RingError> {
        let mut header = Header::open(memory)?;
        let tail = header.load_own_index(TAIL_AT)?;
        Ok(Self { header, tail })
    }

    /// Takes the oldest record. `false` when the ring is empty: `record` is then unchanged.
    ///
    /// # Errors
    /// [`RingError::Indices`] or [`RingError::IndexDamaged`] when the producer's index is impossible,
    /// [`RingError::Access`] when the memory fails.
    pub fn pop(&mut self, record: &mut [u8; SLOT]) -> Result<bool, RingError> {
        let Some(head) = self.header.load_index(HEAD_AT)? else {
            return Ok(false);
        };
        if self.header.distance(head, self.tail)? == 0 {
            return Ok(false);
        }
        self.header.memory.read(self.header.slot_at(self.tail), record)?;
        let tail = self.tail.wrapping_add(1);
        self.header.store_index(TAIL_AT, tail)?;
        self.tail = tail;
        Ok(true)
    }
}
