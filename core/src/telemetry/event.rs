//! What happened once.

use super::ResetCause;
use super::bits::{BitReader, BitWriter};
use super::pose::{put_time, take_time};

/// What the program before a reset left behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultRecord {
    /// Cause of the reset.
    pub cause: ResetCause,
    /// Program counter at a fault, else 0.
    pub program_counter: u32,
    /// Link register at a fault, else 0.
    pub link_register: u32,
    /// Stage of the program that was at work, by the firmware's list.
    pub stage: u8,
    /// How long the program had run, ms.
    pub uptime_ms: u32,
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// The program began anew.
    Reset(FaultRecord),
    /// A configuration with this CRC-32 was taken.
    ConfigAccepted(u32),
    /// A configuration was refused: number of the reason, by the firmware's list.
    ConfigRefused(u8),
    /// The pose was set for the first time.
    Started,
    /// The pose was set anew.
    Refixed,
    /// There is no key, so nothing that comes up is taken.
    KeyMissing,
    /// A record of the permanent memory was damaged: its number, by the firmware's list.
    StorageDamaged(u8),
    /// The map was emptied.
    MapRestarted,
    /// The surface of this number was refuted: every point of it that went out before leaves the map.
    SurfaceWithdrawn(u16),
    /// Two surfaces were one: every point of the one that is gone, as far as it went out before, is of the one that stays.
    SurfaceMerged {
        /// Number that no surface has any more.
        gone: u16,
        /// Number that both have now.
        stays: u16,
    },
}

impl Event {
    fn write(&self, to: &mut BitWriter<'_>) {
        let mut kind = |kind: u64| to.put(kind, 6);
        match self {
            Self::Reset(record) => {
                kind(0);
                record.cause.write(to);
                to.put(u64::from(record.program_counter), 32);
                to.put(u64::from(record.link_register), 32);
                to.put(u64::from(record.stage), 8);
                to.put(u64::from(record.uptime_ms), 32);
            }
            Self::ConfigAccepted(crc) => {
                kind(1);
                to.put(u64::from(*crc), 32);
            }
            Self::ConfigRefused(reason) => {
                kind(2);
                to.put(u64::from(*reason), 8);
            }
            Self::Started => kind(3),
            Self::Refixed => kind(4),
            Self::KeyMissing => kind(5),
            Self::StorageDamaged(record) => {
                kind(6);
                to.put(u64::from(*record), 8);
            }
            Self::MapRestarted => kind(7),
            Self::SurfaceWithdrawn(surface) => {
                kind(8);
                to.put(u64::from(*surface), 16);
            }
            Self::SurfaceMerged { gone, stays } => {
                kind(9);
                to.put(u64::from(*gone), 16);
                to.put(u64::from(*stays), 16);
            }
        }
    }

    fn read(from: &mut BitReader<'_>) -> Option<Self> {
        Some(match from.take(6)? {
            0 => Self::Reset(FaultRecord {
                cause: ResetCause::read(from)?,
                program_counter: from.take_u32(32)?,
                link_register: from.take_u32(32)?,
                stage: from.take_u8(8)?,
                uptime_ms: from.take_u32(32)?,
            }),
            1 => Self::ConfigAccepted(from.take_u32(32)?),
            2 => Self::ConfigRefused(from.take_u8(8)?),
            3 => Self::Started,
            4 => Self::Refixed,
            5 => Self::KeyMissing,
            6 => Self::StorageDamaged(from.take_u8(8)?),
            7 => Self::MapRestarted,
            8 => Self::SurfaceWithdrawn(from.take_u16(16)?),
            9 => Self::SurfaceMerged {
                gone: from.take_u16(16)?,
                stays: from.take_u16(16)?,
            },
            _ => return None,
        })
    }
}

/// An event and when it happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EventReport {
    /// UAV clock, ns; sent in whole microseconds, rounded down.
    pub time_ns: u64,
    /// What happened.
    pub event: Event,
}

impl EventReport {
    pub(super) fn write(&self, to: &mut BitWriter<'_>) {
        put_time(to, self.time_ns);
        self.event.write(to);
    }

    pub(super) fn read(from: &mut BitReader<'_>) -> Option<Self> {
        Some(Self {
            time_ns: take_time(from)?,
            event: Event::read(from)?,
        })
    }
}

/// Whose methods the receiver uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ModeReport {
    /// Ours.
    #[default]
    Best,
    /// The paper's.
    Paper,
}

/// What the receiver is set to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConfigReport {
    /// Version of the configuration's format.
    pub version: u16,
    /// CRC-32 of the configuration.
    pub crc: u32,
    /// Whose methods.
    pub mode: ModeReport,
    /// Version of the firmware.
    pub firmware: [u8; 3],
    /// Voxels that the map has room for.
    pub map_capacity: u32,
    /// Edge of a voxel, m, up to 65 m; sent in steps of 1 mm.
    pub voxel_edge_m: f32,
}

impl ConfigReport {
    pub(super) fn write(&self, to: &mut BitWriter<'_>) {
        to.put(u64::from(self.version), 16);
        to.put(u64::from(self.crc), 32);
        to.put_bit(self.mode == ModeReport::Paper);
        for number in self.firmware {
            to.put(u64::from(number), 8);
        }
        to.put_sized(u64::from(self.map_capacity));
        let edge_mm = libm::floorf(self.voxel_edge_m * 1000.0 + 0.5);
        if (0.0..=65_535.0).contains(&edge_mm) {
            to.put(edge_mm as u64, 16);
        } else {
            to.spoil();
        }
    }

    pub(super) fn read(from: &mut BitReader<'_>) -> Option<Self> {
        Some(Self {
            version: from.take_u16(16)?,
            crc: from.take_u32(32)?,
            mode: if from.take_bit()? {
                ModeReport::Paper
            } else {
                ModeReport::Best
            },
            firmware: [from.take_u8(8)?, from.take_u8(8)?, from.take_u8(8)?],
            map_capacity: u32::try_from(from.take_sized()?).ok()?,
            voxel_edge_m: f32::from(from.take_u16(16)?) / 1000.0,
        })
    }
}
