//! Packets for the ground.
//!
//! First version: one [`Message`] a packet, serialised by postcard, closed by a CRC-32 and framed by COBS so that a
//! receiver finds the next packet after any damage. On the wire:
//!
//! ```text
//! COBS( version: u8 | (sequence: u16, message) in postcard | CRC-32/ISO-HDLC of all before, little endian ) 0x00
//! ```
//!
//! Every measurement leads to a packet, whether it became a point or not: the ground sees what was rejected and why.

mod cobs;
mod decoder;
mod encoder;
mod error;
mod message;

pub use decoder::{Decoder, Packet};
pub use encoder::Encoder;
pub use error::TelemetryError;
pub use message::{InputReport, Message, PointReport, RejectionReport, Summary};

/// Version of the wire format, the first byte of a packet.
pub const VERSION: u8 = 1;

/// Longest packet before framing, bytes.
pub const MAX_PACKET: usize = 64;

/// Longest frame on the wire, the closing zero included, bytes: COBS adds one byte to a packet under 255 bytes.
pub const MAX_FRAME: usize = MAX_PACKET + 2;

const CRC_LENGTH: usize = 4;
