//! Writing a recording.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Context;

use super::truth::{TRUTH, truth};
use super::{EVENT_FILES, FORMAT, FileEntry, HEADERS, MANIFEST, Manifest, VERSION, crc32};
use crate::input::InputError;
use crate::sensors::{Event, SensedFlight, Stamped, Truth};

/// Records a flight into `directory`, which is created. `scene` is a name or file for the description. `samples` is
/// called for every sweep with its number, to write its sample blocks to [`super::sweep_base`]; it returns whether it
/// did, and must do so for all sweeps or for none.
///
/// # Errors
/// When a file cannot be written, naming it, when the flight has late events, and whatever `samples` returns.
pub fn write(
    directory: &Path,
    scene: &str,
    flight: &SensedFlight,
    mut samples: impl FnMut(u32, &Truth) -> anyhow::Result<bool>,
) -> anyhow::Result<Manifest> {
    if flight.config().faults.reorders() {
        let message =
            "faults.transport: late events cannot be recorded, a recording is in the order of time stamps";
        return Err(InputError::new(message).into());
    }
    std::fs::create_dir_all(directory)
        .with_context(|| format!("{} cannot be created", directory.display()))?;
    let mut with_samples = 0;
    for sweep in 0..flight.plan().sweeps() {
        with_samples += u32::from(samples(sweep, &flight.sweep_truth(sweep))?);
    }
    if with_samples != 0 && with_samples != flight.plan().sweeps() {
        anyhow::bail!(
            "samples of {with_samples} of {} sweeps were written",
            flight.plan().sweeps()
        );
    }
    put(directory, TRUTH, truth(flight).as_bytes())?;
    let manifest = Manifest {
        format: FORMAT.into(),
        version: VERSION,
        scene: scene.into(),
        seed: flight.seed(),
        duration_s: flight.plan().duration_s(),
        imu_rate_hz: flight.config().imu.rate_hz,
        samples: with_samples > 0,
        files: Vec::new(),
    };
    write_events(directory, manifest, flight.events())
}

/// Writes the event files and the description into an existing directory; the entries of `manifest.files` are made
/// here. The description comes last: a recording that was interrupted has none.
///
/// # Errors
/// When a file cannot be written, naming it.
pub fn write_events(
    directory: &Path,
    mut manifest: Manifest,
    events: impl IntoIterator<Item = Stamped>,
) -> anyhow::Result<Manifest> {
    let mut imu = Vec::new();
    let mut texts = HEADERS.map(|header| {
        if header.is_empty() {
            String::new()
        } else {
            format!("{header}\n")
        }
    });
    let mut records = [0u64; 5];
    for Stamped { uav_time_ns, event } in events {
        let rank = usize::from(event.rank());
        records[rank] += 1;
        let text = &mut texts[rank];
        match event {
            Event::Imu(sample) => {
                imu.extend_from_slice(&uav_time_ns.to_le_bytes());
                imu.extend_from_slice(&sample.to_packet());
            }
            Event::Magnetometer(sample) => {
                let [x, y, z] = sample.field;
                writeln!(text, "{uav_time_ns},{x},{y},{z}")?;
            }
            Event::Timing(sample) => writeln!(text, "{uav_time_ns},{:e}", sample.clock_offset_s)?,
            Event::Sweep { sweep } => writeln!(text, "{uav_time_ns},{sweep}")?,
            Event::Beacon(beacon) => {
                let line = serde_json::to_string(&super::read::BeaconLine { uav_time_ns, beacon })?;
                writeln!(text, "{line}")?;
            }
        }
    }
    manifest.files.clear();
    for (rank, name) in EVENT_FILES.into_iter().enumerate() {
        let bytes = if rank == 0 {
            imu.as_slice()
        } else {
            texts[rank].as_bytes()
        };
        put(directory, name, bytes)?;
        manifest.files.push(FileEntry {
            name: name.into(),
            records: records[rank],
            bytes: bytes.len() as u64,
            crc32: crc32(bytes),
        });
    }
    let mut text = serde_json::to_string_pretty(&manifest)?;
    text.push('\n');
    put(directory, MANIFEST, text.as_bytes())?;
    Ok(manifest)
}

fn put(directory: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let file = directory.join(name);
    std::fs::write(&file, bytes).with_context(|| format!("{} cannot be written", file.display()))
}
