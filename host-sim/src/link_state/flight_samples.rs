//! Samples of flights: the inputs that the receiver's trees see of every measured path, and what the path truly was.
//!
//! A directory a flight: `samples.json` says which flight and what the inputs are, `inputs.npy` has a row a path, `class.npy` its class,
//! `strongest.npy` whether it was the strongest of its sweep.

use std::path::Path;

use cslam_core::link_state::{LinkGeometry, Received, TREE_INPUTS, tree_names};
use cslam_core::receiver::{PATHS, SweepReport};
use cslam_core::signal::Waveform;
use serde::{Deserialize, Serialize};

use crate::evaluation::PathClass;
use crate::flight_log::FlightLog;
use crate::input::limits::DATASET_COLUMN;
use crate::input::{InputError, read_text};
use crate::npy;

/// Samples of one flight or several.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlightSamples {
    /// Inputs, a row a path, in the order of [`tree_names`].
    pub inputs: Vec<[f32; TREE_INPUTS]>,
    /// What each was.
    pub classes: Vec<PathClass>,
    /// Whether it was the strongest path of its sweep.
    pub strongest: Vec<bool>,
}

/// Which flight samples are of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Scene.
    pub scene: String,
    /// Seed.
    pub seed: u64,
    /// World.
    pub world: String,
    /// Names of the inputs.
    pub inputs: Vec<String>,
}

impl Origin {
    /// A flight, with the inputs of this build.
    #[must_use]
    pub fn new(scene: &str, seed: u64, world: &str) -> Self {
        Self {
            scene: scene.into(),
            seed,
            world: world.into(),
            inputs: tree_names().map(str::to_owned).collect(),
        }
    }
}

/// Inputs of a flight in the making, sweep by sweep: `None` where a path could not be seen from a pose.
#[derive(Clone, Debug, Default)]
pub struct Collector {
    sweeps: Vec<(u32, Vec<Option<[f32; TREE_INPUTS]>>)>,
}

impl Collector {
    /// Takes a sweep.
    pub fn sweep(&mut self, report: &SweepReport<PATHS>) {
        let received: Option<Vec<Received>> = report
            .paths
            .iter()
            .map(|path| {
                Some(Received {
                    path: path.in_world?,
                    gain_db: path.gain_db,
                })
            })
            .collect();
        let received = received.unwrap_or_default();
        let ends = report.ends.as_ref();
        let link = ends.and_then(|ends| LinkGeometry::new(ends, &received, &Waveform::default()).ok());
        let inputs = |path: &Received| link.as_ref().and_then(|link| link.tree_inputs(path).ok());
        self.sweeps
            .push((report.sweep, received.iter().map(inputs).collect()));
    }

    /// Joins the inputs with the truth of a log whose paths have been matched.
    #[must_use]
    pub fn samples(&self, log: &FlightLog) -> FlightSamples {
        let mut samples = FlightSamples::default();
        for sweep in &log.sweeps {
            let Ok(place) = self
                .sweeps
                .binary_search_by_key(&sweep.sweep, |(number, _)| *number)
            else {
                continue;
            };
            let (_, inputs) = &self.sweeps[place];
            let classes = PathClass::of_sweep(&sweep.truth);
            for (index, (inputs, class)) in inputs.iter().zip(classes).enumerate() {
                if let (Some(inputs), Some(class)) = (inputs, class) {
                    samples.inputs.push(*inputs);
                    samples.classes.push(class);
                    samples.strongest.push(index == 0);
                }
            }
        }
        samples
    }
}

impl FlightSamples {
    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.classes.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.classes.is_empty()
    }

    /// Adds those of another flight.
    pub fn append(&mut self, mut other: Self) {
        self.inputs.append(&mut other.inputs);
        self.classes.append(&mut other.classes);
        self.strongest.append(&mut other.strongest);
    }

    /// Writes them into a directory, which is made.
    ///
    /// # Errors
    /// [`InputError`] naming the file that cannot be written.
    pub fn write(&self, directory: &Path, origin: &Origin) -> Result<(), InputError> {
        let cannot = |e: &std::io::Error| InputError::unwritable(directory, "cannot be written", e);
        std::fs::create_dir_all(directory).map_err(|e| cannot(&e))?;
        let strongest: Vec<u8> = self.strongest.iter().map(|s| u8::from(*s)).collect();
        let classes: Vec<u8> = self.classes.iter().map(|class| *class as u8).collect();
        let origin = serde_json::to_string_pretty(origin).map_err(|e| InputError::new(e.to_string()))?;
        let files = [
            (
                "inputs.npy",
                npy::encode(self.inputs.as_flattened(), Some(TREE_INPUTS)),
            ),
            ("class.npy", npy::encode(&classes, None)),
            ("strongest.npy", npy::encode(&strongest, None)),
            ("samples.json", origin.into_bytes()),
        ];
        files
            .iter()
            .try_for_each(|(name, bytes)| std::fs::write(directory.join(name), bytes))
            .map_err(|e| cannot(&e))
    }

    /// Reads those of a directory.
    ///
    /// # Errors
    /// [`InputError`] naming the file and what was expected.
    pub fn read(directory: &Path) -> Result<(Origin, Self), InputError> {
        let file = directory.join("samples.json");
        let text = read_text(&file, &DATASET_COLUMN)?;
        let origin: Origin =
            serde_json::from_str(&text).map_err(|e| InputError::in_file(&file, e.to_string()))?;
        if !origin.inputs.iter().map(String::as_str).eq(tree_names()) {
            let message = "its inputs are those of another build: make the samples anew";
            return Err(InputError::in_file(&file, message));
        }
        let inputs: Vec<f32> = npy::read(&directory.join("inputs.npy"), Some(TREE_INPUTS))?;
        let inputs = inputs.as_chunks().0.to_vec();
        let classes: Vec<u8> = npy::read(&directory.join("class.npy"), None)?;
        let strongest: Vec<u8> = npy::read(&directory.join("strongest.npy"), None)?;
        let classes: Option<Vec<PathClass>> = classes.into_iter().map(PathClass::from_number).collect();
        let Some(classes) =
            classes.filter(|classes| classes.len() == inputs.len() && inputs.len() == strongest.len())
        else {
            let message = "its columns have different lengths, or a class beyond 3";
            return Err(InputError::in_file(directory, message));
        };
        let strongest = strongest.iter().map(|s| *s > 0).collect();
        Ok((
            origin,
            Self {
                inputs,
                classes,
                strongest,
            },
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> FlightSamples {
        FlightSamples {
            inputs: vec![[0.5; TREE_INPUTS], [-1.5; TREE_INPUTS]],
            classes: vec![PathClass::FirstOrder, PathClass::Artefact],
            strongest: vec![true, false],
        }
    }

    #[test]
    fn samples_survive_the_directory() {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path().join("flight");
        let origin = Origin::new("city:101", 7, "real");
        some().write(&place, &origin).expect("written");
        assert_eq!(FlightSamples::read(&place).expect("read"), (origin, some()));
    }

    #[test]
    fn what_is_wrong_with_a_directory_is_said() {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path();
        let error = || FlightSamples::read(place).expect_err("wrong").to_string();
        assert!(error().contains("samples.json"), "{}", error());
        let mut origin = Origin::new("city:101", 7, "real");
        origin.inputs.pop();
        some().write(place, &origin).expect("written");
        assert!(error().contains("another build"), "{}", error());
        some()
            .write(place, &Origin::new("city:101", 7, "real"))
            .expect("written");
        std::fs::write(place.join("class.npy"), npy::encode(&[1_u8, 4], None)).expect("written");
        assert!(error().contains("a class beyond 3"), "{}", error());
        std::fs::write(place.join("class.npy"), npy::encode(&[1_u8], None)).expect("written");
        assert!(error().contains("different lengths"), "{}", error());
    }
}
