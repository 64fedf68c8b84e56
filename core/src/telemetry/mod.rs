//! Packets between UAV and ground, version 3 of the wire format (docs/telemetry.md holds it byte by byte).
//!
//! ```text
//! COBS( version, way and kind, UAV, counter | body: a bit string | authentication code | CRC-32 ) 0x00
//!       7 bytes                               per kind             8 bytes               4
//! ```
//! Framing by COBS puts a receiver in step again at the next zero byte after any damage, the checksum finds the damage, the
//! authentication code finds the forger, the counter finds the replay. In that order, so that a noisy link does not look like
//! an attack.
//!
//! [`Message`] goes down, [`Uplink`] goes up. A [`Sender`] makes frames of either, a [`Deframer`] and an [`Opener`] (together a
//! [`Decoder`]) take them apart. [`Batch`] collects points so that one costs less than 8 bytes, everything included. Nothing
//! here allocates or can panic, and every decoded number comes out of whole numbers, the same on host and chip.
//!
//! # Example
//! A point goes down, and comes out of the bytes to the centimetre:
//! ```
//! use cslam_core::telemetry::{Decoder, Key, MAX_FRAME, Message, PointBatch, PointReport, Sender};
//!
//! let mut batch = PointBatch::new();
//! let sent = PointReport { sweep: 7, stop: 0, position_m: [20.004, 15.0, 2.0], sigma_m: 0.1, probability: 0.97, surface: Some(3) };
//! batch.push(&sent)?;
//! let mut frame = [0; MAX_FRAME];
//! let bytes = Sender::new(1, &Key::TEST, 0).encode(&Message::Points(batch), &mut frame)?;
//! let mut decoder: Decoder = Decoder::new(1, &Key::TEST);
//! let packet = bytes.iter().find_map(|byte| decoder.push(*byte)).expect("a whole frame")?;
//! let Message::Points(heard) = packet.message else { panic!("points were sent") };
//! let point = heard.points().next().expect("one");
//! assert_eq!((point.position_m, point.surface), ([20.0, 15.0, 2.0], Some(3)));
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod batch;
mod bits;
mod catalogue;
mod cobs;
mod decoder;
mod error;
mod event;
mod header;
mod health;
mod key;
mod link;
mod message;
mod opener;
mod points;
mod pose;
mod scale;
mod sender;
mod uplink;
mod window;

pub use batch::Batch;
pub use decoder::{Decoder, Deframer, Frame, Packet};
pub use error::TelemetryError;
pub use event::{ConfigReport, Event, EventReport, FaultRecord, ModeReport};
pub use header::Direction;
pub use health::{HealthCounters, HealthReport, ResetCause};
pub use key::Key;
pub use link::{LinkReport, MAX_OUTCOMES, PathOutcome};
pub use message::{Content, Message};
pub use opener::Opener;
pub use points::{BatchError, MAX_POINTS, PointBatch, PointReport};
pub use pose::{ClockReport, PoseReport, Spread};
pub use sender::Sender;
pub use uplink::{BeaconReport, Command, DownlinkRates, TimingReport, Uplink};
pub use window::REORDERING;

/// Version of the wire format, the first byte of a packet.
pub const VERSION: u8 = 3;

/// Longest packet before framing, bytes: that of a full batch of points as far apart as can be, each on a surface of its own.
pub const MAX_PACKET: usize = 427;

/// Longest frame on the wire, the closing zero included, bytes: COBS adds one byte for each 254 begun.
pub const MAX_FRAME: usize = MAX_PACKET + 1 + MAX_PACKET / 254 + 1;

const HEADER_LENGTH: usize = 7;
const TAG_LENGTH: usize = 8;
const CRC_LENGTH: usize = 4;
