//! Where packets come from: each input is a thread that passes on bytes as they come.
//!
//! Bytes wait in a bounded queue. When that is full an input waits as well, and what the operating system cannot keep meanwhile is
//! lost and shows as gaps in the numbers of the packets.

#[cfg(unix)]
mod serial;
mod udp;

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

#[cfg(unix)]
pub use serial::{Serial, SerialPort};
pub use udp::Udp;

/// Chunks of bytes that may wait: at 100 UAVs and full rate, several seconds.
const MOST_CHUNKS: usize = 16_384;

/// Which input a chunk of bytes is of, by its name for people, and whether it goes on from the chunk before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A stream: frames may be cut anywhere between chunks.
    Stream(Arc<str>),
    /// A datagram, which holds whole frames: anybody may have sent the one before.
    Datagram(Arc<str>),
}

impl Source {
    /// Name of the input.
    pub fn input(&self) -> &Arc<str> {
        let (Self::Stream(input) | Self::Datagram(input)) = self;
        input
    }
}

/// What an input says.
#[derive(Clone, Debug, PartialEq)]
pub enum Said {
    /// A chunk of bytes.
    Bytes(Source, Vec<u8>),
    /// What is wrong with an input, or that it is in order again.
    Trouble(Arc<str>, Option<String>),
}

/// The queue from inputs to the engine.
pub fn queue() -> (SyncSender<Said>, Receiver<Said>) {
    sync_channel(MOST_CHUNKS)
}
