//! What a sweep brings to the filter, and what becomes of it.

use super::measurement::{PathMeasurement, ReflectedPath, Transmitter};

/// What a sweep brought.
#[derive(Clone, Copy, Debug)]
pub struct SweepMeasurement<'a> {
    /// UAV clock at the start of the sweep, ns.
    pub time_ns: u64,
    /// The GMT by its beacon.
    pub gmt: Transmitter,
    /// Number of the stop that the GMT stands at; sweeps of one stop share it.
    pub stop: u32,
    /// The line-of-sight path, if the link state says so.
    pub line_of_sight: Option<PathMeasurement>,
    /// That it is the line of sight shows in the path itself, whatever the position is thought to be.
    pub self_consistent: bool,
    /// Without one: the first path, when it is as strong as through free space, but not from where the pose has the GMT.
    pub contrary: Option<PathMeasurement>,
    /// Reflected paths whose surfaces are known, strongest first. They correct the pose without line of sight.
    pub reflections: &'a [ReflectedPath],
    /// All paths, whatever they met.
    pub paths: &'a [PathMeasurement],
    /// Whether their lengths are compared with those of the sweep before. Their range rates are taken in either way.
    pub delta_ranges: bool,
}

/// What became of a sweep's line of sight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepVerdict {
    /// No line of sight in it.
    NoSight,
    /// Taken in.
    Accepted,
    /// Possible, but the filter is too unsure to tell: kept until the next sweep agrees.
    Held,
    /// Not taken in: it contradicts the filter.
    Rejected,
    /// The pose was set anew from the last sweeps.
    Refixed,
    /// The pose was set for the first time.
    Started,
    /// Kept for the start.
    Waiting,
    /// Its time stamp lies before the horizon.
    TooLate,
}
