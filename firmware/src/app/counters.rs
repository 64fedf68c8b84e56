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
    /// Two-way timing exchanges that the ground says were in the future.
    pub timing_ahead: u32,
    /// Beacons.
    pub beacons: u32,
    /// Blocks that were used.
    pub blocks: u32,
    /// Blocks of a sweep that had ended.
    pub late_blocks: u32,
    /// Sweeps of which the front end did not say how strong their beams are.
    pub powers_missing: u32,
    /// Beams that were not as strong as the front end said.
    pub powers_contradicted: u32,
    /// Beams that were stronger than the one that the front end sent before.
    pub beams_unordered: u32,
    /// Beams that were not searched because the work that a sweep may take was spent on stronger ones.
    pub beams_left_out: u32,
    /// Sweeps with paths that were estimated elsewhere, in which beam squint wanted to hear another path than it did there: they have no
    /// bearing.
    pub sightings_unheard: u32,
    /// Sweeps that ended.
    pub sweeps: u32,
    /// Paths that became points.
    pub points: u32,
    /// Paths that a gate of the reflection point rejected.
    pub rejected: u32,
    /// Paths that were none.
    pub invalid: u32,
    /// Commands carried out.
    pub commands: u32,
    /// Packets from the ground that were damaged.
    pub uplink_damaged: u32,
    /// Packets from the ground that were not signed by the key of this link.
    pub uplink_unsigned: u32,
    /// Packets from the ground that were heard before, or too late to tell.
    pub uplink_replayed: u32,
    /// Packets from the ground for another link.
    pub uplink_wrong_link: u32,
    /// Packets from the ground that were genuine, but whose counters could not be stored ahead of their use.
    pub uplink_unreserved: u32,
    /// Packets from the ground that said nothing known.
    pub uplink_unknown: u32,
    /// Records of the sensor stream that were damaged.
    pub records_damaged: u32,
    /// Records of the sensor stream that never came, the damaged among them.
    pub records_lost: u32,
    /// Records of the sensor stream that came again, or late.
    pub records_repeated: u32,
}

pub(super) fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
