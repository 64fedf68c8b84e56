use cslam_core::geometry::Matrix3;
use cslam_core::path::{Departure, Path};
use nalgebra::Rotation3;

use super::*;
use crate::test_flight::{true_path, turned};

const PERIOD_M_PER_S: f32 = 2.0;
/// What the carriers' offset adds to each rate, m/s.
const OFFSET_M_PER_S: f64 = 0.7;

/// A UAV that hears a mast that leans.
fn truth() -> Truth {
    Truth {
        gmt_position_m: Vector3::new(0.0, 0.0, 2.0),
        gmt_attitude: Rotation3::from_euler_angles(0.01, 0.02, 1.0),
        ..turned()
    }
}

/// Two reflections, and no line of sight.
fn link() -> Link {
    let with_departure = |length_m, arrival: [f64; 2], departure: [f64; 2]| LinkPath {
        aod_zenith_rad: Some(departure[0]),
        aod_azimuth_rad: Some(departure[1]),
        ..true_path(1, length_m, arrival)
    };
    Link {
        paths: vec![
            with_departure(60.0, [1.4, 0.3], [1.6, 2.0]),
            LinkPath {
                closing_m_per_s: Some(0.2),
                ..with_departure(75.0, [1.2, -2.0], [1.5, -0.4])
            },
        ],
        ..Link::default()
    }
}

/// A path as it would be measured without errors.
fn exact(path: &TruePath) -> EstimatedPath {
    let direction = |v: &Vector3<f64>| v.map(|value| value as f32);
    let departure = path.departure.expect("has one");
    let mut rate = RangeRate {
        m_per_s: 0.0,
        sigma_m_per_s: 0.02,
        period_m_per_s: PERIOD_M_PER_S,
    };
    rate.m_per_s = within_period(path.rate_m_per_s + OFFSET_M_PER_S, &rate);
    EstimatedPath {
        path: Path {
            c_tau_m: path.c_tau_m as f32,
            aoa: Direction::from_vector(direction(&path.arrival)).expect("unit"),
            aod: Some(Departure {
                direction: Direction::from_vector(direction(&departure)).expect("unit"),
                sigma_rad: 0.01,
            }),
            covariance: Matrix3::identity(),
        },
        beam: 3,
        snr_db: 20.0,
        energy: 1.0,
        range_rate: Some(rate),
    }
}

/// The same with errors: 0.3 m, some hundredths of a radian at both ends, 0.1 m/s.
fn off(exact: &EstimatedPath) -> EstimatedPath {
    let mut path = *exact;
    let turned = Vector3::new(0.01, -0.02, 0.015);
    path.path.c_tau_m += 0.3;
    path.path.aoa = Direction::from_vector(path.path.aoa.vector() + turned).expect("no zero");
    if let Some(departure) = &mut path.path.aod {
        departure.direction = Direction::from_vector(departure.direction.vector() - turned).expect("no zero");
    }
    if let Some(rate) = &mut path.range_rate {
        rate.m_per_s += 0.1;
    }
    path
}

/// Errors of length (m), arrival, departure (rad) and rate (m/s) of a path.
fn errors(path: &EstimatedPath, exact: &EstimatedPath) -> [f32; 4] {
    let departure = |path: &EstimatedPath| path.path.aod.expect("has one").direction;
    let rate = |path: &EstimatedPath| path.range_rate.expect("has one").m_per_s;
    [
        (path.path.c_tau_m - exact.path.c_tau_m).abs(),
        path.path.aoa.angle_to_rad(&exact.path.aoa),
        departure(path).angle_to_rad(&departure(exact)),
        (rate(path) - rate(exact)).abs(),
    ]
}

/// Paths without errors: the two of the link, and one that is none.
fn exact_paths() -> Vec<EstimatedPath> {
    let (truth, link) = (truth(), link());
    let mut paths: Vec<_> = link
        .paths
        .iter()
        .map(|path| exact(&TruePath::of(path, &truth)))
        .collect();
    let mut artefact = paths[0];
    artefact.path.c_tau_m += 5.0;
    paths.insert(0, artefact);
    paths
}

/// The same as estimated: the second true one errs, the last was listened to.
fn estimated() -> Estimated {
    let mut paths = exact_paths();
    paths[2] = off(&paths[2]);
    Estimated {
        paths: paths.into_iter().collect(),
        sighted: Some((2, Err(Refusal::NoPeak))),
        ..Estimated::default()
    }
}

#[test]
fn what_has_no_errors_is_put_right_and_nothing_else() {
    let (truth, link, exact) = (truth(), link(), exact_paths());
    let put_right = |free: &[ErrorFree]| {
        let put_right = ErrorFree::paths(free, estimated(), &truth, &link);
        assert_eq!(put_right.paths.len(), 3);
        // The artefact and the path that is right already stay as they were.
        for (path, exact) in put_right.paths.iter().zip(&exact[..2]) {
            assert!(errors(path, exact).iter().all(|error| *error < 1e-3));
        }
        errors(&put_right.paths[2], &exact[2]).map(|error| error > 1e-3)
    };
    assert_eq!(put_right(&[]), [true; 4]);
    assert_eq!(put_right(&[ErrorFree::Bends, ErrorFree::Timing]), [true; 4]);
    assert_eq!(put_right(&[ErrorFree::Lengths]), [false, true, true, true]);
    assert_eq!(put_right(&[ErrorFree::Arrivals]), [true, false, true, true]);
    assert_eq!(put_right(&[ErrorFree::Departures]), [true, true, false, true]);
    assert_eq!(put_right(&[ErrorFree::RangeRates]), [true, true, true, false]);
}

#[test]
fn artefacts_are_left_out_and_the_bearing_stays_with_its_path() {
    let estimated = estimated();
    let without = ErrorFree::paths(&[ErrorFree::Artefacts], estimated.clone(), &truth(), &link());
    assert_eq!(without.paths[..], estimated.paths[1..]);
    assert_eq!(without.sighted, Some((1, Err(Refusal::NoPeak))));
}

#[test]
fn departures_without_errors_are_those_of_the_beams() {
    let heard = ErrorFree::paths(&[ErrorFree::Departures], estimated(), &truth(), &link());
    assert_eq!(heard.sighted, Some((2, Err(Refusal::NotBegun))));
}

#[test]
fn what_comes_along_the_straight_way_is_no_artefact_and_can_be_put_straight() {
    let (truth, link) = (truth(), link());
    let straight = exact(&TruePath::straight(&truth));
    let bent = Estimated {
        paths: std::iter::once(off(&straight)).collect(),
        ..Estimated::default()
    };
    let kept = ErrorFree::paths(&[ErrorFree::Artefacts], bent.clone(), &truth, &link);
    assert_eq!(kept, bent);
    let put_right = ErrorFree::paths(&[ErrorFree::Bends], bent.clone(), &truth, &link);
    let [length_m, arrival_rad, departure_rad, _] = errors(&put_right.paths[0], &straight);
    assert!(length_m < 1e-4 && arrival_rad < 1e-3 && departure_rad < 1e-3);
    // Where there is a line of sight nothing is bent.
    let mut in_sight = link;
    in_sight.paths.push(true_path(0, 500.0, [0.1, 0.0]));
    assert_eq!(
        ErrorFree::paths(&[ErrorFree::Bends], bent.clone(), &truth, &in_sight),
        bent
    );
}

#[test]
fn sensors_lose_the_errors_that_are_named() {
    let real = SensorsConfig {
        imu: ImuConfig::real(),
        beacon: BeaconConfig::real(),
        timing: TimingConfig::real(),
        ..SensorsConfig::default()
    };
    assert_eq!(ErrorFree::sensors(&ErrorFree::OF_PATHS, &real), real);
    let timing = ErrorFree::sensors(&[ErrorFree::Timing], &real);
    assert_eq!(
        timing,
        SensorsConfig {
            timing: TimingConfig::ideal(),
            ..real.clone()
        }
    );
    let inertial = ErrorFree::sensors(&[ErrorFree::Inertial, ErrorFree::Beacon], &real);
    assert_eq!(inertial.beacon, BeaconConfig::ideal());
    assert_eq!(inertial.imu.accel_turn_on_bias_mg, 0.0);
    assert_eq!(
        inertial.imu.gyro_noise_mdps_per_sqrt_hz,
        real.imu.gyro_noise_mdps_per_sqrt_hz
    );
}
