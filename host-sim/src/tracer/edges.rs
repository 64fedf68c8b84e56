//! Edges that diffract: where two faces of an object meet, convex, with more than [`LEAST_TURN_RAD`] beyond a half-space.

use core::f64::consts::{PI, TAU};
use std::collections::HashMap;
use std::sync::OnceLock;

use super::beam::{Clipper, Plane, one_face_hides};
use crate::scene::{Scene, Vec3};

/// Vertices closer than this are one, m.
const WELD_M: f64 = 1e-3;

/// Exterior angles must exceed pi by this: flatter ones are facets of a plane, 5 degrees.
const LEAST_TURN_RAD: f64 = 5.0 * PI / 180.0;

/// Shorter edges are left out, m.
const SHORTEST_M: f64 = 0.01;

/// Points must be at least this far in front of a face to count as before it, m.
pub(super) const IN_FRONT_M: f64 = 1e-9;

/// One face of a wedge, seen along the edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flank {
    /// The face.
    pub(super) face: u32,
    /// Unit vector in the face, away from the edge.
    pub(super) inside: Vec3,
    /// Unit normal towards free space.
    pub(super) normal: Vec3,
    /// Whether it is the back of a screen: black, since faces reflect on their fronts only.
    pub(super) black: bool,
}

/// An edge and the wedge of free space around it.
#[derive(Debug)]
pub(super) struct Wedge {
    /// One end, m.
    pub(super) from: Vec3,
    /// Unit vector to the other end: `inside x normal` of the first flank.
    pub(super) along: Vec3,
    /// Length, m.
    pub(super) length_m: f64,
    /// The two faces; twice the same for the rim of an open face.
    pub(super) flanks: [Flank; 2],
    /// Angle from the first to the second flank through free space, rad.
    pub(super) exterior_rad: f64,
}

/// A point in cylindrical coordinates about an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct AboutEdge {
    /// Along the edge, from its first end, m.
    pub(super) along_m: f64,
    /// Distance from the edge's line, m.
    pub(super) off_m: f64,
    /// Along the first flank, and above it, m.
    pub(super) across_m: [f64; 2],
}

impl AboutEdge {
    /// Angle about the edge from the first flank through free space, 0 to 2 pi, rad.
    pub(super) fn angle_rad(&self) -> f64 {
        let angle = libm::atan2(self.across_m[1], self.across_m[0]);
        if angle < 0.0 { angle + TAU } else { angle }
    }
}

impl Wedge {
    /// The place of a point about the edge; `None` for points on its line or inside the wedge, which no ray joins with it.
    pub(super) fn about(&self, point: &Vec3) -> Option<AboutEdge> {
        let way = point - self.from;
        let [first, second] = &self.flanks;
        let above = way.dot(&first.normal);
        if above <= IN_FRONT_M && way.dot(&second.normal) <= IN_FRONT_M {
            return None;
        }
        let across_m = [way.dot(&first.inside), above];
        Some(AboutEdge {
            along_m: way.dot(&self.along),
            off_m: (across_m[0] * across_m[0] + across_m[1] * across_m[1]).sqrt(),
            across_m,
        })
    }

    /// A point of the edge, m.
    pub(super) fn point(&self, along_m: f64) -> Vec3 {
        self.from + self.along * along_m
    }

    /// Its two faces.
    pub(super) fn faces(&self) -> [u32; 2] {
        [self.flanks[0].face, self.flanks[1].face]
    }
}

/// All wedges of a scene, with what they light.
#[derive(Debug)]
pub(super) struct Edges {
    pub(super) wedges: Vec<Wedge>,
    /// For every wedge, the faces that it may light: found when first asked for.
    lit: Vec<OnceLock<Vec<u32>>>,
}

impl Edges {
    /// Finds the edges. With `rims`, those that belong to one face alone and do not rest on another face are screens.
    pub(super) fn of(scene: &Scene, rims: bool) -> Self {
        let corners = weld(scene);
        // Where each side of a face begins, by object and its welded ends in the face's own sense of rotation.
        let mut sides: HashMap<(u32, u32, u32), Vec<(u32, u32)>> = HashMap::new();
        for (face, corners) in corners.iter().enumerate() {
            let object = scene.faces()[face].object();
            for (i, &from) in corners.iter().enumerate() {
                let to = corners[(i + 1) % corners.len()];
                sides
                    .entry((object, from, to))
                    .or_default()
                    .push((face as u32, i as u32));
            }
        }
        let mut wedges = Vec::new();
        for (face, corners) in corners.iter().enumerate() {
            let object = scene.faces()[face].object();
            for (i, &from) in corners.iter().enumerate() {
                let to = corners[(i + 1) % corners.len()];
                let alone = sides[&(object, from, to)].len() == 1;
                let wedge = match sides.get(&(object, to, from)).map(Vec::as_slice) {
                    // Each edge once, from its face of lower number. Where more than two faces meet, none is a wedge's.
                    Some(&[(other, _)]) if alone && face < other as usize => {
                        convex(scene, face as u32, i, other)
                    }
                    None if alone && rims => rim(scene, face as u32, i),
                    _ => None,
                };
                wedges.extend(wedge);
            }
        }
        let lit = wedges.iter().map(|_| OnceLock::new()).collect();
        Self { wedges, lit }
    }

    /// Faces that look at a wedge's edge and of which it sees anything. Ascending.
    pub(super) fn lit_by(&self, scene: &Scene, wedge: u32) -> &[u32] {
        self.lit[wedge as usize].get_or_init(|| {
            let wedge = &self.wedges[wedge as usize];
            (0..scene.faces().len() as u32)
                .filter(|&face| may_light(scene, wedge, face))
                .collect()
        })
    }

    /// Takes these faces for those that a wedge may light.
    #[cfg(test)]
    pub(super) fn light_all(&self, wedge: usize, faces: Vec<u32>) {
        let _ = self.lit[wedge].set(faces);
    }
}

/// False only when no point of the edge sees a point of the face's front.
fn may_light(scene: &Scene, wedge: &Wedge, face: u32) -> bool {
    let target = &scene.faces()[face as usize];
    let ends = [wedge.from, wedge.point(wedge.length_m)];
    if wedge.faces().contains(&face) || ends.iter().all(|end| target.height_m(end) <= IN_FRONT_M) {
        return false;
    }
    // Only what lies before one of the flanks is lit.
    let mut clipper = Clipper::default();
    let mut any_before = false;
    for flank in &wedge.flanks {
        let before = Plane {
            normal: flank.normal,
            offset_m: flank.normal.dot(&wedge.from),
        };
        any_before |= clipper.clip(target.hull(), &[before]);
    }
    let corners = target.hull().iter().flat_map(|p| ends.map(|end| (end, *p)));
    let own = [wedge.flanks[0].face, wedge.flanks[1].face, face];
    any_before && !one_face_hides(scene, corners, &own)
}

/// For every face, its vertices as numbers: vertices of equal number are within [`WELD_M`] of the first one of that number.
fn weld(scene: &Scene) -> Vec<Vec<u32>> {
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut points: Vec<Vec3> = Vec::new();
    let mut number = |vertex: &Vec3| {
        let cell = [0, 1, 2].map(|i| (vertex[i] / WELD_M).floor() as i64);
        for around in 0..27 {
            let near = [
                cell[0] + around % 3 - 1,
                cell[1] + around / 3 % 3 - 1,
                cell[2] + around / 9 - 1,
            ];
            let known = cells.get(&near).into_iter().flatten();
            for &point in known {
                if (points[point as usize] - vertex).norm() <= WELD_M {
                    return point;
                }
            }
        }
        points.push(*vertex);
        let new = points.len() as u32 - 1;
        cells.entry(cell).or_default().push(new);
        new
    };
    scene
        .faces()
        .iter()
        .map(|face| face.vertices().iter().map(&mut number).collect())
        .collect()
}

/// A side of a face, in its sense of rotation.
struct Side {
    from: Vec3,
    to: Vec3,
    along: Vec3,
    length_m: f64,
}

/// A side of a face, unless it is too short for an edge.
fn side(scene: &Scene, face: u32, index: usize) -> Option<Side> {
    let vertices = scene.faces()[face as usize].vertices();
    let [from, to] = [vertices[index], vertices[(index + 1) % vertices.len()]];
    let length_m = (to - from).norm();
    (length_m >= SHORTEST_M).then(|| Side {
        from,
        to,
        along: (to - from) / length_m,
        length_m,
    })
}

fn flank(scene: &Scene, face: u32, along: &Vec3) -> Flank {
    let normal = *scene.faces()[face as usize].normal();
    // Across the edge; vertices within the tolerance of their plane tilt it by nothing that counts.
    let inside = normal.cross(along).normalize();
    Flank {
        face,
        inside,
        normal,
        black: false,
    }
}

/// The wedge of two faces, if it is one that diffracts.
fn convex(scene: &Scene, face: u32, index: usize, other: u32) -> Option<Wedge> {
    let Side {
        from,
        along,
        length_m,
        ..
    } = side(scene, face, index)?;
    let first = flank(scene, face, &along);
    let second = flank(scene, other, &-along);
    let angle = libm::atan2(second.inside.dot(&first.normal), second.inside.dot(&first.inside));
    let exterior_rad = if angle < 0.0 { angle + TAU } else { angle };
    // Two faces back to back are a screen whose sides both reflect.
    let exterior_rad = if exterior_rad < 1e-6 { TAU } else { exterior_rad };
    (exterior_rad > PI + LEAST_TURN_RAD).then_some(Wedge {
        from,
        along,
        length_m,
        flanks: [first, second],
        exterior_rad,
    })
}

/// The rim of a face as a screen, unless it rests on another face.
fn rim(scene: &Scene, face: u32, index: usize) -> Option<Wedge> {
    let Side {
        from,
        to,
        along,
        length_m,
    } = side(scene, face, index)?;
    let first = flank(scene, face, &along);
    let middle = 0.5 * (from + to);
    let over = first.inside * (2.0 * WELD_M);
    if scene
        .find_crossed(middle + over, middle - over, |crossed| crossed != face)
        .is_some()
    {
        return None;
    }
    let back = Flank {
        normal: -first.normal,
        black: true,
        ..first
    };
    Some(Wedge {
        from,
        along,
        length_m,
        flanks: [first, back],
        exterior_rad: TAU,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, RawFace};

    fn scene_of(faces: &[(u32, &[[f64; 3]])]) -> Scene {
        let raw = faces
            .iter()
            .map(|(object, vertices)| RawFace {
                vertices: vertices.to_vec(),
                object: Some(*object),
                ..RawFace::default()
            })
            .collect();
        Scene::new("test", Material::PAPER, 30e9, None, raw).unwrap()
    }

    /// An L-shaped solid of a height on the ground: six walls, a roof, no floor.
    fn on_the_ground(gap_m: f64) -> Scene {
        let plan = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 2.0],
            [2.0, 2.0],
            [2.0, 4.0],
            [0.0, 4.0],
        ];
        let mut faces: Vec<Vec<[f64; 3]>> = (0..6)
            .map(|i| {
                let ([a, b], [c, d]) = (plan[i], plan[(i + 1) % 6]);
                vec![[a, b, 0.0], [c, d, 0.0], [c, d, 3.0], [a, b, 3.0]]
            })
            .collect();
        faces.push(plan.map(|[x, y]| [x + gap_m, y, 3.0]).to_vec());
        let ground: &[[f64; 3]] = &[
            [-9.0, -9.0, 0.0],
            [9.0, -9.0, 0.0],
            [9.0, 9.0, 0.0],
            [-9.0, 9.0, 0.0],
        ];
        let mut all = vec![(0, ground)];
        all.extend(faces.iter().map(|f| (1, f.as_slice())));
        scene_of(&all)
    }

    #[test]
    fn convex_edges_are_found_and_no_other() {
        let scene = on_the_ground(0.0);
        let edges = Edges::of(&scene, false);
        // Six of the roof and five upright ones: not the re-entrant corner, the foot, nor the rim of the ground.
        assert_eq!(edges.wedges.len(), 11);
        for wedge in &edges.wedges {
            assert!((wedge.exterior_rad - 1.5 * PI).abs() < 1e-12, "{wedge:?}");
            let [first, second] = &wedge.flanks;
            assert!((first.inside.cross(&first.normal) - wedge.along).norm() < 1e-12);
            assert!((second.inside.cross(&second.normal) + wedge.along).norm() < 1e-12);
            // From each face its own angle, and none from within.
            let middle = wedge.point(0.5 * wedge.length_m);
            let angle = |p: Vec3| wedge.about(&p).map(|at| at.angle_rad());
            assert!(angle(middle + first.inside + 1e-6 * first.normal).unwrap() < 2e-6);
            assert!(angle(middle + second.inside + 1e-6 * second.normal).unwrap() > 1.5 * PI - 2e-6);
            assert!(angle(middle + first.inside + second.inside).is_none());
            assert!((angle(middle + first.normal + second.normal).unwrap() - 0.75 * PI).abs() < 1e-12);
        }
        // With rims, the ground's own: the feet of the walls rest on it.
        assert_eq!(Edges::of(&scene, true).wedges.len(), 15);
    }

    #[test]
    fn vertices_weld_within_a_millimetre() {
        assert_eq!(Edges::of(&on_the_ground(0.9e-3), false).wedges.len(), 11);
        assert_eq!(Edges::of(&on_the_ground(1.1e-3), false).wedges.len(), 5);
    }

    #[test]
    fn flat_folds_and_foreign_faces_make_no_edge() {
        let roof = |turn: f64, other: u32| {
            let (sin, cos) = turn.to_radians().sin_cos();
            let left: &[[f64; 3]] = &[
                [-2.0, 0.0, 0.0],
                [0.0, 0.0, 0.0],
                [0.0, 5.0, 0.0],
                [-2.0, 5.0, 0.0],
            ];
            let right = [
                [0.0, 0.0, 0.0],
                [2.0 * cos, 0.0, -2.0 * sin],
                [2.0 * cos, 5.0, -2.0 * sin],
                [0.0, 5.0, 0.0],
            ];
            Edges::of(&scene_of(&[(1, left), (other, &right)]), false)
                .wedges
                .len()
        };
        assert_eq!(
            [roof(4.9, 1), roof(5.1, 1), roof(-20.0, 1), roof(20.0, 2)],
            [0, 1, 0, 0]
        );
    }
}
