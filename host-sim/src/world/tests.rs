//! Sweeps of the world follow from its flight and their number alone, and a wrong figure is named.

use super::*;
use crate::flight::FlightConfig;
use crate::paths::Interaction;
use crate::sensors::faults::WrongFix;

/// Two seconds in a small room: four sweeps.
fn short() -> WorldConfig {
    let flight = FlightConfig {
        duration_s: 2.0,
        rest_s: 0.5,
        ..FlightConfig::default()
    };
    WorldConfig {
        flight,
        ..WorldConfig::of(Profile::Budget)
    }
}

#[test]
fn a_sweep_depends_on_the_world_and_its_number_only() {
    let scene = Scene::load("outdoor").expect("built in");
    let world = World::new(&scene, short(), 3).expect("a flight");
    let again = World::new(&scene, short(), 3).expect("a flight");
    assert_eq!(world.sweeps(), 4);
    let late = world.sweep(3).expect("sound");
    let _ = again.sweep(0).expect("sound");
    let same = again.sweep(3).expect("sound");
    assert_eq!(
        (&late.beams, &late.squint, &late.link),
        (&same.beams, &same.squint, &same.link)
    );
    assert_eq!((late.beams.blocks.len(), late.squint.blocks.len()), (72, 33));
    let other = World::new(&scene, short(), 4)
        .expect("a flight")
        .sweep(3)
        .expect("sound");
    assert_ne!(late.beams, other.beams);
}

#[test]
fn both_ends_are_where_the_flight_says() {
    let scene = Scene::load("outdoor").expect("built in");
    let world = World::new(&scene, short(), 3).expect("a flight");
    let heard = world.sweep(2).expect("sound");
    let truth = world.flight().sweep_truth(2);
    assert_eq!(heard.link.rx, <[f64; 3]>::from(truth.uav.position_m));
    assert_eq!(heard.link.tx, <[f64; 3]>::from(truth.gmt_position_m));
    let instant = instant(&truth).expect("sound");
    assert!((instant.attitude.matrix() - truth.uav.attitude.matrix()).norm() < 1e-12);
    assert!((instant.gmt_attitude.matrix() - truth.gmt_attitude.matrix()).norm() < 1e-12);
}

#[test]
fn a_wrong_fix_is_heard_in_its_sweeps_and_the_truth_stays() {
    let scene = Scene::load("outdoor").expect("built in");
    let sound = World::new(&scene, short(), 3).expect("a flight");
    let mut config = short();
    config.sensors.faults.fix.push(WrongFix {
        sweep: 2,
        sweeps: 1,
        distance_m: 20.0,
    });
    let wrong = World::new(&scene, config, 3).expect("a flight");
    let [told, lied] = [&sound, &wrong].map(|world| world.sweep(2).expect("sound"));
    assert_eq!((&told.link, told.truth), (&lied.link, lied.truth));
    assert_ne!(told.beams, lied.beams);
    assert_ne!(told.squint, lied.squint);
    let [before, after] = [&sound, &wrong].map(|world| world.sweep(1).expect("sound").beams);
    assert_eq!(before, after);
    let shift_m = wrong.flight().wrong_fix_m(2);
    let heard = seen_from(&lied.link, shift_m, 0.01);
    let direct: Vec<_> = heard.paths.iter().filter(|path| path.order == Some(0)).collect();
    let length_m = (lied.truth.uav.position_m + shift_m - lied.truth.gmt_position_m).norm();
    assert_eq!(direct.len(), 1);
    assert!((direct[0].delay_s * SPEED_OF_LIGHT_M_PER_S - length_m).abs() < 1e-9);
}

#[test]
fn a_wrong_figure_is_named() {
    let scene = Scene::load("outdoor").expect("built in");
    let mut config = short();
    config.channel.front_end.adc_bits = 3;
    let error = World::new(&scene, config, 1)
        .expect_err("out of range")
        .to_string();
    assert!(
        error.contains("channel.") && error.contains("adc_bits"),
        "{error}"
    );
}

#[test]
fn the_real_world_has_paths_that_no_mirror_makes_and_walls_of_many_materials() {
    let config = |profile| {
        let world = WorldConfig::of(profile);
        let flight = FlightConfig {
            duration_s: 2.0,
            ..world.flight.clone()
        };
        WorldConfig { flight, ..world }
    };
    let kinds = |config: WorldConfig| {
        let scene = config.scene("outdoor").expect("built in");
        let world = World::new(&scene, config, 3).expect("a flight");
        let heard = world.sweep(1).expect("sound");
        let met = |what| {
            let paths = heard.link.paths.iter();
            let kinds = paths.filter_map(|path| path.kind);
            kinds.filter(|kind| kind.interactions().contains(&what)).count()
        };
        let found = [met(Interaction::Diffraction), met(Interaction::Scattering)];
        (found, scene.materials().len(), heard.beams)
    };
    let (found, materials, budget) = kinds(config(Profile::Budget));
    assert_eq!((found, materials), ([0, 0], 1));
    let (found, materials, real) = kinds(config(Profile::Real));
    assert!(
        found[0] > 0 && found[1] > 10 && materials > 4,
        "{found:?} {materials}"
    );
    assert!(budget != real);
    let mut specular = config(Profile::Real);
    specular.propagation = PropagationConfig::default();
    let (found, materials, _) = kinds(specular);
    assert_eq!((found, materials), ([0, 0], 1));
    // The name alone changes nothing.
    let mut named = config(Profile::Budget);
    named.profile = Profile::Real;
    let (_, _, beams) = kinds(named);
    assert!(beams == budget, "a sweep that differs");
}
