//! Keeps what path estimation makes of a flight while it is flown, so that the rest of the receiver can be flown again without it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use cslam_firmware::app::{AppConfig, Estimated};

use super::{FileEntry, Replayed, write_estimated, write_links};
use crate::flight_log::PoseTruth;
use crate::input::InputError;
use crate::paths::Link;
use crate::raw_flight::{Given, Source, Swept};
use crate::sensors::Stamped;

/// A source that notes what it gives. Beside it, the flight tells what became of it ([`Self::swept`]).
#[derive(Debug)]
pub struct Keeper<'s, S> {
    source: &'s S,
    sweeps: Mutex<BTreeMap<u32, (Estimated, Option<Link>)>>,
}

impl<'s, S: Source> Keeper<'s, S> {
    /// Of a source.
    pub fn new(source: &'s S) -> Self {
        Self {
            source,
            sweeps: Mutex::default(),
        }
    }

    /// Notes the paths of a sweep that has ended.
    pub fn swept(&self, swept: &Swept<'_>) {
        if let Some((kept, _)) = self.sweeps().get_mut(&swept.report.sweep) {
            kept.paths = swept.paths.iter().copied().collect();
            kept.sighted = swept.sighted.map(|path| (path, swept.report.bearing));
        }
    }

    /// The paths of sweeps 0, 1, 2 ... that were flown.
    ///
    /// # Errors
    /// [`InputError`] naming a sweep that was left out.
    pub fn estimated(&self) -> Result<Vec<Estimated>, InputError> {
        let kept = self.sweeps();
        (0..)
            .zip(kept.iter())
            .map(|(expected, (sweep, (estimated, _)))| {
                if *sweep == expected {
                    Ok(estimated.clone())
                } else {
                    let message = format!("sweep {expected} was not flown: the paths cannot be kept");
                    Err(InputError::new(message))
                }
            })
            .collect()
    }

    /// The same flight from these paths, without those of the sweeps in `silent`.
    pub fn replayed(&self, silent: BTreeSet<u32>) -> Replayed<'s, S> {
        let kept = self.sweeps();
        Replayed {
            source: self.source,
            estimated: kept
                .iter()
                .map(|(sweep, (estimated, _))| (*sweep, estimated.clone()))
                .collect(),
            silent,
        }
    }

    /// Writes the paths of all sweeps that were flown, as [`write_paths`] does.
    ///
    /// # Errors
    /// [`InputError`] naming a sweep that was left out or cannot be kept, or a file that cannot be written.
    pub fn write(&self, directory: &Path) -> Result<(FileEntry, u32), InputError> {
        let estimated = self.estimated()?;
        let links: Vec<Link> = self
            .sweeps()
            .values()
            .filter_map(|(_, link)| link.clone())
            .collect();
        write_paths(directory, &estimated, &links)
    }
}

/// Writes the estimated paths of sweeps 0, 1, 2 ... into a directory, and their true paths where all of these are known; what the recording is to
/// say of the file, and how many sweeps there are.
///
/// # Errors
/// [`InputError`] naming a sweep that cannot be kept, or a file that cannot be written.
pub fn write_paths(
    directory: &Path,
    estimated: &[Estimated],
    links: &[Link],
) -> Result<(FileEntry, u32), InputError> {
    // A link too few, and the others would be those of other sweeps.
    if links.len() == estimated.len() {
        write_links(directory, links)?;
    }
    let sweeps = u32::try_from(estimated.len()).unwrap_or(u32::MAX);
    Ok((write_estimated(directory, estimated)?, sweeps))
}

impl<S> Keeper<'_, S> {
    // What panics here makes nothing wrong that others would read.
    fn sweeps(&self) -> MutexGuard<'_, BTreeMap<u32, (Estimated, Option<Link>)>> {
        self.sweeps.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How many blocks a sweep was given, without what was made of them; or what was kept of it.
fn blocks(given: &Given) -> Estimated {
    if let Some(estimated) = &given.estimated {
        return estimated.clone();
    }
    let count = |blocks: usize| u16::try_from(blocks).unwrap_or(u16::MAX);
    let last = AppConfig::default().squint_symbols;
    let squint = &given.squint.blocks;
    Estimated {
        beams: count(given.beams.blocks.len()),
        pilots: count(given.pilots.blocks.len()),
        squint_symbols: count(squint.len()),
        whole: squint.iter().any(|block| block.beam.saturating_add(1) >= last),
        ..Estimated::default()
    }
}

impl<S: Source> Source for Keeper<'_, S> {
    fn sweeps(&self) -> u32 {
        self.source.sweeps()
    }

    fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
        self.source.events()
    }

    fn makers(&self) -> usize {
        self.source.makers()
    }

    fn sweep(&self, sweep: u32) -> Result<Given, InputError> {
        let given = self.source.sweep(sweep)?;
        let link = given.truth.as_ref().map(|(_, link)| link.clone());
        self.sweeps().insert(sweep, (blocks(&given), link));
        Ok(given)
    }

    fn truth(&self, uav_time_ns: u64) -> Option<PoseTruth> {
        self.source.truth(uav_time_ns)
    }
}
