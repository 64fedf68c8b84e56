//! Wavefront OBJ meshes (read by the `tobj` crate): positions and faces; normals, textures and materials are not used.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use tobj::LoadOptions;

use super::{Scene, weld};
use crate::input::{InputError, read_text};

/// Reads an OBJ mesh. Units are metres, z points up, faces wind counter-clockwise seen from free space.
pub(super) fn read(file: &Path) -> Result<Scene, InputError> {
    let text = read_text(file)?;
    let options = LoadOptions {
        ignore_points: true,
        ignore_lines: true,
        ..LoadOptions::default()
    };
    let no_materials = |_: &Path| Ok((Vec::new(), HashMap::new()));
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(text), &options, no_materials)
        .map_err(|e| InputError::in_file(file, format!("not an OBJ mesh: {e}")))?;
    let mut polygons = Vec::new();
    for model in &models {
        let mesh = &model.mesh;
        let vertex = |i: &u32| {
            let at = 3 * *i as usize;
            [mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]]
        };
        // No arities means that every face is a triangle.
        let triangles = vec![
            3;
            if mesh.face_arities.is_empty() {
                mesh.indices.len() / 3
            } else {
                0
            }
        ];
        let mut rest = mesh.indices.as_slice();
        for arity in mesh.face_arities.iter().chain(&triangles) {
            let (face, after) = rest.split_at(*arity as usize);
            polygons.push(face.iter().map(vertex).collect());
            rest = after;
        }
    }
    weld::mesh_scene(file, &polygons)
}
