//! The scene as a world has it: where it stands, and how far its surfaces are off its faces.

use serde::{Deserialize, Serialize};

use crate::input::InputError;
use crate::scene::{Placement, Scene, Unevenness};

/// What becomes of a scene before anything flies in it. The default takes it as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneConfig {
    /// Where it stands as a whole; the flight goes with it.
    pub placement: Placement,
    /// How far its surfaces are off its faces.
    pub surfaces: Unevenness,
}

impl SceneConfig {
    /// Uneven ground and facades, where the scene's file has it.
    pub(super) fn real() -> Self {
        Self {
            surfaces: Unevenness::real(),
            ..Self::default()
        }
    }

    /// A scene as this says.
    ///
    /// # Errors
    /// [`InputError`] naming the scene when it does not fit where it shall stand.
    pub fn applied(&self, scene: Scene) -> Result<Scene, InputError> {
        let name = scene.name().to_owned();
        scene
            .with_unevenness(self.surfaces)
            .placed(self.placement)
            .map_err(|error| InputError::new(format!("scene {name}: {error}")))
    }

    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        let placement = self.placement.check().map_err(|error| error.under("placement"));
        placement.and_then(|()| self.surfaces.check().map_err(|error| error.under("surfaces")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{FlightConfig, WindConfig};
    use crate::sensors::Event;
    use crate::world::{Profile, World, WorldConfig};
    use nalgebra::Vector3;

    /// A short flight in wind, without the waves that take long.
    fn short(scene: SceneConfig) -> WorldConfig {
        let flight = FlightConfig {
            duration_s: 20.0,
            wind: WindConfig::real(),
            ..FlightConfig::default()
        };
        WorldConfig {
            scene,
            flight,
            ..WorldConfig::of(Profile::Budget)
        }
    }

    fn moved() -> SceneConfig {
        SceneConfig {
            placement: Placement {
                moved_m: [310.0, -75.0, 42.0],
                turned_deg: 137.0,
            },
            ..SceneConfig::real()
        }
    }

    #[test]
    fn the_flight_through_a_moved_scene_is_the_moved_flight() {
        let placement = moved().placement;
        for name in ["outdoor", "street", "indoor"] {
            let (here, there) = (short(SceneConfig::real()), short(moved()));
            let scenes = [&here, &there].map(|config| config.scene(name).expect("built in"));
            let here = World::new(&scenes[0], here, 3).expect("a flight");
            let there = World::new(&scenes[1], there, 3).expect("a flight");
            assert_eq!(here.sweeps(), there.sweeps());
            for sweep in 0..here.sweeps() {
                let [a, b] = [&here, &there].map(|world| world.flight().sweep_truth(sweep));
                let off = |a: &Vector3<f64>, b: &Vector3<f64>| (placement.place(a) - b).norm();
                assert!(off(&a.uav.position_m, &b.uav.position_m) < 1e-9, "{name} {sweep}");
                assert!(off(&a.gmt_position_m, &b.gmt_position_m) < 1e-9, "{name} {sweep}");
                let turned = placement.rotation() * a.uav.velocity_m_per_s;
                assert!((turned - b.uav.velocity_m_per_s).norm() < 1e-9);
                for (a, b) in [(a.uav.attitude, b.uav.attitude), (a.gmt_attitude, b.gmt_attitude)] {
                    let off = (placement.rotation() * a).into_inner() - b.into_inner();
                    assert!(off.norm() < 1e-9, "{name} {sweep}: {off}");
                }
            }
            // What the body feels is the same; what the GMT says is of where it is now.
            let (mut felt, mut said) = (0, 0);
            for (a, b) in here.flight().events().zip(there.flight().events()) {
                assert_eq!(a.uav_time_ns, b.uav_time_ns);
                match (a.event, b.event) {
                    (Event::Imu(a), Event::Imu(b)) => {
                        assert_eq!(a, b);
                        felt += 1;
                    }
                    (Event::Beacon(a), Event::Beacon(b)) => {
                        let off = placement.place(&a.position_m.into()) - Vector3::from(b.position_m);
                        assert!(off.norm() < 1e-9);
                        assert_eq!(a.heading_pitch_roll_rad, [0.0; 3]);
                        assert_eq!(b.heading_pitch_roll_rad, [placement.turned_rad(), 0.0, 0.0]);
                        said += 1;
                    }
                    _ => {}
                }
            }
            assert!(felt > 19_000 && said > 30, "{felt} {said}");
            // So the receiver is given the same samples, but for their last bits.
            let [a, b] = [&here, &there].map(|world| world.sweep(9).expect("sound"));
            assert_eq!(a.link.paths.len(), b.link.paths.len());
            let exponents = |heard: &crate::world::HeardSweep| {
                heard
                    .beams
                    .blocks
                    .iter()
                    .map(|block| block.exponent)
                    .collect::<Vec<_>>()
            };
            assert_eq!(exponents(&a), exponents(&b), "{name}");
        }
    }

    #[test]
    fn the_gmt_drives_over_the_relief_and_the_flight_stays() {
        let uneven = SceneConfig {
            placement: moved().placement,
            ..SceneConfig::real()
        };
        let level = SceneConfig {
            surfaces: Unevenness::default(),
            ..uneven
        };
        let [level, uneven] = [level, uneven].map(short);
        let scenes = [&level, &uneven].map(|config| config.scene("street").expect("built in"));
        let level = World::new(&scenes[0], level, 3).expect("a flight");
        let world = World::new(&scenes[1], uneven, 3).expect("a flight");
        let (flat, relief) = (level.flight().plan(), scenes[1].uneven().expect("outdoors"));
        let plan = world.flight().plan();
        assert_eq!(plan.uav(), flat.uav());
        let mut most_m = 0.0_f64;
        for (stop, before) in plan.gmt().stops_m().iter().zip(flat.gmt().stops_m()) {
            let rise = stop - before;
            assert!((rise.z - relief.relief_m(before)).abs() < 1e-9 && rise.xy().norm() < 1e-9);
            most_m = most_m.max(rise.z.abs());
        }
        assert!(most_m > 0.02, "{most_m}");
    }

    #[test]
    fn a_scene_that_nothing_becomes_of_is_the_scene() {
        let config = WorldConfig::of(Profile::Budget);
        let scene = config.scene("street").expect("built in");
        assert!(scene.placement().is_none() && scene.uneven().is_none());
        let plain = Scene::load("street").expect("built in");
        let faces = |scene: &Scene| {
            scene
                .faces()
                .iter()
                .map(|f| f.vertices().to_vec())
                .collect::<Vec<_>>()
        };
        assert_eq!(faces(&scene), faces(&plain));
        // Moved back it is what it was.
        let there = moved().applied(plain).expect("near");
        assert_ne!(faces(&there), faces(&scene));
        let back = there.placed(Placement::default()).expect("near");
        assert_eq!(faces(&back), faces(&scene));
    }

    #[test]
    fn figures_out_of_range_are_named() {
        let message = |change: fn(&mut SceneConfig)| {
            let mut config = SceneConfig::default();
            change(&mut config);
            config.check().expect_err("must be refused").to_string()
        };
        assert!(message(|c| c.placement.turned_deg = f64::NAN).starts_with("placement.turned_deg is NaN"));
        let rms = message(|c| c.surfaces.ground_relief_rms_m = -0.1);
        assert!(
            rms.starts_with("surfaces.ground_relief_rms_m is -0.1, expected 0 to 1"),
            "{rms}"
        );
        assert!(message(|c| c.surfaces.ground_relief_length_m = 0.0).contains("expected 5 to 1000"));
        assert!(SceneConfig::real().check().is_ok());
    }
}
