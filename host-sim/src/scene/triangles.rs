//! Polygons as triangles, by clipping ears.

use nalgebra::Vector3;

use super::Face;

/// Triangles that cover a face, corners counter-clockwise seen from its front, m.
pub(crate) fn triangles(face: &Face) -> Vec<[Vector3<f64>; 3]> {
    let mut left: Vec<Vector3<f64>> = face.vertices().to_vec();
    let mut found = Vec::with_capacity(left.len().saturating_sub(2));
    while left.len() > 3 {
        let count = left.len();
        let at = |k: usize| left[k % count];
        // A simple polygon always has an ear; rounding may hide it, then any corner does for a picture.
        let ear = (0..count).find(|&k| is_ear(&left, k, face.normal())).unwrap_or(0);
        found.push([at(ear + count - 1), at(ear), at(ear + 1)]);
        left.remove(ear);
    }
    if let [a, b, c] = left[..] {
        found.push([a, b, c]);
    }
    found
}

/// Whether the triangle at a corner turns left and holds no other corner.
fn is_ear(polygon: &[Vector3<f64>], corner: usize, normal: &Vector3<f64>) -> bool {
    let count = polygon.len();
    let [a, b, c] = [corner + count - 1, corner, corner + 1].map(|k| polygon[k % count]);
    let side =
        |from: &Vector3<f64>, to: &Vector3<f64>, p: &Vector3<f64>| (to - from).cross(&(p - from)).dot(normal);
    if side(&a, &b, &c) <= 0.0 {
        return false;
    }
    let others = polygon.iter().filter(|p| ![a, b, c].contains(p));
    let mut inside =
        others.filter(|p| side(&a, &b, p) >= 0.0 && side(&b, &c, p) >= 0.0 && side(&c, &a, p) >= 0.0);
    inside.next().is_none()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{RawFace, Scene};

    fn area(triangle: &[Vector3<f64>; 3]) -> Vector3<f64> {
        (triangle[1] - triangle[0]).cross(&(triangle[2] - triangle[0])) * 0.5
    }

    #[test]
    fn a_wall_with_a_door_is_covered_once() {
        let outline = [
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 0.0],
            [4.0, 0.0],
            [4.0, 3.0],
            [0.0, 3.0],
        ];
        let raw = RawFace {
            vertices: outline.map(|[x, z]| [x, 10.0, z]).to_vec(),
            ..RawFace::default()
        };
        let face = Face::new(&raw).expect("a polygon");
        let parts = triangles(&face);
        assert_eq!(parts.len(), 6);
        // No part faces backwards, and together they are as large as the wall without its door.
        assert!(parts.iter().all(|t| area(t).dot(face.normal()) > 0.0));
        assert!((parts.iter().map(|t| area(t).norm()).sum::<f64>() - 10.0).abs() < 1e-12);
    }

    #[test]
    fn every_face_of_a_scene_is_covered() {
        let scene = Scene::load("outdoor").expect("built in");
        for face in scene.faces() {
            let v = face.vertices();
            let whole: Vector3<f64> = (1..v.len() - 1).map(|k| area(&[v[0], v[k], v[k + 1]])).sum();
            let parts: Vector3<f64> = triangles(face).iter().map(area).sum();
            assert!((whole - parts).norm() < 1e-9 && triangles(face).len() == v.len() - 2);
        }
    }
}
