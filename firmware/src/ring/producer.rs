//! The writing end.

use super::header::{HEAD_AT, Header, TAIL_AT};
use super::{RingError, SharedMemory};

/// The writing end of a ring whose slots have `SLOT` bytes.
#[derive(Debug)]
pub struct Producer<M, const SLOT: usize> {
    header: Header<M, SLOT>,
    head: u32,
}

impl<M: SharedMemory, const SLOT: usize> Producer<M, SLOT> {
    /// Makes an empty ring of `slots` slots (a power of two). Whatever ring was in the memory is gone.
    ///
    /// # Errors
    /// [`RingError::SlotCount`], [`RingError::TooLarge`] or [`RingError::Access`].
    pub fn create(memory: M, slots: u32) -> Result<Self, RingError> {
        Ok(Self {
            header: Header::create(memory, slots)?,
            head: 0,
        })
    }

    /// Opens the ring that a producer made before and goes on where it stopped.
    ///
    /// # Errors
    /// [`RingError::NotReady`] when there is none, and the other variants for a ring that is not ours to write.
    pub fn open(memory: M) -> Result<Self, RingError> {
        let mut header = Header::open(memory)?;
        let head = header.load_own_index(HEAD_AT)?;
        Ok(Self { header, head })
    }

    /// Publishes a record. `false` when the ring is full: nothing was written, try again when the consumer has moved.
    ///
    /// # Errors
    /// [`RingError::Indices`] or [`RingError::IndexDamaged`] when the consumer's index is impossible,
    /// [`RingError::Access`] when the memory fails.
    pub fn push(&mut self, record: &[u8; SLOT]) -> Result<bool, RingError> {
        let Some(tail) = self.header.load_index(TAIL_AT)? else {
            return Ok(false);
        };
        if self.header.distance(self.head, tail)? == self.header.slots() {
            return Ok(false);
        }
        let at = self.header.slot_at(self.head);
        self.header.memory.write(at, record)?;
        let head = self.head.wrapping_add(1);
        self.header.store_index(HEAD_AT, head)?;
        self.head = head;
        Ok(true)
    }
}
