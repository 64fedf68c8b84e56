//! Path estimation (LTD), fixed-point front end: from the int16 samples of one transmit beam to taps.
//!
//! ```text
//! block --Correlator::level--> Levelled --Correlator::correlate--> BeamTaps --Detector::peak--> Peak
//!                                `-----Correlator::detect--> profile of a few channels, at an eighth of the cost
//! ```
//! A block is a [`BeamBlock`](crate::block::BeamBlock), channels array-major (8 j + i), samples as packed [`Iq`] words; it is levelled,
//! transformed and kept in place. Everything up to the profile is integer arithmetic with stated roundings, the same bits
//! on every machine; source: signal.md sections 3.1 and 4, kernels.md section 3.

#[cfg(all(target_arch = "arm", feature = "armv7em"))]
#[macro_use]
mod instructions;

mod correlator;
mod detector;
mod iq;
pub mod kernels;
mod level;
#[cfg(all(target_arch = "arm", feature = "armv7em"))]
mod simd;
mod stages;
mod tables;
mod taps;

pub use correlator::{Correlator, FOLDED_TAPS, Workspace};
pub use detector::{Detector, Peak};
pub use iq::Iq;
pub use level::Levelled;
pub use stages::Channel;
pub use tables::bin_at;
pub use taps::BeamTaps;
