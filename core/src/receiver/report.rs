//! What a sweep gave: all of it, for whoever flies the receiver to send, log or show.

use heapless::Vec;

use super::SURFACES;
use crate::association::{POINTS, Verdict};
use crate::beam_squint::{Bearing, Refusal};
use crate::estimator::{Health, Pose, SweepVerdict};
use crate::geometry::World;
use crate::link_state::{LinkState, Probabilities};
use crate::map::Insertion;
use crate::path::Path;
use crate::paths::EstimatedPath;
use crate::reflection::{Ends, InputError, ReflectionPoint, Rejection};

/// A point that a sweep put into the map: of one of its own paths, or of one that waited until its surfaces were confirmed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedPoint {
    /// Surface that it lies on; `None` of a path that was taken alone ([`super::Mapped::FirstOrder`], [`super::Mapped::Strongest`]).
    pub surface: Option<u16>,
    /// Sweep of its path.
    pub sweep: u32,
    /// Index of the path in that sweep.
    pub path: u8,
    /// Which of the path's reflections it is, the first after the GMT being 1, and of how many.
    pub reflection: [u8; 2],
    /// Probability that the path's surfaces exist, or that a path taken alone is of first order.
    pub probability: f32,
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
    /// What data association says of it.
    Associated(Verdict),
    /// Taken alone: not probable enough to be a first-order reflection.
    NotFirstOrder,
    /// Taken alone: probably a first-order reflection, but a gate of the reflection points says no.
    Rejected(Rejection),
    /// Taken alone: a point of the map.
    Point,
}

/// What a sweep changed of the surfaces that the map's points lie on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceChanges {
    /// Surfaces that went into another one: (gone, stays).
    pub merged: Vec<(u16, u16), SURFACES>,
    /// Surfaces that are not believed any more: their points left the map.
    pub withdrawn: Vec<u16, SURFACES>,
}

/// A path and what was made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PathReport {
    /// As estimated: arrival in body axes, departure in world axes, clock offset included.
    pub estimated: EstimatedPath<World>,
    /// Path gain between dipoles, dB, see [`super::LinkBudget::path_gain_db`].
    pub gain_db: Option<f32>,
    /// In world axes with the clock taken out, as the classifier saw it; `None` without a pose.
    pub in_world: Option<Path<World>>,
    /// Line of sight, first-order, higher-order; `None` when it could not be classified.
    pub probabilities: Option<Probabilities>,
    /// What became of it.
    pub outcome: Outcome,
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
    /// Normalised innovation squared over the gate: above 1 it is refused.
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
    /// Points that went into the map, of this sweep and of earlier ones.
    pub points: Vec<MappedPoint, POINTS>,
    /// What happened to the surfaces of the map's points, after these points.
    pub surfaces: SurfaceChanges,
    /// State of the link.
    pub link: LinkState,
    /// What the line of sight did to the pose.
    pub verdict: SweepVerdict,
    /// How well its measurements met the filter's expectation; empty without a filter.
    pub innovations: Vec<Innovation, 3>,
    /// Direction of departure by beam squint, or why there is none.
    pub bearing: Result<Bearing, Refusal>,
    /// Pose at the start of the sweep, with the sweep taken in.
    pub pose: Option<Pose>,
    /// Where UAV and GMT were for the classifier: by that pose.
    pub ends: Option<Ends>,
    /// The pose's clock offset with the whole delay periods that two-way timing tells, m; `None` without either.
    pub clock_offset_m: Option<f64>,
    /// Flags of the filter.
    pub health: Health,
}
