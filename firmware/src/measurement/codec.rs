//! Records to bytes and back. Nothing here can panic, whatever the bytes are.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

use super::{DepartureRecord, PathRecord, RecordError};

/// Length of a record, bytes.
pub const LENGTH: usize = 116;
/// Version of the layout.
pub const VERSION: u8 = 1;

/// Bytes under the checksum.
const CHECKED: usize = LENGTH - 4;
const KIND_PATH: u8 = 1;
const KIND_END: u8 = 2;
const FLAG_AOD: u8 = 1;

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// What a record says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Record {
    /// A measured path.
    Path(PathRecord),
    /// Nothing follows.
    End {
        /// Number of path records that the sender put before this one.
        sent: u32,
    },
}

impl Record {
    /// The record as bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        let (content, checksum) = bytes.split_at_mut(CHECKED);
        let mut out = Writer(content);
        match self {
            Self::Path(path) => write_path(&mut out, path),
            Self::End { sent } => {
                out.put(&[KIND_END, VERSION, 0, 0]);
                out.put(&sent.to_le_bytes());
            }
        }
        checksum.copy_from_slice(&CRC.checksum(content).to_le_bytes());
        bytes
    }

    /// Reads a record.
    ///
    /// # Errors
    /// [`RecordError`]: wrong length, wrong checksum, another version, unknown kind or flags.
    pub fn decode(bytes: &[u8]) -> Result<Self, RecordError> {
        let bytes: &[u8; LENGTH] = bytes.try_into().map_err(|_| RecordError::Length)?;
        let (content, checksum) = bytes.split_at(CHECKED);
        if CRC.checksum(content).to_le_bytes() != checksum {
            return Err(RecordError::Checksum);
        }
        let mut content = Reader(content);
        let [kind, version, flags, index] = content.take()?;
        if version != VERSION {
            return Err(RecordError::Version);
        }
        let count = u32::from_le_bytes(content.take()?);
        match (kind, flags) {
            (KIND_PATH, 0 | FLAG_AOD) => {
                read_path(&mut content, count, index, flags == FLAG_AOD).map(Self::Path)
            }
            (KIND_END, 0) => Ok(Self::End { sent: count }),
            _ => Err(RecordError::Content),
        }
    }
}

fn write_path(out: &mut Writer<'_>, record: &PathRecord) {
    let flags = if record.aod.is_some() { FLAG_AOD } else { 0 };
    out.put(&[KIND_PATH, VERSION, flags, record.path]);
    out.put(&record.link.to_le_bytes());
    out.put_floats(&record.uav_m);
    out.put_floats(&record.uav_covariance_m2);
    out.put_floats(&record.gmt_m);
    out.put_floats(&[record.c_tau_m]);
    out.put_floats(&record.aoa);
    out.put_floats(&record.covariance);
    if let Some(aod) = &record.aod {
        out.put_floats(&aod.direction);
        out.put_floats(&[aod.sigma_rad]);
    }
}

fn read_path(
    content: &mut Reader<'_>,
    link: u32,
    path: u8,
    has_aod: bool,
) -> Result<PathRecord, RecordError> {
    let uav_m = content.take_floats()?;
    let uav_covariance_m2 = content.take_floats()?;
    let gmt_m = content.take_floats()?;
    let [c_tau_m] = content.take_floats()?;
    let aoa = content.take_floats()?;
    let covariance = content.take_floats()?;
    let direction = content.take_floats()?;
    let [sigma_rad] = content.take_floats()?;
    let aod = has_aod.then_some(DepartureRecord { direction, sigma_rad });
    Ok(PathRecord {
        link,
        path,
        uav_m,
        uav_covariance_m2,
        gmt_m,
        c_tau_m,
        aoa,
        covariance,
        aod,
    })
}

/// Fills a slice from the front. The layout fits the slice by construction; a test reads the last field back.
struct Writer<'a>(&'a mut [u8]);

impl Writer<'_> {
    fn put(&mut self, bytes: &[u8]) {
        if let Some((place, rest)) = core::mem::take(&mut self.0).split_at_mut_checked(bytes.len()) {
            place.copy_from_slice(bytes);
            self.0 = rest;
        }
    }

    fn put_floats(&mut self, values: &[f32]) {
        for value in values {
            self.put(&value.to_le_bytes());
        }
    }
}

/// Takes a slice apart from the front.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], RecordError> {
        let (bytes, rest) = self.0.split_first_chunk::<N>().ok_or(RecordError::Length)?;
        self.0 = rest;
        Ok(*bytes)
    }

    fn take_floats<const N: usize>(&mut self) -> Result<[f32; N], RecordError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = f32::from_le_bytes(self.take()?);
        }
        Ok(values)
    }
}
