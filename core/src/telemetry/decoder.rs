//! Bytes to messages, whatever happened to the bytes.

use super::{CRC_LENGTH, MAX_FRAME, MAX_PACKET, Message, TelemetryError, VERSION, cobs};
use crate::checksum::CRC;

/// A decoded packet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packet {
    /// Sequence number: a gap is a lost packet.
    pub sequence: u16,
    /// Content.
    pub message: Message,
}

/// Collects bytes up to the next zero and decodes what they say. After any damage it is in step again at the next zero.
#[derive(Clone, Debug)]
pub struct Decoder {
    frame: heapless::Vec<u8, MAX_FRAME>,
    overflowed: bool,
}

impl Decoder {
    /// A decoder at the start of a frame.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            frame: heapless::Vec::new(),
            overflowed: false,
        }
    }

    /// Takes one byte; returns a packet, or the reason why there is none, at the end of every non-empty frame.
    pub fn push(&mut self, byte: u8) -> Option<Result<Packet, TelemetryError>> {
        if byte != 0 {
            self.overflowed |= self.frame.push(byte).is_err();
            return None;
        }
        let result = if self.overflowed {
            Some(Err(TelemetryError::FrameTooLong))
        } else if self.frame.is_empty() {
            None
        } else {
            Some(decode_frame(&self.frame))
        };
        self.frame.clear();
        self.overflowed = false;
        result
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

fn decode_frame(frame: &[u8]) -> Result<Packet, TelemetryError> {
    let mut packet = [0; MAX_PACKET];
    let length = cobs::decode(frame, &mut packet).ok_or(TelemetryError::Framing)?;
    let body = packet.get(..length).ok_or(TelemetryError::Framing)?;
    let checked = length
        .checked_sub(CRC_LENGTH)
        .ok_or(TelemetryError::FrameTooShort)?;
    let (content, checksum) = body
        .split_at_checked(checked)
        .ok_or(TelemetryError::FrameTooShort)?;
    if CRC.checksum(content).to_le_bytes() != checksum {
        return Err(TelemetryError::Checksum);
    }
    let (&version, content) = content.split_first().ok_or(TelemetryError::FrameTooShort)?;
    if version != VERSION {
        return Err(TelemetryError::Version);
    }
    let ((sequence, message), rest) =
        postcard::take_from_bytes::<(u16, Message)>(content).map_err(|_| TelemetryError::Content)?;
    if rest.is_empty() {
        Ok(Packet { sequence, message })
    } else {
        Err(TelemetryError::Content)
    }
}
