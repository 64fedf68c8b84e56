//! Path estimation (LTD): from the int16 samples of the transmit beams, one at a time, to the paths of a sweep.
//!
//! The [front end](crate::signal) turns the samples of one beam into taps. On it stands the [`Estimator`], in `f32` with `libm`: peaks of
//! a beam, coarse angle grid, Fisher scoring off the grid, joint fits of close paths, cancellation, and at the end of a sweep the merge
//! over beams with the angle of departure from the beams' energies (docs/path-estimation.md). A beam whose folded taps show no path but
//! known ones, none better than an earlier beam did, is not transformed: the folded taps tell how strong those are in it.
//!
//! What is handed on is a [`ReceivedPath`] and what is claimed of it ([`covariance()`]).

mod calibration;
mod cancel;
mod check;
mod cholesky;
mod covariance;
mod departure;
mod early_termination;
mod effort;
mod estimator;
mod fit;
mod gate;
mod grid;
mod joint_fit;
mod line;
mod merge;
mod meter;
mod model;
mod multi_start;
mod nomp;
mod paper;
mod place;
mod received;
mod search;
mod sidelobe;
mod template;
mod warm_start;
mod window;

pub use calibration::ElementErrors;
pub use check::EstimatorConfigError;
pub use covariance::{Neighbourhood, PathErrors, covariance, departure_outliers, neighbourhood};
pub use effort::WorkLimit;
pub use estimator::{BeamReport, EstimatedPath, Estimator, EstimatorConfig};
pub use meter::{Meter, Stage};
pub use paper::{PaperEstimator, TapDelays};
pub use received::ReceivedPath;

use heapless::Vec;

use crate::signal::{BeamBlock, Correlator, Workspace};

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
