//! Path estimation (LTD): from the int16 samples of the transmit beams, one at a time, to the paths of a sweep.
//!
//! The [front end](crate::signal) turns the samples of one beam into taps. On it stands the [`Estimator`], in `f32` with `libm`: peaks of
//! a beam, coarse angle grid, Fisher scoring off the grid, joint fits of close paths, cancellation, and at the end of a sweep the merge
//! over beams with the angle of departure from the beams' energies (docs/path-estimation.md). A beam whose folded taps show no path but
//! known ones, none better than an earlier beam did, is not transformed: the folded taps tell how strong those are in it.
//!
//! What is handed on is a [`ReceivedPath`] and what is claimed of it ([`covariance()`]).
//!
//! # Example
//! One beam of the GMT, whose wave comes in from the left ahead after 40 samples (48.8 m):
//! ```
//! use cslam_core::array::{UavArrays, phasor};
//! use cslam_core::geometry::{Body, Complex, Direction};
//! use cslam_core::paths::PathEstimator;
//! use cslam_core::profile::{Block, FlightConfig, FlightEstimator};
//! use cslam_core::signal::{Iq, Waveform};
//!
//! let (waveform, arrays) = (Waveform::default(), UavArrays::<f32>::default());
//! let from: Direction<Body> = Direction::from_zenith_azimuth(1.4, 0.6)?;
//! let (step_rad, amplitude, lead_m) = (arrays.phase_step_rad(&from), arrays.amplitude(&from), arrays.lead_m(&from));
//! let mut samples = Box::new([[Iq::ZERO; 512]; 32]);
//! for (j, n) in (0..4).flat_map(|j| (0..512).map(move |n| (j, n))) {
//!     let late = n as f32 - 40.0 + lead_m[j] / waveform.metres_per_sample() as f32;
//!     let wave = |k| waveform.symbol::<f32>(k) * phasor(core::f32::consts::TAU * waveform.offset(k) as f32 * late / 512.0);
//!     let sum: Complex<f32> = (0..waveform.active).map(wave).sum();
//!     for (i, steering) in UavArrays::<f32>::steering(step_rad[j]).iter().enumerate() {
//!         let x = sum * steering * (200.0 * amplitude[j]);
//!         samples[8 * j + i][n] = Iq::new(x.re as i16, x.im as i16);
//!     }
//! }
//! let mut estimator = Box::new(FlightEstimator::checked(&FlightConfig::default())?);
//! estimator.push_beam(Block { samples: &mut samples, beam: 12, exponent: -38 });
//! let path = estimator.finish()[0].path;
//! assert!((path.c_tau_m - 40.0 * 1.2199).abs() < 0.02 && path.aoa.angle_to_rad(&from) < 5e-3);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod calibration;
mod cancel;
mod check;
mod cholesky;
mod config;
mod covariance;
mod departure;
mod early_termination;
mod effort;
mod estimated;
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
mod pilot;
mod place;
mod received;
mod search;
mod sidelobe;
mod template;
mod warm_start;
mod window;

pub use calibration::ElementErrors;
pub use check::EstimatorConfigError;
pub use config::EstimatorConfig;
pub use covariance::{Neighbourhood, PathErrors, covariance, departure_outliers, neighbourhood};
pub use effort::WorkLimit;
pub use estimated::{BeamReport, EstimatedPath};
pub use estimator::Estimator;
pub use meter::{Meter, Stage};
pub use paper::{PaperEstimator, TapDelays};
pub use received::ReceivedPath;

use heapless::Vec;
use nalgebra::Vector3;

use crate::signal::{BeamBlock, Correlator, Workspace};

/// A sweep's worth of path estimation, one transmit beam at a time. `C` channels, at most `K` paths.
pub trait PathEstimator<const C: usize, const K: usize> {
    /// Takes the samples of one beam; the block is worked on in place and is not needed afterwards. Beams may come in
    /// any order, or be missing.
    fn push_beam(&mut self, block: BeamBlock<'_, C>) -> BeamReport;

    /// Takes a pilot of the sweep that has ended with these paths: a beam that was sent again, `block.beam` its number, and with the number of all beams
    /// added for the second time. After the second one, paths that are strongest in that beam are told [how fast they grow](crate::path::RangeRate), while the
    /// body turned so fast, rad/s in its own axes. Nothing in an estimator that does not listen to pilots.
    fn push_pilot(
        &mut self,
        block: BeamBlock<'_, C>,
        turn_rad_per_s: &Vector3<f32>,
        paths: &mut [EstimatedPath],
    ) {
        let _unheard = (block, turn_rad_per_s, paths);
    }

    /// Ends the sweep: its paths, strongest first. The estimator is empty afterwards.
    fn finish(&mut self) -> Vec<EstimatedPath, K>;

    /// The front end that the beams went through, for other symbols between sweeps: what was in it does not matter any more.
    fn front_end(&mut self) -> (&Correlator, &mut Workspace);
}
