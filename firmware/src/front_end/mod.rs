//! The link from the capture front end: frames of one header and, but for the begin of a sweep, one block of samples.
//!
//! The front end (an FPGA) takes 32 channels x 512 samples a transmit beam and hands them over frame by frame; what it
//! must keep to is docs/front-end.md, of which this module is the receiving half. [`Header`] is the format of a frame,
//! [`FrontEnd`] what a receiver does with one: header, checksum, sequence number, then a view of the samples **in the
//! buffer in which the DMA left them**. Samples are little-endian words like [`Iq`] itself, so nothing is copied; where
//! the processor is big-endian the words are turned in place.
//!
//! How a frame gets into the buffer, and one that breaks off does not stop those after it, is [`Capture`].
//!
//! Nothing that comes over a wire is trusted, and everything has its counter: see [`Counters`].

mod capture;
mod checksum;
mod control;
mod counters;
mod error;
mod exchange;
mod header;
mod kind;
mod powers;
mod receive;
mod sequence;

pub use capture::{
    Capture, Cut, DRAIN_US, FRAME_WORDS, LONGEST_FRAME_US, Look, OFFER_US, Port, Step, WITHDRAWN_US,
};
pub use checksum::{Checksum, SoftwareCrc};
pub use control::{Control, ControlError};
pub use counters::Counters;
pub use error::FrameError;
pub use exchange::Exchange;
pub use header::{Header, Status};
pub use kind::Kind;
pub use powers::{POWER_BYTES, Powers, powers_checksum, write_powers};
pub use receive::{Content, Frame, FrontEnd, read_samples, write_samples};
pub use sequence::{Arrival, WINDOW};

use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
use cslam_core::signal::{Iq, SAMPLES};

/// Samples of a frame, channel after channel: 8 j + i is element i of array j.
pub type Block = [[Iq; SAMPLES]; CHANNELS];

/// Bytes of a header: two cache lines of a Cortex-M7, so that the samples behind it begin on one.
pub const HEADER_LENGTH: usize = 64;
/// Bytes of a frame's samples.
pub const SAMPLE_BYTES: usize = CHANNELS * SAMPLES * size_of::<Iq>();
/// Bytes of a frame with samples.
pub const FRAME_LENGTH: usize = HEADER_LENGTH + SAMPLE_BYTES;
/// Transmit beams of a sweep.
pub const BEAMS: u16 = 72;
/// Beam squint symbols of a sweep: 11 a face.
pub const SQUINT_SYMBOLS: u16 = 33;
/// Beams whose pilots are handed over, the strongest of a sweep.
pub const PILOT_BEAMS: u16 = 12;
/// Times that a beam is sent again.
pub const PILOTS_OF_A_BEAM: u16 = 2;
/// Frames of a sweep: its begin, the beams, the pilots, the squint symbols.
pub const FRAMES_PER_SWEEP: u16 = 1 + BEAMS + PILOTS_OF_A_BEAM * PILOT_BEAMS + SQUINT_SYMBOLS;
/// Frames of a sweep at most: pilots of all beams.
pub const MOST_FRAMES: u16 = 1 + BEAMS + PILOTS_OF_A_BEAM * BEAMS + SQUINT_SYMBOLS;
