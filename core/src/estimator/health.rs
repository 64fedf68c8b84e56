//! What the filter knows about its own trouble.

/// Flags that stand while the trouble lasts. All false: the pose can be trusted as far as its covariance says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// No pose yet.
    pub starting: bool,
    /// The last line-of-sight sweep contradicts the filter: wrong path, wrong beacon or wrong pose.
    pub contested: bool,
    /// Two-way timing contradicts the clock.
    pub clock_contested: bool,
    /// The beacon claims a position the GMT cannot have.
    pub beacon_implausible: bool,
    /// Inertial data are missing or marked as doubtful.
    pub inertial_missing: bool,
    /// Nothing from outside has corrected the position for more than two seconds.
    pub dead_reckoning: bool,
    /// Position sigma above the limit of [`super::Gates::lost_m`].
    pub lost: bool,
    /// Attitude sigma above the limit of [`super::Gates::attitude_lost_rad`].
    pub attitude_lost: bool,
}

impl Health {
    /// Whether any flag stands.
    pub fn is_degraded(&self) -> bool {
        *self != Self::default()
    }
}

/// What happened since the start. Saturating counters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Line-of-sight sweeps taken in.
    pub accepted: u32,
    /// Line-of-sight sweeps rejected by the gate.
    pub rejected: u32,
    /// Line-of-sight sweeps held back until a neighbour agrees.
    pub held: u32,
    /// Reflections taken in.
    pub reflections: u32,
    /// Reflections rejected or not matched to a plane.
    pub reflections_rejected: u32,
    /// Delta ranges of paths taken in.
    pub delta_ranges: u32,
    /// Delta ranges rejected by the gate.
    pub delta_ranges_rejected: u32,
    /// Rates of paths taken in, less one a sweep.
    pub range_rates: u32,
    /// Rates of paths that no other agrees with.
    pub range_rates_rejected: u32,
    /// Poses set anew.
    pub refixes: u32,
    /// Sweeps whose first path proves the pose wrong: shorter than the straight way.
    pub contrary: u32,
    /// Starts and re-fixes that the magnetic heading contradicts, and starts that the tilt at rest does.
    pub starts_refused: u32,
    /// Clock steps taken over.
    pub clock_steps: u32,
    /// Two-way exchanges rejected.
    pub timing_rejected: u32,
    /// Times that a line of sight agreed with the clock which timing contradicted.
    pub timing_refuted: u32,
    /// Sweeps whose beacon was not believed.
    pub beacons_refused: u32,
    /// Measurements that came too late for the history, or out of order.
    pub too_late: u32,
    /// Times that a number was not finite and the filter started anew.
    pub broken: u32,
}

/// Innovation test ratios of the last measurement of each kind: chi-square over its gate; above one is rejected. Zero
/// before the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TestRatios {
    /// Line of sight, joint.
    pub line_of_sight: f32,
    /// Reflection, joint.
    pub reflection: f32,
    /// Two-way timing.
    pub two_way: f32,
}
