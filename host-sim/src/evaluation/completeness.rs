//! How much of what was lit is in the map.
//!
//! A surface is lit where this flight's waves were truly reflected once: within a patch radius of a true first-order
//! reflection point, on the same face, whether the receiver heard that path or not. A sample of a lit surface is complete
//! when the map has a point within a threshold. Nothing is said of surfaces that no wave of this flight reached. Where the
//! patch is wider than the threshold even the truth's own points leave gaps: [`Completeness::ceiling`] is what they reach.

use std::collections::HashSet;

use serde::Serialize;

use super::grid::PointGrid;
use super::surface::Surfaces;
use crate::scene::Face;

/// Distance between samples on a face, m.
pub const SAMPLE_STEP_M: f64 = 0.1;

/// A true reflection point lies on the nearest face, within this distance, m; others (of a list whose scene is another
/// one) light nothing.
const ON_SURFACE_M: f64 = 0.01;

/// Faces whose normal leans less than this from the horizontal are walls: |n_z| below it.
const WALL_NORMAL_Z: f64 = 0.5;

/// Share of the lit surface that is in the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Completeness {
    /// Radius of the lit patch around a true reflection point, m.
    pub patch_m: f64,
    /// A sample is complete when a map point is this near, m.
    pub threshold_m: f64,
    /// Lit surface, m^2.
    pub lit_m2: f64,
    /// Share of it that is complete.
    pub share: f64,
    /// Share that would be complete if the map held exactly the true reflection points.
    pub ceiling: f64,
}

/// Which faces count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Walls only.
    Walls,
    /// Walls, roofs, ground and ceilings.
    All,
}

/// Samples of the lit surface.
pub(super) struct Lit {
    samples_m: Vec<[f64; 3]>,
    patch_m: f64,
}

impl Lit {
    /// Lights a patch around every true reflection point.
    pub(super) fn new(surfaces: &Surfaces<'_>, vertices_m: &[[f64; 3]], patch_m: f64, part: Part) -> Self {
        let mut seen = HashSet::new();
        let mut samples_m = Vec::new();
        for &vertex in vertices_m {
            let Some((number, _)) = surfaces.nearest(vertex).filter(|(_, d)| *d <= ON_SURFACE_M) else {
                continue;
            };
            let Some(face) = surfaces.face(number) else {
                continue;
            };
            if part == Part::Walls && face.normal().z.abs() >= WALL_NORMAL_Z {
                continue;
            }
            for (cell, foot) in lattice_around(face, vertex, patch_m) {
                if seen.insert((number, cell)) {
                    samples_m.push(surfaces.on_surface(number, foot).into());
                }
            }
        }
        Self { samples_m, patch_m }
    }

    /// Compares with the points of a map; `None` when nothing was lit.
    pub(super) fn completeness(
        &self,
        map_m: &[[f64; 3]],
        vertices_m: &[[f64; 3]],
        threshold_m: f64,
    ) -> Option<Completeness> {
        let share = |points: &[[f64; 3]]| {
            let grid = PointGrid::new(points.iter().copied(), threshold_m);
            let near = self.samples_m.iter().filter(|&&s| grid.nearest_m(s).is_some());
            near.count() as f64 / self.samples_m.len() as f64
        };
        (!self.samples_m.is_empty()).then(|| Completeness {
            patch_m: self.patch_m,
            threshold_m,
            lit_m2: self.samples_m.len() as f64 * SAMPLE_STEP_M * SAMPLE_STEP_M,
            share: share(map_m),
            ceiling: share(vertices_m),
        })
    }
}

/// Centres of the cells of the face's own lattice within `patch_m` of a point on it.
fn lattice_around(face: &Face, point_m: [f64; 3], patch_m: f64) -> Vec<([i64; 2], nalgebra::Vector3<f64>)> {
    let Some(origin) = face.vertices().first() else {
        return Vec::new();
    };
    let [u, v] = face.axes();
    let offset = nalgebra::Vector3::from(point_m) - origin;
    let (pu, pv) = (offset.dot(&u), offset.dot(&v));
    let cell = |coordinate: f64| libm::floor(coordinate / SAMPLE_STEP_M) as i64;
    let mut found = Vec::new();
    for i in cell(pu - patch_m)..=cell(pu + patch_m) {
        for j in cell(pv - patch_m)..=cell(pv + patch_m) {
            let centre = [i, j].map(|k| (k as f64 + 0.5) * SAMPLE_STEP_M);
            if libm::hypot(centre[0] - pu, centre[1] - pv) > patch_m {
                continue;
            }
            let sample = origin + u * centre[0] + v * centre[1];
            if face.contains(&sample) {
                found.push(([i, j], sample));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::surface::tests::wall_with_a_door;
    use super::*;

    /// Far from every edge of the wall with a door.
    const VERTEX: [f64; 3] = [3.1, 10.0, 1.5];

    #[test]
    fn a_disc_is_lit_around_a_reflection() {
        let scene = wall_with_a_door();
        let surfaces = Surfaces::new(&scene);
        let lit = Lit::new(&surfaces, &[VERTEX, VERTEX, [3.1, 9.0, 1.5]], 0.5, Part::Walls);
        // The second one lights the same disc, the third is on no surface.
        let all = lit.completeness(&[VERTEX], &[VERTEX], 0.5).expect("lit");
        assert!((all.lit_m2 / (PI * 0.25) - 1.0).abs() < 0.05, "{all:?}");
        assert_eq!((all.share, all.ceiling), (1.0, 1.0));
        // Within 0.2 m of a point 0.1 m off the wall lies a disc of sqrt(0.03) m radius, of which this map sees all.
        // Samples 0.1 m apart count so small a disc to within three of the 78.
        let part = lit.completeness(&[[3.1, 9.9, 1.5]], &[VERTEX], 0.2).expect("lit");
        assert!((part.share - 0.03 / 0.25).abs() < 0.04, "{part:?}");
        assert!((part.ceiling - 0.04 / 0.25).abs() < 0.04, "{part:?}");
        assert_eq!(lit.completeness(&[], &[VERTEX], 0.5).expect("lit").share, 0.0);
    }

    #[test]
    fn a_patch_ends_at_the_edge_of_its_face() {
        let scene = wall_with_a_door();
        let surfaces = Surfaces::new(&scene);
        // On the right door post half of the disc is air.
        let lit = Lit::new(&surfaces, &[[2.0, 10.0, 1.0]], 0.4, Part::Walls);
        let area = lit.completeness(&[], &[], 0.5).expect("lit").lit_m2;
        assert!((area / (PI * 0.08) - 1.0).abs() < 0.08, "{area}");
    }

    #[test]
    fn the_ground_is_no_wall() {
        let scene = crate::scene::Scene::load("outdoor").expect("built in");
        let surfaces = Surfaces::new(&scene);
        let ground = (0..40)
            .flat_map(|i| (0..40).map(move |j| [f64::from(i) * 3.0, f64::from(j) * 3.0, 0.0]))
            .find(|p| {
                surfaces
                    .nearest(*p)
                    .and_then(|(n, _)| surfaces.face(n))
                    .is_some_and(|f| f.normal().z > 0.9)
            })
            .expect("ground between the buildings");
        let walls = Lit::new(&surfaces, &[ground], 0.5, Part::Walls);
        assert!(walls.completeness(&[ground], &[ground], 0.5).is_none());
        let all = Lit::new(&surfaces, &[ground], 0.5, Part::All);
        assert_eq!(
            all.completeness(&[ground], &[ground], 0.5).expect("lit").share,
            1.0
        );
    }
}
