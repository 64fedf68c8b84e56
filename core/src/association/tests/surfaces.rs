//! Surfaces over a flight: born, confirmed, refined, retired; and what a sweep may not say.

extern crate std;

use std::vec::Vec;

use nalgebra::Vector3;

use super::world::{Link, Noise, Paths, confirmed, measured, sweep, wall};
use crate::association::{AssociationConfig, Decision, SurfacePoint, associate};
use crate::geometry::{Plane, Position, Rotation, World};
use crate::surfaces::birth::Birth;
use crate::surfaces::{GROUND, Kind, Status, Surface, SurfaceConfig, Surfaces};

const FACADE_M: f32 = 20.0;

fn facade() -> Plane {
    wall([FACADE_M, 10.0, 4.0], [-1.0, 0.0, 0.0])
}

fn ground() -> Plane {
    wall([0.0, 10.0, 0.0], [0.0, 0.0, 1.0])
}

/// The UAV flies on and climbs, the transmitter moves 0.3 m after every four sweeps.
fn link(sweep: u32) -> Link {
    let (k, stop) = (f64::from(sweep), f64::from(sweep / 4));
    Link::between(
        [2.0 + 0.1 * stop, -10.0 - 0.28 * stop, 1.5],
        [6.0, 15.0 + 0.4 * k, 6.0 + 0.05 * k],
    )
}

fn with_ground(z_m: f32) -> Surfaces<16> {
    let beneath = Position::new(4.0, 0.0, z_m).expect("finite");
    Surfaces::with_ground(SurfaceConfig::default(), beneath)
}

/// Flies over planes: line of sight and a path over each of the chains. All points, and in which sweep each came.
fn fly(
    surfaces: &mut Surfaces<16>,
    chains: &[&[Plane]],
    first_order: f32,
    sweeps: u32,
    seed: u64,
) -> Vec<(u32, SurfacePoint)> {
    let mut noise = Noise::seeded(seed);
    let mut points = Vec::new();
    for k in 0..sweeps {
        let link = link(k);
        let mut paths = Paths::new();
        let straight = link.path(&[], 0.0).expect("exists");
        paths.push(measured(&straight, &mut noise)).expect("room");
        for chain in chains {
            if let Some(path) = link.path(chain, if chain.len() == 1 { first_order } else { 0.1 }) {
                paths.push(measured(&path, &mut noise)).expect("room");
            }
        }
        let (association, learned) = sweep(surfaces, &link, &link.pose_with(&mut noise), &paths, k);
        assert!(
            association.verdicts[0].is_line_of_sight(),
            "{k} {:?}",
            association.verdicts[0]
        );
        assert_eq!(association.left_out, Default::default());
        points.extend(learned.points.iter().map(|point| (k, *point)));
    }
    points
}

fn confirmed_walls(surfaces: &Surfaces<16>) -> Vec<Surface> {
    let walls = surfaces
        .iter()
        .filter(|s| s.kind == Kind::Wall && s.status == Status::Confirmed);
    walls.copied().collect()
}

#[test]
fn a_wall_is_born_confirmed_and_refined_and_its_points_leave_waiting() {
    let mut ratios = 0.0;
    for seed in 1..=8 {
        let mut surfaces = with_ground(0.0);
        let facade = facade();
        let points = fly(&mut surfaces, &[&[ground()], &[facade]], 0.9, 60, seed);
        let walls = confirmed_walls(&surfaces);
        let [found] = walls.as_slice() else {
            panic!("{seed}: {:?}", surfaces.iter().collect::<Vec<_>>());
        };
        let (error, variance) = (
            facade.height_m(found.plane.centre.vector()),
            found.plane.covariance.m11,
        );
        assert!(
            error.abs() < 0.06 && variance.sqrt() < 0.05,
            "{seed}: {error} {variance}"
        );
        ratios += error * error / variance;
        assert!((found.plane.normal.vector() - facade.normal.vector()).norm() < 0.008);
        let here: Vec<_> = points.iter().filter(|(_, p)| p.surface == found.id).collect();
        let waited = here.iter().filter(|(sweep, point)| point.sweep < *sweep).count();
        assert!(
            here.len() > 45 && waited >= 3,
            "{seed}: {} points, {waited} waited",
            here.len()
        );
        // Each point once, and on the wall.
        for (_, point) in &here {
            let twice = here
                .iter()
                .filter(|(_, p)| (p.sweep, p.path) == (point.sweep, point.path))
                .count();
            let off = facade.height_m(point.point.position.vector()).abs();
            assert!(twice == 1 && off < 0.2, "{seed}: {twice} {off}");
        }
        // It is not confirmed while the transmitter stands.
        assert!(here.iter().all(|(sweep, _)| *sweep >= 4), "{seed}");
    }
    assert!(
        ratios / 8.0 < 4.0,
        "mean squared error over variance {}",
        ratios / 8.0
    );
}

#[test]
fn a_wall_that_only_pairs_show_is_found_off_a_known_one() {
    let mut surfaces = with_ground(0.0);
    let facade = facade();
    let id = confirmed(&mut surfaces, &facade, 60.0);
    let across = wall([-15.0, 10.0, 4.0], [1.0, 0.0, 0.0]);
    fly(&mut surfaces, &[&[facade], &[facade, across]], 0.95, 80, 3);
    let found = confirmed_walls(&surfaces);
    assert_eq!(found.len(), 2, "{:?}", surfaces.iter().collect::<Vec<_>>());
    let other = found.iter().find(|surface| surface.id != id).expect("found");
    assert!(across.height_m(other.plane.centre.vector()).abs() < 0.15);
}

#[test]
fn the_ground_is_found_to_a_few_centimetres() {
    for (seed, wrong_m) in [(1, 0.5), (2, -0.5), (3, 0.5), (4, -0.5)] {
        let mut surfaces = with_ground(wrong_m);
        let points = fly(&mut surfaces, &[&[ground()]], 0.9, 60, seed);
        let found = surfaces.get(GROUND).expect("there");
        let below = found.plane.height_m(&Vector3::new(
            found.plane.centre.vector().x,
            found.plane.centre.vector().y,
            0.0,
        ));
        assert!(below.abs() < 0.05, "{wrong_m}: {below}");
        assert!(
            found.is_confirmed() && points.len() > 40,
            "{wrong_m}: {}",
            points.len()
        );
        let last = points.iter().filter(|(sweep, _)| *sweep > 20);
        for (_, point) in last {
            assert!(point.point.position.vector().z.abs() < 0.1, "{point:?}");
        }
    }
}

#[test]
fn what_was_learnt_from_a_poor_attitude_gives_way_to_a_good_one() {
    // At the start the attitude is off by 60 mrad about one axis, the same in every sweep, and known to 30: twice its standard deviation.
    // Then it is known.
    let turn = Rotation::<World, World, f64>::from_rotation_vector(&Vector3::new(0.06, 0.0, 0.0));
    let turn = turn.expect("finite");
    for seed in 1..=4 {
        let (mut surfaces, mut noise) = (with_ground(0.0), Noise::seeded(seed));
        let facade = facade();
        for k in 0..48 {
            let link = link(k);
            let mut paths = Paths::new();
            for chain in [&[][..], &[facade]] {
                let path = link.path(chain, 0.95).expect("exists");
                paths.push(measured(&path, &mut noise)).expect("room");
            }
            let mut pose = link.pose_with(&mut noise);
            if k < 24 {
                pose.attitude = turn.after(&pose.attitude);
                for axis in 3..6 {
                    pose.covariance[(axis, axis)] = 0.03 * 0.03;
                }
            }
            let (association, _) = sweep(&mut surfaces, &link, &pose, &paths, k);
            // The wall that was learnt explains its path from the first good sweep on; that it is one is sure a few sweeps later.
            let decision = association.verdicts[1].decision;
            let explains = matches!(decision, Decision::Explained | Decision::Tentative);
            assert!(k < 24 || explains, "{seed}: sweep {k}, {decision:?}");
            assert!(
                k < 28 || decision == Decision::Explained,
                "{seed}: sweep {k}, {decision:?}"
            );
        }
        let walls = confirmed_walls(&surfaces);
        assert_eq!(walls.len(), 1, "{seed}");
        let off_rad = (walls[0].plane.normal.vector() - facade.normal.vector()).norm();
        assert!(off_rad < 0.006, "{seed}: {off_rad} rad");
    }
}

/// A wall where there is none, across the line of sight, that something waits for.
fn wrong(surfaces: &mut Surfaces<16>, status: Status) -> u16 {
    let birth = Birth {
        kind: Kind::Wall,
        plane: wall([4.0, 5.0, 3.5], [0.0, -1.0, 0.0]),
        log_odds: if status == Status::Confirmed { 4.0 } else { 0.0 },
    };
    let id = surfaces.add(&birth, &Vector3::zeros(), 0).expect("room");
    let surface = surfaces.get_mut(id).expect("there");
    surface.status = status;
    surface.extent_m = [[-4.0, 4.0]; 2];
    id
}

#[test]
fn a_wrong_surface_is_retired_by_lines_of_sight_through_it() {
    let mut surfaces = with_ground(0.0);
    let id = wrong(&mut surfaces, Status::Tentative);
    let link = link(0);
    surfaces.waiting.push(crate::surfaces::Waiting {
        sweep: 0,
        path: 0,
        chain: crate::surfaces::SurfaceIds::from_slice(&[id]).expect("one"),
        transmitter_m: link.transmitter_m.map(|c| c as f32),
        uav_m: link.uav_m.map(|c| c as f32),
        uav_covariance_m2: crate::geometry::Matrix3::identity(),
    });
    let points = fly(&mut surfaces, &[], 0.0, 6, 1);
    assert!(surfaces.get(id).is_none() && surfaces.waiting().is_empty() && points.is_empty());
    assert_eq!((surfaces.counters.died, surfaces.counters.forgotten), (1, 1));
}

#[test]
fn a_confirmed_one_is_demoted_first() {
    let mut surfaces = with_ground(0.0);
    let id = wrong(&mut surfaces, Status::Confirmed);
    // What is not there blocks the line of sight, which fits so well that it is seen all the same.
    fly(&mut surfaces, &[], 0.0, 6, 1);
    assert_eq!(
        surfaces.get(id).map(|surface| surface.status),
        Some(Status::Tentative)
    );
    assert_eq!(surfaces.counters.demoted, 1);
    fly(&mut surfaces, &[], 0.0, 6, 2);
    assert!(surfaces.get(id).is_none());
}

#[test]
fn a_wall_that_reflects_no_more_dies_by_and_by() {
    let mut surfaces = with_ground(0.0);
    let birth = Birth {
        kind: Kind::Wall,
        plane: facade(),
        log_odds: 0.0,
    };
    let id = surfaces.add(&birth, &Vector3::zeros(), 0).expect("room");
    surfaces.get_mut(id).expect("there").extent_m = [[-30.0, 30.0]; 2];
    fly(&mut surfaces, &[], 0.0, 10, 1);
    assert!(surfaces.get(id).is_some_and(|surface| surface.log_odds < -0.8));
    fly(&mut surfaces, &[], 0.0, 30, 1);
    assert!(surfaces.get(id).is_none());
}

#[test]
fn a_chain_explains_one_path_of_a_sweep() {
    let mut surfaces = with_ground(0.0);
    let id = confirmed(&mut surfaces, &facade(), 60.0);
    let link = link(0);
    let path = link.path(&[facade()], 0.9).expect("exists");
    let mut late = path;
    late.c_tau_m += 0.1;
    let paths = Paths::from_slice(&[late, path]).expect("two");
    let (association, learned) = sweep(&mut surfaces, &link, &link.pose(), &paths, 1);
    let decisions: Vec<_> = association
        .verdicts
        .iter()
        .map(|v| (v.decision, v.chain.as_slice()))
        .collect();
    assert_eq!(
        decisions,
        [(Decision::Ambiguous, &[id][..]), (Decision::Explained, &[id][..])]
    );
    assert_eq!(learned.points.len(), 1);
}

#[test]
fn what_there_is_no_time_for_is_ambiguous_and_counted() {
    let mut surfaces = with_ground(0.0);
    confirmed(&mut surfaces, &facade(), 60.0);
    // Near enough to be weighed as well.
    confirmed(&mut surfaces, &wall([20.45, 10.0, 4.0], [-1.0, 0.0, 0.0]), 60.0);
    let link = link(0);
    let path = link.path(&[facade()], 0.9).expect("exists");
    let paths = Paths::from_slice(&[path]).expect("one");
    let decide = |weighings: u16| {
        let config = AssociationConfig {
            weighings,
            ..AssociationConfig::default()
        };
        let association = associate(&paths, &link.pose(), &link.transmitter(), &surfaces, &config);
        (association.verdicts[0].decision, association.left_out.unweighed)
    };
    assert_eq!(decide(160), (Decision::Explained, 0));
    let (decision, unweighed) = decide(1);
    assert!(decision == Decision::Ambiguous && unweighed > 0);
}

#[test]
fn pairs_that_no_confirmed_surface_vouches_for_leave_a_path_finished() {
    let link = link(0);
    let mut surfaces = with_ground(0.0);
    confirmed(&mut surfaces, &facade(), 60.0);
    // A step under the transmitter and a wall behind the facade: off both the transmitter's image lies near that in the facade.
    for plane in [
        wall([4.0, 0.0, 1.2], [0.0, 0.0, 1.0]),
        wall([FACADE_M + 0.45, 10.0, 4.0], [-1.0, 0.0, 0.0]),
    ] {
        let id = confirmed(&mut surfaces, &plane, 60.0);
        surfaces.get_mut(id).expect("there").status = Status::Tentative;
    }
    let path = link.path(&[facade()], 0.9).expect("exists");
    let paths = Paths::from_slice(&[path]).expect("one");
    // Ten chains are near; four of them are pairs of those two.
    for (weighings, decision, unweighed) in [
        (5, Decision::Ambiguous, 1),
        (6, Decision::Explained, 0),
        (10, Decision::Explained, 0),
    ] {
        let config = AssociationConfig {
            weighings,
            ..AssociationConfig::default()
        };
        let association = associate(&paths, &link.pose(), &link.transmitter(), &surfaces, &config);
        assert_eq!(association.verdicts[0].decision, decision);
        assert_eq!(association.left_out.unweighed, unweighed);
    }
}

#[test]
fn a_poor_pose_does_not_tell_two_facades_apart() {
    let mut surfaces = with_ground(0.0);
    let near = confirmed(&mut surfaces, &facade(), 60.0);
    // Too near behind it to be hidden.
    confirmed(&mut surfaces, &wall([20.5, 10.0, 4.0], [-1.0, 0.0, 0.0]), 60.0);
    let link = link(0);
    let path = link.path(&[facade()], 0.9).expect("exists");
    let paths = Paths::from_slice(&[path]).expect("one");
    let mut pose = link.pose();
    let (association, _) = sweep(&mut surfaces.clone(), &link, &pose, &paths, 1);
    assert_eq!(association.verdicts[0].decision, Decision::Explained);
    assert_eq!(association.verdicts[0].chain.as_slice(), [near]);
    for axis in 0..3 {
        pose.covariance[(axis, axis)] = 100.0;
    }
    let (association, learned) = sweep(&mut surfaces, &link, &pose, &paths, 1);
    assert_eq!(
        association.verdicts[0].decision,
        Decision::Ambiguous,
        "{:?}",
        association.verdicts[0]
    );
    assert!(learned.points.is_empty() && surfaces.counters.born == 2);
}
