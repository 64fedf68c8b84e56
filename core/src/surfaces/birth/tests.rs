use core::f32::consts::LN_2;

use super::*;
use crate::path::diagonal_covariance;
use crate::surfaces::evidence::Evidence;
use crate::surfaces::surface::Status;

/// The wall x = 20, which faces west.
fn wall(centre: [f32; 3], normal: [f32; 3]) -> Plane {
    Plane {
        normal: Direction::from_vector(normal.into()).expect("not zero"),
        centre: Position::new(centre[0], centre[1], centre[2]).expect("finite"),
        covariance: Matrix3::identity() * 1e-4,
    }
}

fn path(walls: &[Plane]) -> BirthPath {
    let (transmitter, uav) = (Vector3::new(2.0, -10.0, 1.5), Vector3::new(5.0, 25.0, 8.0));
    let source = walls.iter().fold(transmitter, |g, wall| wall.to_f64().image(&g));
    BirthPath {
        transmitter_m: transmitter,
        uav_m: uav,
        length_m: (source - uav).norm(),
        arrival: Direction::from_vector(source - uav).expect("apart"),
        path_covariance: diagonal_covariance(0.03, 0.002),
        uav_covariance_m2: Matrix3::identity() * 0.0025,
    }
}

#[test]
fn one_path_shows_the_wall_that_reflected_it() {
    let config = SurfaceConfig::default();
    let wall = wall([20.0, 0.0, 5.0], [-1.0, 0.05, 0.0]);
    let birth = from_single(&path(&[wall]), &config).expect("born");
    assert_eq!(birth.kind, Kind::Wall);
    // Upright: nearly as much for a wall as a lean can say.
    assert!(
        birth.log_odds > 0.4 && birth.log_odds < LN_2,
        "{}",
        birth.log_odds
    );
    assert!(wall.height_m(birth.plane.centre.vector()).abs() < 1e-4);
    assert!((birth.plane.normal.vector() - wall.normal.vector()).norm() < 1e-4);
}

#[test]
fn covariance_is_that_of_the_errors() {
    // At normal incidence the shift errs by half of the delay and of the position along the normal.
    let config = SurfaceConfig::default();
    let (transmitter, uav) = (Vector3::new(0.0, 0.0, 2.0), Vector3::new(0.0, 1e-3, 2.0));
    let path = BirthPath {
        transmitter_m: transmitter,
        uav_m: uav,
        length_m: 40.0,
        arrival: Direction::from_vector(Vector3::new(20.0, -0.5e-3, 0.0)).expect("not zero"),
        path_covariance: diagonal_covariance(0.06, 0.002),
        uav_covariance_m2: Matrix3::from_diagonal(&Vector3::new(0.16, 0.0, 0.0)) * 0.25,
    };
    let birth = from_single(&path, &config).expect("born");
    // dP = (d c tau + dx) / 2: 0.03 m and 0.1 m.
    assert!(
        (birth.plane.covariance.m11 - (0.03 * 0.03 + 0.1 * 0.1)).abs() < 1e-5,
        "{}",
        birth.plane.covariance.m11
    );
}

#[test]
fn a_wall_is_plumb_and_an_oblique_plane_is_doubtful() {
    let config = SurfaceConfig::default();
    let birth = |lean: f32| from_single(&path(&[wall([20.0, 0.0, 5.0], [-1.0, 0.0, lean])]), &config);
    let plumb = birth(0.03).expect("born");
    assert!(plumb.plane.normal.vector().z < 0.03 && plumb.plane.covariance.m33 <= 2.5e-5);
    assert!(plumb.log_odds >= -config.doubtful_log_odds && plumb.log_odds < LN_2);
    let oblique = birth(0.1).expect("born");
    assert!((oblique.log_odds + config.doubtful_log_odds).abs() < 1e-6);
    assert!((oblique.plane.normal.vector().z - 0.0995).abs() < 1e-3);
}

#[test]
fn a_lean_that_the_path_could_not_have_made_speaks_against_a_wall() {
    let config = SurfaceConfig::default();
    let log_odds = |lean: f32, arrival_rad: f32| {
        let mut path = path(&[wall([20.0, 0.0, 5.0], [-1.0, 0.0, lean])]);
        path.path_covariance = diagonal_covariance(0.03, f64::from(arrival_rad));
        from_single(&path, &config).expect("born").log_odds
    };
    let leans = [0.0, 0.01, 0.02, 0.03, 0.039].map(|lean| log_odds(lean, 0.002));
    assert!(leans.windows(2).all(|pair| pair[1] <= pair[0]), "{leans:?}");
    assert!((leans[0] - LN_2).abs() < 0.2 && leans[3] < 0.0, "{leans:?}");
    assert_eq!(leans[4], -config.doubtful_log_odds);
    // A path that is known worse says less, both ways.
    assert!(log_odds(0.03, 0.02) > leans[3] && log_odds(0.0, 0.02) < leans[0]);
}

#[test]
fn what_is_known_too_poorly_is_not_born() {
    let config = SurfaceConfig::default();
    let mut path = path(&[wall([20.0, 0.0, 5.0], [-1.0, 0.0, 0.0])]);
    path.uav_covariance_m2 = Matrix3::identity();
    assert!(from_single(&path, &config).is_none());
    path.length_m = 1.0;
    assert!(
        from_single(&path, &config).is_none(),
        "shorter than the straight way"
    );
}

#[test]
fn a_pair_shows_its_other_wall_from_either_end() {
    let config = SurfaceConfig::default();
    let east = wall([20.0, 3.0, 5.0], [-1.0, 0.0, 0.0]);
    let north = wall([10.0, 45.0, 5.0], [0.1, -1.0, 0.0]);
    let surface = |plane: Plane, extent_m: f32| Surface {
        id: 1,
        kind: Kind::Wall,
        plane,
        log_odds: 5.0,
        status: Status::Confirmed,
        extent_m: [[-extent_m, extent_m]; 2],
        evidence: Evidence::default(),
    };
    let path = path(&[east, north]);
    for (known, other, which, index) in [(east, north, Known::First, 1), (north, east, Known::Last, 0)] {
        let (birth, points) = from_pair(&path, &surface(known, 40.0), which, &config).expect("born");
        assert!(other.height_m(birth.plane.centre.vector()).abs() < 1e-3);
        assert!((birth.plane.normal.vector() - other.normal.vector()).norm() < 1e-3);
        assert!(birth.log_odds < 0.0);
        let met = points[1 - index].map(|c| c as f32);
        assert!(known.height_m(&met).abs() < 1e-3);
        // The way over both points is as long as the path.
        let [first, last] = points;
        let way = (first - path.transmitter_m).norm() + (last - first).norm() + (path.uav_m - last).norm();
        assert!((way - path.length_m).abs() < 1e-3);
        let mut elsewhere = surface(known, 0.0);
        elsewhere.recentre([60.0, 0.0]);
        elsewhere.extent_m = [[0.0; 2]; 2];
        assert!(
            from_pair(&path, &elsewhere, which, &config).is_none(),
            "not seen there"
        );
    }
}
