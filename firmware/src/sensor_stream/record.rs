//! Records to bytes and back. Nothing here can panic, whatever the bytes are.

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use cslam_core::geometry::Vector3;
use cslam_core::inertial::ImuSample;

use super::RecordError;
use crate::icm42688::{PACKET_LEN, RawSample};

/// Length of a record, bytes.
pub const LENGTH: usize = 128;
/// Most bytes of the uplink in a record.
pub const UPLINK_MAX: usize = CHECKED - HEAD;

const VERSION: u8 = 1;
const HEAD: usize = 16;
const CHECKED: usize = LENGTH - 4;

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// What a record says.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// A sample of the inertial sensor.
    Imu(RawSample),
    /// A sample of the magnetometer, uT in body axes.
    Magnetometer(Vector3<f32>),
    /// A two-way timing exchange: UAV clock less GMT clock, s.
    Timing(f64),
    /// Bytes that the radio has received: beacons and commands, in frames of the telemetry's format.
    Uplink(heapless::Vec<u8, UPLINK_MAX>),
    /// So many frames of the front end lie ready.
    Frames(u16),
    /// Nothing follows.
    End,
}

/// A record.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Number of the record.
    pub number: u32,
    /// UAV clock, ns.
    pub time_ns: u64,
    /// What it says.
    pub content: Content,
}

impl Record {
    /// The inertial sample of a record, if it is one.
    #[must_use]
    pub fn imu(&self) -> Option<ImuSample> {
        match &self.content {
            Content::Imu(raw) => Some(raw.at(self.time_ns)),
            _ => None,
        }
    }

    /// The record as bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        let mut content = [0; UPLINK_MAX];
        let mut used = 0;
        let mut put = |bytes: &[u8]| {
            for (slot, byte) in content.iter_mut().skip(used).zip(bytes) {
                *slot = *byte;
            }
            used += bytes.len();
        };
        let kind: u8 = match &self.content {
            Content::Imu(raw) => {
                put(&raw.to_packet());
                1
            }
            Content::Magnetometer(field_ut) => {
                field_ut.iter().for_each(|c| put(&c.to_le_bytes()));
                2
            }
            Content::Timing(offset_s) => {
                put(&offset_s.to_le_bytes());
                3
            }
            Content::Uplink(heard) => {
                put(heard);
                4
            }
            Content::Frames(count) => {
                put(&count.to_le_bytes());
                5
            }
            Content::End => 6,
        };
        let length = (used as u16).to_le_bytes();
        let number = self.number.to_le_bytes();
        let time = self.time_ns.to_le_bytes();
        let head = [VERSION, kind]
            .into_iter()
            .chain(length)
            .chain(number)
            .chain(time);
        for (slot, byte) in bytes.iter_mut().zip(head.chain(content)) {
            *slot = byte;
        }
        let (checked, checksum) = bytes.split_at_mut(CHECKED);
        checksum.copy_from_slice(&CRC.checksum(checked).to_le_bytes());
        bytes
    }

    /// Reads a record.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn decode(bytes: &[u8; LENGTH]) -> Result<Self, RecordError> {
        let (checked, checksum) = bytes.split_at(CHECKED);
        if CRC.checksum(checked).to_le_bytes() != *checksum {
            return Err(RecordError::Checksum);
        }
        let mut reader = Reader(checked);
        let [found] = reader.take()?;
        if found != VERSION {
            return Err(RecordError::Version { found });
        }
        let [kind] = reader.take()?;
        let found = u16::from_le_bytes(reader.take()?);
        let number = u32::from_le_bytes(reader.take()?);
        let time_ns = u64::from_le_bytes(reader.take()?);
        let length = RecordError::Length { found };
        let content = reader.0.get(..usize::from(found)).ok_or(length)?;
        let mut reader = Reader(content);
        let content = match kind {
            1 => {
                let packet: [u8; PACKET_LEN] = reader.take()?;
                Content::Imu(RawSample::from_packet(&packet).map_err(|_| RecordError::Packet)?)
            }
            2 => {
                let mut axis = || Ok::<_, RecordError>(f32::from_le_bytes(reader.take()?));
                Content::Magnetometer(Vector3::new(axis()?, axis()?, axis()?))
            }
            3 => Content::Timing(f64::from_le_bytes(reader.take()?)),
            4 => {
                let heard = reader.0;
                reader.0 = &[];
                Content::Uplink(heapless::Vec::from_slice(heard).map_err(|_| length)?)
            }
            5 => Content::Frames(u16::from_le_bytes(reader.take()?)),
            6 => Content::End,
            found => return Err(RecordError::Kind { found }),
        };
        if !reader.0.is_empty() {
            return Err(length);
        }
        Ok(Self {
            number,
            time_ns,
            content,
        })
    }
}

/// Bytes that have not been read.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], RecordError> {
        let found = self.0.len() as u16;
        let (first, rest) = self
            .0
            .split_first_chunk::<N>()
            .ok_or(RecordError::Length { found })?;
        self.0 = rest;
        Ok(*first)
    }
}
