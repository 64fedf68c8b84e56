//! The board's PSRAM, which QEMU shares with a process of the host as a file.

use core::ops::Range;
use core::ptr;
use core::sync::atomic::{Ordering, fence};

use cslam_firmware::ring::{AccessError, SharedMemory};

/// First address and length of the PSRAM (Arm AN500, memory map).
const BASE: usize = 0x6000_0000;
const LENGTH: usize = 16 * 1024 * 1024;

/// A view of the whole PSRAM.
pub(crate) struct Psram(());

impl Psram {
    /// A view of the PSRAM. Several may exist: they share the memory with the host anyway, and with each other in the
    /// same way.
    pub(crate) const fn new() -> Self {
        Self(())
    }
}

/// Addresses of the bytes of a range, if the range lies inside.
fn addresses(offset: usize, length: usize) -> Result<Range<usize>, AccessError> {
    let end = offset.checked_add(length).ok_or(AccessError::OutOfRange)?;
    if end <= LENGTH {
        Ok(BASE + offset..BASE + end)
    } else {
        Err(AccessError::OutOfRange)
    }
}

impl SharedMemory for Psram {
    fn size(&self) -> usize {
        LENGTH
    }

    fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), AccessError> {
        for (at, byte) in addresses(offset, bytes.len())?.zip(bytes) {
            // SAFETY: `addresses` has shown that the byte lies in the PSRAM, which exists for the whole run, is mapped,
            // and is no Rust object: neither the linker script nor any reference covers it. A byte has no alignment and
            // no invalid value. Volatile, because the host writes here at the same time.
            *byte = unsafe { ptr::read_volatile(at as *const u8) };
        }
        // A dmb: what the caller reads next is read after this.
        fence(Ordering::SeqCst);
        Ok(())
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), AccessError> {
        let addresses = addresses(offset, bytes.len())?;
        // A dmb: what the caller wrote before is seen before this.
        fence(Ordering::SeqCst);
        for (at, byte) in addresses.zip(bytes) {
            // SAFETY: as in `read`; and nothing in this program relies on what the PSRAM holds staying the same.
            unsafe { ptr::write_volatile(at as *mut u8, *byte) };
        }
        Ok(())
    }
}
