//! The flights of a campaign: through a simulated world, or from paths that were kept.

use std::path::{Path, PathBuf};
use std::sync::PoisonError;
use std::sync::atomic::AtomicBool;
use std::thread;

use super::{Args, Together};
use crate::campaign::Flight;
use crate::commands::fly::keep;
use crate::commands::fly::raw::{Hooks, Site, described, fly};
use crate::commands::kept::{self, Kept};
use crate::config::{Config, ReceiverConfig};
use crate::evaluation::evaluate;
use crate::flight_log::Header;
use crate::link_state::flight_samples::{Collector, Origin};
use crate::progress;
use crate::raw_flight::{Shared, Source, Swept, UNHEARD};
use crate::recording::Keeper;
use crate::report::Report;
use crate::scene::Scene;
use crate::world::World;

/// Flies the receivers of all modes through one world, or from its paths where these are kept, and hands on each report: `None` when it
/// was interrupted, the reason when it could not be flown.
pub(super) fn flown(
    args: &Args,
    kept: Option<&Kept<'_>>,
    flights: &Together<'_>,
    interrupted: &AtomicBool,
    done: impl Fn(&Flight, Result<Option<serde_json::Value>, String>) + Sync,
) {
    let config = &flights.world.config;
    // What is still to be reported when there is no world.
    let mut left: Vec<&Flight> = flights.modes.iter().map(|(flight, _)| flight).collect();
    let mut in_world = || -> anyhow::Result<()> {
        let scene = config.world.scene(&flights.scene)?;
        let of_one = kept
            .map(|kept| kept.of_one(config, &flights.scene, flights.seed))
            .transpose()?;
        let _alone = of_one
            .as_ref()
            .map(|one| one.lock().unwrap_or_else(PoisonError::into_inner));
        let mut receivers: Vec<Receiver> = Vec::new();
        for (flight, mode) in &flights.modes {
            let mut told = config.receiver.clone();
            told.mode = *mode;
            let place = kept.map(|kept| kept.place(config, &told, flight)).transpose()?;
            match place {
                Some(place) if kept::is_kept(&place) => {
                    let report = from_paths(args, config, &told, (&scene, flight), &place, interrupted);
                    done(flight, report.map_err(|error| format!("{error:#}")));
                    left.retain(|other| *other != flight);
                }
                // One of those that have the same paths keeps them.
                place => receivers.push(Receiver {
                    flight,
                    told,
                    keep: place
                        .filter(|place| receivers.iter().all(|other| other.keep.as_ref() != Some(place))),
                }),
            }
        }
        if receivers.is_empty() {
            return Ok(());
        }
        let world = config.world_in(&scene, flights.seed)?;
        let shared = Shared::new(&world);
        let listeners = shared.listeners(receivers.len());
        left.clear();
        thread::scope(|scope| {
            for (listener, receiver) in listeners.into_iter().zip(receivers) {
                let (world, scene, done) = (&world, &scene, &done);
                scope.spawn(move || {
                    let report = heard(args, config, &receiver, scene, world, &listener, interrupted);
                    done(receiver.flight, report.map_err(|error| format!("{error:#}")));
                });
            }
        });
        Ok(())
    };
    if let Err(error) = in_world() {
        for flight in left {
            done(flight, Err(format!("{error:#}")));
        }
    }
}

/// A receiver of a flight through a world.
struct Receiver<'a> {
    flight: &'a Flight,
    told: ReceiverConfig,
    /// Where to keep what its path estimation makes of the flight.
    keep: Option<PathBuf>,
}

/// What one receiver makes of a world that others may hear too.
fn heard(
    args: &Args,
    config: &Config,
    receiver: &Receiver<'_>,
    scene: &Scene,
    world: &World<'_>,
    listener: &impl Source,
    interrupted: &AtomicBool,
) -> anyhow::Result<Option<serde_json::Value>> {
    let planned = usize::try_from(world.sweeps())?.min(args.steps.unwrap_or(usize::MAX));
    let Receiver { flight, told, keep } = receiver;
    let described = described(told, &flight.scene, world, flight.seed, planned)?;
    let keep = keep
        .as_deref()
        .map(|place| keep::open(place, world))
        .transpose()?;
    let Some(directory) = keep else {
        return reported(
            args,
            told,
            described,
            (scene, flight),
            listener,
            interrupted,
            |_| {},
        );
    };
    let keeper = Keeper::new(listener);
    let report = reported(
        args,
        told,
        described,
        (scene, flight),
        &keeper,
        interrupted,
        |swept| keeper.swept(swept),
    )?;
    if report.is_some() {
        let config = Config {
            receiver: told.clone(),
            ..config.clone()
        };
        let paths = keeper.write(directory.path())?;
        keep::write(directory, paths, &config, &flight.scene, world)?;
    }
    Ok(report)
}

/// What a receiver makes of a flight whose paths are kept.
fn from_paths(
    args: &Args,
    config: &Config,
    told: &ReceiverConfig,
    (scene, flight): (&Scene, &Flight),
    place: &Path,
    interrupted: &AtomicBool,
) -> anyhow::Result<Option<serde_json::Value>> {
    let (source, header, site) = kept::open(place, config, told, flight, args.steps)?;
    let report = reported(
        args,
        told,
        (header, site),
        (scene, flight),
        &source,
        interrupted,
        |_| {},
    )?;
    if let Some(sweeps) = report.as_ref().and_then(|report| report["counters"].get(UNHEARD)) {
        progress::note(format_args!("{}: {sweeps} sweeps {UNHEARD}", flight.text()));
    }
    Ok(report)
}

/// The report of a flight over a source; `None` when it was interrupted.
fn reported(
    args: &Args,
    told: &ReceiverConfig,
    (header, site): (Header, Site),
    (scene, flight): (&Scene, &Flight),
    source: &impl Source,
    interrupted: &AtomicBool,
    mut swept: impl FnMut(&Swept<'_>),
) -> anyhow::Result<Option<serde_json::Value>> {
    let start = std::time::Instant::now();
    let mut inputs = Collector::default();
    let hooks = Hooks {
        interrupted,
        swept: |ended: &Swept<'_>| {
            if args.samples.is_some() {
                inputs.sweep(ended.report);
            }
            swept(ended);
        },
        sent: |_: u64, _: &[u8]| {},
    };
    let logs = fly(told, header, &site, source, args.smooth, hooks)?;
    let (mut log, smoothed) = (logs.log, logs.smoothed);
    if log.interrupted() {
        return Ok(None);
    }
    let evaluation = evaluate(&mut log, Some(scene));
    if let Some(directory) = &args.samples {
        let name = flight.file_name();
        let place = directory.join(name.strip_suffix(".json").unwrap_or(&name));
        let origin = Origin::new(&flight.scene, flight.seed, &flight.world);
        inputs.samples(&log).write(&place, &origin)?;
    }
    let mut report = Report::new(&log, &evaluation, start.elapsed().as_secs_f64());
    report.smoothed = smoothed.map(|mut smoothed| evaluate(&mut smoothed, Some(scene)).into());
    Ok(Some(serde_json::to_value(&report)?))
}
