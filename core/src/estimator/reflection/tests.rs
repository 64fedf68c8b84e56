//! Which reflections are taken in, and what becomes of their surfaces.

use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::estimator::layout::{ATTITUDE, CLOCK_OFFSET, POSITION};
use crate::estimator::{Bounces, Filter61, FilterConfig, PathMeasurement};
use crate::geometry::{Direction, Gmt, Plane, Position, Rotation, World};
use crate::radio::RadioModel;

fn wall(id: u32, x_m: f32, normal: Vector3<f32>) -> MappedPlane {
    MappedPlane {
        id,
        plane: Plane {
            normal: Direction::from_vector(normal).expect("unit"),
            centre: Position::new(x_m, 0.0, 5.0).expect("finite"),
            covariance: Matrix3::from_diagonal(&Vector3::new(0.01, 1e-6, 1e-6)),
        },
    }
}

fn gmt() -> Transmitter {
    Transmitter {
        position_m: Vector3::new(0.0, 0.0, 1.5),
        sigma_m: 0.02,
        attitude: Rotation::<Gmt, World, f64>::identity(),
        reach: crate::array::BeamReach::default(),
    }
}

/// A filter at a place that it knows to 0.1 m an axis, and the path that these walls make there, longer by `late_m`.
fn flight(walls: &[MappedPlane], late_m: f64) -> (Filter61, ReflectedPath) {
    let mut filter = Filter61::new(&RadioModel::default(), FilterConfig::default(), 0);
    filter.nominal.position_m = Vector3::new(4.0, 12.0, 6.0);
    for axis in 0..3 {
        filter.covariance.reset(POSITION + axis, 0.01);
        filter.covariance.reset(ATTITUDE + axis, 1e-8);
    }
    filter.covariance.reset(CLOCK_OFFSET, 1e-4);
    let image = |from: Vector3<f64>, wall: &MappedPlane| wall.plane.to_f64().image(&from);
    let way = walls.iter().fold(gmt().position_m, image) - filter.nominal.position_m;
    let path = PathMeasurement {
        c_tau_m: way.norm() + late_m,
        c_tau_sigma_m: 0.01,
        aoa: Direction::from_vector(way).expect("apart"),
        aoa_sigma_rad: 1e-4,
        range_rate: None,
        departure: None,
    };
    let planes = Bounces::from_slice(walls).expect("two at most");
    (filter, ReflectedPath { path, planes })
}

#[test]
fn a_reflection_is_taken_when_it_fits_and_its_surface_learns() {
    for walls in [
        &[wall(0, 15.0, -Vector3::x())][..],
        &[wall(0, 15.0, -Vector3::x()), wall(1, -9.0, Vector3::x())],
    ] {
        let (mut filter, path) = flight(walls, 0.05);
        filter.reflections(&gmt(), &[path]);
        assert_eq!(
            (
                filter.counters().reflections,
                filter.counters().reflections_rejected
            ),
            (1, 0)
        );
        assert_eq!(filter.planes().count(), walls.len());
        for (held, wall) in filter.planes().zip(walls) {
            assert!(
                held.plane.covariance.m11 < 0.9 * wall.plane.covariance.m11,
                "learnt"
            );
        }
        let (mut filter, path) = flight(walls, 3.0);
        let before = filter.nominal.position_m;
        filter.reflections(&gmt(), &[path]);
        assert_eq!(
            (
                filter.counters().reflections,
                filter.counters().reflections_rejected
            ),
            (0, 1)
        );
        assert_eq!(filter.nominal.position_m, before);
    }
}

#[test]
fn a_surface_that_was_let_go_is_taken_as_it_is_lent_next() {
    let east = wall(0, 15.0, -Vector3::x());
    let (mut filter, path) = flight(&[east], 0.0);
    filter.reflections(&gmt(), core::slice::from_ref(&path));
    filter.release_planes();
    assert_eq!(filter.planes().count(), 0);
    let better = MappedPlane {
        plane: Plane {
            covariance: Matrix3::identity() * 1e-8,
            ..east.plane
        },
        ..east
    };
    let again = ReflectedPath {
        planes: Bounces::from_slice(&[better]).expect("one"),
        ..path
    };
    filter.reflections(&gmt(), &[again]);
    let held = filter.planes().next().expect("held");
    assert!(held.plane.covariance.m11 <= 1.01e-8);
}

#[test]
fn no_more_paths_are_taken_than_there_is_time_for() {
    let (mut filter, path) = flight(&[wall(0, 15.0, -Vector3::x())], 0.0);
    let paths: [ReflectedPath; MOST_PATHS + 2] = core::array::from_fn(|_| path.clone());
    filter.reflections(&gmt(), &paths);
    let counters = filter.counters();
    assert_eq!(
        (counters.reflections, counters.reflections_rejected),
        (MOST_PATHS as u32, 2)
    );
}
