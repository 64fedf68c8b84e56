//! The sensors' events as the receiver takes them: records of the sensor stream, beacons signed as the GMT signs them.

use cslam_core::telemetry::{BeaconReport, Key, MAX_FRAME, Sender, Uplink};
use cslam_firmware::front_end::FRAMES_PER_SWEEP;
use cslam_firmware::sensor_stream::{Content, Record, UAV};

use crate::sensors::{Beacon, Event, Stamped};

/// Makes records of events.
#[derive(Debug)]
pub struct Recorder {
    number: u32,
    gmt: Sender<Uplink>,
}

impl Default for Recorder {
    fn default() -> Self {
        Self {
            number: 0,
            gmt: Sender::new(UAV, &Key::TEST, 0),
        }
    }
}

impl Recorder {
    /// The record of an event; none of what the receiver has no input for. That of a sweep announces its frames.
    pub fn record(&mut self, stamped: &Stamped) -> Option<Record> {
        let content = match &stamped.event {
            Event::Imu(sample) => Content::Imu(*sample),
            Event::Magnetometer(sample) => Content::Magnetometer(sample.field_ut().map(|c| c as f32)),
            Event::Timing(sample) => Content::Timing(sample.clock_offset_s),
            Event::Beacon(said) => Content::Uplink(self.beacon(said)),
            Event::Sweep { .. } => Content::Frames(FRAMES_PER_SWEEP),
            Event::Barometer(_) => return None,
        };
        Some(self.next(stamped.uav_time_ns, content))
    }

    /// The last record.
    pub fn end(&mut self, time_ns: u64) -> Record {
        self.next(time_ns, Content::End)
    }

    fn next(&mut self, time_ns: u64, content: Content) -> Record {
        let number = self.number;
        self.number = number.wrapping_add(1);
        Record {
            number,
            time_ns,
            content,
        }
    }

    /// A beacon in its frame; nothing when it says what no frame can say.
    fn beacon(&mut self, said: &Beacon) -> heapless::Vec<u8, { cslam_firmware::sensor_stream::UPLINK_MAX }> {
        let mut frame = [0; MAX_FRAME];
        let bytes = self
            .gmt
            .encode(&Uplink::Beacon(report(said)), &mut frame)
            .unwrap_or(&[]);
        heapless::Vec::from_slice(bytes).unwrap_or_default()
    }
}

/// A beacon as a packet says it.
pub(crate) fn report(said: &Beacon) -> BeaconReport {
    BeaconReport {
        sweep: said.sweep,
        position_m: said.position_m,
        sigma_m: said.position_sigma_m,
        heading_pitch_roll_rad: said.heading_pitch_roll_rad,
        sweeps_per_stop: said.sweeps_per_stop,
    }
}
