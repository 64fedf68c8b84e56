//! What the ground says to the UAV.

use core::f64::consts::PI;

use super::bits::{BitReader, BitWriter};
use super::scale::CLOCK_OFFSET;
use crate::geometry::Rotation;
use crate::receiver::Beacon;

/// What the GMT says about itself after a sweep. Everything that the UAV computes with comes out of whole numbers, so host and
/// chip compute with the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BeaconReport {
    /// Number of the sweep it follows.
    pub sweep: u32,
    /// Position of the antenna during that sweep, world frame, m, up to 54 975 km; sent in steps of 0.1 mm.
    pub position_m: [f64; 3],
    /// Standard deviation of that, m per axis, 0 to 6.5 m; sent in steps of 0.1 mm.
    pub sigma_m: f64,
    /// Heading of the mast about z, then pitch about its new y, then roll about its new x, rad, -pi to pi; sent in steps of
    /// 2^-30 pi.
    pub heading_pitch_roll_rad: [f64; 3],
    /// Sweeps that the GMT sends from one place before it moves on, 65 535 at most.
    pub sweeps_per_stop: u32,
}

/// Steps and bits of a position, a standard deviation and an angle.
const POSITION: (f64, u32) = (10_000.0, 40);
const SIGMA: (f64, u32) = (10_000.0, 17);
const ANGLE: (f64, u32) = (1_073_741_824.0 / PI, 32);

impl BeaconReport {
    /// The beacon as the receiver takes it; `None` when its angles are no attitude, which a decoded one's always are.
    #[must_use]
    pub fn to_beacon(&self) -> Option<Beacon> {
        let [heading, pitch, roll] = self.heading_pitch_roll_rad.map(|angle| angle as f32);
        Some(Beacon {
            sweep: self.sweep,
            position_m: self.position_m.into(),
            sigma_m: self.sigma_m,
            attitude: Rotation::from_yaw_pitch_roll(heading, pitch, roll).ok()?,
            sweeps_per_stop: self.sweeps_per_stop,
        })
    }

    fn write(&self, to: &mut BitWriter<'_>) {
        to.put(u64::from(self.sweep), 32);
        for coordinate in self.position_m {
            to.put_linear(coordinate, POSITION.0, POSITION.1);
        }
        if self.sigma_m < 0.0 {
            to.spoil();
        }
        to.put_linear(self.sigma_m, SIGMA.0, SIGMA.1);
        for angle in self.heading_pitch_roll_rad {
            to.put_linear(angle, ANGLE.0, ANGLE.1);
        }
        to.put(u64::from(self.sweeps_per_stop), 16);
    }

    fn read(from: &mut BitReader<'_>) -> Option<Self> {
        let sweep = from.take_u32(32)?;
        let mut position_m = [0.0; 3];
        for coordinate in &mut position_m {
            *coordinate = from.take_linear(POSITION.0, POSITION.1)?;
        }
        let sigma_m = from.take_linear(SIGMA.0, SIGMA.1).filter(|sigma| *sigma >= 0.0)?;
        let mut heading_pitch_roll_rad = [0.0; 3];
        for angle in &mut heading_pitch_roll_rad {
            *angle = from.take_linear(ANGLE.0, ANGLE.1)?;
        }
        Some(Self {
            sweep,
            position_m,
            sigma_m,
            heading_pitch_roll_rad,
            sweeps_per_stop: from.take_u32(16)?,
        })
    }
}

/// A two-way timing exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimingReport {
    /// UAV clock at the exchange, ns.
    pub time_ns: u64,
    /// UAV clock less GMT clock, s, up to 90 000 s (25 hours); sent in steps of 10 ps.
    pub clock_offset_s: f64,
}

/// How often the UAV sends what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DownlinkRates {
    /// Poses per second; 0 for none.
    pub pose_hz: u8,
    /// Sweeps from one link report to the next; 0 for none.
    pub link_sweeps: u8,
    /// Seconds from one health report to the next; 0 for none.
    pub health_s: u8,
    /// How long a point may wait for others, in steps of 0.1 s.
    pub point_wait_ds: u8,
}

impl Default for DownlinkRates {
    /// Ten poses per second, every sweep, health once a second, points wait for [`super::Batch::LIMIT_NS`].
    fn default() -> Self {
        Self {
            pose_hz: 10,
            link_sweeps: 1,
            health_s: 1,
            point_wait_ds: 80,
        }
    }
}

/// What the UAV is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Send that often.
    SetRates(DownlinkRates),
    /// Send what you are set to.
    SendConfig,
    /// Empty the map.
    RestartMap,
    /// Begin anew.
    Reboot,
}

/// What the ground says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Uplink {
    /// Where the GMT is.
    Beacon(BeaconReport),
    /// What two-way timing says about the clocks.
    Timing(TimingReport),
    /// What to do.
    Command(Command),
}

impl Uplink {
    pub(super) fn number(&self) -> u8 {
        match self {
            Self::Beacon(_) => 0,
            Self::Timing(_) => 1,
            Self::Command(_) => 2,
        }
    }

    pub(super) fn write_body(&self, to: &mut BitWriter<'_>) {
        match self {
            Self::Beacon(beacon) => beacon.write(to),
            Self::Timing(timing) => {
                to.put(timing.time_ns, 64);
                to.put_linear(timing.clock_offset_s, CLOCK_OFFSET.0, CLOCK_OFFSET.1);
            }
            Self::Command(command) => match command {
                Command::SetRates(rates) => {
                    to.put(0, 8);
                    for rate in [
                        rates.pose_hz,
                        rates.link_sweeps,
                        rates.health_s,
                        rates.point_wait_ds,
                    ] {
                        to.put(u64::from(rate), 8);
                    }
                }
                Command::SendConfig => to.put(1, 8),
                Command::RestartMap => to.put(2, 8),
                Command::Reboot => to.put(3, 8),
            },
        }
    }

    pub(super) fn read_body(number: u8, from: &mut BitReader<'_>) -> Option<Self> {
        Some(match number {
            0 => Self::Beacon(BeaconReport::read(from)?),
            1 => Self::Timing(TimingReport {
                time_ns: from.take(64)?,
                clock_offset_s: from.take_linear(CLOCK_OFFSET.0, CLOCK_OFFSET.1)?,
            }),
            2 => Self::Command(match from.take(8)? {
                0 => Command::SetRates(DownlinkRates {
                    pose_hz: from.take_u8(8)?,
                    link_sweeps: from.take_u8(8)?,
                    health_s: from.take_u8(8)?,
                    point_wait_ds: from.take_u8(8)?,
                }),
                1 => Command::SendConfig,
                2 => Command::RestartMap,
                3 => Command::Reboot,
                _ => return None,
            }),
            _ => return None,
        })
    }
}
