//! Writing a recording.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Context;

use super::{EVENT_FILES, FORMAT, FileEntry, HEADERS, MANIFEST, Manifest, VERSION, crc32};
use crate::input::InputError;
use crate::sensors::{Event, SensedFlight, Stamped, Truth};

/// Columns of `truth.csv`. Quaternion Hamilton, body to world; clock: UAV less GMT.
const TRUTH_HEADER: &str = "time_s,sweep,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s,qw,qx,qy,qz,\
                            rate_x_rad_per_s,rate_y_rad_per_s,rate_z_rad_per_s,gmt_x_m,gmt_y_m,gmt_z_m,\
                            clock_offset_s,clock_drift";
/// Truth lines a second, besides those at sweeps.
const TRUTH_RATE_HZ: u32 = 100;

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
    put(directory, "truth.csv", truth(flight).as_bytes())?;
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

/// The text of `truth.csv`: a line every 10 ms and one at each sweep, in order of time. `sweep` is empty between.
fn truth(flight: &SensedFlight) -> String {
    let schedule = flight.plan().schedule();
    let ticks = (flight.plan().duration_s() * f64::from(TRUTH_RATE_HZ)) as u32;
    let mut instants: Vec<(f64, Option<u32>)> = (0..=ticks)
        .map(|tick| (f64::from(tick) / f64::from(TRUTH_RATE_HZ), None))
        .chain((0..flight.plan().sweeps()).map(|sweep| (schedule.sweep_time_s(sweep), Some(sweep))))
        .collect();
    instants.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut text = format!("{TRUTH_HEADER}\n");
    for (time_s, sweep) in instants {
        let truth = flight.truth(time_s);
        let uav = &truth.uav;
        text += &format!("{time_s},{}", sweep.map_or(String::new(), |s| s.to_string()));
        let numbers = uav
            .position_m
            .iter()
            .chain(&uav.velocity_m_per_s)
            .copied()
            .chain(uav.quaternion_wb())
            .chain(uav.rate_rad_per_s.iter().copied())
            .chain(truth.gmt_position_m.iter().copied())
            .chain([truth.clock_offset_s, truth.clock_drift]);
        for number in numbers {
            text += &format!(",{number:e}");
        }
        text.push('\n');
    }
    text
}
