//! Iron in the walls of a building: reinforcement, beams, ducts, each a magnetic dipole of its own direction.
//!
//! B(r) = B_1 (3 (m.r) r - m) / (2 |r|^3), m and r unit vectors, B_1 the field at 1 m along the axis. One dipole for each 3 x 3 m of a
//! wall, 0.1 m behind its face, anywhere in its square. Furniture has none. It belongs to the place, and is drawn face by face.

use nalgebra::Vector3;

use crate::flight::FlightPlan;
use crate::movers::Room;
use crate::scene::{Face, Placement, Scene};
use crate::seeded::{Seeded, Source};

/// Side of the square of a wall that has one dipole, m.
const SQUARE_M: f64 = 3.0;
/// Depth behind the face, m.
const DEPTH_M: f64 = 0.1;
/// Faces that look up or down less than this are upright.
const UPRIGHT: f64 = 0.1;
/// Upright faces lower than this are of furniture, m.
const LEAST_HEIGHT_M: f64 = 2.2;
/// Closer than this, where nobody flies, the field is that at this distance, m.
const LEAST_DISTANCE_M: f64 = 0.1;

/// A dipole.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Dipole {
    place_m: Vector3<f64>,
    /// Direction times the field at 1 m along it, uT.
    moment_ut: Vector3<f64>,
}

/// All dipoles around a flight; none by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WallIron {
    dipoles: Vec<Dipole>,
}

impl WallIron {
    /// Draws the iron around a flight in the scene's own frame, of a field at 1 m along a dipole's axis, uT. None under the sky.
    pub fn draw(scene: &Scene, plan: &FlightPlan, field_ut: f64, seed: u64) -> Self {
        if field_ut <= 0.0 || !Room::of(scene).is_roofed(&plan.gmt().at(0.0).0) {
            return Self::default();
        }
        let faces = scene.faces().iter().zip(0u32..);
        let walls =
            faces.filter(|(face, _)| face.normal().z.abs() < UPRIGHT && height_m(face) >= LEAST_HEIGHT_M);
        Self {
            dipoles: walls
                .flat_map(|(face, number)| {
                    in_wall(face, field_ut, Seeded::numbered(seed, Source::WallIron, number))
                })
                .collect(),
        }
    }

    /// The same iron where a scene stands.
    #[must_use]
    pub fn placed(mut self, placement: &Placement) -> Self {
        for dipole in &mut self.dipoles {
            dipole.place_m = placement.place(&dipole.place_m);
            dipole.moment_ut = placement.rotation() * dipole.moment_ut;
        }
        self
    }

    /// Its field at a place, uT, world frame.
    pub fn field_ut(&self, place_m: &Vector3<f64>) -> Vector3<f64> {
        let of_one = |dipole: &Dipole| {
            let way = place_m - dipole.place_m;
            let distance_m = way.norm().max(LEAST_DISTANCE_M);
            let u = way / distance_m;
            (u * (3.0 * dipole.moment_ut.dot(&u)) - dipole.moment_ut)
                / (2.0 * distance_m * distance_m * distance_m)
        };
        self.dipoles.iter().map(of_one).sum()
    }
}

/// From its lowest to its highest point, m.
fn height_m(face: &Face) -> f64 {
    let heights = || face.vertices().iter().map(|v| v.z);
    heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min)
}

/// The dipoles of a wall, square by square from its lower corner on; one whose place is no part of the face is left out.
fn in_wall(face: &Face, field_ut: f64, mut random: Seeded) -> Vec<Dipole> {
    let along = Vector3::z().cross(face.normal()).normalize();
    let origin = face.vertices()[0];
    let seen = face
        .vertices()
        .iter()
        .map(|v| [(v - origin).dot(&along), v.z - origin.z]);
    let (low, high) = seen.fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), p| {
        (
            [0, 1].map(|i| low[i].min(p[i])),
            [0, 1].map(|i| high[i].max(p[i])),
        )
    });
    let counts = [0, 1].map(|i| libm::ceil((high[i] - low[i]) / SQUARE_M) as u32);
    let mut dipoles = Vec::new();
    for row in 0..counts[1] {
        for column in 0..counts[0] {
            let [x, z] = [column, row].map(|k| SQUARE_M * (f64::from(k) + random.uniform()));
            let on_face = origin + along * (low[0] + x) + Vector3::z() * (low[1] + z);
            let direction = random.normal_vector();
            // On the plane of a wall that leans a little.
            let on_face = on_face - face.normal() * face.height_m(&on_face);
            if face.contains(&on_face) {
                dipoles.push(Dipole {
                    place_m: on_face - face.normal() * DEPTH_M,
                    moment_ut: direction * (field_ut / direction.norm().max(f64::MIN_POSITIVE)),
                });
            }
        }
    }
    dipoles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::FlightConfig;

    fn drawn(name: &str, field_ut: f64, seed: u64) -> (Scene, FlightPlan, WallIron) {
        let scene = Scene::load(name).expect("built in");
        let config = FlightConfig {
            duration_s: 10.0,
            ..FlightConfig::default()
        };
        let plan = FlightPlan::plan(&scene, &config, 2).expect("room");
        let iron = WallIron::draw(&scene, &plan, field_ut, seed);
        (scene, plan, iron)
    }

    #[test]
    fn a_dipole_has_its_field_along_and_across_and_falls_with_the_third_power() {
        let iron = WallIron {
            dipoles: vec![Dipole {
                place_m: Vector3::new(1.0, 2.0, 3.0),
                moment_ut: Vector3::x() * 20.0,
            }],
        };
        let field = |x, y| iron.field_ut(&Vector3::new(1.0 + x, 2.0 + y, 3.0));
        assert!((field(1.0, 0.0) - Vector3::x() * 20.0).norm() < 1e-12);
        assert!((field(-1.0, 0.0) - Vector3::x() * 20.0).norm() < 1e-12);
        assert!((field(0.0, 1.0) + Vector3::x() * 10.0).norm() < 1e-12);
        assert!((field(2.0, 0.0) - Vector3::x() * 2.5).norm() < 1e-12);
        // Free of divergence and of rotation where it is.
        let step = 1e-4;
        let at = Vector3::new(1.7, 2.4, 2.5);
        let slope = |axis: usize| {
            let mut off = Vector3::zeros();
            off[axis] = step;
            (iron.field_ut(&(at + off)) - iron.field_ut(&(at - off))) / (2.0 * step)
        };
        let [dx, dy, dz] = [slope(0), slope(1), slope(2)];
        assert!((dx.x + dy.y + dz.z).abs() < 1e-4 * dx.norm());
        let curl = Vector3::new(dy.z - dz.y, dz.x - dx.z, dx.y - dy.x);
        assert!(curl.norm() < 1e-4 * dx.norm());
        assert_eq!(WallIron::default().field_ut(&at), Vector3::zeros());
    }

    #[test]
    fn walls_of_a_building_have_it_and_nothing_under_the_sky_has() {
        let (scene, plan, iron) = drawn("indoor", 20.0, 7);
        let upright = |face: &&Face| face.normal().z.abs() < UPRIGHT && height_m(face) >= LEAST_HEIGHT_M;
        let walls = scene.faces().iter().filter(upright).count();
        assert!(
            iron.dipoles.len() >= walls && walls > 10,
            "{} of {walls}",
            iron.dipoles.len()
        );
        for dipole in &iron.dipoles {
            assert!((dipole.moment_ut.norm() - 20.0).abs() < 1e-9);
            let behind = |face: &Face| (face.height_m(&dipole.place_m) + DEPTH_M).abs() < 1e-6;
            assert!(scene.faces().iter().any(behind));
        }
        // As much as it disturbs the heading by: fractions of a microtesla in the middle of a room, more along walls.
        let along = (0..100).map(|k| iron.field_ut(&plan.uav().place_m(0.1 * f64::from(k))).norm());
        let most = along.fold(0.0, f64::max);
        assert!((0.2..60.0).contains(&most), "{most}");
        // By its seed, its figure and the face alone; none by 0, and none outdoors.
        assert_eq!(drawn("indoor", 20.0, 7).2, iron);
        assert_ne!(drawn("indoor", 20.0, 8).2, iron);
        let half = drawn("indoor", 10.0, 7).2;
        let at = plan.uav().place_m(1.0);
        assert!((half.field_ut(&at) * 2.0 - iron.field_ut(&at)).norm() < 1e-12);
        assert_eq!(drawn("indoor", 0.0, 7).2, WallIron::default());
        assert_eq!(drawn("outdoor", 20.0, 7).2, WallIron::default());
    }

    #[test]
    fn it_goes_with_the_scene() {
        let (_, plan, iron) = drawn("indoor", 20.0, 7);
        let placement = Placement {
            moved_m: [100.0, -20.0, 3.0],
            turned_deg: 70.0,
        };
        let at = plan.uav().place_m(4.0);
        let there = iron.clone().placed(&placement).field_ut(&placement.place(&at));
        assert!((there - placement.rotation() * iron.field_ut(&at)).norm() < 1e-9);
    }
}
