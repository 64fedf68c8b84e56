//! What someone beside the application sees of its work: to count it, to log it, to know where it hangs.

use cslam_core::paths::EstimatedPath;
use cslam_core::receiver::{PATHS, SweepReport};

/// A kind of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Stage {
    /// An inertial sample, or the motion up to a sweep.
    Inertial = 0,
    /// A sample of the magnetometer.
    Magnetic = 1,
    /// A two-way timing exchange.
    Timing = 2,
    /// A block of a transmit beam.
    Beam = 3,
    /// The end of the beams: paths, and which one is the line of sight.
    Paths = 4,
    /// A block of a squint symbol.
    Squint = 5,
    /// The end of a sweep: link states, pose, points, planes.
    Sweep = 6,
    /// Packets.
    Telemetry = 7,
    /// Checks of a frame of the front end.
    Frame = 8,
    /// A block of a pilot.
    Pilot = 9,
}

impl Stage {
    /// Every stage, in the order of their numbers.
    pub const ALL: [Self; 10] = [
        Self::Inertial,
        Self::Magnetic,
        Self::Timing,
        Self::Beam,
        Self::Paths,
        Self::Squint,
        Self::Sweep,
        Self::Telemetry,
        Self::Frame,
        Self::Pilot,
    ];

    /// Name in tables and logs.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Inertial => "inertial sample",
            Self::Magnetic => "magnetometer sample",
            Self::Timing => "two-way exchange",
            Self::Beam => "beam",
            Self::Paths => "end of beams",
            Self::Squint => "squint symbol",
            Self::Sweep => "end of sweep",
            Self::Telemetry => "telemetry",
            Self::Frame => "frame",
            Self::Pilot => "pilot",
        }
    }
}

/// Sees the work of an application.
pub trait Observer {
    /// Wraps a piece of work.
    fn stage<R>(&mut self, _stage: Stage, work: impl FnOnce() -> R) -> R {
        work()
    }

    /// A sweep is about to end: its paths as they were estimated, angles of departure in the axes of the GMT's arrays, and the index of
    /// the one that beam squint listened to. Its report follows.
    fn estimated(&mut self, _paths: &[EstimatedPath], _sighted: Option<usize>) {}

    /// A sweep has ended.
    fn swept(&mut self, _report: &SweepReport<PATHS>) {}
}

/// Sees nothing.
impl Observer for () {}
