use super::*;
use crate::surfaces::Waiting;

fn birth(east_m: f32, north_m: f32, log_odds: f32) -> Birth {
    Birth {
        kind: Kind::Wall,
        plane: Plane {
            normal: Direction::from_vector(-Vector3::x()).expect("not zero"),
            centre: Position::new(east_m, north_m, 3.0).expect("finite"),
            covariance: Matrix3::from_diagonal(&Vector3::new(0.01, 1e-4, 2.5e-5)),
        },
        log_odds,
    }
}

fn store() -> Surfaces<3> {
    let beneath = Position::new(0.0, 0.0, 0.0).expect("finite");
    Surfaces::with_ground(SurfaceConfig::default(), beneath)
}

fn wait(surfaces: &mut Surfaces<3>, id: u16) {
    surfaces.waiting.push(Waiting {
        sweep: 1,
        path: 0,
        chain: SurfaceIds::from_slice(&[id]).expect("one"),
        transmitter_m: Vector3::zeros(),
        uav_m: Vector3::zeros(),
        uav_covariance_m2: Matrix3::identity(),
    });
}

#[test]
fn the_ground_is_surface_0_and_of_unknown_height() {
    let surfaces = store();
    let ground = surfaces.get(GROUND).expect("there");
    assert_eq!((ground.kind, ground.status), (Kind::Ground, Status::Tentative));
    assert!((ground.plane.covariance.m11 - 0.25).abs() < 1e-6 && ground.existence() > 0.99);
    assert_eq!(ground.outside_m(&Vector3::new(500.0_f32, -900.0, 3.0)), 0.0);
}

#[test]
fn no_wall_is_born_twice() {
    let mut surfaces = store();
    let origin = Vector3::zeros();
    let first = surfaces.add(&birth(20.0, 0.0, 0.0), &origin, 1);
    assert_eq!(first, Some(1));
    assert_eq!(surfaces.add(&birth(20.3, 4.0, 0.0), &origin, 1), None);
    assert_eq!(surfaces.counters.refused, 0);
    assert_eq!(
        surfaces.add(&birth(20.3, 9.0, 0.0), &origin, 1),
        Some(2),
        "far along it"
    );
    assert_eq!(surfaces.len(), 3);
}

#[test]
fn when_full_the_least_tentative_makes_room_for_a_likelier_one() {
    let mut surfaces = store();
    let origin = Vector3::zeros();
    surfaces.add(&birth(20.0, 0.0, -1.0), &origin, 1);
    surfaces.add(&birth(40.0, 0.0, 0.5), &origin, 1);
    wait(&mut surfaces, 1);
    assert_eq!(surfaces.add(&birth(60.0, 0.0, -1.0), &origin, 2), None);
    assert_eq!(surfaces.counters.refused, 1);
    assert_eq!(surfaces.add(&birth(60.0, 0.0, 0.0), &origin, 2), Some(3));
    assert!(surfaces.get(1).is_none() && surfaces.get(GROUND).is_some());
    assert_eq!((surfaces.counters.evicted, surfaces.counters.forgotten), (1, 1));
}

#[test]
fn two_of_one_wall_are_merged_and_the_older_stays() {
    let mut surfaces = store();
    let origin = Vector3::zeros();
    surfaces.add(&birth(20.0, 0.0, 0.0), &origin, 1);
    surfaces.add(&birth(20.5, 0.0, 2.0), &origin, 1);
    surfaces.get_mut(2).expect("born").plane.centre = Position::new(20.1, 0.0, 3.0).expect("finite");
    surfaces.get_mut(2).expect("born").plane.covariance.m11 = 0.03;
    wait(&mut surfaces, 2);
    assert_eq!(surfaces.merge().as_slice(), [(2, 1)]);
    let wall = surfaces.get(1).expect("stays");
    // 1 : 3 by their variances.
    assert!((wall.plane.centre.vector().x - 20.025).abs() < 1e-4);
    assert!((wall.plane.covariance.m11 - 0.0075).abs() < 1e-5);
    assert!((wall.log_odds - 2.0).abs() < 1e-6);
    assert_eq!(surfaces.waiting()[0].chain.as_slice(), [1]);
    assert_eq!(surfaces.len(), 2);
}

#[test]
fn walls_one_behind_the_other_stay_two() {
    let mut surfaces = store();
    surfaces.add(&birth(20.0, 0.0, 0.0), &Vector3::zeros(), 1);
    surfaces.add(&birth(20.5, 0.0, 0.0), &Vector3::zeros(), 1);
    assert!(surfaces.merge().is_empty());
}

#[test]
fn evidence_confirms_demotes_and_removes() {
    let mut surfaces = store();
    surfaces.add(&birth(20.0, 0.0, 0.0), &Vector3::zeros(), 1);
    let confirmed = SurfaceConfig::default().confirmed_log_odds();
    let set = |surfaces: &mut Surfaces<3>, odds: f32| {
        surfaces.get_mut(1).expect("there").log_odds = odds;
        surfaces.update_status()
    };
    assert_eq!(set(&mut surfaces, confirmed - 0.01), StatusChanges::default());
    assert_eq!(set(&mut surfaces, confirmed + 0.01).confirmed.as_slice(), [1]);
    assert_eq!(set(&mut surfaces, 0.5), StatusChanges::default());
    assert_eq!(set(&mut surfaces, -0.5).demoted.as_slice(), [1]);
    wait(&mut surfaces, 1);
    assert_eq!(set(&mut surfaces, -confirmed - 0.01).died.as_slice(), [1]);
    assert!(surfaces.get(1).is_none() && surfaces.waiting().is_empty());
    let counters = surfaces.counters;
    assert_eq!((counters.confirmed, counters.demoted, counters.died), (1, 1, 1));
}

#[test]
fn a_clear_leaves_the_ground() {
    let mut surfaces = store();
    surfaces.add(&birth(20.0, 0.0, 0.0), &Vector3::zeros(), 1);
    wait(&mut surfaces, 1);
    surfaces.clear();
    assert_eq!(surfaces.len(), 1);
    assert!(surfaces.get(GROUND).is_some() && surfaces.waiting().is_empty());
}
