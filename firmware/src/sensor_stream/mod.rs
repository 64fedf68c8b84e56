//! What reaches the receiver beside the blocks of samples, as records of one length: the second stream of a board that has no
//! sensors of its own, as under emulation.
//!
//! Records come in the order in which things happened. Blocks of samples are too large for it; a record of
//! [`Content::Frames`] says how many frames now lie ready on the link of the [`front_end`](crate::front_end), so that a run does not
//! depend on which of the two streams is faster.
//!
//! A record, little endian:
//!
//! | offset | type | content |
//! |---|---|---|
//! | 0 | u8 | version |
//! | 1 | u8 | kind |
//! | 2 | u16 | bytes of content |
//! | 4 | u32 | number of the record, from 0 |
//! | 8 | u64 | UAV clock, ns |
//! | 16 | | content, then zeros |
//! | 124 | u32 | CRC-32/ISO-HDLC of all before |

mod error;
mod record;

pub use error::RecordError;
pub use record::{Content, LENGTH, Record, UPLINK_MAX};

/// Number of the UAV in a simulated world; its packets are signed with the published key.
pub const UAV: u8 = 1;
/// Session on the link of the front end in a simulated world.
pub const SESSION: u16 = 1;

/// Where the ring of records begins in memory that is shared with the world, bytes.
pub const RECORDS_AT: usize = 0;
/// Where the ring of frames begins.
pub const FRAMES_AT: usize = 4 * 1024 * 1024;
