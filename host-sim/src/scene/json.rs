//! The project's own scene format: JSON with planar polygons (design page, section 5).

use std::path::Path;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::{Bounds, Material, RawFace, Scene};
use crate::input::limits::SCENE;
use crate::input::{InputError, from_json, read_text};

/// Every key of the format. Those that are ignored are what generators say of how a scene was made.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "of some keys only the names matter")]
struct SceneFile {
    name: String,
    units: String,
    material: MaterialEntry,
    frequency_hz: f64,
    bounds: Option<[[f64; 3]; 2]>,
    faces: Vec<FaceEntry>,
    frame: Option<IgnoredAny>,
    seed: Option<IgnoredAny>,
    prisms: Option<IgnoredAny>,
    ground: Option<IgnoredAny>,
    ceiling: Option<IgnoredAny>,
    outer_walls: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialEntry {
    relative_permittivity: f64,
    #[serde(rename = "conductivity_S_per_m")]
    conductivity_s_per_m: f64,
    model: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "of some keys only the names matter")]
struct FaceEntry {
    vertices: Vec<[f64; 3]>,
    normal: Option<[f64; 3]>,
    obj: Option<u32>,
    id: Option<IgnoredAny>,
    kind: Option<IgnoredAny>,
}

/// Reads a JSON scene.
pub(super) fn read(file: &Path) -> Result<Scene, InputError> {
    parse(file, &read_text(file, &SCENE)?)
}

/// Parses a JSON scene; `file` is for messages only.
pub(super) fn parse(file: &Path, text: &str) -> Result<Scene, InputError> {
    let wrong = |message: String| InputError::in_file(file, message);
    let entry: SceneFile = from_json(file, text, "a scene")?;
    if entry.units != "metre" {
        return Err(wrong(format!(
            "units: expected \"metre\", found \"{}\"",
            entry.units
        )));
    }
    if entry.material.model != "half-space" {
        return Err(wrong(format!(
            "material.model: expected \"half-space\", found \"{}\"",
            entry.material.model
        )));
    }
    let material = Material::new(
        entry.material.relative_permittivity,
        entry.material.conductivity_s_per_m,
    )
    .ok_or_else(|| {
        wrong("material: expected relative_permittivity >= 1 and conductivity_S_per_m >= 0".into())
    })?;
    if !(entry.frequency_hz > 0.0 && entry.frequency_hz.is_finite()) {
        return Err(wrong(format!(
            "frequency_hz: expected a positive number, found {}",
            entry.frequency_hz
        )));
    }
    let bounds = entry.bounds.map(|[min_m, max_m]| Bounds { min_m, max_m });
    if bounds.is_some_and(|b| (0..3).any(|i| b.min_m[i] >= b.max_m[i])) {
        return Err(wrong(
            "bounds: expected [[x, y, z], [x, y, z]], the first below the second in each".into(),
        ));
    }
    let faces = entry
        .faces
        .into_iter()
        .map(|f| RawFace {
            vertices: f.vertices,
            normal: f.normal,
            object: f.obj,
        })
        .collect();
    Scene::new(entry.name, material, entry.frequency_hz, bounds, faces).map_err(|e| wrong(e.to_string()))
}
