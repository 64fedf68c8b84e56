//! Path estimation (LTD): from the int16 samples of the transmit beams, one at a time, to the paths of a sweep.
//!
//! Two floors. The fixed-point front end turns the samples of one beam into taps:
//!
//! ```text
//! block --Correlator::level--> Levelled --Correlator::correlate--> BeamTaps --Detector::peak--> Peak
//!                                `-----Correlator::detect--> profile of a few channels, at an eighth of the cost
//! ```
//! A block is a [`BeamBlock`], channels array-major (8 j + i), samples as packed [`Iq`] words; it is levelled, transformed and kept in place. Everything up to the profile is integer arithmetic with stated roundings, the same bits
//! on every machine; source: docs/signal-model.md, "Fixed point".
//!
//! On it stands the [`Estimator`], in `f32` with `libm`: peaks of a beam, coarse angle grid, Fisher scoring off the grid,
//! joint fits of close paths, cancellation, and at the end of a sweep the merge over beams with the angle of departure
//! from the beams' energies (docs/signal-model.md, "Path estimation"). A beam whose folded taps show no path but known ones, none better than an
//! earlier beam did, is not transformed: the folded taps tell how strong those are in it.

mod calibration;
mod cancel;
mod check;
mod cholesky;
mod correlator;
mod departure;
mod detector;
mod effort;
mod estimator;
mod fit;
mod gate;
mod grid;
mod group;
mod iq;
pub mod kernels;
mod known;
mod level;
mod line;
mod merge;
mod meter;
mod model;
mod nomp;
mod paper;
mod phase;
mod screen;
mod search;
mod sidelobe;
pub(crate) mod stages;
mod starts;
pub(crate) mod tables;
mod taps;
mod template;
mod window;

pub use calibration::ElementErrors;
pub use check::EstimatorConfigError;
pub use correlator::{Correlator, FOLDED_CHANNELS, FOLDED_TAPS, Folded, Workspace};
pub use detector::{Detector, Peak};
pub use effort::WorkLimit;
pub use estimator::{BeamReport, EstimatedPath, Estimator, EstimatorConfig};
pub use iq::Iq;
pub use level::{Levelled, Measured};
pub use meter::{Meter, Stage};
pub use paper::{PaperEstimator, TapDelays};
pub use stages::{Channel, FoldedChannel};
pub use tables::bin_at;
pub use taps::BeamTaps;

use heapless::Vec;

use crate::block::BeamBlock;

/// A sweep's worth of path estimation, one transmit beam at a time. `C` channels, at most `K` paths.
pub trait PathEstimator<const C: usize, const K: usize> {
    /// Takes the samples of one beam; the block is worked on in place and is not needed afterwards. Beams may come in
    /// any order, or be missing.
    fn push_beam(&mut self, block: BeamBlock<'_, C>) -> BeamReport;

    /// Ends the sweep: its paths, strongest first. The estimator is empty afterwards.
    fn finish(&mut self) -> Vec<EstimatedPath, K>;

    /// The front end that the beams went through, for other symbols between sweeps: what was in it does not matter any more.
    fn front_end(&mut self) -> (&Correlator, &mut Workspace);
}
