//! The header of a frame (docs/front-end.md section 5).
//!
//! Little endian, version 2; the last four bytes are the checksum of those before, in every version:
//!
//! | offset | type | content |
//! |---|---|---|
//! | 0 | `[u8; 4]` | magic `CSLF` |
//! | 4 | u8 | version |
//! | 5 | u8 | kind: 1 begin of a sweep, 2 beam, 3 squint symbol, 4 pilot |
//! | 6 | u16 | session, as the receiver wrote it into the front end's register |
//! | 8 | u32 | sequence number, from 0 in a session, one more with each frame, handed over or dropped |
//! | 12 | u32 | number of the sweep |
//! | 16 | u16 | index: of the beam or the symbol; of a pilot that of its beam, plus 72 when it is the second one; of a begin, the number of frames that follow |
//! | 18 | i16 | exponent: amplitude = integer x 2^exponent |
//! | 20 | u32 | bytes behind this header that count: of samples; of a begin 288 with [powers](super::Powers), 0 without |
//! | 24 | u64 | time of the sweep's first sample by the UAV clock, ns: in every frame, so that none is missed most |
//! | 32 | u32 | checksum of those bytes, 0 without |
//! | 36 | u32 | frames of this session that the front end dropped because the receiver took none |
//! | 40 | u16 | status, see [`Status`] |
//! | 42 | | 2 bytes 0 |
//! | 44 | u32 | time of this block's first sample since that of the sweep, ns |
//! | 48 | | of a begin: a two-way exchange, see [`Exchange`](super::Exchange); 12 bytes 0 without one |
//! | 60 | u32 | checksum of bytes 0..60 |

use super::checksum::SoftwareCrc;
use super::error::FrameError;
use super::kind::{Kind, MAGIC, VERSION};
use super::{HEADER_LENGTH, POWER_BYTES, SAMPLE_BYTES};

/// Largest size of an exponent. A block's scale lies near 2^-38 sqrt(W); what is beyond is no gain setting.
const EXPONENT_LIMIT: i16 = 128;

/// State of the front end when it took the frame. Bits that this version does not name are kept and mean nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status(pub u16);

impl Status {
    /// At least one converter was at the end of its range in this block.
    pub const CLIPPED: u16 = 1;
    /// The sampling clock has lost its reference: time stamps drift.
    pub const UNLOCKED: u16 = 2;
    /// The GMT's frame timing has been lost: blocks may not begin at delay 0.
    pub const UNTIMED: u16 = 4;

    /// Whether all bits of `flags` are set.
    #[must_use]
    pub const fn has(self, flags: u16) -> bool {
        self.0 & flags == flags
    }
}

/// A frame but for its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// What the frame is.
    pub kind: Kind,
    /// Session that the receiver opened.
    pub session: u16,
    /// Number of the frame in its session.
    pub sequence: u32,
    /// Number of the sweep.
    pub sweep: u32,
    /// Beam 0..72, squint symbol 0..33, pilot 0..144 (its beam, plus 72 when it is the second one); of a begin the number of frames that
    /// follow, 0..=249.
    pub index: u16,
    /// Amplitude = integer x 2^exponent, sqrt(W); one scale over all blocks. 0 for a begin.
    pub exponent: i16,
    /// UAV clock at the first sample of the sweep, ns.
    pub sweep_ns: u64,
    /// From there to the first sample of this block, ns; 0 for a begin.
    pub offset_ns: u32,
    /// Whether a begin tells the powers of the sweep's beams. `false` for all other frames.
    pub powers: bool,
    /// CRC-32 of the samples as they lie in memory, or of the powers; 0 without either.
    pub payload_checksum: u32,
    /// Frames of this session that the front end dropped: the receiver took none for too long.
    pub dropped: u32,
    /// State of the front end.
    pub status: Status,
}

impl Header {
    /// Bytes behind the header that count.
    #[must_use]
    pub const fn payload_length(&self) -> usize {
        match (self.kind, self.powers) {
            (Kind::Begin, false) => 0,
            (Kind::Begin, true) => POWER_BYTES,
            (Kind::Beam | Kind::Squint | Kind::Pilot, _) => SAMPLE_BYTES,
        }
    }

    /// The header as it is sent.
    #[must_use]
    pub fn encode(&self) -> [u8; HEADER_LENGTH] {
        let mut writer = Writer {
            bytes: [0; HEADER_LENGTH],
            at: 0,
        };
        writer.put(MAGIC);
        writer.put([VERSION, self.kind.code()]);
        writer.put(self.session.to_le_bytes());
        writer.put(self.sequence.to_le_bytes());
        writer.put(self.sweep.to_le_bytes());
        writer.put(self.index.to_le_bytes());
        writer.put(self.exponent.to_le_bytes());
        writer.put((self.payload_length() as u32).to_le_bytes());
        writer.put(self.sweep_ns.to_le_bytes());
        writer.put(self.payload_checksum.to_le_bytes());
        writer.put(self.dropped.to_le_bytes());
        writer.put(self.status.0.to_le_bytes());
        writer.put([0; 2]);
        writer.put(self.offset_ns.to_le_bytes());
        let mut bytes = writer.bytes;
        seal(&mut bytes);
        bytes
    }

    /// Reads a header.
    ///
    /// # Errors
    /// The first of [`FrameError::Magic`], [`FrameError::HeaderChecksum`], [`FrameError::Version`], [`FrameError::Kind`],
    /// [`FrameError::Index`], [`FrameError::Exponent`] and [`FrameError::Length`] that holds.
    pub fn decode(bytes: &[u8; HEADER_LENGTH]) -> Result<Self, FrameError> {
        let mut reader = Reader(bytes);
        let found = reader.take();
        if found != MAGIC {
            return Err(FrameError::Magic {
                found: u32::from_le_bytes(found),
            });
        }
        if bytes.last_chunk().copied().map(u32::from_le_bytes) != Some(checksum_of(bytes)) {
            return Err(FrameError::HeaderChecksum);
        }
        let [version, kind] = reader.take();
        if version != VERSION {
            return Err(FrameError::Version { found: version });
        }
        let kind = match kind {
            1 => Kind::Begin,
            2 => Kind::Beam,
            3 => Kind::Squint,
            4 => Kind::Pilot,
            found => return Err(FrameError::Kind { found }),
        };
        let mut header = Self {
            kind,
            session: u16::from_le_bytes(reader.take()),
            sequence: u32::from_le_bytes(reader.take()),
            sweep: u32::from_le_bytes(reader.take()),
            index: u16::from_le_bytes(reader.take()),
            exponent: i16::from_le_bytes(reader.take()),
            sweep_ns: 0,
            offset_ns: 0,
            powers: false,
            payload_checksum: 0,
            dropped: 0,
            status: Status(0),
        };
        if header.index >= kind.limit() {
            return Err(FrameError::Index {
                kind,
                found: header.index,
                limit: kind.limit(),
            });
        }
        if header.exponent.unsigned_abs() > EXPONENT_LIMIT.unsigned_abs() {
            return Err(FrameError::Exponent {
                found: header.exponent,
            });
        }
        let length = u32::from_le_bytes(reader.take());
        header.powers = kind == Kind::Begin && length != 0;
        let expected = header.payload_length() as u32;
        if length != expected {
            return Err(FrameError::Length {
                found: length,
                expected,
            });
        }
        header.sweep_ns = u64::from_le_bytes(reader.take());
        header.payload_checksum = u32::from_le_bytes(reader.take());
        header.dropped = u32::from_le_bytes(reader.take());
        header.status = Status(u16::from_le_bytes(reader.take()));
        let [_, _] = reader.take();
        header.offset_ns = u32::from_le_bytes(reader.take());
        Ok(header)
    }
}

/// Writes the checksum.
pub(super) fn seal(bytes: &mut [u8; HEADER_LENGTH]) {
    let checksum = checksum_of(bytes).to_le_bytes();
    if let Some(last) = bytes.last_chunk_mut() {
        *last = checksum;
    }
}

/// Checksum of a header's bytes but the last four.
fn checksum_of(bytes: &[u8; HEADER_LENGTH]) -> u32 {
    let covered = bytes
        .split_last_chunk::<4>()
        .map_or(&[][..], |(covered, _)| covered);
    SoftwareCrc.bytes(covered)
}

/// Fields one after the other.
struct Writer {
    bytes: [u8; HEADER_LENGTH],
    at: usize,
}

impl Writer {
    fn put<const N: usize>(&mut self, field: [u8; N]) {
        if let Some(place) = self
            .bytes
            .get_mut(self.at..)
            .and_then(|rest| rest.first_chunk_mut())
        {
            *place = field;
        }
        self.at += N;
    }
}

/// The fields again. Beyond the end there are zeros; no field of a header lies there.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        match self.0.split_first_chunk() {
            Some((field, rest)) => {
                self.0 = rest;
                *field
            }
            None => [0; N],
        }
    }
}
