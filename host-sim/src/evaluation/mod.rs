//! How good a flight was: its log against the truth in it, and against the surfaces of its scene.
//!
//! Everything here sees the truth, and nothing here is seen by the receiver.

mod assignment;
mod by_faces;
pub mod completeness;
mod consistency;
pub mod downlink;
mod fates;
mod figures;
mod grid;
#[cfg(test)]
mod higher_order_tests;
mod link_state;
mod losses;
mod map;
pub mod matching;
mod states;
mod surface;
#[cfg(test)]
mod tests;
mod trajectory;

use serde::Serialize;

pub use completeness::Completeness;
pub use consistency::{ClockFigures, Consistency, normalised_squared};
pub use fates::Fate;
pub use link_state::LinkStateFigures;
pub use losses::FirstOrderPaths;
pub use map::{MapFigures, PointErrors, true_vertices_m};
pub use states::{PathClass, PathStateFigures, PathStates};
pub use surface::Surfaces;
pub use trajectory::{PoseError, SETTLING_S, TrajectoryFigures, attitude_error_rad, visible_spans};

use crate::flight_log::FlightLog;
use crate::scene::Scene;
use matching::MatchGates;

/// All figures of a flight, and the single errors behind them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Evaluation {
    /// The map.
    pub map: MapFigures,
    /// The trajectory.
    pub trajectory: TrajectoryFigures,
    /// The clock.
    pub clock: ClockFigures,
    /// Honesty of the covariances.
    pub consistency: Consistency,
    /// Link states.
    pub link_state: LinkStateFigures,
    /// What became of every measured path.
    pub fates: Vec<Fate>,
    /// Errors of single points.
    #[serde(skip)]
    pub point_errors: PointErrors,
    /// Errors of single poses.
    #[serde(skip)]
    pub pose_errors: Vec<PoseError>,
}

/// Finds the true path behind every measured one that has none yet, and judges the flight. Without a scene nothing is
/// said about surfaces.
pub fn evaluate(log: &mut FlightLog, scene: Option<&Scene>) -> Evaluation {
    matching::match_paths(log, &MatchGates::default());
    let surfaces = scene.map(Surfaces::new);
    let (map, point_errors) = map::judge(log, surfaces.as_ref());
    let pose_errors = trajectory::errors(log);
    Evaluation {
        map,
        trajectory: trajectory::judge(log, &pose_errors),
        clock: consistency::clock(&pose_errors),
        consistency: consistency::consistency(log, &pose_errors),
        link_state: link_state::judge(log),
        fates: fates::fates(log),
        point_errors,
        pose_errors,
    }
}
