//! The board's PSRAM, which QEMU shares with a process of the host as a file.

use core::ops::Range;
use core::ptr;
use core::sync::atomic::{Ordering, fence};

use cslam_firmware::ring::{AccessError, SharedMemory};

/// First address and length of the PSRAM (Arm AN500, memory map).
const BASE: usize = 0x6000_0000;
const LENGTH: usize = 16 * 1024 * 1024;

/// A view of the PSRAM from some place on. Several may exist: they share the memory with the host anyway, and with each other in
/// the same way.
pub(crate) struct Psram {
    at: usize,
}

impl Psram {
    /// A view from `at` on, at most the length.
    pub(crate) const fn from(at: usize) -> Self {
        Self {
            at: if at < LENGTH { at } else { LENGTH },
        }
    }

    /// Addresses of the bytes of a range, if the range lies inside.
    fn addresses(&self, offset: usize, length: usize) -> Result<Range<usize>, AccessError> {
        let end = offset.checked_add(length).ok_or(AccessError::OutOfRange)?;
        if end <= self.size() {
            Ok(BASE + self.at + offset..BASE + self.at + end)
        } else {
            Err(AccessError::OutOfRange)
        }
    }
}

impl SharedMemory for Psram {
    fn size(&self) -> usize {
        LENGTH - self.at
    }

    fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), AccessError> {
        let addresses = self.addresses(offset, bytes.len())?;
        // Words where they lie on words, as all of a block of samples does: a byte at a time takes the emulator four times as long.
        let aligned = addresses.start % 4 == 0;
        let (words, rest) = bytes.as_chunks_mut::<4>();
        let words_end = addresses.start + 4 * words.len();
        for (at, word) in addresses.clone().step_by(4).zip(words) {
            *word = if aligned {
                // SAFETY: `addresses` has shown that the bytes lie in the PSRAM, which exists for the whole run, is mapped, and is no
                // Rust object: neither the linker script nor any reference covers it. The word is aligned, and any is valid.
                // Volatile, because the host writes here at the same time.
                unsafe { ptr::read_volatile(at as *const u32) }.to_le_bytes()
            } else {
                // SAFETY: as above; a byte has no alignment.
                [0, 1, 2, 3].map(|k| unsafe { ptr::read_volatile((at + k) as *const u8) })
            };
        }
        for (at, byte) in (words_end..addresses.end).zip(rest) {
            // SAFETY: as above; a byte has no alignment.
            *byte = unsafe { ptr::read_volatile(at as *const u8) };
        }
        // A dmb: what the caller reads next is read after this.
        fence(Ordering::SeqCst);
        Ok(())
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), AccessError> {
        let addresses = self.addresses(offset, bytes.len())?;
        // A dmb: what the caller wrote before is seen before this.
        fence(Ordering::SeqCst);
        for (at, byte) in addresses.zip(bytes) {
            // SAFETY: as in `read`; and nothing in this program relies on what the PSRAM holds staying the same.
            unsafe { ptr::write_volatile(at as *mut u8, *byte) };
        }
        Ok(())
    }
}
