//! Reading and replaying a recording.
//!
//! Long: the files of one directory, one after the other.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use cslam_firmware::icm42688::{PACKET_LEN, RawSample};
use serde::{Deserialize, Serialize};

use super::arrivals::merge;
use super::{
    ARRIVALS, Damage, EVENT_FILES, FORMAT, FileEntry, HEADERS, IMU_RECORD_LEN, MANIFEST, Manifest, PILOTS,
    VERSION, VERSION_WITHOUT_BAROMETER, crc32, event_files, pilots_base, sweep_base,
};
use crate::input::limits::{FLIGHT_DESCRIPTION, FLIGHT_EVENTS, FLIGHT_S};
use crate::input::{InputError, from_json, from_json_line, lines as numbered, read_exactly, read_text};
use crate::sensors::{BarometerSample, Beacon, Event, KINDS, MagnetometerSample, Stamped, TimingSample};

/// More sweeps than the longest flight has with the shortest period.
const MOST_SWEEPS: u32 = 180_000;

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
/// [`InputError`] naming the file and the place in it that is missing, cut short, changed or inconsistent, and the reason.
pub fn read(directory: &Path) -> Result<Recording, InputError> {
    read_with(directory, &mut Damage::refused())
}

/// The same, with damage refused or counted. Records that cannot be read, or that are earlier than the one before them, are left out.
///
/// # Errors
/// As [`read`]; always when the description itself cannot be read.
pub fn read_with(directory: &Path, damage: &mut Damage) -> Result<Recording, InputError> {
    let file = directory.join(MANIFEST);
    let manifest: Manifest = from_json(
        &file,
        &read_text(&file, &FLIGHT_DESCRIPTION)?,
        "the description of a recording",
    )?;
    let names = event_files(manifest.version).filter(|_| manifest.format == FORMAT);
    let Some(names) = names else {
        let message = format!(
            "format {} version {}, expected {FORMAT} version {VERSION_WITHOUT_BAROMETER} or {VERSION}",
            manifest.format, manifest.version
        );
        return Err(InputError::in_file(&file, message));
    };
    let told = manifest.files.iter().map(|entry| entry.name.as_str());
    if !told.eq(names.iter().copied()) {
        return Err(InputError::in_file(
            &file,
            format!("expected the files {}", names.join(", ")),
        ));
    }
    if !(manifest.duration_s > 0.0 && manifest.duration_s <= FLIGHT_S) {
        let message = format!(
            "duration_s is {}, expected above 0, up to {FLIGHT_S}",
            manifest.duration_s
        );
        return Err(InputError::in_file(&file, message));
    }
    if manifest.pilots && !manifest.samples {
        let message = "pilots is true, expected false: samples is, and pilots lie beside samples";
        return Err(InputError::in_file(&file, message));
    }
    if let Some(radio) = &manifest.radio {
        let wrong = |error: InputError| error.under("radio").within(&file);
        radio.check().map_err(wrong)?;
    }
    if let Some(told) = &manifest.scene_as {
        let wrong = |error: InputError| error.under("scene_as").within(&file);
        told.check().map_err(wrong)?;
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
    let mut of_files: [Vec<Stamped>; KINDS] = Default::default();
    for (rank, entry) in manifest.files.iter().enumerate() {
        let file = directory.join(&entry.name);
        let bytes = content(directory, entry, damage)?;
        let mut part = Part {
            file: &file,
            name: &entry.name,
            events: Vec::new(),
            rises: manifest.arrivals.is_none(),
            damage: &mut *damage,
        };
        match rank {
            0 => imu(&mut part, &bytes)?,
            _ => lines(&mut part, rank, &bytes)?,
        }
        let found = part.events;
        let missing = entry.records.saturating_sub(found.len() as u64);
        if found.len() as u64 != entry.records {
            let message = format!(
                "{} records, expected {} as {MANIFEST} says",
                found.len(),
                entry.records
            );
            let counted = damage.gaps().get(&entry.name).copied().unwrap_or(0);
            let error = InputError::in_file(&file, message);
            damage.found(&entry.name, missing.saturating_sub(counted), error)?;
        }
        of_files[rank] = found;
    }
    if let Some(entry) = &manifest.arrivals {
        let events = arrived(directory, entry, of_files, damage)?;
        samples(directory, &manifest, &events, damage)?;
        return Ok(Recording { manifest, events });
    }
    let mut events = of_files.concat();
    // Stable, and the files were read by rank: the order in which the flight made the events.
    events.sort_by_key(|stamped| (stamped.uav_time_ns, stamped.event.rank()));
    sweeps(directory, &mut events, damage)?;
    samples(directory, &manifest, &events, damage)?;
    Ok(Recording { manifest, events })
}

/// All events in the order of a file of arrivals.
fn arrived(
    directory: &Path,
    entry: &FileEntry,
    events: [Vec<Stamped>; KINDS],
    damage: &mut Damage,
) -> Result<Vec<Stamped>, InputError> {
    if entry.name != ARRIVALS || entry.bytes > FLIGHT_EVENTS.bytes {
        let message = format!(
            "arrivals: expected {ARRIVALS} of up to {} bytes",
            FLIGHT_EVENTS.bytes
        );
        return Err(InputError::in_file(&directory.join(MANIFEST), message));
    }
    let bytes = content(directory, entry, damage)?;
    let mut arrived = merge(directory, &bytes, events, damage)?;
    let name = EVENT_FILES[3];
    let is_beyond =
        |stamped: &Stamped| matches!(stamped.event, Event::Sweep { sweep } if sweep >= MOST_SWEEPS);
    let beyond = arrived.iter().filter(|stamped| is_beyond(stamped)).count() as u64;
    if beyond > 0 {
        let message = format!("has a sweep beyond {}", MOST_SWEEPS - 1);
        damage.found(name, beyond, InputError::in_file(&directory.join(name), message))?;
        arrived.retain(|stamped| !is_beyond(stamped));
    }
    Ok(arrived)
}

/// The bytes of a file that is described.
pub(super) fn content(
    directory: &Path,
    entry: &FileEntry,
    damage: &mut Damage,
) -> Result<Vec<u8>, InputError> {
    let file = directory.join(&entry.name);
    let bytes = match read_exactly(&file, entry.bytes, &format!("as {MANIFEST} says")) {
        Ok(bytes) => bytes,
        Err(error) => {
            damage.found(&entry.name, 0, error)?;
            std::fs::read(&file).unwrap_or_default()
        }
    };
    if let Err(error) = unchanged(&file, &bytes, entry) {
        damage.found(&entry.name, 0, error)?;
    }
    Ok(bytes)
}

/// Whether the bytes of a file have the checksum that is described.
fn unchanged(file: &Path, bytes: &[u8], entry: &FileEntry) -> Result<(), InputError> {
    let crc = crc32(bytes);
    if crc == entry.crc32 {
        return Ok(());
    }
    Err(InputError::in_file(
        file,
        format!(
            "changed: CRC-32 {crc:08x}, expected {:08x} as {MANIFEST} says",
            entry.crc32
        ),
    ))
}

/// A file of events while it is read.
struct Part<'a> {
    file: &'a Path,
    name: &'a str,
    events: Vec<Stamped>,
    /// Whether no record may be earlier than the one before it.
    rises: bool,
    damage: &'a mut Damage,
}

impl Part<'_> {
    /// Enters a record that begins at `offset` bytes.
    fn enter(&mut self, offset: usize, record: Result<Stamped, String>) -> Result<(), InputError> {
        let last_ns = self.events.last().map_or(0, |stamped| stamped.uav_time_ns);
        let record = record.and_then(|stamped| {
            if self.rises && stamped.uav_time_ns < last_ns {
                return Err("is earlier than the one before it".to_owned());
            }
            Ok(stamped)
        });
        match record {
            Ok(stamped) => self.events.push(stamped),
            Err(why) => {
                let number = self.events.len() + 1;
                let message = format!("record {number} (byte {offset}) {why}");
                self.damage
                    .found(self.name, 1, InputError::in_file(self.file, message))?;
            }
        }
        Ok(())
    }
}

fn imu(part: &mut Part<'_>, bytes: &[u8]) -> Result<(), InputError> {
    for (index, record) in bytes.chunks(IMU_RECORD_LEN).enumerate() {
        part.enter(index * IMU_RECORD_LEN, imu_record(record))?;
    }
    Ok(())
}

fn imu_record(record: &[u8]) -> Result<Stamped, String> {
    let (stamp, packet) = record
        .split_first_chunk::<8>()
        .and_then(|(stamp, packet)| Some((stamp, <&[u8; PACKET_LEN]>::try_from(packet).ok()?)))
        .ok_or_else(|| format!("has {} bytes, expected {IMU_RECORD_LEN}", record.len()))?;
    let sample = RawSample::from_packet(packet)
        .map_err(|error| format!("is not a packet of the high-resolution FIFO: {error}"))?;
    Ok(Stamped {
        uav_time_ns: u64::from_le_bytes(*stamp),
        event: Event::Imu(sample),
    })
}

fn lines(part: &mut Part<'_>, rank: usize, bytes: &[u8]) -> Result<(), InputError> {
    let text = match core::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let sound = error.valid_up_to();
            let message = format!("cannot be read as text from byte {sound} on");
            part.damage
                .found(part.name, 0, InputError::in_file(part.file, message))?;
            core::str::from_utf8(&bytes[..sound]).unwrap_or_default()
        }
    };
    let file = part.file;
    let mut numbered = numbered(file, text, &FLIGHT_EVENTS);
    if !HEADERS[rank].is_empty() && numbered.next().transpose()?.map(|(_, line)| line) != Some(HEADERS[rank])
    {
        let message = format!("expected the columns {}", HEADERS[rank]);
        part.damage
            .found(part.name, 0, InputError::at_line(file, 1, message))?;
    }
    for line in numbered {
        let (number, line) = line?;
        let offset = line.as_ptr() as usize - text.as_ptr() as usize;
        let record = if rank == 4 {
            from_json_line(file, number, line, "a beacon").map(|BeaconLine { uav_time_ns, beacon }| Stamped {
                uav_time_ns,
                event: Event::Beacon(beacon),
            })
        } else {
            columns(line, rank)
                .ok_or_else(|| InputError::at_line(file, number, format!("expected {}", HEADERS[rank])))
        };
        match record {
            Ok(stamped) => part.enter(offset, Ok(stamped))?,
            Err(error) => part.damage.found(part.name, 1, error)?,
        }
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
        3 => Event::Sweep {
            sweep: field(&mut fields)?,
        },
        _ => Event::Barometer(BarometerSample {
            pressure: field(&mut fields)?,
        }),
    };
    fields.next().is_none().then_some(Stamped { uav_time_ns, event })
}

/// Sweeps are numbered without a gap, and every beacon follows a sweep.
fn sweeps(directory: &Path, events: &mut Vec<Stamped>, damage: &mut Damage) -> Result<(), InputError> {
    let mut heard = 0u32;
    let mut wrong = Vec::new();
    for (index, stamped) in events.iter().enumerate() {
        match stamped.event {
            Event::Sweep { sweep } => {
                if sweep != heard {
                    let message = format!("sweep {sweep}, expected {heard}");
                    let error = InputError::in_file(&directory.join(EVENT_FILES[3]), message);
                    // Records that are missing by number have been counted.
                    let is_counted = damage.gaps().contains_key(EVENT_FILES[3]);
                    let missing = u64::from(sweep.saturating_sub(heard));
                    damage.found(EVENT_FILES[3], if is_counted { 0 } else { missing }, error)?;
                }
                if sweep < heard || sweep == u32::MAX {
                    wrong.push(index);
                } else {
                    heard = sweep + 1;
                }
            }
            Event::Beacon(beacon) if beacon.sweep >= heard => {
                let message = format!("the beacon of sweep {} comes before that sweep", beacon.sweep);
                let error = InputError::in_file(&directory.join(EVENT_FILES[4]), message);
                damage.found(EVENT_FILES[4], 1, error)?;
                wrong.push(index);
            }
            _ => {}
        }
    }
    for index in wrong.into_iter().rev() {
        events.remove(index);
    }
    Ok(())
}

/// The samples and the pilots of every sweep are there, where they were recorded.
fn samples(
    directory: &Path,
    manifest: &Manifest,
    events: &[Stamped],
    damage: &mut Damage,
) -> Result<(), InputError> {
    if !manifest.samples {
        return Ok(());
    }
    let begun = |stamped: &Stamped| match stamped.event {
        Event::Sweep { sweep } => Some(sweep),
        _ => None,
    };
    let begun: BTreeSet<u32> = events.iter().filter_map(begun).collect();
    let mut expect = |part: &str, what: &str, base: PathBuf, sweep: u32| {
        let (meta, data) = crate::sigmf::files(&base);
        let Some(missing) = [meta, data].into_iter().find(|file| !file.is_file()) else {
            return Ok(());
        };
        let message = format!("missing, expected the {what} of sweep {sweep}");
        // Counted when they are asked for.
        damage.found(part, 0, InputError::in_file(&missing, message))
    };
    for sweep in begun {
        expect("sweeps", "samples", sweep_base(directory, sweep), sweep)?;
        if manifest.pilots {
            expect(PILOTS, "pilots", pilots_base(directory, sweep), sweep)?;
        }
    }
    Ok(())
}
