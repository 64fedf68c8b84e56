//! Messages to frames.

use core::marker::PhantomData;

use super::bits::{BitWriter, Unwritten};
use super::header::{Header, put};
use super::{
    CRC_LENGTH, Content, HEADER_LENGTH, Key, MAX_FRAME, MAX_PACKET, Message, TAG_LENGTH, TelemetryError, cobs,
};
use crate::numeric::CRC;

/// One end of a link, sending: numbers, signs and frames messages of one direction, [`Message`] from a UAV or
/// [`super::Uplink`] to it.
///
/// No counter may be used twice with a key, not even after a reset: what was sent before would be taken for new. So a sender
/// has a limit. Store a counter some way ahead, allow it by [`Sender::allow`], and begin with the stored one after a reset:
///
/// ```
/// use cslam_core::telemetry::{Command, Key, MAX_FRAME, Sender, Uplink};
///
/// const RESERVE: u32 = 1024;
/// let mut stored = 5000; // read from memory that survives a reset
/// let mut sender = Sender::new(1, &Key::TEST, stored);
/// sender.allow(stored);
/// let mut frame = [0; MAX_FRAME];
/// for _ in 0..3000 {
///     if sender.left() == 0 {
///         stored = sender.counter() + RESERVE; // write it there, and only then
///         sender.allow(stored);
///     }
///     sender.encode(&Uplink::Command(Command::SendConfig), &mut frame)?;
/// }
/// assert_eq!(stored, 5000 + 3 * RESERVE);
/// # Ok::<(), cslam_core::telemetry::TelemetryError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Sender<M = Message> {
    uav: u8,
    key: Option<Key>,
    next: u32,
    limit: u32,
    direction: PhantomData<fn(&M)>,
}

impl<M: Content> Sender<M> {
    /// A sender for the link of UAV number `uav` whose first packet has counter `first`.
    #[must_use]
    pub fn new(uav: u8, key: &Key, first: u32) -> Self {
        Self {
            key: Some(key.clone()),
            ..Self::unsigned(uav, first)
        }
    }

    /// A sender whose packets prove nothing. Receivers refuse them unless they were told not to.
    #[must_use]
    pub const fn unsigned(uav: u8, first: u32) -> Self {
        Self {
            uav,
            key: None,
            next: first,
            limit: u32::MAX,
            direction: PhantomData,
        }
    }

    /// Counter of the next packet.
    #[must_use]
    pub fn counter(&self) -> u32 {
        self.next
    }

    /// Sets the counter that this sender may not reach. Before the first call it may go on to the end, 4 294 967 295: 13
    /// packets per second for ten years.
    pub fn allow(&mut self, limit: u32) {
        self.limit = limit;
    }

    /// Packets that may still be sent.
    #[must_use]
    pub fn left(&self) -> u32 {
        self.limit.saturating_sub(self.next)
    }

    /// Encodes one message into `frame` and returns the bytes to send, closing zero included. Counts only packets that were
    /// made.
    ///
    /// # Errors
    /// [`TelemetryError::OutOfRange`] for a message that cannot be said, [`TelemetryError::CounterExhausted`] at the limit of
    /// [`Sender::allow`].
    pub fn encode<'a>(
        &mut self,
        message: &M,
        frame: &'a mut [u8; MAX_FRAME],
    ) -> Result<&'a [u8], TelemetryError> {
        if self.left() == 0 {
            return Err(TelemetryError::CounterExhausted);
        }
        let mut packet = [0; MAX_PACKET];
        let length = self
            .write(message, &mut packet)
            .map_err(|unwritten| match unwritten {
                Unwritten::TooLong => TelemetryError::BufferTooSmall,
                Unwritten::Unfit => TelemetryError::OutOfRange,
            })?;
        let packet = packet.get(..length).ok_or(TelemetryError::BufferTooSmall)?;
        let stuffed = cobs::encode(packet, frame).ok_or(TelemetryError::BufferTooSmall)?;
        *frame.get_mut(stuffed).ok_or(TelemetryError::BufferTooSmall)? = 0;
        self.next = self.next.saturating_add(1);
        frame.get(..=stuffed).ok_or(TelemetryError::BufferTooSmall)
    }

    /// Writes header, body, authentication code and checksum; returns the length.
    fn write(&self, message: &M, packet: &mut [u8; MAX_PACKET]) -> Result<usize, Unwritten> {
        let header = Header {
            direction: M::DIRECTION,
            signed: self.key.is_some(),
            kind: message.kind(),
            uav: self.uav,
            counter: self.next,
        };
        let mut length = put(packet, 0, &header.encode()).ok_or(Unwritten::TooLong)?;
        let body = packet.get_mut(HEADER_LENGTH..MAX_PACKET - TAG_LENGTH - CRC_LENGTH);
        let mut writer = BitWriter::new(body.ok_or(Unwritten::TooLong)?);
        message.write(&mut writer);
        length += writer.finish()?;
        if let Some(key) = &self.key {
            let tag = packet.get(..length).and_then(|signed| key.tag(signed));
            length = put(packet, length, &tag.ok_or(Unwritten::TooLong)?).ok_or(Unwritten::TooLong)?;
        }
        let checked = packet.get(..length).ok_or(Unwritten::TooLong)?;
        let checksum = CRC.checksum(checked).to_be_bytes();
        put(packet, length, &checksum).ok_or(Unwritten::TooLong)
    }
}
