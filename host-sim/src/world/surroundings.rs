//! What is around a flight beside the scene's own faces as mirrors, and the links that it leaves.

use super::PropagationConfig;
use crate::flight::FlightPlan;
use crate::input::InputError;
use crate::movers::Movers;
use crate::paths::Link;
use crate::sensors::Truth;
use crate::tracer::{Bodies, Crowns, ImageTree, Sheets, TracedPath, Tracer};
use crate::vegetation::Trees;

/// Thin walls, trees and movers around a flight. Each is laid over what a tracer finds, and changes nothing where there is none.
#[derive(Clone, Debug, Default)]
pub(super) struct Surroundings {
    sheets: Option<Sheets>,
    trees: Trees,
    movers: Movers,
    seed: u64,
}

impl Surroundings {
    /// Finds places for them around a flight in the scene's own frame; they stand where the scene stands.
    ///
    /// # Errors
    /// [`InputError`] naming a given mover that has no room.
    pub(super) fn place(
        tracer: &Tracer<'_>,
        config: &PropagationConfig,
        plan: &FlightPlan,
        seed: u64,
    ) -> Result<Self, InputError> {
        let (own, placement) = (tracer.scene().own(), tracer.scene().placement());
        let sheets = config.transmission.then(|| Sheets::of(tracer));
        Ok(Self {
            sheets: sheets.filter(|sheets| !sheets.is_empty()),
            trees: Trees::place(own, &config.vegetation, plan, seed).placed(&placement),
            movers: Movers::place(own, &config.movers, plan, seed)?.placed(&placement),
            seed,
        })
    }

    /// The link between both ends at an instant.
    pub(super) fn link(&self, tracer: &Tracer<'_>, truth: &Truth) -> Link {
        let tree = tracer.transmitter(truth.gmt_position_m.into());
        let rx_m: [f64; 3] = truth.uav.position_m.into();
        let paths = self.laid_over(tracer, &tree, rx_m, truth.time_s, tree.trace(rx_m));
        tree.to_link(rx_m, &paths)
    }

    /// The paths to a receiver at a time, of those that a tree has found.
    fn laid_over(
        &self,
        tracer: &Tracer<'_>,
        tree: &ImageTree<'_>,
        rx_m: [f64; 3],
        time_s: f64,
        mut paths: Vec<TracedPath>,
    ) -> Vec<TracedPath> {
        let (scene, propagation) = (tracer.scene(), tracer.propagation());
        if let Some(sheets) = &self.sheets {
            sheets.trace(tree, rx_m, tracer.max_order(), &mut paths);
        }
        let crowns = Crowns::new(self.trees.all(), scene.frequency_hz(), time_s, self.seed);
        if !self.trees.all().is_empty() && propagation.diffuse.is_some() {
            crowns.scatter(tree, rx_m, &mut paths);
        }
        if !self.movers.is_empty() {
            let bodies = self.movers.at(time_s);
            paths = Bodies::new(&bodies, scene, propagation).among(tree, rx_m, paths);
        }
        if !self.trees.all().is_empty() {
            crowns.weaken(tree, rx_m, &mut paths);
        }
        paths
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Medium, Profile, World, WorldConfig};
    use super::*;
    use crate::flight::FlightConfig;
    use crate::movers::MoversConfig;
    use crate::paths::{Interaction, LinkPath};
    use crate::scene::Scene;
    use crate::vegetation::VegetationConfig;

    /// A short flight.
    fn short(duration_s: f64, propagation: PropagationConfig) -> WorldConfig {
        let flight = FlightConfig {
            duration_s,
            rest_s: 0.5,
            ..FlightConfig::default()
        };
        WorldConfig {
            flight,
            propagation,
            ..WorldConfig::of(Profile::Budget)
        }
    }

    fn crowd() -> MoversConfig {
        MoversConfig {
            moving_cars_per_ha: 30.0,
            people_per_ha: 100.0,
            people_per_100_m2: 20.0,
            ..MoversConfig::real()
        }
    }

    /// What a world through a scene is made of.
    fn parts<'w>(world: &'w World<'_>) -> (&'w Tracer<'w>, &'w Surroundings) {
        match &world.medium {
            Medium::Traced(tracer, surroundings) => (tracer, surroundings),
            Medium::Given(_) => panic!("a scene"),
        }
    }

    /// The links of all sweeps, with these surroundings or with none.
    fn links(world: &World<'_>, surroundings: &Surroundings) -> Vec<Link> {
        let truths = (0..world.sweeps()).map(|sweep| world.flight().sweep_truth(sweep));
        truths
            .map(|truth| surroundings.link(parts(world).0, &truth))
            .collect()
    }

    fn count(links: &[Link], what: fn(&LinkPath) -> bool) -> usize {
        let paths = links.iter().flat_map(|link| &link.paths);
        paths.filter(|path| what(path)).count()
    }

    #[test]
    fn a_sweep_among_movers_depends_on_its_number_only() {
        let scene = Scene::load("indoor").expect("built in");
        let config = || PropagationConfig {
            movers: crowd(),
            ..PropagationConfig::default()
        };
        let world = || World::new(&scene, short(2.0, config()), 3).expect("a flight");
        let (busy, again) = (world(), world());
        let late = busy.sweep(3).expect("sound");
        let _ = again.sweep(0).expect("sound");
        let same = again.sweep(3).expect("sound");
        assert_eq!((&late.beams, &late.link), (&same.beams, &same.link));
        let bare = short(2.0, PropagationConfig::default());
        let bare = World::new(&scene, bare, 3)
            .expect("a flight")
            .sweep(3)
            .expect("sound");
        assert!(late.link != bare.link && late.beams != bare.beams);
    }

    #[test]
    fn movers_block_and_reflect_in_every_scene() {
        for name in ["outdoor", "indoor"] {
            let scene = Scene::load(name).expect("built in");
            // Outdoors they are rarely in the way.
            let propagation = PropagationConfig {
                movers: crowd(),
                ..PropagationConfig::default()
            };
            let world = World::new(&scene, short(30.0, propagation), 3).expect("a flight");
            // As high as cars: what looks down on them sees them in no mirror that is upright.
            let links = |surroundings: &Surroundings| {
                let links = (0..world.sweeps()).map(|sweep| {
                    let mut truth = world.flight().sweep_truth(sweep);
                    truth.uav.position_m.z = 1.2;
                    truth.gmt_position_m.z = 1.0;
                    surroundings.link(parts(&world).0, &truth)
                });
                links.collect::<Vec<_>>()
            };
            let (busy, bare) = (links(parts(&world).1), links(&Surroundings::default()));
            let off_movers = count(&busy, LinkPath::is_off_mover);
            let shifted = count(&busy, |path| path.closing_m_per_s.is_some());
            let weaker = busy
                .iter()
                .zip(&bare)
                .filter(|(busy, bare)| bare.paths.iter().any(|path| !busy.paths.contains(path)));
            let weaker = weaker.count();
            println!(
                "{name}: {off_movers} off movers, {shifted} shifted, {weaker} of {} links weaker",
                bare.len()
            );
            assert!(weaker > 0 && off_movers > 0 && shifted > 0, "{name}");
        }
    }

    #[test]
    fn trees_and_thin_walls_change_links_and_none_of_them_changes_nothing() {
        let scene = Scene::load("outdoor").expect("built in");
        let planted = PropagationConfig {
            vegetation: VegetationConfig { trees_per_ha: 20.0 },
            ..PropagationConfig::default()
        };
        let world = World::new(&scene, short(30.0, planted), 3).expect("a flight");
        let none = Surroundings::default();
        assert!(links(&world, parts(&world).1) != links(&world, &none));
        let config = short(
            5.0,
            PropagationConfig {
                materials: super::super::Materials::Drawn,
                transmission: true,
                ..PropagationConfig::default()
            },
        );
        let boards = config.scene("indoor").expect("built in");
        let world = World::new(&boards, config.clone(), 3).expect("a flight");
        let through = links(&world, parts(&world).1);
        let is_through = |path: &LinkPath| {
            path.kind
                .is_some_and(|kind| kind.interactions().contains(&Interaction::Transmission))
        };
        let (found, opaque) = (count(&through, is_through), links(&world, &none));
        println!(
            "indoor: {found} paths through walls beside {}",
            count(&opaque, |_| true)
        );
        assert!(found > 10 && count(&opaque, is_through) == 0);
        let all_of_them =
            |(more, fewer): (&Link, &Link)| fewer.paths.iter().all(|path| more.paths.contains(path));
        assert!(through.iter().zip(&opaque).all(all_of_them));
        // Nothing asked for: bit for bit what a tracer alone finds.
        let bare = World::new(&scene, short(5.0, PropagationConfig::default()), 3).expect("a flight");
        for sweep in 0..bare.sweeps() {
            let truth = bare.flight().sweep_truth(sweep);
            let tree = parts(&bare).0.transmitter(truth.gmt_position_m.into());
            let rx_m: [f64; 3] = truth.uav.position_m.into();
            let alone = tree.to_link(rx_m, &tree.trace(rx_m));
            assert_eq!(parts(&bare).1.link(parts(&bare).0, &truth), alone);
        }
    }

    #[test]
    #[ignore = "a measurement, of a release build"]
    fn what_surroundings_cost() {
        for name in ["outdoor", "street", "indoor"] {
            let mut config = WorldConfig::of(Profile::Real);
            config.flight.duration_s = 60.0;
            let scene = config.scene(name).expect("built in");
            let start = std::time::Instant::now();
            let world = World::new(&scene, config, 1).expect("a flight");
            let made_s = start.elapsed().as_secs_f64();
            let truths: Vec<_> = (0..world.sweeps())
                .map(|k| world.flight().sweep_truth(k))
                .collect();
            let (tracer, of) = parts(&world);
            let none = Surroundings::default();
            let (mut walls, mut trees, mut movers) = (none.clone(), none.clone(), none.clone());
            walls.sheets.clone_from(&of.sheets);
            trees.trees.clone_from(&of.trees);
            movers.movers.clone_from(&of.movers);
            let traced: Vec<_> = truths
                .iter()
                .map(|truth| {
                    let tree = tracer.transmitter(truth.gmt_position_m.into());
                    let rx_m: [f64; 3] = truth.uav.position_m.into();
                    let paths = tree.trace(rx_m);
                    (tree, rx_m, truth.time_s, paths)
                })
                .collect();
            for (what, surroundings) in [
                ("walls", &walls),
                ("trees", &trees),
                ("movers", &movers),
                ("all", of),
            ] {
                let start = std::time::Instant::now();
                let paths = traced.iter().map(|(tree, rx_m, time_s, paths)| {
                    let paths = paths.clone();
                    surroundings.laid_over(tracer, tree, *rx_m, *time_s, paths).len()
                });
                let (paths, count) = (paths.sum::<usize>() as f64, traced.len() as f64);
                let each_ms = 1e3 * start.elapsed().as_secs_f64() / count;
                println!(
                    "{name}, {what}: {each_ms:.3} ms a link, {:.0} paths",
                    paths / count
                );
            }
            let start = std::time::Instant::now();
            let config = WorldConfig::of(Profile::Real);
            let placed = Surroundings::place(tracer, &config.propagation, world.flight().plan(), 1);
            let placed_ms = 1e3 * start.elapsed().as_secs_f64();
            assert!(placed.is_ok());
            println!("{name}: world {made_s:.2} s, of it surroundings {placed_ms:.0} ms");
        }
    }
}
