//! The project's own scene format: JSON with planar polygons (design page, section 5).

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::{Bounds, MATERIAL_NAMES, Material, RawFace, Roughness, Scene};
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
    /// Materials of this scene's own, by name.
    #[serde(default)]
    materials: BTreeMap<String, OwnMaterial>,
    /// Names of materials by object.
    #[serde(default)]
    object_materials: BTreeMap<u32, String>,
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

/// A material by the name of a common one or by its values.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OwnMaterial {
    name: Option<String>,
    relative_permittivity: Option<f64>,
    #[serde(rename = "conductivity_S_per_m")]
    conductivity_s_per_m: Option<f64>,
    thickness_m: Option<f64>,
    rms_height_m: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "of some keys only the names matter")]
struct FaceEntry {
    vertices: Vec<[f64; 3]>,
    normal: Option<[f64; 3]>,
    obj: Option<u32>,
    material: Option<String>,
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
    let own = Palette::of(&entry).map_err(wrong)?;
    let faces = entry
        .faces
        .into_iter()
        .map(|f| RawFace {
            vertices: f.vertices,
            normal: f.normal,
            object: f.obj,
        })
        .collect();
    let scene = Scene::new(entry.name, material, entry.frequency_hz, bounds, faces)
        .map_err(|e| wrong(e.to_string()))?;
    Ok(if own.materials.is_empty() {
        scene
    } else {
        scene.with_materials(&own.materials, &own.of_face)
    })
}

/// The materials that faces name.
struct Palette {
    materials: Vec<Material>,
    /// For every face, its place among them.
    of_face: Vec<Option<u16>>,
}

impl Palette {
    /// A face's own name counts before that of its object.
    fn of(entry: &SceneFile) -> Result<Self, String> {
        let mut own = BTreeMap::new();
        for (name, values) in &entry.materials {
            own.insert(name.as_str(), values.material(name)?);
        }
        let mut palette = Self {
            materials: Vec::new(),
            of_face: Vec::new(),
        };
        let mut places: BTreeMap<&str, u16> = BTreeMap::new();
        let mut place = |materials: &mut Vec<Material>, name| -> Result<u16, String> {
            if let Some(&known) = places.get(name) {
                return Ok(known);
            }
            let material = own.get(name).copied().or_else(|| Material::named(name));
            let material = material.ok_or_else(|| unknown(name))?;
            let new = u16::try_from(materials.len())
                .ok()
                .filter(|&new| new < u16::MAX - 1);
            let new = new.ok_or("has more materials than can be told apart, expected fewer than 65 534")?;
            materials.push(material);
            places.insert(name, new);
            Ok(new)
        };
        for (object, name) in &entry.object_materials {
            if !entry.faces.iter().any(|face| face.obj == Some(*object)) {
                return Err(format!(
                    "object_materials: object {object} has no face (`obj` of a face)"
                ));
            }
            place(&mut palette.materials, name)
                .map_err(|e| format!("object_materials: object {object}: {e}"))?;
        }
        for (index, face) in entry.faces.iter().enumerate() {
            let of_object = || face.obj.and_then(|object| entry.object_materials.get(&object));
            let name = face.material.as_ref().or_else(of_object);
            let found = name.map(|name| place(&mut palette.materials, name)).transpose();
            palette
                .of_face
                .push(found.map_err(|e| format!("face {index}: {e}"))?);
        }
        Ok(palette)
    }
}

fn unknown(name: &str) -> String {
    format!(
        "material \"{name}\" is not known, expected one of `materials` of the scene, or {}",
        MATERIAL_NAMES.join(", ")
    )
}

impl OwnMaterial {
    /// # Errors
    /// What is wrong with it, in words.
    fn material(&self, called: &str) -> Result<Material, String> {
        let wrong = |what: &str| format!("materials: \"{called}\": {what}");
        let base = match (&self.name, self.relative_permittivity, self.conductivity_s_per_m) {
            (Some(name), None, None) => {
                Material::named(name).ok_or_else(|| wrong(&format!("name: {}", unknown(name))))?
            }
            (None, Some(permittivity), Some(conductivity)) => Material::new(permittivity, conductivity)
                .ok_or_else(|| wrong("expected relative_permittivity >= 1 and conductivity_S_per_m >= 0"))?,
            _ => {
                return Err(wrong(
                    "expected either name, or relative_permittivity and conductivity_S_per_m",
                ));
            }
        };
        let base = match self.thickness_m {
            Some(thickness_m) => base
                .slab(thickness_m)
                .ok_or_else(|| wrong("expected a positive thickness_m"))?,
            None => base,
        };
        let roughness = Roughness {
            rms_height_m: self.rms_height_m.unwrap_or(base.roughness().rms_height_m),
            ..*base.roughness()
        };
        base.with_roughness(roughness)
            .ok_or_else(|| wrong("expected rms_height_m >= 0"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three faces, the last two of object 7; with more keys of the scene, and of the last face.
    fn scene(more: &str, of_last: &str) -> Result<Scene, String> {
        let face = |z: u32, more: &str| format!("{{\"vertices\":[[0,0,{z}],[1,0,{z}],[0,1,{z}]]{more}}}");
        let faces = [
            face(0, ""),
            face(1, ",\"obj\":7"),
            face(2, &format!(",\"obj\":7{of_last}")),
        ]
        .join(",");
        let text = format!(
            "{{\"name\":\"t\",\"units\":\"metre\",\"frequency_hz\":3e10,\"material\":{{\"relative_permittivity\":15,\
             \"conductivity_S_per_m\":0.015,\"model\":\"half-space\"}},\"faces\":[{faces}]{more}}}"
        );
        parse(Path::new("t.json"), &text).map_err(|e| e.to_string())
    }

    #[test]
    fn faces_have_the_material_that_they_or_their_object_name() {
        let own = "\"materials\":{\"pane\":{\"name\":\"glass\",\"thickness_m\":0.006},\
            \"clay\":{\"relative_permittivity\":4,\"conductivity_S_per_m\":0.1,\"rms_height_m\":0.001}}";
        let glazed = scene(
            &format!(",{own},\"object_materials\":{{\"7\":\"pane\"}}"),
            ",\"material\":\"brick\"",
        )
        .unwrap();
        let of = |scene: &Scene, face| scene.materials()[scene.material_of(face)];
        let pane = Material::named("glass").unwrap().slab(0.006).unwrap();
        assert_eq!(
            [0, 1, 2].map(|face| of(&glazed, face)),
            [Material::PAPER, pane, Material::named("brick").unwrap()]
        );
        let clay = of(&scene(&format!(",{own}"), ",\"material\":\"clay\"").unwrap(), 2);
        assert_eq!(
            (
                clay.relative_permittivity(),
                clay.conductivity_s_per_m(),
                clay.roughness().rms_height_m
            ),
            (4.0, 0.1, 0.001)
        );
        // Materials that no face names change nothing.
        let plain = scene(&format!(",{own}"), "").unwrap();
        assert_eq!((plain.materials().len(), of(&plain, 2)), (1, Material::PAPER));
    }

    #[test]
    fn what_is_wrong_with_a_material_is_named() {
        let error = |more: &str, of_last: &str| scene(more, of_last).unwrap_err();
        let unknown = error("", ",\"material\":\"adobe\"");
        assert!(
            unknown.starts_with("t.json: face 2: material \"adobe\" is not known, expected one of"),
            "{unknown}"
        );
        assert!(
            unknown.ends_with("wood, glass, metal, asphalt, medium_dry_ground"),
            "{unknown}"
        );
        let objects = |object: u32, name: &str| {
            error(&format!(",\"object_materials\":{{\"{object}\":\"{name}\"}}"), "")
        };
        assert!(objects(7, "adobe").contains("object_materials: object 7: material \"adobe\" is not known"));
        assert!(objects(8, "brick").contains("object_materials: object 8 has no face"));
        for (values, expected) in [
            (
                "\"name\":\"adobe\"",
                "\"x\": name: material \"adobe\" is not known",
            ),
            (
                "\"name\":\"brick\",\"relative_permittivity\":2",
                "\"x\": expected either name, or",
            ),
            ("\"relative_permittivity\":2", "expected either name, or"),
            (
                "\"relative_permittivity\":0.5,\"conductivity_S_per_m\":0",
                "expected relative_permittivity >= 1",
            ),
            (
                "\"name\":\"brick\",\"thickness_m\":0",
                "expected a positive thickness_m",
            ),
            (
                "\"name\":\"brick\",\"rms_height_m\":-1",
                "expected rms_height_m >= 0",
            ),
            ("\"name\":\"brick\",\"colour\":1", "unknown field `colour`"),
        ] {
            let message = error(&format!(",\"materials\":{{\"x\":{{{values}}}}}"), "");
            assert!(
                message.starts_with("t.json") && message.contains(expected),
                "{message}"
            );
        }
    }
}
