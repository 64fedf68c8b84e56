//! Records of the sensor stream into the application.

use cslam_core::receiver::Radio;

use super::{Application, Observer, counters};
use crate::front_end::Checksum;
use crate::sensor_stream::{Content, LENGTH, Record, RecordError};

/// What a record asks of whoever feeds the application.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Fed {
    /// Nothing: it has been used.
    Used,
    /// So many frames of the front end lie ready and come next.
    Frames(u16),
    /// The stream has ended.
    End,
}

impl<R: Radio, const VOXELS: usize, const STATES: usize, C: Checksum> Application<'_, R, VOXELS, STATES, C> {
    /// Takes a record.
    ///
    /// # Errors
    /// [`RecordError`]: nothing was used. It is counted, and so are records that never came.
    pub fn record(&mut self, bytes: &[u8; LENGTH], observer: &mut impl Observer) -> Result<Fed, RecordError> {
        let record = Record::decode(bytes).inspect_err(|_| {
            counters::count(&mut self.counters.records_damaged);
        })?;
        // Records come in order, so a number that is skipped is lost, and one that comes again has been used.
        let ahead = record.number.wrapping_sub(self.next_record);
        if ahead > u32::MAX / 2 {
            counters::count(&mut self.counters.records_repeated);
            return Ok(Fed::Used);
        }
        self.counters.records_lost = self.counters.records_lost.saturating_add(ahead);
        self.next_record = record.number.wrapping_add(1);
        let time_ns = record.time_ns;
        match record.content {
            Content::Imu(raw) => self.imu(&raw.at(time_ns), observer),
            Content::Magnetometer(field_ut) => self.magnetometer(time_ns, &field_ut, observer),
            Content::Timing(offset_s) => self.timing(time_ns, offset_s, observer),
            Content::Uplink(heard) => self.uplink(time_ns, &heard, |_| None, observer),
            Content::Frames(count) => {
                self.elapse(time_ns, observer);
                return Ok(Fed::Frames(count));
            }
            Content::End => return Ok(Fed::End),
        }
        Ok(Fed::Used)
    }
}
