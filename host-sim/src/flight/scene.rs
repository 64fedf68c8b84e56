//! A scene is a world to fly in.

use nalgebra::Vector3;

use super::Obstacles;
use crate::scene::Scene;

impl Obstacles for Scene {
    fn blocked(&self, from: [f64; 3], to: [f64; 3]) -> bool {
        Scene::blocked(self, from, to)
    }

    fn reflected(&self, from: [f64; 3], to: [f64; 3]) -> bool {
        let (from, to) = (Vector3::from(from), Vector3::from(to));
        self.faces().iter().any(|face| {
            let (before, behind) = (face.height_m(&from), face.height_m(&to));
            if before <= 0.0 || behind <= 0.0 {
                return false;
            }
            // Where the line from the image meets the plane.
            let image = from - face.normal() * (2.0 * before);
            let point = image + (to - image) * (before / (before + behind));
            // A millimetre before the face, so that it is not in its own way.
            let before_it = (point + face.normal() * 1e-3).into();
            face.contains(&point)
                && !Scene::blocked(self, from.into(), before_it)
                && !Scene::blocked(self, before_it, to.into())
        })
    }

    fn inside_solid(&self, point: [f64; 3]) -> bool {
        Scene::inside_solid(self, point)
    }

    fn relief_m(&self, place: [f64; 3]) -> f64 {
        self.uneven().map_or(0.0, |uneven| uneven.relief_m(&place.into()))
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let bounds = Scene::bounds(self);
        (bounds.min_m, bounds.max_m)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::flight::{FlightConfig, FlightPlan, Obstacles, WindConfig};
    use crate::scene::{Face, Scene};
    use crate::seeded::{Seeded, Source};
    use crate::tracer::Tracer;

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
    fn fly(name: &str, seed: u64, duration_s: f64, wind: &WindConfig) -> (FlightPlan, f64) {
        let scene = Scene::load(name).expect("a built-in scene");
        let config = FlightConfig {
            duration_s,
            wind: wind.clone(),
            ..FlightConfig::default()
        };
        let plan = FlightPlan::plan(&scene, &config, seed).unwrap_or_else(|e| panic!("{name} {seed}: {e}"));
        let mut least = f64::INFINITY;
        for k in 0..(duration_s * 20.0) as u32 {
            let p = plan.uav().place_m(f64::from(k) * 0.05);
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
                let (plan, least_m) = fly(name, seed, 40.0, &WindConfig::default());
                println!("{name} {seed}: {least_m:.2} m, {:?}", plan.contact());
                assert!(least_m > 0.9 * clearance_m, "{name} {seed}: {least_m} m");
            }
        }
    }

    #[test]
    fn in_wind_four_tenths_of_the_clearance_are_left_and_under_a_roof_it_is_calm() {
        let storm = WindConfig {
            w20_kn: 30.0,
            ..WindConfig::default()
        };
        for name in ["outdoor", "street"] {
            let (plan, least_m) = fly(name, 1, 40.0, &storm);
            let (calm, _) = fly(name, 1, 40.0, &WindConfig::default());
            println!("{name}: {least_m:.2} m");
            assert!(least_m > 0.4 * 1.5, "{name}: {least_m} m");
            let off_m = (plan.uav().place_m(30.0) - calm.uav().place_m(30.0)).norm();
            assert!((0.01..0.75).contains(&off_m), "{off_m} m");
            assert_eq!(plan.uav().position_m(), calm.uav().position_m());
            assert_eq!(plan.gmt(), calm.gmt());
        }
        let (windy, calm) = (
            fly("indoor", 1, 40.0, &storm).0,
            fly("indoor", 1, 40.0, &WindConfig::default()).0,
        );
        assert_eq!(windy.uav(), calm.uav());
    }

    #[test]
    fn what_one_reflection_reaches_is_what_the_tracer_says() {
        for name in ["outdoor", "indoor"] {
            let scene = Scene::load(name).expect("built in");
            let tracer = Tracer::new(&scene, 1).expect("one reflection");
            let (low, high) = Obstacles::bounds(&scene);
            let mut random = Seeded::new(3, Source::UavRoute);
            let mut point = || {
                let at: [f64; 3] = core::array::from_fn(|i| random.between(low[i] + 0.2, high[i] - 0.2));
                at
            };
            let (mut reached, mut asked) = (0, 0);
            while asked < 200 {
                let (from, to) = (point(), point());
                if Obstacles::inside_solid(&scene, from) || Obstacles::inside_solid(&scene, to) {
                    continue;
                }
                asked += 1;
                let traced = tracer.transmitter(from).trace(to);
                let expected = traced.iter().any(|path| path.order() == 1);
                assert_eq!(scene.reflected(from, to), expected, "{name}: {from:?} to {to:?}");
                reached += u32::from(expected);
            }
            assert!((20..180).contains(&reached), "{name}: {reached} of {asked}");
        }
    }

    #[test]
    fn flights_planned_for_reflections_keep_their_promise() {
        let scene = Scene::load("outdoor").expect("built in");
        let config = FlightConfig::covered();
        for seed in 1..=5 {
            let plan = FlightPlan::plan(&scene, &config, seed).expect("room");
            let contact = plan.contact();
            assert!(
                (0.6..=0.8).contains(&contact.visible_share),
                "{seed}: {contact:?}"
            );
            assert!(contact.reflected_share >= 0.7, "{seed}: {contact:?}");
            assert!(contact.longest_outage_s <= 18.0, "{seed}: {contact:?}");
            assert!(contact.low_start_s >= 10.0, "{seed}: {contact:?}");
        }
    }

    #[test]
    fn no_flight_touches_a_wall_in_many_cities() {
        for seed in 0..12 {
            let (plan, least_m) = fly(&format!("city:{seed}"), 100 + seed, 30.0, &WindConfig::default());
            println!("city {seed}: {least_m:.2} m, {:?}", plan.contact());
            assert!(least_m > 1.2, "city {seed}: {least_m} m");
        }
    }
}
