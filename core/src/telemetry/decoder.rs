//! Bytes to messages, whatever happened to the bytes.

use super::header::Header;
use super::{
    CRC_LENGTH, Content, Direction, HEADER_LENGTH, Key, MAX_FRAME, MAX_PACKET, Message, Opener, TAG_LENGTH,
    TelemetryError, VERSION, cobs,
};
use crate::numeric::CRC;

/// A packet as it came: undamaged and of this version, but of any link, and not yet known to be genuine.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    pub(super) header: Header,
    /// Header and body.
    pub(super) authenticated: &'a [u8],
    pub(super) body: &'a [u8],
    /// The authentication code, if there is one.
    pub(super) tag: Option<[u8; TAG_LENGTH]>,
}

impl Frame<'_> {
    /// Number of the UAV that it claims to come from or go to.
    #[must_use]
    pub fn uav(&self) -> u8 {
        self.header.uav
    }

    /// Which way it claims to go.
    #[must_use]
    pub fn direction(&self) -> Direction {
        self.header.direction
    }

    /// Whether it has an authentication code.
    #[must_use]
    pub fn is_signed(&self) -> bool {
        self.header.signed
    }
}

/// Cuts a stream of bytes into [`Frame`]s. After any damage it is in step again at the next zero.
///
/// It serves a stream that several UAVs share: the number in the frame says whose [`Opener`] takes it.
#[derive(Clone, Debug)]
pub struct Deframer {
    frame: heapless::Vec<u8, MAX_FRAME>,
    overflowed: bool,
    packet: [u8; MAX_PACKET],
}

impl Deframer {
    /// A deframer at the start of a frame.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            frame: heapless::Vec::new(),
            overflowed: false,
            packet: [0; MAX_PACKET],
        }
    }

    /// Takes one byte; returns a frame, or the reason why there is none, at the end of every non-empty frame.
    ///
    /// # Errors
    /// Damage by [`TelemetryError::is_damage`], or [`TelemetryError::Version`].
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame<'_>, TelemetryError>> {
        if byte != 0 {
            self.overflowed |= self.frame.push(byte).is_err();
            return None;
        }
        let stuffed = core::mem::replace(&mut self.frame, heapless::Vec::new());
        if core::mem::take(&mut self.overflowed) {
            return Some(Err(TelemetryError::FrameTooLong));
        }
        (!stuffed.is_empty()).then(|| read(&stuffed, &mut self.packet))
    }
}

impl Default for Deframer {
    fn default() -> Self {
        Self::new()
    }
}

fn read<'a>(stuffed: &[u8], packet: &'a mut [u8; MAX_PACKET]) -> Result<Frame<'a>, TelemetryError> {
    let length = cobs::decode(stuffed, packet).ok_or(TelemetryError::Framing)?;
    let packet = packet.get(..length).ok_or(TelemetryError::Framing)?;
    let (content, checksum) = packet
        .split_last_chunk::<CRC_LENGTH>()
        .ok_or(TelemetryError::FrameTooShort)?;
    if CRC.checksum(content).to_be_bytes() != *checksum {
        return Err(TelemetryError::Checksum);
    }
    let version = content.first().ok_or(TelemetryError::FrameTooShort)?;
    if *version != VERSION {
        return Err(TelemetryError::Version);
    }
    let (header, _) = content
        .split_first_chunk::<HEADER_LENGTH>()
        .ok_or(TelemetryError::FrameTooShort)?;
    let header = Header::decode(*header);
    let (authenticated, tag) = if header.signed {
        let (authenticated, tag) = content
            .split_last_chunk::<TAG_LENGTH>()
            .ok_or(TelemetryError::FrameTooShort)?;
        (authenticated, Some(*tag))
    } else {
        (content, None)
    };
    let body = authenticated
        .get(HEADER_LENGTH..)
        .ok_or(TelemetryError::FrameTooShort)?;
    Ok(Frame {
        header,
        authenticated,
        body,
        tag,
    })
}

/// A packet that was checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Packet<M = Message> {
    /// Number of the UAV.
    pub uav: u8,
    /// Counter: a gap is a lost packet, or one that comes late.
    pub counter: u32,
    /// Whether a key says that it is genuine.
    pub signed: bool,
    /// Content.
    pub message: M,
}

/// Bytes of one link to messages: a [`Deframer`] and an [`Opener`].
#[derive(Clone, Debug)]
pub struct Decoder<M = Message> {
    deframer: Deframer,
    opener: Opener<M>,
}

impl<M: Content> Decoder<M> {
    /// A decoder for the link of UAV number `uav` that has heard nothing yet.
    #[must_use]
    pub fn new(uav: u8, key: &Key) -> Self {
        Self::with(Opener::new(uav, key))
    }

    /// A decoder that opens packets as told.
    #[must_use]
    pub const fn with(opener: Opener<M>) -> Self {
        Self {
            deframer: Deframer::new(),
            opener,
        }
    }

    /// Takes one byte; returns a packet, or the reason why there is none, at the end of every non-empty frame.
    ///
    /// # Errors
    /// Whatever [`Deframer::push`] and [`Opener::open`] say.
    pub fn push(&mut self, byte: u8) -> Option<Result<Packet<M>, TelemetryError>> {
        self.push_reserving(byte, |_| None)
    }

    /// The same where counters are set aside before they are taken, see [`Opener::open_reserving`].
    ///
    /// # Errors
    /// As [`Decoder::push`].
    pub fn push_reserving(
        &mut self,
        byte: u8,
        reserve: impl FnOnce(u32) -> Option<u32>,
    ) -> Option<Result<Packet<M>, TelemetryError>> {
        let frame = self.deframer.push(byte)?;
        Some(frame.and_then(|frame| self.opener.open_reserving(&frame, reserve)))
    }

    /// What opens the packets.
    #[must_use]
    pub const fn opener(&self) -> &Opener<M> {
        &self.opener
    }
}
