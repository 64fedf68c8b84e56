//! What the ground says: frames to beacons, timing and commands. What is not signed by the key of this link, or was heard before, is
//! counted and forgotten.

use cslam_core::receiver::Radio;
use cslam_core::telemetry::{Command, Event, TelemetryError, Uplink};

use super::counters::count;
use super::{Application, Observer};
use crate::front_end::Checksum;

/// What a command asks of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Request {
    /// Begin anew.
    Reboot,
}

impl<R: Radio, const VOXELS: usize, const STATES: usize, C: Checksum> Application<'_, R, VOXELS, STATES, C> {
    /// Bytes that the radio has received by `time_ns`. `reserve` sets counters aside when the opener has come to its limit
    /// ([`Opener::open_reserving`](cslam_core::telemetry::Opener::open_reserving)); an opener without a limit never asks.
    pub fn uplink(
        &mut self,
        time_ns: u64,
        bytes: &[u8],
        mut reserve: impl FnMut(u32) -> Option<u32>,
        observer: &mut impl Observer,
    ) {
        self.elapse(time_ns, observer);
        for byte in bytes {
            match self.uplink.push_reserving(*byte, &mut reserve) {
                None => {}
                Some(Ok(packet)) => self.obey(time_ns, &packet.message, observer),
                Some(Err(error)) => self.refuse(error),
            }
        }
    }

    /// One more than the highest counter that was taken.
    pub fn uplink_counter(&self) -> u32 {
        self.uplink.opener().next()
    }

    /// What a command has asked of the board, once.
    pub fn request(&mut self) -> Option<Request> {
        self.request.take()
    }

    fn obey(&mut self, time_ns: u64, said: &Uplink, observer: &mut impl Observer) {
        match said {
            Uplink::Beacon(report) => match report.to_beacon() {
                Some(beacon) => self.beacon(time_ns, &beacon, observer),
                None => count(&mut self.counters.uplink_unknown),
            },
            // What is said to have been later than it is heard would take the UAV's time along.
            Uplink::Timing(report) if report.time_ns > time_ns => count(&mut self.counters.timing_ahead),
            Uplink::Timing(report) => self.timing(report.time_ns, report.clock_offset_s, observer),
            Uplink::Command(command) => {
                count(&mut self.counters.commands);
                match command {
                    Command::SetRates(rates) => self.set_rates(rates),
                    Command::SendConfig => self.send_config(),
                    Command::RestartMap => {
                        self.cslam.clear_map();
                        self.announce(Event::MapRestarted);
                    }
                    Command::Reboot => self.request = Some(Request::Reboot),
                }
            }
        }
    }

    fn refuse(&mut self, error: TelemetryError) {
        let counters = &mut self.counters;
        count(match error {
            TelemetryError::WrongLink => &mut counters.uplink_wrong_link,
            TelemetryError::Unsigned | TelemetryError::KeyMissing | TelemetryError::Forged => {
                &mut counters.uplink_unsigned
            }
            TelemetryError::Replayed | TelemetryError::Stale => &mut counters.uplink_replayed,
            TelemetryError::Unreserved => &mut counters.uplink_unreserved,
            TelemetryError::Content | TelemetryError::Version => &mut counters.uplink_unknown,
            _ => &mut counters.uplink_damaged,
        });
    }
}
