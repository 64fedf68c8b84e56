//! What became of everything that came in.

/// Saturating counters since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Inertial samples.
    pub imu: u32,
    /// Samples of the magnetometer.
    pub magnetometer: u32,
    /// Two-way timing exchanges.
    pub timing: u32,
    /// Beacons.
    pub beacons: u32,
    /// Blocks that were used.
    pub blocks: u32,
    /// Blocks of a sweep that had ended.
    pub late_blocks: u32,
    /// Sweeps that ended.
    pub sweeps: u32,
}

pub(super) fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
