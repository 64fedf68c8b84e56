//! What can be wrong with a store.

use core::fmt;

use super::VERSION;

/// A record that is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RecordError {
    /// Not the beginning of a record.
    Magic,
    /// A record of another version.
    Version {
        /// Version found.
        found: u16,
    },
    /// A record of another length.
    Length {
        /// Bytes of content found.
        found: u16,
    },
    /// The checksum does not match, as when the power failed while it was written.
    Checksum,
    /// A field has a value that it cannot have.
    Content,
    /// The memory could not be read there.
    Unreadable,
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic => f.write_str("no record begins there"),
            Self::Version { found } => write!(
                f,
                "it is of version {found}, this firmware's is {VERSION}: write the settings anew"
            ),
            Self::Length { found } => {
                write!(f, "it has {found} bytes of content, another number is expected")
            }
            Self::Checksum => f.write_str("its checksum does not match"),
            Self::Content => f.write_str("a field has a value that it cannot have: write the settings anew"),
            Self::Unreadable => f.write_str("the memory cannot be read there"),
        }
    }
}

impl core::error::Error for RecordError {}

/// A store that cannot be used; `E` is the flash's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StorageError<E> {
    /// The memory is no pair of halves that this store can use.
    Geometry {
        /// Bytes of the memory.
        capacity: usize,
        /// Bytes of a sector.
        sector: usize,
    },
    /// Nothing has ever been stored.
    Empty,
    /// There are records, and none is sound. This is what is wrong with the last one.
    NoneSound(RecordError),
    /// Erasing or writing failed.
    Flash(E),
    /// There is no room without an erase, which is still to be done or under way.
    Busy,
    /// What was written does not read back, in several places.
    Worn,
}

impl<E: fmt::Debug> fmt::Display for StorageError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Geometry { capacity, sector } => write!(
                f,
                "storage: {capacity} bytes in sectors of {sector} are not two halves of whole sectors"
            ),
            Self::Empty => f.write_str("storage: nothing has been stored yet: write the settings"),
            Self::NoneSound(error) => write!(f, "storage: no record is sound, of the last one {error}"),
            Self::Flash(error) => write!(f, "storage: the flash refuses ({error:?}): check its supply"),
            Self::Busy => f.write_str("storage: room is being made: the settings are stored a little later"),
            Self::Worn => f.write_str("storage: what is written does not read back: the flash is worn out"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for StorageError<E> {}
