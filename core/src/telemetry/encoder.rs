//! Messages to frames.

use super::{CRC_LENGTH, MAX_FRAME, MAX_PACKET, Message, TelemetryError, VERSION, cobs};
use crate::checksum::CRC;

/// Numbers packets and frames them.
#[derive(Clone, Debug, Default)]
pub struct Encoder {
    sequence: u16,
}

impl Encoder {
    /// An encoder whose first packet has sequence number 0.
    #[must_use]
    pub const fn new() -> Self {
        Self { sequence: 0 }
    }

    /// Encodes one message into `frame` and returns the bytes to send, closing zero included. The sequence number wraps
    /// at 65 536 and counts only packets that were made.
    ///
    /// # Errors
    /// [`TelemetryError::BufferTooSmall`], which a buffer of [`MAX_FRAME`] bytes excludes.
    pub fn encode<'a>(
        &mut self,
        message: &Message,
        frame: &'a mut [u8; MAX_FRAME],
    ) -> Result<&'a [u8], TelemetryError> {
        let mut packet = [0; MAX_PACKET];
        let length = write_packet(self.sequence, message, &mut packet)?;
        let body = packet.get(..length).ok_or(TelemetryError::BufferTooSmall)?;
        let stuffed = cobs::encode(body, frame).ok_or(TelemetryError::BufferTooSmall)?;
        *frame.get_mut(stuffed).ok_or(TelemetryError::BufferTooSmall)? = 0;
        self.sequence = self.sequence.wrapping_add(1);
        frame.get(..=stuffed).ok_or(TelemetryError::BufferTooSmall)
    }
}

/// Writes version, sequence number, message and checksum; returns the length.
fn write_packet(
    sequence: u16,
    message: &Message,
    packet: &mut [u8; MAX_PACKET],
) -> Result<usize, TelemetryError> {
    let (version, body) = packet.split_first_mut().ok_or(TelemetryError::BufferTooSmall)?;
    *version = VERSION;
    let room = body.len() - CRC_LENGTH;
    let content = body.get_mut(..room).ok_or(TelemetryError::BufferTooSmall)?;
    let used = postcard::to_slice(&(sequence, message), content)
        .map_err(|_| TelemetryError::BufferTooSmall)?
        .len();
    let checked = 1 + used;
    let checksum = CRC.checksum(packet.get(..checked).ok_or(TelemetryError::BufferTooSmall)?);
    packet
        .get_mut(checked..checked + CRC_LENGTH)
        .ok_or(TelemetryError::BufferTooSmall)?
        .copy_from_slice(&checksum.to_le_bytes());
    Ok(checked + CRC_LENGTH)
}
