//! From the int16 samples of a transmit beam to its taps and their power-delay profile, in integers.
//!
//! ```text
//! block --Correlator::scale--> Scaled --Correlator::correlate--> BeamTaps --Detector::peak--> Peak
//!                                `-----Correlator::detect--> profile of a few channels, at an eighth of the cost
//! ```
//! A block is a [`BeamBlock`], channels array-major (8 j + i), samples as packed [`Iq`] words; it is scaled, transformed and kept in
//! place. Everything up to the profile is integer arithmetic with stated roundings, the same bits on every machine; source:
//! docs/signal-model.md, "Fixed point". The [`Waveform`] says what is sent.
//!
//! ```text
//! h[n] = 1/512 sum_k Y[k] conj(X[k]) exp(+j 2 pi k n / 512)  in each channel,  profile[n] = sum |h[n]|^2 over the channels
//! ```
//!
//! # Example
//! One channel hears the symbol 40 samples late: its power-delay profile has its peak there.
//! ```
//! use cslam_core::array::phasor;
//! use cslam_core::geometry::Complex;
//! use cslam_core::signal::{BeamBlock, Correlator, Iq, Waveform, Workspace};
//!
//! let waveform = Waveform::default();
//! let turns = |k, n: i32| waveform.offset(k) as f32 * (n - 40) as f32 / 512.0;
//! let sample = |n| (0..waveform.active).map(|k| waveform.symbol::<f32>(k) * phasor(core::f32::consts::TAU * turns(k, n))).sum();
//! let mut samples = [core::array::from_fn(|n| sample(n as i32)).map(|x: Complex<f32>| Iq::new((300.0 * x.re) as i16, (300.0 * x.im) as i16))];
//! let (correlator, mut work) = (<Correlator>::new(&waveform), Workspace::new());
//! let block = BeamBlock { samples: &mut samples, beam: 0, exponent: 0 };
//! let taps = correlator.correlate(correlator.scale(block), &mut work);
//! let peak = (0..512).max_by_key(|tap| taps.profile()[*tap]);
//! assert_eq!(peak, Some(40)); // 48.8 m
//! ```

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
pub(crate) use block_scaling::REFERENCE_EXPONENT;
pub use block_scaling::{Measured, Scaled};
pub(crate) use correlator::TAP_EXPONENT;
pub use correlator::{Correlator, FOLDED_CHANNELS, FOLDED_TAPS, Folded, Workspace};
pub use delay::DelayPeriod;
pub(crate) use detector::quantile;
pub use detector::{Detector, Peak, fit_threshold};
pub(crate) use phase::{phasor, round_half_up};
pub use tables::bin_at;
pub use taps::BeamTaps;
pub use waveform::{Waveform, WaveformError};

pub use crate::kernels::{Iq, SAMPLES};
