//! CRC-32/ISO-HDLC, the checksum of everything this crate reads: one table in flash.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

/// The checksum's table, 1 KiB.
pub(crate) static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);
