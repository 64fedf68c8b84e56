//! The paths of a flight, kept so that the receiver behind path estimation can be flown again.

use std::path::Path;

use super::methods;
use crate::commands::record;
use crate::config::{Config, DepartureChoice, ReceiverConfig};
use crate::input::InputError;
use crate::recording::{self, Estimates, FileEntry, Manifest};
use crate::result_directory::ResultDirectory;
use crate::world::World;

/// Makes room for the paths of a flight through a world. Before the flight: a directory that cannot be used must not cost one.
pub(crate) fn open(directory: &Path, world: &World<'_>) -> Result<ResultDirectory, InputError> {
    recording::check_order(world.flight())?;
    ResultDirectory::open(directory, recording::KIND)
}

/// Writes a whole flight through a world about its paths, which lie in the directory already: what the recording is to say of their file, and
/// how many sweeps there are.
pub(crate) fn write(
    directory: ResultDirectory,
    (file, sweeps): (FileEntry, u32),
    config: &Config,
    scene: &str,
    world: &World<'_>,
) -> anyhow::Result<()> {
    let manifest = Manifest {
        estimated: Some(Estimates {
            estimator: methods::estimator(&config.receiver),
            departures: methods::departures(&config.receiver)?,
            world_crc32: world_crc32(config)?,
            file,
        }),
        ..record::manifest(config, (Some(scene), config.world.scene), world, sweeps)
    };
    recording::write(directory.path(), manifest, world.flight(), sweeps)?;
    directory.commit()
}

/// What tells the configuration of one simulated world and of its radio from that of another.
pub(crate) fn world_crc32(config: &Config) -> anyhow::Result<u32> {
    let mut text = toml::to_string(&config.world)?;
    if let Some(radio) = config.radio.unless_default() {
        text += &toml::to_string(&radio)?;
    }
    Ok(recording::crc32(text.as_bytes()))
}

/// Whether a receiver can fly paths that were kept.
///
/// # Errors
/// [`InputError`] when it estimates paths, or reads bearings, in another way: that wants samples.
pub(crate) fn check_receiver(kept: &Estimates, told: &ReceiverConfig) -> Result<(), InputError> {
    let estimator = methods::estimator(told);
    if kept.estimator != estimator {
        return Err(InputError::new(format!(
            "its paths were estimated by {}, not by {}: expected samples, or --estimator {}",
            kept.estimator.name(),
            estimator.name(),
            kept.estimator.name(),
        )));
    }
    let departures = methods::departures(told).map_err(|error| InputError::new(error.to_string()))?;
    // A receiver without beam squint needs no bearing.
    if kept.departures != departures && departures != DepartureChoice::Beams {
        return Err(InputError::new(format!(
            "its bearings were read by {}, not by {}: expected samples, or --departures {}",
            kept.departures.name(),
            departures.name(),
            kept.departures.name(),
        )));
    }
    Ok(())
}
