//! Writing a recording.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Context;

use super::arrivals::entry;
use super::truth::{TRUTH, truth};
use super::{
    ARRIVALS, BAROMETER, EVENT_FILES, HEADERS, MANIFEST, Manifest, VERSION, VERSION_WITHOUT_BAROMETER,
};
use crate::input::InputError;
use crate::sensors::{Event, KINDS, SensedFlight, Stamped};

/// Records the first `sweeps` sweeps of a flight into `directory`, which is created. `manifest` describes it; when it speaks of
/// samples, the caller writes them to [`super::sweep_base`] and [`super::squint_base`], and those of pilots that it speaks of to [`super::pilots_base`].
///
/// # Errors
/// When a file cannot be written, naming it.
pub fn write(
    directory: &Path,
    manifest: Manifest,
    flight: &SensedFlight,
    sweeps: u32,
) -> anyhow::Result<Manifest> {
    std::fs::create_dir_all(directory)
        .with_context(|| format!("{} cannot be created", directory.display()))?;
    put(
        directory,
        TRUTH,
        truth(flight, sweeps, manifest.duration_s).as_bytes(),
    )?;
    // What comes after the last sweep was heard goes with the next one.
    let events = flight
        .events()
        .take_while(|stamped| !matches!(stamped.event, Event::Sweep { sweep } if sweep >= sweeps));
    write_events(directory, manifest, events)
}

/// Whether every sweep of a flight comes once, in its turn: what is kept of it is told by its number.
///
/// # Errors
/// [`InputError`] when faults of its configuration bring events out of order, or sweeps twice or not at all.
pub fn check_order(flight: &SensedFlight) -> Result<(), InputError> {
    if flight.config().faults.reorders() {
        return Err(InputError::new(
            "world.sensors.faults.transport: with late events, and with lost or doubled sweeps, no paths are kept: these are a sweep a line, \
             every sweep once (`cslam record` records the samples of such a flight)",
        ));
    }
    Ok(())
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
    let mut records = [0u64; KINDS];
    let mut order = Vec::new();
    for Stamped { uav_time_ns, event } in events {
        let rank = usize::from(event.rank());
        order.push(event.rank());
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
            Event::Barometer(sample) => writeln!(text, "{uav_time_ns},{}", sample.pressure)?,
            Event::Sweep { sweep } => writeln!(text, "{uav_time_ns},{sweep}")?,
            Event::Beacon(beacon) => {
                let line = serde_json::to_string(&super::read::BeaconLine { uav_time_ns, beacon })?;
                writeln!(text, "{line}")?;
            }
        }
    }
    manifest.files.clear();
    if records[BAROMETER] > 0 {
        manifest.version = VERSION;
    }
    for (rank, name) in EVENT_FILES.into_iter().enumerate() {
        if rank == BAROMETER && manifest.version == VERSION_WITHOUT_BAROMETER {
            continue;
        }
        let bytes = if rank == 0 {
            imu.as_slice()
        } else {
            texts[rank].as_bytes()
        };
        put(directory, name, bytes)?;
        manifest.files.push(entry(name, records[rank], bytes));
    }
    if manifest.arrivals.is_some() {
        put(directory, ARRIVALS, &order)?;
        manifest.arrivals = Some(entry(ARRIVALS, order.len() as u64, &order));
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
