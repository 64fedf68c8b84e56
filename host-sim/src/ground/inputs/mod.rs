//! Where packets come from: each input is a thread that passes on bytes as they come.
//!
//! Bytes wait in a bounded queue. When that is full an input waits as well, and what the operating system cannot keep meanwhile is
//! lost and shows as gaps in the numbers of the packets.

#[cfg(unix)]
mod serial;
mod udp;

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

#[cfg(unix)]
pub use serial::{Serial, SerialPort};
pub use udp::Udp;

/// Chunks of bytes that may wait: at 100 UAVs and full rate, several seconds.
const MOST_CHUNKS: usize = 16_384;

/// Which stream of bytes a chunk belongs to: frames do not go across streams.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Source {
    /// Name of the input, for people.
    pub input: Arc<str>,
    /// Who sent it, where there are several.
    pub peer: Option<SocketAddr>,
}

/// What an input says.
#[derive(Clone, Debug, PartialEq)]
pub enum Said {
    /// Bytes of a stream.
    Bytes(Source, Vec<u8>),
    /// What is wrong with an input, or that it is in order again.
    Trouble(Arc<str>, Option<String>),
}

/// The queue from inputs to the engine.
pub fn queue() -> (SyncSender<Said>, Receiver<Said>) {
    sync_channel(MOST_CHUNKS)
}
