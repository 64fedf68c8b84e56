//! Which explanations of a path are believed.

use nalgebra::Matrix3;

use super::*;
use crate::geometry::{Direction, Gmt, Position, Rotation, World};
use crate::localization::filter::{Filter58, FilterConfig};
use crate::geometry::Plane;

fn wall(id: u32, x_m: f32, normal: Vector3<f32>) -> MappedPlane {
    MappedPlane {
        id,
        plane: Plane {
            normal: Direction::from_vector(normal).expect("unit"),
            centre: Position::new(x_m, 0.0, 5.0).expect("finite"),
            covariance: Matrix3::identity() * 1e-4,
        },
    }
}

/// Whether a path off these walls, which fits in truth, is taken when its chi-square is said to be `least` and the place is known to
/// `sigma_m` per axis.
fn taken(walls: &[MappedPlane], least: f64, sigma_m: f32) -> bool {
    let mut filter = Filter58::new(FilterConfig::default(), 0);
    let gmt = Transmitter {
        position_m: Vector3::new(0.0, 0.0, 1.5),
        sigma_m: 0.02,
        attitude: Rotation::<Gmt, World, f64>::identity(),
    };
    filter.nominal.position_m = Vector3::new(4.0, 12.0, 6.0);
    for axis in 0..3 {
        filter.covariance.reset(POSITION + axis, sigma_m * sigma_m);
    }
    let source = walls
        .iter()
        .fold(gmt.position_m, |from, wall| wall.image_m(&from));
    let way = source - filter.nominal.position_m;
    let path = PathMeasurement {
        c_tau_m: way.norm(),
        c_tau_sigma_m: 0.01,
        aoa: Direction::from_vector(way).expect("apart"),
        aoa_sigma_rad: 1e-4,
        aoa_rise_sigma_rad: 0.0,
        departure: None,
    };
    let mut found = Match {
        least,
        ..Match::default()
    };
    for wall in walls {
        let _ = found.planes.push(*wall);
    }
    let view = filter.view(&path);
    filter.conclude(&gmt, &path, &view, found, &mut EFFORT.clone());
    let counters = filter.counters();
    assert_eq!(counters.reflections + counters.reflections_rejected, 1);
    counters.reflections == 1
}

#[test]
fn a_path_of_two_reflections_must_fit_better_than_one_of_one() {
    let (east, west) = (wall(0, 15.0, -Vector3::x()), wall(1, -9.0, Vector3::x()));
    let gate = FilterConfig::default().gates.three;
    assert!(taken(&[east], 0.9 * gate, 0.1) && !taken(&[east], 1.1 * gate, 0.1));
    assert!(taken(&[east, west], 0.4 * gate, 0.1) && !taken(&[east, west], 0.6 * gate, 0.1));
}

/// From thirty metres away the way straight from the GMT is as long, and comes from the same side.
#[test]
fn what_may_be_the_line_of_sight_is_no_reflection() {
    let east = wall(0, 15.0, -Vector3::x());
    assert!(taken(&[east], 1.0, 0.1) && !taken(&[east], 1.0, 30.0));
}
