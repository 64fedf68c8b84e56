//! A scene is a world to fly in.

use super::Obstacles;
use crate::scene::Scene;

impl Obstacles for Scene {
    fn blocked(&self, from: [f64; 3], to: [f64; 3]) -> bool {
        Scene::blocked(self, from, to)
    }

    fn inside_solid(&self, point: [f64; 3]) -> bool {
        Scene::inside_solid(self, point)
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let bounds = Scene::bounds(self);
        (bounds.min_m, bounds.max_m)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::flight::{FlightConfig, FlightPlan};
    use crate::scene::{Face, Scene};

    /// Distance of a point to a face: to its plane where the foot lies in the polygon, else to its nearest edge.
    fn face_distance_m(face: &Face, p: &Vector3<f64>) -> f64 {
        let height = face.height_m(p);
        let foot = p - face.normal() * height;
        if face.contains(&foot) {
            return height.abs();
        }
        let vertices = face.vertices();
        (0..vertices.len())
            .map(|k| (vertices[k], vertices[(k + 1) % vertices.len()]))
            .map(|(a, b)| {
                let share = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                (a + (b - a) * share - p).norm()
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Least distance of the UAV to any face over a planned flight, m, and the plan.
    fn fly(name: &str, seed: u64, duration_s: f64) -> (FlightPlan, f64) {
        let scene = Scene::load(name).expect("a built-in scene");
        let config = FlightConfig {
            duration_s,
            ..FlightConfig::default()
        };
        let plan = FlightPlan::plan(&scene, &config, seed).unwrap_or_else(|e| panic!("{name} {seed}: {e}"));
        let mut least = f64::INFINITY;
        for k in 0..(duration_s * 20.0) as u32 {
            let p = plan.uav().position_m().at(f64::from(k) * 0.05)[0];
            assert!(
                !scene.inside_solid(p.into()),
                "{name} {seed}: inside a wall at {p:?}"
            );
            let g = plan.gmt().at(f64::from(k) * 0.05).0;
            assert!(
                !scene.inside_solid(g.into()),
                "{name} {seed}: GMT inside a wall at {g:?}"
            );
            for face in scene.faces() {
                least = least.min(face_distance_m(face, &p));
                assert!(
                    face_distance_m(face, &g) > 0.2,
                    "{name} {seed}: GMT touches a wall at {g:?}"
                );
            }
        }
        (plan, least)
    }

    #[test]
    fn no_flight_touches_a_wall_in_any_built_in_scene() {
        for (name, clearance_m) in [
            ("outdoor", 1.5),
            ("street", 1.5),
            ("indoor", 0.4),
            ("outdoor_a", 1.5),
        ] {
            for seed in 0..3 {
                let (plan, least_m) = fly(name, seed, 40.0);
                println!("{name} {seed}: {least_m:.2} m, {:?}", plan.contact());
                assert!(least_m > 0.9 * clearance_m, "{name} {seed}: {least_m} m");
            }
        }
    }

    #[test]
    fn no_flight_touches_a_wall_in_many_cities() {
        for seed in 0..12 {
            let (plan, least_m) = fly(&format!("city:{seed}"), 100 + seed, 30.0);
            println!("city {seed}: {least_m:.2} m, {:?}", plan.contact());
            assert!(least_m > 1.2, "city {seed}: {least_m} m");
        }
    }
}
