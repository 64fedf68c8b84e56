//! Beams: the part of space that an image lights through an aperture, the part of the last face it can come from.
//!
//! A beam starts at the aperture and is bounded by the face's plane and by the planes through the image and the aperture's
//! edges. Clipping the next face's hull by these planes gives the next aperture. Each cut leaves [`SLACK_M`] more than
//! exact geometry would, so rounding never loses a path; what it keeps too much falls to the exact tests at the end.

use crate::scene::{Face, Scene, Vec3};

/// How far outside a bounding plane still counts as inside, m. Exceeds rounding in scenes of a kilometre by far.
pub(super) const SLACK_M: f64 = 1e-6;

/// Edges shorter than this bound nothing: the plane through the image would be ill-defined, m.
const SHORTEST_EDGE_M: f64 = 1e-3;

/// How clear of both ends an occluder must stand before it hides a whole aperture, m. Wider than the margin of the exact
/// visibility test, so that what is dropped here would have been blocked there.
const CLEAR_M: f64 = 1e-5;

/// A half-space: inside is where `normal . p >= offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) normal: Vec3,
    pub(super) offset_m: f64,
}

impl Plane {
    /// Front of a face.
    pub(super) fn front_of(face: &Face) -> Self {
        let normal = *face.normal();
        Self {
            normal,
            offset_m: -face.height_m(&Vec3::zeros()),
        }
    }

    /// Signed distance, m; positive inside.
    #[inline]
    pub(super) fn distance_m(&self, point: &Vec3) -> f64 {
        self.normal.dot(point) - self.offset_m
    }

    /// Inside, or outside by no more than the slack.
    #[inline]
    pub(super) fn admits(&self, point: &Vec3) -> bool {
        self.distance_m(point) >= -SLACK_M
    }
}

/// Appends the planes through the image and the edges of a convex aperture, which runs counter-clockwise as seen from the
/// front while the image is behind it.
pub(super) fn push_sides(image: &Vec3, aperture: &[Vec3], planes: &mut Vec<Plane>) {
    for (i, a) in aperture.iter().enumerate() {
        let b = &aperture[(i + 1) % aperture.len()];
        if (b - a).norm_squared() < SHORTEST_EDGE_M * SHORTEST_EDGE_M {
            continue;
        }
        let normal = (a - image).cross(&(b - image)).normalize();
        planes.push(Plane {
            normal,
            offset_m: normal.dot(image),
        });
    }
}

/// Scratch space of [`Clipper::clip`], kept to save allocations.
#[derive(Default)]
pub(super) struct Clipper {
    pub(super) polygon: Vec<Vec3>,
    spare: Vec<Vec3>,
}

impl Clipper {
    /// Clips a convex polygon by all planes, into `self.polygon`. False when nothing is left.
    pub(super) fn clip(&mut self, polygon: &[Vec3], planes: &[Plane]) -> bool {
        self.polygon.clear();
        self.polygon.extend_from_slice(polygon);
        planes.iter().all(|plane| self.cut(plane))
    }

    /// One step of Sutherland and Hodgman.
    fn cut(&mut self, plane: &Plane) -> bool {
        let depth = |p: &Vec3| plane.distance_m(p) + SLACK_M;
        if self.polygon.iter().all(|p| depth(p) >= 0.0) {
            return true;
        }
        self.spare.clear();
        let Some(mut from) = self.polygon.last().copied() else {
            return false;
        };
        let mut d_from = depth(&from);
        for &to in &self.polygon {
            let d_to = depth(&to);
            if (d_from < 0.0) != (d_to < 0.0) {
                self.spare.push(from + (to - from) * (d_from / (d_from - d_to)));
            }
            if d_to >= 0.0 {
                self.spare.push(to);
            }
            (from, d_from) = (to, d_to);
        }
        std::mem::swap(&mut self.polygon, &mut self.spare);
        self.polygon.len() >= 3
    }
}

/// Whether a single convex face stands between the image and all of an aperture on `target`.
///
/// Seen from one point, the shadow of a convex face is convex: when it holds every corner of the aperture, it holds the
/// aperture. `through` is the face that the image was last mirrored at; only what stands in front of it counts.
pub(super) fn hidden(
    scene: &Scene,
    image: &Vec3,
    through: Option<u32>,
    aperture: &[Vec3],
    target: u32,
) -> bool {
    // Where the ray from the image to a corner comes into being: what stands before would be refused below, but it need
    // not be searched for.
    let start = |corner: &Vec3| match through {
        None => *image,
        Some(face) => {
            let face = &scene.faces()[face as usize];
            let (behind, before) = (-face.height_m(image), face.height_m(corner));
            image + (corner - image) * (behind / (behind + before))
        }
    };
    one_face_crosses(
        scene,
        aperture.iter().map(|corner| (start(corner), *corner)),
        through,
        target,
    )
}

/// Whether one and the same convex face crosses all segments, well clear of the faces that they start and end on.
pub(super) fn one_face_crosses(
    scene: &Scene,
    segments: impl Iterator<Item = (Vec3, Vec3)> + Clone,
    start: Option<u32>,
    end: u32,
) -> bool {
    let faces = scene.faces();
    let clear = |from: &Vec3, _: &Vec3, at: &Vec3| {
        let clear_of_start = match start {
            None => (at - from).norm(),
            Some(face) => faces[face as usize].height_m(at),
        };
        clear_of_start > CLEAR_M && faces[end as usize].height_m(at) > CLEAR_M
    };
    one_face(scene, segments, |face| face != end && Some(face) != start, clear)
}

/// Whether one and the same convex face, other than the given ones, crosses all segments well clear of their ends.
pub(super) fn one_face_hides(
    scene: &Scene,
    segments: impl Iterator<Item = (Vec3, Vec3)> + Clone,
    except: &[u32],
) -> bool {
    let clear = |from: &Vec3, to: &Vec3, at: &Vec3| (at - from).norm().min((at - to).norm()) > CLEAR_M;
    one_face(scene, segments, |face| !except.contains(&face), clear)
}

/// Whether one and the same convex face of those accepted crosses all segments, each at a place (start, end, place) that is
/// clear.
fn one_face(
    scene: &Scene,
    segments: impl Iterator<Item = (Vec3, Vec3)> + Clone,
    accepted: impl Fn(u32) -> bool,
    clear: impl Fn(&Vec3, &Vec3, &Vec3) -> bool,
) -> bool {
    let Some((from, to)) = segments.clone().next() else {
        return false;
    };
    let occluder = scene.find_crossed(from, to, |candidate| {
        let face = &scene.faces()[candidate as usize];
        accepted(candidate)
            && face.is_convex()
            && segments.clone().all(|(from, to)| {
                face.crossing(&from, &to)
                    .is_some_and(|t| clear(&from, &to, &(from + (to - from) * t)))
            })
    });
    occluder.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, RawFace};

    /// A target at y = 10, seen from the origin past an occluder at y = 5.
    fn behind(occluder: &[[f64; 2]]) -> bool {
        let upright = |corners: &[[f64; 2]], y: f64| RawFace {
            vertices: corners.iter().map(|c| [c[0], y, c[1]]).collect(),
            ..RawFace::default()
        };
        let square = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]];
        let scene = Scene::new(
            "test",
            Material::PAPER,
            30e9,
            None,
            vec![upright(&square, 10.0), upright(occluder, 5.0)],
        )
        .unwrap();
        hidden(&scene, &Vec3::zeros(), None, scene.faces()[0].hull(), 0)
    }

    #[test]
    fn only_a_convex_face_that_covers_all_hides() {
        assert!(behind(&[[-1.1, -1.1], [1.1, -1.1], [1.1, 1.1], [-1.1, 1.1]]));
        assert!(
            !behind(&[[-1.1, -1.1], [1.1, -1.1], [1.1, 1.1], [-0.9, 0.9]]),
            "a corner looks out"
        );
        // A U covers all four corners, but not what is seen through its gap.
        let u = [
            [-3.0, -3.0],
            [3.0, -3.0],
            [3.0, 3.0],
            [0.5, 3.0],
            [0.5, -1.5],
            [-0.5, -1.5],
            [-0.5, 3.0],
            [-3.0, 3.0],
        ];
        assert!(!behind(&u));
    }

    #[test]
    fn clipping_keeps_the_slack_and_no_more() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        let right_of = |x: f64| Plane {
            normal: Vec3::x(),
            offset_m: x,
        };
        let mut clipper = Clipper::default();
        assert!(clipper.clip(&square, &[right_of(0.25)]));
        let least = clipper.polygon.iter().map(|p| p.x).fold(1.0, f64::min);
        assert!((least - (0.25 - SLACK_M)).abs() < 1e-12);
        assert!(clipper.clip(&square, &[right_of(1.0 + 0.5 * SLACK_M)]));
        assert!(!clipper.clip(&square, &[right_of(1.0 + 2.0 * SLACK_M)]));
    }
}
