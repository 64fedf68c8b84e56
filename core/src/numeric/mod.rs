//! What every floor may use: bounded collections, the checksum, the time between two stamps.

mod bounded;
mod checksum;
mod elapsed;

pub(crate) use bounded::gather;
pub(crate) use checksum::CRC;
pub(crate) use elapsed::elapsed_s;
