//! Path estimation (LTD), fixed-point front end: from the int16 samples of one transmit beam to taps.
//!
//! ```text
//! block --Levelled::new--> Levelled --Correlator::correlate--> BeamTaps --Detector::peak--> Peak
//!                              `-----Correlator::detect--> profile of a few channels, at an eighth of the cost
//! ```
//! A block is `[Channel; CHANNELS]`, channels array-major (8 j + i), samples as packed [`Iq`] words; it is levelled,
//! transformed and kept in place. Everything up to the profile is integer arithmetic with stated roundings, the same bits
//! on every machine; source: signal.md sections 3.1 and 4, kernels.md section 3.

mod correlator;
mod detector;
mod iq;
mod kernels;
mod level;
mod stages;
mod tables;
mod taps;

pub use correlator::{Correlator, FOLDED_TAPS, Workspace};
pub use detector::{Detector, Peak};
pub use iq::Iq;
pub use level::Levelled;
pub use stages::Channel;
pub use tables::{SAMPLES, bin_at, q15};
pub use taps::BeamTaps;
