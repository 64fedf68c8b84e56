//! What became of everything received.

use super::count;
use crate::measurement::RecordError;

/// Counters of a receiver, saturating.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Measurements that became points.
    pub points: u32,
    /// Measurements rejected as not first-order.
    pub rejected: u32,
    /// Measurements that were no paths.
    pub invalid: u32,
    /// Records of the wrong length.
    pub damaged_length: u32,
    /// Records whose checksum did not match.
    pub damaged_checksum: u32,
    /// Records of another version.
    pub damaged_version: u32,
    /// Records of an unknown kind.
    pub damaged_content: u32,
    /// Records that the sender counted and that never arrived, damaged or not. Known at the end of the stream.
    pub missing: u32,
    /// Packets handed to the downlink.
    pub sent: u32,
    /// Packets that the downlink did not take.
    pub unsent: u32,
}

impl Counters {
    /// Damaged records of every kind.
    #[must_use]
    pub fn damaged_total(&self) -> u32 {
        let kinds = [
            self.damaged_length,
            self.damaged_checksum,
            self.damaged_version,
            self.damaged_content,
        ];
        kinds.into_iter().fold(0, u32::saturating_add)
    }

    /// Records that arrived, the end of the stream not counted.
    #[must_use]
    pub fn received(&self) -> u32 {
        let measurements = self
            .points
            .saturating_add(self.rejected)
            .saturating_add(self.invalid);
        measurements.saturating_add(self.damaged_total())
    }

    pub(super) fn damaged(&mut self, error: RecordError) {
        count(match error {
            RecordError::Length => &mut self.damaged_length,
            RecordError::Checksum => &mut self.damaged_checksum,
            RecordError::Version => &mut self.damaged_version,
            RecordError::Content => &mut self.damaged_content,
        });
    }

    pub(super) fn ended(&mut self, sent: u32) {
        self.missing = sent.saturating_sub(self.received());
    }
}
