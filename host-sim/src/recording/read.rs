//! Reading and replaying a recording.

use std::path::Path;
use std::str::FromStr;

use cslam_firmware::icm42688::{PACKET_LEN, RawSample};
use serde::{Deserialize, Serialize};

use super::{
    EVENT_FILES, FORMAT, FileEntry, HEADERS, IMU_RECORD_LEN, MANIFEST, Manifest, VERSION, crc32, sweep_base,
};
use crate::input::limits::{FLIGHT_DESCRIPTION, FLIGHT_EVENTS, FLIGHT_S};
use crate::input::{InputError, from_json, from_json_line, lines as numbered, read_exactly, read_text};
use crate::sensors::{Beacon, Event, MagnetometerSample, Stamped, TimingSample};

/// A line of `beacons.jsonl`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BeaconLine {
    pub(super) uav_time_ns: u64,
    pub(super) beacon: Beacon,
}

/// A recording in memory: what the receiver was given, without the truth.
#[derive(Clone, Debug)]
pub struct Recording {
    manifest: Manifest,
    events: Vec<Stamped>,
}

impl Recording {
    /// What the recording says about itself.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Events in the order in which they happened.
    pub fn events(&self) -> &[Stamped] {
        &self.events
    }
}

/// Reads the recording in `directory` and checks it whole.
///
/// # Errors
/// [`InputError`] naming the file (and line) that is missing, cut short, changed or inconsistent, and the reason.
pub fn read(directory: &Path) -> Result<Recording, InputError> {
    let file = directory.join(MANIFEST);
    let manifest: Manifest = from_json(
        &file,
        &read_text(&file, &FLIGHT_DESCRIPTION)?,
        "the description of a recording",
    )?;
    if manifest.format != FORMAT || manifest.version != VERSION {
        return Err(InputError::in_file(
            &file,
            format!(
                "format {} version {}, expected {FORMAT} version {VERSION}",
                manifest.format, manifest.version
            ),
        ));
    }
    if !manifest
        .files
        .iter()
        .map(|entry| entry.name.as_str())
        .eq(EVENT_FILES)
    {
        return Err(InputError::in_file(
            &file,
            format!("expected the files {}", EVENT_FILES.join(", ")),
        ));
    }
    if !(manifest.duration_s > 0.0 && manifest.duration_s <= FLIGHT_S) {
        let message = format!(
            "duration_s is {}, expected above 0, up to {FLIGHT_S}",
            manifest.duration_s
        );
        return Err(InputError::in_file(&file, message));
    }
    if let Some(entry) = manifest
        .files
        .iter()
        .find(|entry| entry.bytes > FLIGHT_EVENTS.bytes)
    {
        let message = format!(
            "bytes of {} is {}, expected up to {}",
            entry.name, entry.bytes, FLIGHT_EVENTS.bytes
        );
        return Err(InputError::in_file(&file, message));
    }
    let mut events = Vec::new();
    for (rank, entry) in manifest.files.iter().enumerate() {
        let file = directory.join(&entry.name);
        let bytes = checked(&file, entry)?;
        let first = events.len();
        match rank {
            0 => imu(&file, &bytes, &mut events)?,
            _ => lines(&file, rank, &bytes, &mut events)?,
        }
        let found = &events[first..];
        if found.len() as u64 != entry.records {
            return Err(InputError::in_file(
                &file,
                format!(
                    "{} records, expected {} as {MANIFEST} says",
                    found.len(),
                    entry.records
                ),
            ));
        }
        if let Some(k) = found
            .windows(2)
            .position(|pair| pair[1].uav_time_ns < pair[0].uav_time_ns)
        {
            return Err(InputError::in_file(
                &file,
                format!("record {} is earlier than the one before it", k + 2),
            ));
        }
    }
    // Stable, and the files were read by rank: the order in which the flight made the events.
    events.sort_by_key(|stamped| (stamped.uav_time_ns, stamped.event.rank()));
    sweeps(directory, &manifest, &events)?;
    Ok(Recording { manifest, events })
}

/// The bytes of a file, with length and checksum as described.
fn checked(file: &Path, entry: &FileEntry) -> Result<Vec<u8>, InputError> {
    let bytes = read_exactly(file, entry.bytes, &format!("as {MANIFEST} says"))?;
    let crc = crc32(&bytes);
    if crc != entry.crc32 {
        return Err(InputError::in_file(
            file,
            format!(
                "changed: CRC-32 {crc:08x}, expected {:08x} as {MANIFEST} says",
                entry.crc32
            ),
        ));
    }
    Ok(bytes)
}

fn imu(file: &Path, bytes: &[u8], events: &mut Vec<Stamped>) -> Result<(), InputError> {
    let records = bytes.chunks_exact(IMU_RECORD_LEN);
    if !records.remainder().is_empty() {
        return Err(InputError::in_file(
            file,
            format!("{} bytes, expected a multiple of {IMU_RECORD_LEN}", bytes.len()),
        ));
    }
    for (index, record) in records.enumerate() {
        let (mut stamp, mut packet) = ([0; 8], [0; PACKET_LEN]);
        stamp.copy_from_slice(&record[..8]);
        packet.copy_from_slice(&record[8..]);
        let sample = RawSample::from_packet(&packet).map_err(|error| {
            InputError::in_file(
                file,
                format!(
                    "record {} is not a packet of the high-resolution FIFO: {error}",
                    index + 1
                ),
            )
        })?;
        events.push(Stamped {
            uav_time_ns: u64::from_le_bytes(stamp),
            event: Event::Imu(sample),
        });
    }
    Ok(())
}

fn lines(file: &Path, rank: usize, bytes: &[u8], events: &mut Vec<Stamped>) -> Result<(), InputError> {
    let text = core::str::from_utf8(bytes)
        .map_err(|e| InputError::in_file(file, format!("cannot be read as text: {e}")))?;
    let mut numbered = numbered(file, text, &FLIGHT_EVENTS);
    if !HEADERS[rank].is_empty() && numbered.next().transpose()?.map(|(_, line)| line) != Some(HEADERS[rank])
    {
        return Err(InputError::at_line(
            file,
            1,
            format!("expected the columns {}", HEADERS[rank]),
        ));
    }
    for line in numbered {
        let (number, line) = line?;
        let stamped = if rank == 4 {
            let BeaconLine { uav_time_ns, beacon } = from_json_line(file, number, line, "a beacon")?;
            Stamped {
                uav_time_ns,
                event: Event::Beacon(beacon),
            }
        } else {
            columns(line, rank)
                .ok_or_else(|| InputError::at_line(file, number, format!("expected {}", HEADERS[rank])))?
        };
        events.push(stamped);
    }
    Ok(())
}

/// One line of a file with columns.
fn columns(line: &str, rank: usize) -> Option<Stamped> {
    fn field<T: FromStr>(fields: &mut core::str::Split<'_, char>) -> Option<T> {
        fields.next()?.parse().ok()
    }
    let mut fields = line.split(',');
    let uav_time_ns = field(&mut fields)?;
    let event = match rank {
        1 => {
            let field_codes = [field(&mut fields)?, field(&mut fields)?, field(&mut fields)?];
            Event::Magnetometer(MagnetometerSample { field: field_codes })
        }
        2 => {
            let clock_offset_s: f64 = field(&mut fields)?;
            clock_offset_s.is_finite().then_some(())?;
            Event::Timing(TimingSample { clock_offset_s })
        }
        _ => Event::Sweep {
            sweep: field(&mut fields)?,
        },
    };
    fields.next().is_none().then_some(Stamped { uav_time_ns, event })
}

/// Sweeps are numbered without a gap, every beacon follows a sweep, and recorded samples are there.
fn sweeps(directory: &Path, manifest: &Manifest, events: &[Stamped]) -> Result<(), InputError> {
    let mut heard = 0u32;
    for stamped in events {
        match stamped.event {
            Event::Sweep { sweep } if sweep == heard => heard += 1,
            Event::Sweep { sweep } => {
                return Err(InputError::in_file(
                    &directory.join(EVENT_FILES[3]),
                    format!("sweep {sweep}, expected {heard}"),
                ));
            }
            Event::Beacon(beacon) if beacon.sweep >= heard => {
                return Err(InputError::in_file(
                    &directory.join(EVENT_FILES[4]),
                    format!("the beacon of sweep {} comes before that sweep", beacon.sweep),
                ));
            }
            _ => {}
        }
    }
    if !manifest.samples {
        return Ok(());
    }
    for sweep in 0..heard {
        let (meta, data) = crate::sigmf::files(&sweep_base(directory, sweep));
        if let Some(missing) = [meta, data].iter().find(|file| !file.is_file()) {
            return Err(InputError::in_file(
                missing,
                format!("missing, expected the samples of sweep {sweep}"),
            ));
        }
    }
    Ok(())
}
