//! What a receiver keeps while it has no power: who it is, its key, how far its counters have come, how it is mounted,
//! where it flies, with which radio.
//!
//! [`Store`] appends records to one of two halves of a flash memory. The newest sound record counts; when a half is full the
//! other one is erased and goes on. A record is sound when its checksum, its last bytes, is right, and nothing that counts is ever
//! written over or erased. So whenever the power fails, in a write or in an erase, the record before or the new one is there:
//! never none, never a mixture. Appending instead of two places that take turns saves the flash: a sector of an STM32H743 takes
//! 1024 records for each erase.
//!
//! What may be used only once, [`Ledger`] sets aside in it.
//!
//! An erase takes seconds. [`Store::make_room`] waits for it, before a flight; in flight [`Store::tend`] lets it go on beside everything else and
//! [`Store::append`] never needs one.
//!
//! It works over [`embedded_storage::nor_flash::NorFlash`]: whole words of at most [`SLOT`] bytes that are written once, an
//! erase that leaves ones. A read that fails (a word whose programming was cut has no valid error correction) is a damaged record like
//! any other.

mod erase;
mod error;
mod ledger;
mod radio;
mod record;
mod settings;
mod site;
mod store;

pub use erase::EraseInBackground;
pub use error::{RecordError, StorageError};
pub use ledger::{DOWNLINK_RESERVE, Ledger, ROOM, ROOM_IN_FLIGHT, UPLINK_RESERVE};
pub use radio::RadioSettings;
pub use record::SLOT;
pub use settings::{Mount, Settings};
pub use site::{EarthField, GmtPlace};
pub use store::Store;

/// Version of the records.
pub const VERSION: u16 = 2;
