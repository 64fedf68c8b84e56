//! A flight on disk: what the receiver was given, and beside it the truth.
//!
//! A recording is a directory:
//!
//! | file | content |
//! |---|---|
//! | `flight.json` | format and version, scene, seed, rates, and of each other file its records, bytes and CRC-32 |
//! | `imu.bin` | 28 bytes a record, little-endian time stamp (u64, ns of the UAV clock), then the 20-byte FIFO packet |
//! | `magnetometer.csv` | `uav_time_ns,x,y,z`: integer codes |
//! | `timing.csv` | `uav_time_ns,clock_offset_s` |
//! | `sweeps.csv` | `uav_time_ns,sweep` |
//! | `beacons.jsonl` | `{"uav_time_ns":..,"beacon":{..}}`, a beacon a line |
//! | `barometer.csv` | `uav_time_ns,pressure`: integer codes; where there is a barometer |
//! | `arrivals.bin` | a byte an event, the place of its file: the order in which they arrived, where it is not that of their stamps |
//! | `truth.csv` | the world at every sweep and every 10 ms: never read by [`read`], checked by [`check_truth`] |
//! | `truth_paths.jsonl` | the true paths of every sweep, a link a line, beside samples |
//! | `estimated_paths.jsonl` | what path estimation and beam squint made of the samples, a sweep a line, where they were kept instead |
//! | `sweep-NNNN.sigmf-meta`, `.sigmf-data` | sample blocks of each sweep, when they were recorded ([`sweep_base`]) |
//! | `pilots-NNNN.sigmf-meta`, `.sigmf-data` | the pilots of each sweep, beside samples that have them ([`pilots_base`]) |
//! | `squint-NNNN.sigmf-meta`, `.sigmf-data` | the beam squint symbols after each sweep, beside samples ([`squint_base`]) |
//!
//! Numbers are written so that reading gives back the same bits, hence a recording that is read and written again has
//! the same bytes. A file that is cut short, longer or changed is refused with the reason.

mod arrivals;
mod damage;
mod estimated;
mod flight;
mod keeper;
mod read;
mod replayed;
mod thinned;
mod truth;
mod write;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::config::{EarthField, RadioFigures};
use crate::result_directory::Kind;
use crate::sensors::{KINDS, SensedFlight};
use crate::world::SceneConfig;

pub use damage::Damage;
pub use estimated::{Estimates, read_estimated, write_estimated};
pub use flight::RecordedFlight;
pub use keeper::{Keeper, write_paths};
pub use read::{Recording, read, read_with};
pub use replayed::Replayed;
pub(crate) use thinned::keep;
pub use thinned::{Span, Thinned, Thinning};
pub use truth::{check_truth, write_links};
pub use write::{check_order, write, write_events};

/// Value of `format` in `flight.json`.
const FORMAT: &str = "cslam-flight";
/// Value of `version` in `flight.json`: with a barometer, and without.
const VERSION: u32 = 3;
const VERSION_WITHOUT_BAROMETER: u32 = 2;
/// Name of the description.
const MANIFEST: &str = "flight.json";
/// What damage to the pilots is counted as.
const PILOTS: &str = "pilots";
/// Bytes of a record of `imu.bin`.
const IMU_RECORD_LEN: usize = 8 + cslam_firmware::icm42688::PACKET_LEN;
/// Files of the receiver's events, by the rank of the event.
const EVENT_FILES: [&str; KINDS] = [
    "imu.bin",
    "magnetometer.csv",
    "timing.csv",
    "sweeps.csv",
    "beacons.jsonl",
    "barometer.csv",
];
/// Rank of the barometer, the last; a recording without one has no file of it.
const BAROMETER: usize = KINDS - 1;
/// File of the order of arrival.
const ARRIVALS: &str = "arrivals.bin";
/// Files of the truth.
const TRUTH_FILES: [&str; 2] = ["truth.csv", "truth_paths.jsonl"];
/// First lines of the text files with columns, by the rank of the event; empty for the others.
const HEADERS: [&str; KINDS] = [
    "",
    "uav_time_ns,x,y,z",
    "uav_time_ns,clock_offset_s",
    "uav_time_ns,sweep",
    "",
    "uav_time_ns,pressure",
];

/// What a recording says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Always "cslam-flight".
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Scene that was flown in, or to compare with; absent when nobody has it as a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// What became of that scene first: where it was moved, and its surfaces. Absent: it is as its name or file says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_as: Option<SceneConfig>,
    /// Profile of the simulated world; absent when none was simulated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<String>,
    /// Seed of the flight and of its sensors; absent when none was simulated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Length of the flight, s.
    pub duration_s: f64,
    /// Time from sweep to sweep, s.
    pub sweep_period_s: f64,
    /// The radio, where it is not the default's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radio: Option<RadioFigures>,
    /// Where whoever set the GMT up says that its antenna stands at first, m, world frame. Absent: nobody says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gmt_setup_position_m: Option<[f64; 3]>,
    /// The earth's field there. Absent: the magnetometer is not used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub magnetic_field: Option<EarthField>,
    /// Height of the ground, m, world frame; absent: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_z_m: Option<f64>,
    /// IMU samples per second, Hz.
    pub imu_rate_hz: u32,
    /// Whether each sweep's sample blocks lie beside.
    pub samples: bool,
    /// Whether the pilots of each sweep lie beside its samples; absent: false, and files of pilots are not read.
    #[serde(default, skip_serializing_if = "is_false")]
    pub pilots: bool,
    /// Estimated paths that lie beside; absent: there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimated: Option<Estimates>,
    /// The order in which events arrived, [`Manifest::files`] by place; absent: that of their time stamps, every sweep once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrivals: Option<FileEntry>,
    /// The files of the receiver's events, in the order of [`Manifest::files`].
    pub files: Vec<FileEntry>,
}

impl Manifest {
    /// Of the first `sweeps` sweeps of a simulated flight; `scene` is a name or a file, where there is one to compare with. Without samples, the GMT where it stands and
    /// the earth's field as it is.
    pub fn of(scene: Option<&str>, world: Option<String>, flight: &SensedFlight, sweeps: u32) -> Self {
        let schedule = flight.plan().schedule();
        let duration_s = if sweeps < flight.plan().sweeps() {
            schedule.sweep_time_s(sweeps)
        } else {
            flight.plan().duration_s()
        };
        Self {
            format: FORMAT.into(),
            version: VERSION_WITHOUT_BAROMETER,
            scene: scene.map(Into::into),
            scene_as: None,
            world,
            seed: Some(flight.seed()),
            duration_s,
            sweep_period_s: schedule.sweep_period_s,
            radio: None,
            gmt_setup_position_m: Some(flight.sweep_truth(0).gmt_position_m.into()),
            magnetic_field: Some(EarthField::from(&flight.config().magnetometer)),
            ground_z_m: None,
            imu_rate_hz: flight.config().imu.rate_hz,
            samples: false,
            pilots: false,
            estimated: None,
            arrivals: flight
                .config()
                .faults
                .reorders()
                .then(|| arrivals::entry(ARRIVALS, 0, &[])),
            files: Vec::new(),
        }
    }
}

/// Whether a key that is absent says the same.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
fn is_false(said: &bool) -> bool {
    !said
}

/// Names of the files of events of a version; `None` for one that nobody knows.
fn event_files(version: u32) -> Option<&'static [&'static str]> {
    match version {
        VERSION => Some(&EVENT_FILES),
        VERSION_WITHOUT_BAROMETER => Some(&EVENT_FILES[..BAROMETER]),
        _ => None,
    }
}

/// One file of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// Name within the directory.
    pub name: String,
    /// Number of records.
    pub records: u64,
    /// Length, bytes.
    pub bytes: u64,
    /// CRC-32 (ISO-HDLC) of the content.
    pub crc32: u32,
}

/// How a directory with a recording is known again: by the format in its description. A damaged one, whose description is cut
/// short, is not.
pub const KIND: Kind = Kind {
    what: "recording",
    description: MANIFEST,
    describes: |text| serde_json::from_str::<Manifest>(text).is_ok_and(|manifest| manifest.format == FORMAT),
    writes: is_name,
};

/// Whether a recording has files of this name.
fn is_name(name: &str) -> bool {
    let samples = |prefix: &str| {
        let number = name.strip_prefix(prefix).and_then(|rest| rest.split_once('.'));
        number.is_some_and(|(number, extension)| {
            number.len() >= 4
                && number.bytes().all(|digit| digit.is_ascii_digit())
                && ["sigmf-meta", "sigmf-data"].contains(&extension)
        })
    };
    name == MANIFEST
        || EVENT_FILES.contains(&name)
        || TRUTH_FILES.contains(&name)
        || name == estimated::ESTIMATED
        || name == ARRIVALS
        || samples("sweep-")
        || samples("pilots-")
        || samples("squint-")
}

/// Where the sample blocks of a sweep lie: the name that [`crate::sigmf`] appends `.sigmf-meta` and `.sigmf-data` to.
pub fn sweep_base(directory: &Path, sweep: u32) -> PathBuf {
    directory.join(format!("sweep-{sweep:04}"))
}

/// Where the pilots of a sweep lie, as [`sweep_base`].
pub fn pilots_base(directory: &Path, sweep: u32) -> PathBuf {
    directory.join(format!("pilots-{sweep:04}"))
}

/// Where the beam squint symbols that follow a sweep lie, as [`sweep_base`].
pub fn squint_base(directory: &Path, sweep: u32) -> PathBuf {
    directory.join(format!("squint-{sweep:04}"))
}

/// CRC-32 as files, configurations and executables are told apart by it.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(bytes)
}

#[cfg(test)]
mod tests;
