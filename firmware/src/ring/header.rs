//! The header of a ring: geometry, written once, and two indices.

use super::{RingError, SharedMemory};

/// First four bytes of a ring.
pub const MAGIC: [u8; 4] = *b"CSLR";
/// Version of the layout.
pub const VERSION: u32 = 1;
/// Bytes before the first slot.
pub const HEADER_LENGTH: usize = 128;

const VERSION_AT: usize = 4;
const SLOT_SIZE_AT: usize = 8;
const SLOTS_AT: usize = 12;
pub(super) const HEAD_AT: usize = 32;
pub(super) const TAIL_AT: usize = 64;

/// How often in a row the other party's index may disagree with its complement. A writer may be suspended between the
/// two for a scheduler's slice, so this is a long time at any polling rate, and not for ever.
const TORN_READS_MAX: u32 = 1 << 20;

/// Memory that a ring of this geometry takes, bytes.
///
/// # Errors
/// [`RingError::SlotCount`] unless `slots` is a power of two, [`RingError::TooLarge`] when the length is no `usize`.
pub fn region_length(slot_size: usize, slots: u32) -> Result<usize, RingError> {
    if !slots.is_power_of_two() {
        return Err(RingError::SlotCount { found: slots });
    }
    let count = usize::try_from(slots).map_err(|_| RingError::TooLarge)?;
    let length = slot_size
        .checked_mul(count)
        .and_then(|n| n.checked_add(HEADER_LENGTH));
    length.ok_or(RingError::TooLarge)
}

/// A ring's memory with geometry that was checked against it.
#[derive(Debug)]
pub(super) struct Header<M, const SLOT: usize> {
    pub(super) memory: M,
    slots: u32,
    /// Torn reads in a row.
    torn: u32,
}

impl<M: SharedMemory, const SLOT: usize> Header<M, SLOT> {
    /// Makes an empty ring of `slots` slots. Whatever ring was there is gone.
    pub(super) fn create(mut memory: M, slots: u32) -> Result<Self, RingError> {
        if region_length(SLOT, slots)? > memory.size() {
            return Err(RingError::TooLarge);
        }
        let slot_size = u32::try_from(SLOT).map_err(|_| RingError::TooLarge)?;
        memory.write(0, &[0; MAGIC.len()])?;
        memory.write(VERSION_AT, &VERSION.to_le_bytes())?;
        memory.write(SLOT_SIZE_AT, &slot_size.to_le_bytes())?;
        memory.write(SLOTS_AT, &slots.to_le_bytes())?;
        let mut header = Self {
            memory,
            slots,
            torn: 0,
        };
        header.store_index(HEAD_AT, 0)?;
        header.store_index(TAIL_AT, 0)?;
        header.memory.write(0, &MAGIC)?;
        Ok(header)
    }

    /// Opens the ring that the other party made.
    pub(super) fn open(memory: M) -> Result<Self, RingError> {
        let mut magic = [0; MAGIC.len()];
        memory.read(0, &mut magic)?;
        if magic != MAGIC {
            return Err(RingError::NotReady);
        }
        let found = load(&memory, VERSION_AT)?;
        if found != VERSION {
            return Err(RingError::Version { found });
        }
        let found = load(&memory, SLOT_SIZE_AT)?;
        let expected = u32::try_from(SLOT).map_err(|_| RingError::TooLarge)?;
        if found != expected {
            return Err(RingError::SlotSize { found, expected });
        }
        let slots = load(&memory, SLOTS_AT)?;
        if region_length(SLOT, slots)? > memory.size() {
            return Err(RingError::TooLarge);
        }
        Ok(Self {
            memory,
            slots,
            torn: 0,
        })
    }

    pub(super) fn slots(&self) -> u32 {
        self.slots
    }

    /// Number of records between two indices, which must not exceed the number of slots.
    pub(super) fn distance(&self, head: u32, tail: u32) -> Result<u32, RingError> {
        let distance = head.wrapping_sub(tail);
        if distance > self.slots {
            return Err(RingError::Indices { head, tail });
        }
        Ok(distance)
    }

    /// Offset of the slot that an index falls on.
    pub(super) fn slot_at(&self, index: u32) -> usize {
        // Both casts widen, and `region_length` has shown that the sum fits.
        HEADER_LENGTH + (index & (self.slots - 1)) as usize * SLOT
    }

    pub(super) fn store_index(&mut self, at: usize, index: u32) -> Result<(), RingError> {
        let mut pair = [0; 8];
        let (value, complement) = pair.split_at_mut(4);
        value.copy_from_slice(&index.to_le_bytes());
        complement.copy_from_slice(&(!index).to_le_bytes());
        Ok(self.memory.write(at, &pair)?)
    }

    /// An index that only this party writes, as it was left.
    pub(super) fn load_own_index(&mut self, at: usize) -> Result<u32, RingError> {
        self.load_index(at)?.ok_or(RingError::IndexDamaged)
    }

    /// An index of the other party; `None` while it is being written.
    pub(super) fn load_index(&mut self, at: usize) -> Result<Option<u32>, RingError> {
        let complement = load(&self.memory, at + 4)?;
        let index = load(&self.memory, at)?;
        if index == !complement {
            self.torn = 0;
            return Ok(Some(index));
        }
        self.torn += 1;
        if self.torn >= TORN_READS_MAX {
            Err(RingError::IndexDamaged)
        } else {
            Ok(None)
        }
    }
}

fn load<M: SharedMemory>(memory: &M, at: usize) -> Result<u32, RingError> {
    let mut bytes = [0; 4];
    memory.read(at, &mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}
