//! How shared memory is reached.

use core::fmt;

/// An access that did not happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AccessError {
    /// Part of the range lies outside the memory.
    OutOfRange,
    /// The memory's owner refused (a file that cannot be read or written).
    Failed,
}

impl fmt::Display for AccessError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OutOfRange => "an access lies outside the shared memory",
            Self::Failed => "the shared memory cannot be reached",
        })
    }
}

impl core::error::Error for AccessError {}

/// Memory that another party reads and writes at the same time.
///
/// # Contract
/// Every call reaches the memory itself (volatile, not cached), and the other party sees the calls of this one in their
/// order. Within one call bytes go in ascending order, but a call as a whole need not be atomic.
pub trait SharedMemory {
    /// Length of the memory, bytes.
    fn size(&self) -> usize;

    /// Reads `bytes.len()` bytes from `offset`.
    ///
    /// # Errors
    /// [`AccessError`]; what `bytes` then holds is not specified.
    fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), AccessError>;

    /// Writes `bytes` at `offset`.
    ///
    /// # Errors
    /// [`AccessError`]; how much was written is then not specified.
    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), AccessError>;
}
