//! What every floor may use: bounded collections, the checksum.

mod bounded;
mod checksum;

pub(crate) use bounded::gather;
pub(crate) use checksum::CRC;
