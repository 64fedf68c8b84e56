//! A recording as a flight: what it holds goes to the receiver as it went when it was recorded.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use cslam_firmware::app::Estimated;

use super::truth::{TRUTH_PATHS, TruthTrack};
use super::{
    Damage, Manifest, PILOTS, Recording, pilots_base, read_estimated, read_with, squint_base, sweep_base,
};
use crate::channel::Sweep;
use crate::flight_log::PoseTruth;
use crate::input::InputError;
use crate::paths::{self, Link};
use crate::raw_flight::{Given, Source};
use crate::sensors::{Event, Stamped};
use crate::sigmf::{self, Codebook};

/// A recording with samples or estimated paths, ready to be flown. Where both are there, samples are.
#[derive(Debug)]
pub struct RecordedFlight {
    directory: PathBuf,
    recording: Recording,
    /// When each sweep begins by the UAV's clock, ns; without those whose beginning is not recorded.
    starts_ns: BTreeMap<u32, u64>,
    truth: Option<TruthTrack>,
    /// The true paths, a link a sweep; empty when nobody knows.
    links: Vec<Link>,
    /// The estimated paths of sweeps 0, 1, 2 ...; `None` where samples are flown.
    estimated: Option<Vec<Estimated>>,
    damage: Mutex<Damage>,
}

impl RecordedFlight {
    /// Reads all but the samples, which are read as they are flown.
    ///
    /// # Errors
    /// [`InputError`] naming the file and the place of what is missing or damaged, unless `damage` is to be counted; always when
    /// the description of the recording cannot be read, or says that there are neither samples nor estimated paths.
    pub fn open(directory: &Path, mut damage: Damage) -> Result<Self, InputError> {
        let recording = read_with(directory, &mut damage)?;
        let estimated = if recording.manifest().samples {
            None
        } else {
            let Some(estimated) = read_estimated(directory, recording.manifest(), &mut damage)? else {
                let message = "has no samples to fly, and no estimated paths: it was recorded without";
                return Err(InputError::in_file(directory, message));
            };
            Some(estimated)
        };
        let starts_ns = recording
            .events()
            .iter()
            .filter_map(|stamped| match stamped.event {
                Event::Sweep { sweep } => Some((sweep, stamped.uav_time_ns)),
                _ => None,
            });
        let file = directory.join(TRUTH_PATHS);
        let links = if file.exists() {
            paths::read(&file)?
        } else {
            Vec::new()
        };
        Ok(Self {
            directory: directory.to_owned(),
            starts_ns: starts_ns.collect(),
            truth: TruthTrack::read(directory)?,
            links,
            estimated,
            recording,
            damage: Mutex::new(damage),
        })
    }

    /// What the recording says about itself.
    pub fn manifest(&self) -> &Manifest {
        self.recording.manifest()
    }

    /// Whether estimated paths are flown, and no samples.
    pub fn is_of_paths(&self) -> bool {
        self.estimated.is_some()
    }

    /// What was found damaged or missing so far.
    pub fn damage(&self) -> Damage {
        self.damage
            .lock()
            .map_or_else(|e| e.into_inner().clone(), |d| d.clone())
    }

    /// The blocks of a sweep, of its pilots, or of the symbols after it; none when they are damaged and damage is counted.
    fn blocks(&self, base: &Path, expected: Codebook, part: &str) -> Result<Sweep, InputError> {
        let read = sigmf::read(base).and_then(|recording| {
            let message = if recording.codebook != expected {
                format!(
                    "cslam:codebook is {}, expected {}",
                    recording.codebook.name(),
                    expected.name()
                )
            } else if recording.radio.unwrap_or_default() != self.manifest().radio.unwrap_or_default() {
                "cslam:radio is another than the flight's".to_owned()
            } else {
                return Ok(Sweep {
                    blocks: recording.blocks,
                });
            };
            Err(InputError::in_file(&sigmf::files(base).0, message))
        });
        read.or_else(|error| {
            let mut damage = self
                .damage
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner);
            damage.found(part, 1, error)?;
            Ok(Sweep::default())
        })
    }
}

impl Source for RecordedFlight {
    fn sweeps(&self) -> u32 {
        self.starts_ns.keys().next_back().map_or(0, |last| last + 1)
    }

    fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
        Box::new(self.recording.events().iter().copied())
    }

    fn sweep(&self, sweep: u32) -> Result<Given, InputError> {
        // One whose beginning nobody recorded is not asked for again.
        let Some(&start_ns) = self.starts_ns.get(&sweep) else {
            return Ok(Given::default());
        };
        let truth = self.truth(start_ns);
        let truth = truth.zip(self.links.get(sweep as usize).cloned());
        if let Some(estimated) = &self.estimated {
            return Ok(Given {
                estimated: estimated.get(sweep as usize).cloned(),
                truth,
                ..Given::default()
            });
        }
        // One that says nothing of pilots has none: files of other programs may have such names.
        let pilots = if self.manifest().pilots {
            self.blocks(&pilots_base(&self.directory, sweep), Codebook::Pilots, PILOTS)?
        } else {
            Sweep::default()
        };
        Ok(Given {
            pilots,
            beams: self.blocks(&sweep_base(&self.directory, sweep), Codebook::Beams, "sweeps")?,
            squint: self.blocks(
                &squint_base(&self.directory, sweep),
                Codebook::SquintSequential,
                "beam squint symbols",
            )?,
            truth,
            ..Given::default()
        })
    }

    fn truth(&self, uav_time_ns: u64) -> Option<PoseTruth> {
        let truth = self.truth.as_ref()?;
        Some(truth.at(uav_time_ns as f64 * 1e-9))
    }
}
