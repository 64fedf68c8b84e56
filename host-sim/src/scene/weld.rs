//! Meshes to faces. Modelling programs cut every wall into triangles; a ray tracer wants the wall: each region of coplanar
//! neighbours becomes one polygon, unless it has a hole. Also tells which faces make one solid.

use std::collections::HashMap;
use std::path::Path;

use super::face::PLANARITY_TOLERANCE_M;
use super::{DEFAULT_FREQUENCY_HZ, Face, Material, RawFace, Scene, SceneError, Vec3, checked};
use crate::input::InputError;

/// Vertices that round to the same multiple of this are one, m.
const WELD_M: f64 = 1e-6;

/// Normals of neighbours that count as one plane differ by less than this (rad), whatever their size.
const SAME_PLANE_RAD: f64 = 1e-4;

/// A scene of a mesh's polygons, in the paper's material at the default frequency.
pub(super) fn mesh_scene(file: &Path, polygons: Vec<Vec<[f64; 3]>>) -> Result<Scene, InputError> {
    let wrong = |e: SceneError| InputError::in_file(file, e.to_string());
    let name = file
        .file_stem()
        .map_or_else(|| "mesh".into(), |s| s.to_string_lossy().into_owned());
    let raw: Vec<RawFace> = polygons
        .into_iter()
        .map(|vertices| RawFace {
            vertices,
            ..RawFace::default()
        })
        .collect();
    // Faults are told by the file's own numbering, hence before any welding.
    let faces = checked(&raw).map_err(wrong)?;
    Scene::new(
        name,
        Material::PAPER,
        DEFAULT_FREQUENCY_HZ,
        None,
        welded(&raw, &faces),
    )
    .map_err(wrong)
}

/// Gives every face the number of its solid: the stated one, or one per set of faces that hang together by vertices.
pub(super) fn number_objects(raw: &[RawFace], faces: &mut [Face]) {
    let mut first_at: HashMap<[i64; 3], usize> = HashMap::new();
    let mut leader: Vec<usize> = (0..raw.len()).collect();
    for (i, face) in raw.iter().enumerate() {
        if face.object.is_some() {
            continue;
        }
        for vertex in &face.vertices {
            let j = *first_at.entry(key(vertex)).or_insert(i);
            let (a, b) = (root(&mut leader, i), root(&mut leader, j));
            leader[a.max(b)] = a.min(b);
        }
    }
    let stated = raw
        .iter()
        .filter_map(|f| f.object)
        .max()
        .map_or(0, |o| o.saturating_add(1));
    for (i, face) in faces.iter_mut().enumerate() {
        let own = u32::try_from(root(&mut leader, i)).unwrap_or(u32::MAX);
        face.set_object(raw[i].object.unwrap_or_else(|| stated.saturating_add(own)));
    }
}

/// Root of a set, with path halving.
fn root(leader: &mut [usize], mut i: usize) -> usize {
    while leader[i] != i {
        leader[i] = leader[leader[i]];
        i = leader[i];
    }
    i
}

fn key(vertex: &[f64; 3]) -> [i64; 3] {
    vertex.map(|c| (c / WELD_M).round() as i64)
}

/// One polygon per region of coplanar neighbours; regions whose outline is not one simple loop stay in pieces.
fn welded(raw: &[RawFace], faces: &[Face]) -> Vec<RawFace> {
    let mut numbers: HashMap<[i64; 3], usize> = HashMap::new();
    let mut points: Vec<[f64; 3]> = Vec::new();
    let loops: Vec<Vec<usize>> = raw
        .iter()
        .map(|face| {
            let number = |v: &[f64; 3]| {
                *numbers.entry(key(v)).or_insert_with(|| {
                    points.push(*v);
                    points.len() - 1
                })
            };
            face.vertices.iter().map(number).collect()
        })
        .collect();
    let mut across: HashMap<(usize, usize), usize> = HashMap::new();
    for (face, corners) in loops.iter().enumerate() {
        for edge in edges(corners) {
            across.insert(edge, face);
        }
    }
    let mut taken = vec![false; raw.len()];
    let mut result = Vec::new();
    for seed in 0..raw.len() {
        if taken[seed] {
            continue;
        }
        taken[seed] = true;
        let mut region = vec![seed];
        let mut next = 0;
        while next < region.len() {
            for (a, b) in edges(&loops[region[next]]) {
                let Some(&other) = across.get(&(b, a)) else {
                    continue;
                };
                if !taken[other] && coplanar(&faces[seed], &faces[other]) {
                    taken[other] = true;
                    region.push(other);
                }
            }
            next += 1;
        }
        let merged = outline(&region, &loops).map(|corners| RawFace {
            vertices: corners.iter().map(|&i| points[i]).collect(),
            ..RawFace::default()
        });
        match merged {
            Some(merged) if region.len() > 1 && Face::new(&merged).is_ok() => {
                result.push(without_straight_corners(merged))
            }
            _ => result.extend(region.iter().map(|&i| raw[i].clone())),
        }
    }
    result
}

fn edges(corners: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    corners
        .iter()
        .copied()
        .zip(corners.iter().copied().cycle().skip(1))
}

fn coplanar(seed: &Face, other: &Face) -> bool {
    seed.normal().cross(other.normal()).norm() < SAME_PLANE_RAD
        && seed.normal().dot(other.normal()) > 0.0
        && other
            .vertices()
            .iter()
            .all(|v| seed.height_m(v).abs() < 0.5 * PLANARITY_TOLERANCE_M)
}

/// The region's outline, when it is a single loop that meets no vertex twice.
fn outline(region: &[usize], loops: &[Vec<usize>]) -> Option<Vec<usize>> {
    let inner: std::collections::HashSet<(usize, usize)> =
        region.iter().flat_map(|&f| edges(&loops[f])).collect();
    let mut next: HashMap<usize, usize> = HashMap::new();
    let mut start = None;
    for (a, b) in region.iter().flat_map(|&f| edges(&loops[f])) {
        if !inner.contains(&(b, a)) {
            start.get_or_insert(a);
            if next.insert(a, b).is_some() {
                return None;
            }
        }
    }
    let start = start?;
    let mut corners = vec![start];
    let mut at = *next.get(&start)?;
    while at != start {
        corners.push(at);
        at = *next.get(&at)?;
    }
    (corners.len() == next.len()).then_some(corners)
}

/// Drops the vertices that lie on the straight line between their neighbours.
fn without_straight_corners(mut face: RawFace) -> RawFace {
    let mut i = 0;
    while face.vertices.len() > 3 && i < face.vertices.len() {
        let n = face.vertices.len();
        let [before, here, after] = [i + n - 1, i, i + 1].map(|k| Vec3::from(face.vertices[k % n]));
        let along = (after - before).normalize();
        if (here - before).cross(&along).norm() < WELD_M {
            face.vertices.remove(i);
        } else {
            i += 1;
        }
    }
    face
}
