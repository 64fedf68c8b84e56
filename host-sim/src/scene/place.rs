//! A scene by name or by file.

use std::path::Path;

use super::{Scene, SceneError, city, indoor, json, obj, ply, street};
use crate::input::InputError;

/// Names that need no file; `city:SEED` and `indoor:SEED` are two more for every seed.
pub const BUILT_IN_NAMES: [&str; 4] = ["outdoor", "indoor", "street", "outdoor_a"];

/// The scene of the reference path lists, built in as `outdoor_a`.
pub const REFERENCE_SCENE_JSON: &str = include_str!("../../fixtures/outdoor_a_scene.json");

impl Scene {
    /// A scene by what stands after `--scene`: a built-in name, `city:SEED`, `indoor:SEED`, or a file ending in `.json`, `.obj` or
    /// `.ply` (`.json.gz` and `.obj.gz` too).
    ///
    /// # Errors
    /// [`InputError`] naming the name or the file, the face, and what was expected.
    pub fn load(name_or_file: &str) -> Result<Self, InputError> {
        match Self::built_in(name_or_file) {
            Some(scene) => scene,
            None => Self::read(Path::new(name_or_file)),
        }
    }

    /// A built-in scene or a seeded city; `None` when the name is neither.
    fn built_in(name: &str) -> Option<Result<Self, InputError>> {
        if let Some((kind @ ("city" | "indoor"), seed)) = name.split_once(':') {
            let make = if kind == "city" {
                city::city
            } else {
                indoor::seeded
            };
            return Some(match seed.parse::<u64>() {
                Ok(seed) => generated(name, make(name, seed)),
                Err(_) => Err(InputError::new(format!(
                    "scene {name}: expected {kind}:SEED with a whole number from 0"
                ))),
            });
        }
        Some(match name {
            "outdoor" => generated(name, city::city(name, city::OUTDOOR_SEED)),
            "indoor" => generated(name, indoor::indoor()),
            "street" => generated(name, street::street()),
            "outdoor_a" => json::parse(Path::new("outdoor_a_scene.json"), REFERENCE_SCENE_JSON),
            _ => return None,
        })
    }

    /// Reads a scene file; its name's ending says which format.
    ///
    /// # Errors
    /// [`InputError`] naming the file and what is wrong with it.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let stem = file.with_extension("");
        let kind = match file.extension().and_then(|e| e.to_str()) {
            Some("gz") => stem.extension(),
            _ => file.extension(),
        };
        match kind
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("json") => json::read(file),
            Some("obj") => obj::read(file),
            Some("ply") => ply::read(file),
            _ => Err(InputError::new(format!(
                "scene {}: expected one of {}, city:SEED, indoor:SEED, or a file ending in .json, .obj or .ply",
                file.display(),
                BUILT_IN_NAMES.join(", ")
            ))),
        }
    }
}

/// The generators are tested to give valid faces; a fault would still be told, not hidden.
fn generated(name: &str, scene: Result<Scene, SceneError>) -> Result<Scene, InputError> {
    scene.map_err(|e| InputError::new(format!("scene {name}: {e}")))
}
