//! What a sweep gave: all of it, for whoever flies the receiver to send, log or show.

use heapless::Vec;

use super::higher_order::MAX_REFLECTIONS;
use crate::association::ReceivedPath;
use crate::localization::Pose;
use crate::localization::bsm::{Bearing, Refusal};
use crate::localization::filter::{Health, SweepVerdict, Transmitter};
use crate::lscn::{LinkState, Probabilities};
use crate::ltd::EstimatedPath;
use crate::map::Insertion;
use crate::reflection::{InputError, ReflectionPoint, Rejection};

/// A reflection point, and what the map did with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedPoint {
    /// The point.
    pub point: ReflectionPoint,
    /// `None` when it lies beyond the map's range.
    pub insertion: Option<Insertion>,
}

/// What became of a path.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The receiver has no pose yet, has lost it, or does not know where the GMT is.
    NoPose,
    /// It is not one of the paths that this mode uses.
    Unused,
    /// No measurement of a path.
    Input(InputError),
    /// Taken for the line of sight.
    LineOfSight,
    /// Not probable enough to be a first-order reflection, and no two or three known mirrors explain it.
    NotFirstOrder,
    /// Probably a first-order reflection, but its angle of departure, which would prove it, is not known well enough.
    DepartureUnknown,
    /// Probably a first-order reflection, or explained by known mirrors, but a gate of the reflection points says no.
    Rejected(Rejection),
    /// Points of the map, one for each reflection of the path, from the GMT to the UAV: there is at least one.
    Points(Vec<MappedPoint, MAX_REFLECTIONS>),
}

/// A path and what was made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PathReport {
    /// As estimated: body axes, clock offset included.
    pub estimated: EstimatedPath,
    /// As data association takes it.
    pub received: ReceivedPath,
    /// Path gain between dipoles, dB, see [`super::LinkBudget::path_gain_db`].
    pub gain_db: Option<f32>,
    /// Line of sight, first-order, higher-order; `None` when it could not be classified.
    pub probabilities: Option<Probabilities>,
    /// What became of it.
    pub outcome: Outcome,
}

impl PathReport {
    /// Probability that the path is what its points presume: of first order when there is one, of higher order when there are
    /// several. Of a path without a point, that of first order. `None` when it could not be classified.
    #[must_use]
    pub fn presumed_probability(&self) -> Option<f32> {
        let several = matches!(&self.outcome, Outcome::Points(points) if points.len() > 1);
        let probabilities = self.probabilities?;
        Some(if several {
            probabilities.higher_order
        } else {
            probabilities.first_order
        })
    }
}

/// What an innovation is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Measured {
    /// Delay, angle of arrival and, with five degrees of freedom, angle of departure of the line of sight, jointly.
    LineOfSight,
    /// The last two-way exchange.
    TwoWayTiming,
    /// The last reflection off a mapped plane that was taken in.
    Reflection,
}

/// How far a measurement was from what the filter expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Of what.
    pub measured: Measured,
    /// Degrees of freedom.
    pub dof: u8,
    /// Normalised innovation squared over the gate: above 1 it is refused, unless a vote says otherwise.
    pub test_ratio: f32,
    /// The gate.
    pub gate: f32,
    /// Whether it was taken in.
    pub accepted: bool,
}

/// Everything about one sweep.
#[derive(Clone, Debug)]
pub struct SweepReport<const K: usize> {
    /// Number of the sweep.
    pub sweep: u32,
    /// UAV clock at its start, ns.
    pub time_ns: u64,
    /// Transmit beams that were heard.
    pub beams: u16,
    /// Paths, strongest first.
    pub paths: Vec<PathReport, K>,
    /// State of the link.
    pub link: LinkState,
    /// What the line of sight did to the pose.
    pub verdict: SweepVerdict,
    /// How well its measurements met the filter's expectation; empty without a filter.
    pub innovations: Vec<Innovation, 3>,
    /// Direction of departure by beam squint, or why there is none.
    pub bearing: Result<Bearing, Refusal>,
    /// The GMT as it was taken; `None` before its first beacon.
    pub transmitter: Option<Transmitter>,
    /// Pose at the start of the sweep, with the sweep taken in.
    pub pose: Option<Pose>,
    /// The pose's clock offset with the whole delay periods that two-way timing tells, m; `None` without either.
    pub clock_offset_m: Option<f64>,
    /// Flags of the filter.
    pub health: Health,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Direction, Matrix3, Position, Vector3};
    use crate::path::Path;

    fn report(outcome: Outcome) -> PathReport {
        let aoa = Direction::from_vector(Vector3::x()).expect("unit");
        let estimated = EstimatedPath {
            path: Path {
                c_tau_m: 30.0,
                aoa,
                aod: None,
                covariance: Matrix3::identity(),
            },
            beam: 0,
            snr_db: 30.0,
            energy: 1.0,
        };
        PathReport {
            estimated,
            received: ReceivedPath::of(&estimated, aoa, None, None),
            gain_db: None,
            probabilities: Some(Probabilities {
                los: 0.1,
                first_order: 0.2,
                higher_order: 0.7,
            }),
            outcome,
        }
    }

    fn points(count: usize) -> Outcome {
        let point = ReflectionPoint {
            position: Position::new(1.0, 2.0, 3.0).expect("finite"),
            covariance: Matrix3::identity(),
            distance_m: 4.0,
        };
        let mapped = MappedPoint {
            point,
            insertion: None,
        };
        Outcome::Points(core::iter::repeat_n(mapped, count).collect())
    }

    #[test]
    fn a_point_presumes_as_many_reflections_as_its_path_gave() {
        let presumed = |outcome| report(outcome).presumed_probability();
        assert_eq!(
            [1, 2, 3].map(points).map(presumed),
            [Some(0.2), Some(0.7), Some(0.7)]
        );
        assert_eq!(presumed(Outcome::NotFirstOrder), Some(0.2));
        let unknown = PathReport {
            probabilities: None,
            ..report(points(2))
        };
        assert_eq!(unknown.presumed_probability(), None);
    }
}
