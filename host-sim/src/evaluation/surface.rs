//! The true surfaces of a scene: the nearest one to a point and its distance. Where ground has relief and facades have panels, these are meant,
//! not the planes of their faces.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use bvh::point_query::PointDistance;
use nalgebra::{Point3, Vector3};

use crate::scene::{Face, Scene, Uneven};

/// Boxes of flat faces are this much larger on every side, m: a box without volume would break the tree's heuristic.
const BOX_PADDING_M: f64 = 1e-6;

/// Surfaces this much apart at a point meet there, m.
const TOGETHER_M: f64 = 0.01;

/// A search tree over the faces of a scene.
pub struct Surfaces<'s> {
    faces: Vec<SearchFace<'s>>,
    tree: Bvh<f64, 3>,
    uneven: Option<&'s Uneven>,
}

/// A face on its way into the tree.
struct SearchFace<'s> {
    face: &'s Face,
    /// The surface that lies off it.
    uneven: Option<&'s Uneven>,
    number: u32,
    bounds: Aabb<f64, 3>,
    node: usize,
}

impl Bounded<f64, 3> for SearchFace<'_> {
    fn aabb(&self) -> Aabb<f64, 3> {
        self.bounds
    }
}

impl BHShape<f64, 3> for SearchFace<'_> {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl PointDistance<f64, 3> for SearchFace<'_> {
    fn distance_squared(&self, point: Point3<f64>) -> f64 {
        let height_m = |foot: &Vector3<f64>| {
            self.uneven
                .map_or(0.0, |uneven| uneven.height_m(self.number, foot))
        };
        surface_distance_m(self.face, &point.coords, height_m).powi(2)
    }
}

impl<'s> Surfaces<'s> {
    /// Builds the tree.
    pub fn new(scene: &'s Scene) -> Self {
        let searchable = |(face, number): (&'s Face, u32)| {
            let uneven = scene.uneven().filter(|uneven| uneven.is_off(number));
            let padding_m = BOX_PADDING_M + uneven.map_or(0.0, |uneven| uneven.greatest_m(number));
            let mut bounds = Aabb::empty();
            for vertex in face.vertices() {
                bounds.grow_mut(&Point3::from(vertex.add_scalar(padding_m)));
                bounds.grow_mut(&Point3::from(vertex.add_scalar(-padding_m)));
            }
            SearchFace {
                face,
                uneven,
                number,
                bounds,
                node: 0,
            }
        };
        let mut faces: Vec<_> = scene.faces().iter().zip(0..).map(searchable).collect();
        let tree = Bvh::build(&mut faces);
        let uneven = scene.uneven();
        Self { faces, tree, uneven }
    }

    /// Index in the scene of the face whose surface is nearest to a point, and its distance, m.
    pub fn nearest(&self, point_m: [f64; 3]) -> Option<(u32, f64)> {
        let (face, distance_m) = self.tree.nearest_to(Point3::from(point_m), &self.faces)?;
        Some((face.number, distance_m))
    }

    /// The faces whose surfaces meet at a true point of one of them: one, or those that share an edge there.
    pub(super) fn faces_at(&self, point_m: [f64; 3]) -> impl Iterator<Item = &'s Face> {
        let point = Point3::from(point_m);
        let least_m = self.nearest(point_m).map_or(0.0, |(_, distance_m)| distance_m);
        let near =
            move |face: &&SearchFace<'s>| face.distance_squared(point) <= (least_m + TOGETHER_M).powi(2);
        self.faces.iter().filter(near).map(|found| found.face)
    }

    /// The point of a face's surface over a point of its plane, m.
    pub(super) fn on_surface(&self, number: u32, foot: Vector3<f64>) -> Vector3<f64> {
        match (self.uneven, self.face(number)) {
            (Some(uneven), Some(face)) => foot + face.normal() * uneven.height_m(number, &foot),
            _ => foot,
        }
    }

    /// A face by its index in the scene.
    pub(super) fn face(&self, number: u32) -> Option<&'s Face> {
        // The tree numbers its nodes, the faces stay in their order.
        self.faces.get(number as usize).map(|f| f.face)
    }
}

/// Distance of a point to a surface over a polygon, m, along the polygon's normal where the foot lies inside, else to the nearest edge of
/// what lies over it. Slopes of a degree make the way along the normal longer than the shortest by 1.5 in ten thousand.
fn surface_distance_m(face: &Face, point: &Vector3<f64>, over_m: impl Fn(&Vector3<f64>) -> f64) -> f64 {
    let height_m = face.height_m(point);
    let foot = point - face.normal() * height_m;
    let height_m = height_m - over_m(&foot);
    if face.contains(&foot) {
        height_m.abs()
    } else {
        libm::hypot(height_m, face.edge_distance_m(&foot))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::scene::{DEFAULT_FREQUENCY_HZ, Material, Placement, RawFace, Unevenness};
    use crate::tracer::Tracer;

    /// A wall 4 m wide and 3 m high in the plane y = 10, seen from the south, with a doorway 1 m wide and 2 m high.
    pub(in crate::evaluation) fn wall_with_a_door() -> Scene {
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
        let wall = RawFace {
            vertices: outline.map(|[x, z]| [x, 10.0, z]).to_vec(),
            ..RawFace::default()
        };
        Scene::new("wall", Material::PAPER, DEFAULT_FREQUENCY_HZ, None, vec![wall]).expect("a polygon")
    }

    #[test]
    fn distances_to_a_wall_are_those_of_geometry() {
        let scene = wall_with_a_door();
        let surfaces = Surfaces::new(&scene);
        for (point, expected_m) in [
            ([3.0, 9.0, 1.0], 1.0),   // before the wall
            ([3.0, 10.2, 1.0], 0.2),  // behind it
            ([1.5, 10.0, 0.5], 0.5),  // in the doorway
            ([1.6, 10.3, 0.5], 0.5),  // beside and behind a door post
            ([4.0, 14.0, 6.0], 5.0),  // over and behind the top
            ([-2.0, 12.0, 4.0], 3.0), // off a corner: 2, 2, 1
        ] {
            let (face, distance_m) = surfaces.nearest(point).expect("a wall");
            assert_eq!(face, 0);
            assert!((distance_m - expected_m).abs() < 1e-12, "{point:?}: {distance_m}");
        }
    }

    #[test]
    fn the_tree_finds_what_trying_all_faces_finds() {
        let scene = Scene::load("outdoor").expect("built in");
        let surfaces = Surfaces::new(&scene);
        let mut stream = Stream::new(2, 0);
        for _ in 0..500 {
            let mut uniform = |low: f64, high: f64| low + (high - low) * stream.uniform();
            let point = [uniform(-20.0, 140.0), uniform(-20.0, 140.0), uniform(-5.0, 40.0)];
            let all = scene
                .faces()
                .iter()
                .map(|f| surface_distance_m(f, &point.into(), |_| 0.0));
            let least = all.fold(f64::INFINITY, f64::min);
            let (face, distance_m) = surfaces.nearest(point).expect("faces");
            assert!((distance_m - least).abs() < 1e-9);
            let again = surface_distance_m(&scene.faces()[face as usize], &point.into(), |_| 0.0);
            assert!((again - least).abs() < 1e-9);
        }
    }

    #[test]
    fn a_point_on_the_true_relief_or_panel_is_on_the_surface() {
        let scene = || Scene::load("outdoor").expect("built in");
        let placement = Placement {
            moved_m: [40.0, -7.0, 11.0],
            turned_deg: 25.0,
        };
        let uneven = scene().with_unevenness(Unevenness::real());
        let (flat, uneven) = [scene(), uneven]
            .map(|scene| scene.placed(placement).expect("near"))
            .into();
        let (planes, surfaces) = (Surfaces::new(&flat), Surfaces::new(&uneven));
        let tracer = Tracer::new(&uneven, 1).expect("few reflections");
        let mut stream = Stream::new(5, 0);
        let (mut met, mut off, mut worst) = (0, 0, 0.0_f64);
        while met < 300 {
            let mut free = || loop {
                let at = [120.0, 120.0, 20.0].map(|size| size * stream.uniform());
                let at = placement.place(&at.into()).into();
                if uneven.is_free(at) {
                    return at;
                }
            };
            let (tx, rx) = (free(), free());
            for path in tracer
                .transmitter(tx)
                .trace(rx)
                .iter()
                .filter(|path| path.order() == 1)
            {
                let (_, distance_m) = surfaces.nearest(path.vertices()[0]).expect("faces");
                let (_, from_plane_m) = planes.nearest(path.vertices()[0]).expect("faces");
                met += 1;
                off += usize::from(distance_m > 1e-3);
                worst = worst.max(from_plane_m);
            }
        }
        // The others are beyond the rim of their panel, or those of the flat faces.
        assert!(off * 12 < met, "{off} of {met}");
        assert!(worst > 0.1, "{worst}");
        // Samples of what is lit lie on it too.
        let ground = (0..uneven.faces().len() as u32).find(|&f| uneven.faces()[f as usize].normal().z > 0.99);
        let foot = placement.place(&Vector3::new(3.0, 4.0, 0.0));
        let number = ground.expect("a face that looks up");
        let sample = surfaces.on_surface(number, foot);
        assert!((sample.z - foot.z - uneven.uneven().expect("outdoors").relief_m(&foot)).abs() < 1e-12);
    }
}
