//! Wavefront OBJ meshes: positions and faces. Normals, textures, groups and materials are read over; any other statement is
//! refused.

use std::path::Path;

use super::{Scene, weld};
use crate::input::limits::{FACE_VERTICES, SCENE, SCENE_FACES, SCENE_VERTICES};
use crate::input::{InputError, lines, read_text};

/// Statements that say nothing of where a surface is: of the OBJ specification's appendix B1, without free-form surfaces.
const READ_OVER: [&str; 22] = [
    "vt",
    "vn",
    "vp",
    "p",
    "l",
    "g",
    "s",
    "o",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "usemtl",
    "mtllib",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "call",
];

/// Reads an OBJ mesh. Units are metres, z points up, faces wind counter-clockwise seen from free space.
pub(super) fn read(file: &Path) -> Result<Scene, InputError> {
    let text = read_text(file, &SCENE)?;
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut polygons = Vec::new();
    for line in lines(file, &text, &SCENE) {
        let (number, line) = line?;
        statement(line, &mut vertices, &mut polygons)
            .map_err(|e| InputError::at_line(file, number, format!("not an OBJ mesh: {e}")))?;
    }
    weld::mesh_scene(file, polygons)
}

/// Takes one line.
fn statement(
    line: &str,
    vertices: &mut Vec<[f64; 3]>,
    polygons: &mut Vec<Vec<[f64; 3]>>,
) -> Result<(), String> {
    let before_comment = line.split('#').next().unwrap_or_default();
    let mut words = before_comment.split_whitespace();
    match words.next() {
        None => {}
        Some("v") => {
            if vertices.len() >= SCENE_VERTICES {
                return Err(format!("expected at most {SCENE_VERTICES} vertices"));
            }
            let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
            // A weight or a colour may follow.
            match numbers.as_deref() {
                Some([x, y, z] | [x, y, z, _] | [x, y, z, _, _, _]) => vertices.push([*x, *y, *z]),
                _ => return Err("expected v x y z".into()),
            }
        }
        Some("f") => {
            if polygons.len() >= SCENE_FACES {
                return Err(format!("expected at most {SCENE_FACES} faces"));
            }
            let corners: Vec<_> = words
                .map(|word| corner(word, vertices))
                .collect::<Result<_, _>>()?;
            if !(3..=FACE_VERTICES).contains(&corners.len()) {
                return Err(format!(
                    "a face has {} vertices, expected 3 to {FACE_VERTICES}",
                    corners.len()
                ));
            }
            polygons.push(corners);
        }
        Some(word) if READ_OVER.contains(&word) => {}
        Some(word) => return Err(format!("unknown statement \"{word}\"")),
    }
    Ok(())
}

/// The vertex of a corner `index`, `index/texture`, `index/texture/normal` or `index//normal`; indices count from 1, those below 0
/// from the last vertex back.
fn corner(word: &str, vertices: &[[f64; 3]]) -> Result<[f64; 3], String> {
    let index = word.split('/').next().unwrap_or_default();
    let number: i64 = index
        .parse()
        .map_err(|_| format!("expected the number of a vertex, found \"{word}\""))?;
    let count = vertices.len() as i64;
    let place = if number < 0 {
        count.saturating_add(number)
    } else {
        number - 1
    };
    usize::try_from(place)
        .ok()
        .and_then(|place| vertices.get(place))
        .copied()
        .ok_or_else(|| format!("a face names vertex {number}, there are {count} before it"))
}
