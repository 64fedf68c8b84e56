//! The paths of many flights, kept for receivers that are changed behind path estimation.
//!
//! A flight lies there by its simulated world, scene, seed, and by who estimated its paths: whatever else its receiver is.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::campaign::Flight;
use crate::commands::fly::keep::{check_receiver, world_crc32};
use crate::commands::fly::methods::{departures, estimator};
use crate::commands::fly::raw::Site;
use crate::commands::fly::recorded::described;
use crate::config::{Config, ReceiverConfig};
use crate::flight_log::Header;
use crate::input::InputError;
use crate::raw_flight::Source;
use crate::recording::{Damage, RecordedFlight};

/// Where paths are kept.
pub(crate) struct Kept<'a> {
    directory: &'a Path,
    /// One for each simulated flight: what one receiver makes of it, the next need not make again.
    flights: Mutex<BTreeMap<String, Arc<Mutex<()>>>>,
}

impl<'a> Kept<'a> {
    /// In a directory, which need not be there yet.
    pub(crate) fn new(directory: &'a Path) -> Self {
        Self {
            directory,
            flights: Mutex::default(),
        }
    }

    /// What a thread must hold that flies through a world, so that no other flies through the same one meanwhile.
    pub(crate) fn of_one(&self, config: &Config, scene: &str, seed: u64) -> anyhow::Result<Arc<Mutex<()>>> {
        let flight = format!("{:08x} {scene} {seed}", world_crc32(config)?);
        let mut flights = self.flights.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(Arc::clone(flights.entry(flight).or_default()))
    }

    /// Where the paths of a flight are, or will be.
    pub(crate) fn place(
        &self,
        world: &Config,
        told: &ReceiverConfig,
        flight: &Flight,
    ) -> anyhow::Result<PathBuf> {
        // The name of a flight's report, with what counts here in place of world and mode.
        let name = Flight {
            world: format!("{}-{:08x}", world.world.profile.name(), world_crc32(world)?),
            mode: format!("{}-{}", estimator(told).name(), departures(told)?.name()),
            ..flight.clone()
        };
        let name = name.file_name();
        Ok(self.directory.join(name.strip_suffix(".json").unwrap_or(&name)))
    }
}

/// Whether the paths of a flight are there.
pub(crate) fn is_kept(place: &Path) -> bool {
    place.join("flight.json").is_file()
}

/// A flight whose paths are there, what the head of its log says, and what is known of the place.
///
/// # Errors
/// [`InputError`] naming what is damaged, or not what the flight asks for.
pub(crate) fn open(
    place: &Path,
    world: &Config,
    told: &ReceiverConfig,
    flight: &Flight,
    steps: Option<usize>,
) -> anyhow::Result<(RecordedFlight, Header, Site)> {
    let kept = RecordedFlight::open(place, Damage::refused())?;
    let manifest = kept.manifest();
    let wrong = |message: String| InputError::in_file(place, message);
    let Some(estimates) = manifest.estimated.as_ref().filter(|_| kept.is_of_paths()) else {
        return Err(wrong("holds samples, expected the paths of a flight".into()).into());
    };
    check_receiver(estimates, told).map_err(|error| error.within(place))?;
    if estimates.world_crc32 != world_crc32(world)?
        || manifest.scene.as_ref() != Some(&flight.scene)
        || manifest.seed != Some(flight.seed)
    {
        return Err(wrong(format!("holds another flight, expected {}", flight.text())).into());
    }
    let sweeps = usize::try_from(kept.sweeps())?;
    let is_whole = manifest.duration_s >= world.world.flight.duration_s;
    if !is_whole && steps.is_none_or(|steps| sweeps < steps) {
        let expected = steps.map_or("all".to_owned(), |steps| steps.to_string());
        return Err(wrong(format!(
            "holds {sweeps} sweeps of the flight, expected {expected}"
        ))
        .into());
    }
    let planned = sweeps.min(steps.unwrap_or(usize::MAX));
    let (header, site) = described(manifest, told, flight.scene.clone(), planned);
    Ok((kept, header, site))
}
