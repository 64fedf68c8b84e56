//! Data association: which surfaces made this path?
//!
//! One question, asked in one place. Hypotheses of a path are the line of sight, chains of one to three known surfaces, one reflection off an
//! unknown surface (N), and anything else (U). Each is weighed by how likely the path is over it ([`Likelihood`]) and by what is known
//! beforehand: the network, existence and reach of the surfaces, walls in the way. The posterior is the verdict; what it says of the surfaces goes
//! back into the store ([`Surfaces::learn`]).
//!
//! Once a sweep: [`associate`], then [`Surfaces::learn`] with what it returned. It may be asked twice, with the pose that is expected and
//! with the corrected one; only the second is learnt from.
//!
//! Bounds: chains that are weighed are capped ([`AssociationConfig::weighings`]), third orders are made of confirmed surfaces only
//! ([`SURFACES_OF_THREES`]); what was left out is counted ([`LeftOut`]). Pairs of tentative surfaces come last and are not missed.
//!
//! # Example
//! What a path over one wall must look like, by the image of the transmitter in it ([`chain`]); [`associate`] asks this of every chain.
//! ```
//! use cslam_core::association::chain::Chain;
//! use cslam_core::geometry::{Direction, Matrix3, Plane, Position, Vector3};
//!
//! let wall = Plane {
//!     normal: Direction::from_vector(Vector3::new(-1.0, 0.0, 0.0))?,
//!     centre: Position::new(20.0, 10.0, 5.0)?,
//!     covariance: Matrix3::identity() * 0.01,
//! };
//! let path = Chain::over(&[wall]).predict(&Vector3::new(0.0, 0.0, 2.0), &Vector3::new(0.0, 30.0, 2.0)).expect("both are before it");
//! assert!((path.range_m - 50.0).abs() < 1e-9); // from (40, 0, 2), the image
//! assert!((path.points[0] - Vector3::new(20.0, 15.0, 2.0)).norm() < 1e-9);
//! # Ok::<(), cslam_core::geometry::GeometryError>(())
//! ```

mod against;
mod births;
pub mod chain;
mod clutter;
mod config;
mod hypotheses;
mod learn;
mod likelihood;
mod measurement;
mod part;
mod points;
mod pose;
mod prior;
#[cfg(test)]
mod tests;
mod verdict;

pub use crate::paths::ReceivedPath;
pub use config::AssociationConfig;
pub use hypotheses::{LeftOut, SURFACES_OF_THREES};
pub use learn::{Learned, POINTS, SweepPaths};
pub use likelihood::Likelihood;
pub use measurement::Measurement;
pub use points::SurfacePoint;
pub use pose::PoseEstimate;
pub use verdict::{Association, Decision, Verdict};

use heapless::Vec;

use self::clutter::clutter;
use self::hypotheses::{Scene, weigh_all};
use self::prior::known;
use self::verdict::claim_once;
use crate::estimator::Transmitter;
use crate::link_state::Probabilities;
use crate::paths::neighbourhood;
use crate::surfaces::Surfaces;

/// Which surfaces made these paths? `paths`: those of one sweep, strongest first; `transmitter`: where it is and how its mast stands, its error
/// counts as the UAV's does.
// Its frame is gone when the surfaces learn: never inlined.
#[must_use]
#[inline(never)]
pub fn associate<const N: usize, const K: usize>(
    paths: &Vec<ReceivedPath, K>,
    pose: &PoseEstimate,
    transmitter: &Transmitter,
    surfaces: &Surfaces<N>,
    config: &AssociationConfig,
) -> Association<K> {
    let scene = Scene {
        known: known(surfaces),
        transmitter,
        pose: pose.relative_to(transmitter.sigma_m),
        config,
    };
    let measured: Vec<(Measurement, Option<Probabilities>), K> = measurements(paths, &scene);
    let (weighed, left_out) = weigh_all(&scene, &measured);
    let mut verdicts = Vec::<Verdict, K>::new();
    for ((path, probabilities), weighed) in measured.iter().zip(&weighed) {
        let clutter = clutter(&scene, path, probabilities.as_ref());
        let verdict = Verdict::of(weighed, &clutter, path.neighbourhood, config);
        let _fits = verdicts.push(verdict);
    }
    claim_once(&mut verdicts);
    Association { verdicts, left_out }
}

/// The paths as measurements, with what stands beside each.
fn measurements<const N: usize, const K: usize>(
    paths: &Vec<ReceivedPath, K>,
    scene: &Scene<'_, N>,
) -> Vec<(Measurement, Option<Probabilities>), K> {
    let errors = &scene.config.errors;
    crate::numeric::gather(paths.iter().enumerate().map(|(index, path)| {
        let around = neighbourhood(paths, index, &scene.pose.delay_period, errors);
        (
            Measurement::of(path, around, &scene.pose, errors),
            path.probabilities,
        )
    }))
}
