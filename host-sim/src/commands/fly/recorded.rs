//! A flight over a recording: what was recorded goes to the receiver that flies.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::raw::{self, Hooks, Site};
use super::{Args, Flown, keep};
use crate::config::{Config, RadioFigures, ReceiverConfig};
use crate::flight_log::Header;
use crate::input::InputError;
use crate::progress;
use crate::raw_flight::{Source, Swept, UNHEARD};
use crate::recording::{Damage, Manifest, RecordedFlight, Thinned};
use crate::scene::Scene;

/// What the log counts of paths that were left out on purpose.
const LINES_OF_SIGHT_CUT: &str = "lines of sight left out";
const PATHS_CUT: &str = "paths left out by --path-share";

/// Flies over the recording in a directory until `interrupted`. `sent` gets what goes to the ground as it goes, with the UAV's time,
/// ns.
pub(super) fn run(
    args: &Args,
    config: &Config,
    directory: &Path,
    interrupted: &AtomicBool,
    sent: impl FnMut(u64, &[u8]),
) -> anyhow::Result<Flown> {
    args.refuse_no_steps()?;
    let damage = if args.keep_going {
        Damage::counted()
    } else {
        Damage::refused()
    };
    let flight = RecordedFlight::open(directory, damage)?;
    let thinning = args.thinning.of(flight.is_of_paths())?;
    let out = super::result_directory(args)?;
    let manifest = flight.manifest();
    if let Some(estimates) = manifest.estimated.as_ref().filter(|_| flight.is_of_paths()) {
        keep::check_receiver(estimates, &config.receiver).map_err(|error| error.within(directory))?;
    }
    check_radio(manifest, &config.radio).map_err(|error| error.within(directory))?;
    let scene = scene(args, manifest)?;
    let planned = args.planned(flight.sweeps())?;
    let named = named(args, manifest, directory);
    let (header, site) = described(manifest, &config.receiver, named, planned);
    let thinned = Thinned::new(&flight, thinning);
    let bar = progress::bar(planned as u64, "flying");
    let hooks = Hooks {
        interrupted,
        swept: |_: &Swept<'_>| bar.inc(1),
        sent,
    };
    let mut logs = raw::fly(&config.receiver, header, &site, &thinned, args.smooth, hooks)?;
    bar.finish_and_clear();
    let log = &mut logs.log;
    let damage = flight.damage();
    for message in damage.messages() {
        progress::note(format_args!("left out: {message}"));
    }
    for (part, records) in damage.gaps() {
        log.counters
            .insert(format!("recording damaged: {part}"), *records);
    }
    for (what, paths) in [LINES_OF_SIGHT_CUT, PATHS_CUT]
        .into_iter()
        .zip(thinned.left_out())
    {
        if paths > 0 {
            log.counters.insert(what.to_owned(), paths);
            progress::note(format_args!("{what}: {paths}"));
        }
    }
    if let Some(sweeps) = log.counters.get(UNHEARD) {
        progress::note(format_args!("{sweeps} sweeps {UNHEARD}"));
    }
    let imu = args.imu(&flight, log);
    Ok(Flown {
        logs,
        scene,
        imu,
        out,
    })
}

/// Refuses a configuration that says another radio than was recorded: what a recording says of its radio counts.
fn check_radio(manifest: &Manifest, told: &RadioFigures) -> Result<(), InputError> {
    let recorded = manifest.radio.unwrap_or_default();
    match told.unless_default() {
        Some(told) if told != recorded => Err(InputError::new(
            "[radio] of the configuration is another than the recording's, which counts: expected none, or the same",
        )),
        _ => Ok(()),
    }
}

/// The head of the log of a recorded flight, and what is known of the place.
pub(crate) fn described(
    manifest: &Manifest,
    told: &ReceiverConfig,
    scene: String,
    planned_sweeps: usize,
) -> (Header, Site) {
    let radio = manifest.radio.unwrap_or_default().config();
    let header = Header {
        mode: told.mode.name().into(),
        scene,
        world: manifest.world.clone(),
        // The report's key is a count: what was not drawn has none.
        seed: manifest.seed.unwrap_or(0),
        planned_sweeps,
        sweep_period_s: manifest.sweep_period_s,
        delay_cycle_m: Some(radio.waveform.delay_period().length_m()),
    };
    let site = Site {
        radio,
        magnetic_field: manifest.magnetic_field,
        gmt_m: manifest.gmt_setup_position_m,
        ground_z_m: manifest.ground_z_m.unwrap_or(0.0),
    };
    (header, site)
}

/// What the report calls the scene: as the recording says, else the one that was asked for, else the recording itself.
fn named(args: &Args, manifest: &Manifest, directory: &Path) -> String {
    let scene = manifest.scene.as_ref().or(args.scene.as_ref()).cloned();
    scene.unwrap_or_else(|| directory.display().to_string())
}

/// The scene to compare the map with: the one that was asked for, or that of the recording, if it has one and it is still there. Either stands, and is
/// uneven, as the recorded one.
fn scene(args: &Args, manifest: &Manifest) -> Result<Option<Scene>, InputError> {
    let told = manifest.scene_as.unwrap_or_default();
    let load = |name: &str| told.applied(Scene::load(name)?);
    if let Some(name) = &args.scene {
        return load(name).map(Some);
    }
    let Some(recorded) = &manifest.scene else {
        return Ok(None);
    };
    match load(recorded) {
        Ok(scene) => Ok(Some(scene)),
        Err(error) => {
            progress::note(format_args!(
                "the map is not compared with surfaces: {error}; --scene names another"
            ));
            Ok(None)
        }
    }
}
