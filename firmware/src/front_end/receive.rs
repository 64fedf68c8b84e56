//! Frames in, blocks out.

use cslam_core::signal::{BeamBlock, Iq};

use super::checksum::{Checksum, SoftwareCrc};
use super::counters::Counters;
use super::error::FrameError;
use super::header::Header;
use super::kind::Kind;
use super::powers::{self, Powers, powers_checksum};
use super::sequence::{Arrival, Refusal, Sequence};
use super::{Block, HEADER_LENGTH, SAMPLE_BYTES};

/// What a frame brought.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "one at a time, and there is no heap")]
pub enum Content<'a> {
    /// A sweep begins.
    Begin {
        /// Frames that follow.
        frames: u16,
        /// How strong the beams are that follow, where the front end says so.
        powers: Option<Powers>,
    },
    /// Samples of a transmit beam.
    Beam(BeamBlock<'a>),
    /// Samples of a squint symbol; `beam` is its place in the schedule.
    Squint(BeamBlock<'a>),
    /// Samples of a pilot; `beam` is its beam, plus 72 when it is the second one.
    Pilot(BeamBlock<'a>),
}

/// A whole frame.
#[derive(Debug)]
pub struct Frame<'a> {
    /// Its header: sweep and time stamp among others.
    pub header: Header,
    /// How it came.
    pub arrival: Arrival,
    /// What it brought.
    pub content: Content<'a>,
}

/// The receiving end of the link.
#[derive(Clone, Copy, Debug)]
pub struct FrontEnd<C = SoftwareCrc> {
    checksum: C,
    session: u16,
    sequence: Sequence,
    /// The front end's count of dropped frames in the newest header.
    dropped: u32,
    counters: Counters,
}

impl<C: Checksum> FrontEnd<C> {
    /// A link on which `session` has been opened: the receiver writes another number, not 0, into the front end's register
    /// every time it starts it, and the front end numbers its frames from 0 then.
    #[must_use]
    pub const fn new(checksum: C, session: u16) -> Self {
        Self {
            checksum,
            session,
            sequence: Sequence::new(),
            dropped: 0,
            counters: Counters {
                ok: 0,
                late: 0,
                lost: 0,
                repeated: 0,
                stale: 0,
                damaged_header: 0,
                damaged_payload: 0,
                foreign: 0,
                overrun: 0,
                cut: 0,
            },
        }
    }

    /// Another session has been opened. Counters go on.
    pub const fn reopen(&mut self, session: u16) {
        self.session = session;
        self.sequence = Sequence::new();
        self.dropped = 0;
    }

    /// The open session.
    #[must_use]
    pub const fn session(&self) -> u16 {
        self.session
    }

    /// What became of the frames so far.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// The link's hardware gave up a frame (overrun, DMA error, one that ended early). There is nothing to decode.
    pub fn cut(&mut self) {
        self.counters.cut();
    }

    /// Takes a frame as it lies in memory. On success a beam's samples are those of the buffer, ready to be worked on; of
    /// a begin, `samples` begins with the powers, or is not looked at.
    ///
    /// # Errors
    /// [`FrameError`]; the counters know already.
    pub fn receive<'a>(
        &mut self,
        header: &[u8; HEADER_LENGTH],
        samples: &'a mut Block,
    ) -> Result<Frame<'a>, FrameError> {
        let (header, arrival) = self.check(header, samples).inspect_err(|error| {
            self.counters.refused(*error);
        })?;
        self.counters.arrived(arrival);
        // A late frame has an old count.
        if matches!(arrival, Arrival::Newest { .. }) {
            self.counters.dropped(header.dropped.saturating_sub(self.dropped));
            self.dropped = self.dropped.max(header.dropped);
        }
        let content = match header.kind {
            Kind::Begin => Content::Begin {
                frames: header.index,
                powers: header.powers.then(|| powers::read(samples)),
            },
            Kind::Beam => Content::Beam(block(&header, samples)),
            Kind::Squint => Content::Squint(block(&header, samples)),
            Kind::Pilot => Content::Pilot(block(&header, samples)),
        };
        Ok(Frame {
            header,
            arrival,
            content,
        })
    }

    /// Whether a frame is sound, ours and new. Only then is its number taken.
    fn check(
        &mut self,
        header: &[u8; HEADER_LENGTH],
        samples: &Block,
    ) -> Result<(Header, Arrival), FrameError> {
        let header = Header::decode(header)?;
        let sequence = header.sequence;
        if header.session != self.session {
            return Err(FrameError::Session {
                found: header.session,
                expected: self.session,
            });
        }
        let is_sound = match header.kind {
            Kind::Begin => {
                !header.powers || powers_checksum(&powers::read(samples)) == header.payload_checksum
            }
            Kind::Beam | Kind::Squint | Kind::Pilot => {
                self.checksum.samples(samples) == header.payload_checksum
            }
        };
        if !is_sound {
            return Err(FrameError::PayloadChecksum { sequence });
        }
        let arrival = self.sequence.take(sequence).map_err(|refusal| match refusal {
            Refusal::Repeated => FrameError::Repeated { sequence },
            Refusal::Stale { newest } => FrameError::Stale { sequence, newest },
        })?;
        Ok((header, arrival))
    }
}

/// The samples where they are; on a little-endian machine nothing happens to them.
fn block<'a>(header: &Header, samples: &'a mut Block) -> BeamBlock<'a> {
    for sample in samples.as_flattened_mut() {
        *sample = Iq::from_word(u32::from_le(sample.word()));
    }
    BeamBlock {
        samples,
        beam: header.index,
        exponent: i32::from(header.exponent),
    }
}

/// Copies samples from bytes, where they did not come by DMA into a [`Block`]. They stay as they lie in memory: give them to
/// [`FrontEnd::receive`].
pub fn read_samples(bytes: &[u8; SAMPLE_BYTES], samples: &mut Block) {
    let (words, _none_left) = bytes.as_chunks::<4>();
    for (sample, word) in samples.as_flattened_mut().iter_mut().zip(words) {
        *sample = Iq::from_word(u32::from_ne_bytes(*word));
    }
}

/// Samples as they are sent.
pub fn write_samples(samples: &Block, bytes: &mut [u8; SAMPLE_BYTES]) {
    let (words, _none_left) = bytes.as_chunks_mut::<4>();
    for (word, sample) in words.iter_mut().zip(samples.as_flattened()) {
        *word = sample.word().to_le_bytes();
    }
}
