//! From the int16 samples of a transmit beam to its taps and their power-delay profile, in integers.
//!
//! ```text
//! block --Correlator::level--> Levelled --Correlator::correlate--> BeamTaps --Detector::peak--> Peak
//!                                `-----Correlator::detect--> profile of a few channels, at an eighth of the cost
//! ```
//! A block is a [`BeamBlock`], channels array-major (8 j + i), samples as packed [`Iq`] words; it is levelled, transformed and kept in
//! place. Everything up to the profile is integer arithmetic with stated roundings, the same bits on every machine; source:
//! docs/signal-model.md, "Fixed point". The [`Waveform`] says what is sent.

mod block;
mod block_scaling;
mod correlator;
mod delay;
mod detector;
mod phase;
mod strain;
mod tables;
mod taps;
mod waveform;

pub use block::BeamBlock;
pub use block_scaling::{Levelled, Measured};
pub(crate) use correlator::TAP_EXPONENT;
pub use correlator::{Correlator, FOLDED_CHANNELS, FOLDED_TAPS, Folded, Workspace};
pub use delay::DelayPeriod;
pub use detector::{Detector, Peak};
pub(crate) use detector::{fit_threshold, quantile};
pub(crate) use phase::{phasor, round_half_up};
pub use tables::bin_at;
pub use taps::BeamTaps;
pub use waveform::{Waveform, WaveformError};

pub use crate::kernels::{Iq, SAMPLES};
