use nalgebra::Vector3;

use super::super::layout::POSITION;
use super::super::{Filter49, FilterConfig};
use super::*;
use crate::estimator::Transmitter;
use crate::geometry::{Direction, Rotation};
use crate::path::RangeRate;
use crate::radio::RadioModel;

const PERIOD_M_PER_S: f64 = 2.5;
/// How the UAV flies in truth; the filter knows of the first part alone.
const TRULY_M_PER_S: Vector3<f64> = Vector3::new(5.0, 0.1, -0.05);
const KNOWN_M_PER_S: Vector3<f64> = Vector3::new(5.0, 0.0, 0.0);
const TOWARDS: [Vector3<f64>; 4] = [
    Vector3::new(0.0, 1.0, 0.0),
    Vector3::new(0.6, 0.0, 0.8),
    Vector3::new(-1.0, 0.0, 0.0),
    Vector3::new(0.6, -0.8, 0.0),
];

/// A running filter, its velocity known so well along each axis.
fn flying(sigma_m_per_s: f32) -> Filter49 {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 1_000_000_000);
    filter.running = true;
    filter.nominal.velocity_m_per_s = KNOWN_M_PER_S;
    for axis in 0..3 {
        filter
            .covariance
            .reset(VELOCITY + axis, sigma_m_per_s * sigma_m_per_s);
        filter.covariance.reset(ATTITUDE + axis, 1e-8);
    }
    filter
}

/// A path from a direction, whose rate is off by so much.
fn path(towards: Vector3<f64>, off_m_per_s: f64) -> PathMeasurement {
    let rate = off_m_per_s - towards.dot(&TRULY_M_PER_S);
    let folded = rate - PERIOD_M_PER_S * libm::round(rate / PERIOD_M_PER_S);
    PathMeasurement {
        c_tau_m: 50.0,
        c_tau_sigma_m: 0.01,
        aoa: Direction::from_vector(towards).expect("a direction"),
        aoa_sigma_rad: 1e-3,
        departure: None,
        range_rate: Some(RangeRate {
            m_per_s: folded as f32,
            sigma_m_per_s: 0.01,
            period_m_per_s: PERIOD_M_PER_S as f32,
        }),
    }
}

fn sweep(paths: &[PathMeasurement]) -> SweepMeasurement<'_> {
    SweepMeasurement {
        time_ns: 1_000_000_000,
        gmt: Transmitter {
            position_m: Vector3::zeros(),
            sigma_m: 0.02,
            attitude: Rotation::identity(),
            reach: crate::array::BeamReach::default(),
        },
        stop: 0,
        line_of_sight: None,
        self_consistent: false,
        contrary: None,
        reflections: &[],
        paths,
        delta_ranges: true,
    }
}

fn take(filter: &mut Filter49, paths: &[PathMeasurement]) {
    filter.range_rates(&sweep(paths));
}

fn counted(filter: &Filter49) -> (u32, u32) {
    (filter.counters.range_rates, filter.counters.range_rates_rejected)
}

#[test]
fn four_paths_tell_the_velocity_whatever_the_offset_of_the_carriers() {
    for offset_m_per_s in [0.0, 0.7, -1.2, 31.3] {
        let mut filter = flying(0.06);
        take(&mut filter, &TOWARDS.map(|towards| path(towards, offset_m_per_s)));
        let off = (filter.nominal.velocity_m_per_s - TRULY_M_PER_S).norm();
        assert!(
            off < 0.03,
            "{offset_m_per_s}: {}",
            filter.nominal.velocity_m_per_s
        );
        let sigma = |axis| libm::sqrt(filter.variance(VELOCITY + axis));
        assert!((0..3).all(|axis| sigma(axis) < 0.04), "{offset_m_per_s}");
        assert_eq!(counted(&filter), (3, 0));
    }
}

#[test]
fn the_variance_is_that_of_least_squares_with_an_unknown_offset_and_what_is_in_doubt() {
    let prior = 0.0025;
    let mut filter = flying(0.05);
    filter.nominal.velocity_m_per_s = TRULY_M_PER_S;
    let paths = TOWARDS.map(|towards| path(towards, 0.3));
    let rates = paths.map(|path| filter.rate(&path).expect("a rate"));
    take(&mut filter, &paths);
    // Velocity and offset together: information of the prior and of the four rates.
    let mut information = nalgebra::Matrix4::<f64>::zeros();
    for axis in 0..3 {
        information[(axis, axis)] = 1.0 / prior;
    }
    for rate in rates {
        let slope = rate.slopes.velocity.push(1.0);
        information += slope * slope.transpose() / rate.variance;
    }
    let expected = information.try_inverse().expect("all is told");
    for axis in 0..3 {
        let (found, expected) = (filter.variance(VELOCITY + axis), expected[(axis, axis)]);
        // One rate in ten that agrees is of another path.
        let doubt = (found - expected) / prior;
        assert!((0.005..0.05).contains(&doubt), "{axis}: {found} {expected}");
    }
}

#[test]
fn one_path_alone_tells_nothing() {
    let mut filter = flying(0.06);
    take(&mut filter, &[path(TOWARDS[0], 0.3)]);
    assert_eq!(filter.nominal.velocity_m_per_s, KNOWN_M_PER_S);
    assert_eq!(counted(&filter), (0, 0));
}

#[test]
fn a_path_that_moves_by_itself_is_left_out_and_counted() {
    let mut filter = flying(0.05);
    filter.nominal.velocity_m_per_s = TRULY_M_PER_S;
    // The strongest one is that of a car.
    let paths = [0, 1, 2, 3].map(|k| path(TOWARDS[k], if k == 0 { 0.6 } else { 0.0 }));
    take(&mut filter, &paths);
    let off = (filter.nominal.velocity_m_per_s - TRULY_M_PER_S).norm();
    assert!(off < 1e-3, "{}", filter.nominal.velocity_m_per_s);
    assert_eq!(counted(&filter), (2, 1));
}

#[test]
fn an_attitude_that_is_off_shows_in_the_rates() {
    let mut filter = flying(0.01);
    filter.nominal.velocity_m_per_s = TRULY_M_PER_S;
    for axis in 0..3 {
        filter.covariance.reset(ATTITUDE + axis, 1e-4);
    }
    let turned = crate::estimator::nominal::rotation(&Vector3::new(0.0, 0.0, 0.01));
    let paths = TOWARDS.map(|towards| {
        let seen = turned.transpose() * towards;
        PathMeasurement {
            aoa: Direction::from_vector(seen).expect("a direction"),
            ..path(towards, 0.0)
        }
    });
    let before = filter.nominal.attitude;
    take(&mut filter, &paths);
    let yaw_rad = (filter.nominal.attitude * before.transpose()).m21;
    assert!((0.002..0.012).contains(&yaw_rad), "{yaw_rad}");
}

#[test]
fn a_velocity_too_unsure_to_count_periods_takes_none() {
    let mut filter = flying(0.3);
    take(&mut filter, &TOWARDS.map(|towards| path(towards, 0.0)));
    assert_eq!(filter.nominal.velocity_m_per_s, KNOWN_M_PER_S);
    assert_eq!(counted(&filter), (0, 3));
}

/// What two rates leave of the variance of the velocity between their directions, when the second one is off by so much.
fn left_in_doubt(sigma_m_per_s: f32, off_m_per_s: f64) -> f64 {
    let mut filter = flying(sigma_m_per_s);
    filter.nominal.velocity_m_per_s = TRULY_M_PER_S;
    take(
        &mut filter,
        &[path(TOWARDS[0], 0.0), path(TOWARDS[1], off_m_per_s)],
    );
    assert_eq!(counted(&filter), (1, 0));
    let apart = TOWARDS[1] - TOWARDS[0];
    let velocity = filter.covariance.block(VELOCITY, VELOCITY).map(f64::from);
    let prior = f64::from(sigma_m_per_s) * f64::from(sigma_m_per_s) * apart.norm_squared();
    apart.dot(&(velocity * apart)) / prior
}

#[test]
fn a_rate_that_may_be_of_another_path_or_period_leaves_its_doubt() {
    // Half a period is seventeen standard deviations of this velocity: the next one is in no doubt. At three of them it is another path's as well.
    assert!(left_in_doubt(0.05, 0.0) < 0.15, "{}", left_in_doubt(0.05, 0.0));
    assert!(left_in_doubt(0.05, 0.22) > 0.6, "{}", left_in_doubt(0.05, 0.22));
    // Here it is five, and one rate in a thousand is of either next period.
    assert!(left_in_doubt(0.17, 0.0) > 0.1, "{}", left_in_doubt(0.17, 0.0));
}

#[test]
fn a_rate_that_those_before_it_contradict_counts_for_little() {
    let mut filter = flying(0.12);
    let [a, b, c, d] = TOWARDS;
    let others = [a, b, c, d, Vector3::new(0.0, -0.6, -0.8)].map(|towards| path(towards, 0.0));
    // Of the state before the sweep it is within three standard deviations.
    let off = path(Vector3::new(0.0, -1.0, 0.0), 0.5);
    let [a, b, c, d, e] = others;
    take(&mut filter, &[a, b, c, d, e, off]);
    assert_eq!(counted(&filter), (5, 0));
    let error = (filter.nominal.velocity_m_per_s - TRULY_M_PER_S).norm();
    assert!(error < 0.03, "{error}");
}

#[test]
fn numbers_that_are_none_are_no_rates() {
    let mut filter = flying(0.06);
    let broken = [f32::NAN, f32::INFINITY, 0.0, -1.0].map(|period_m_per_s| {
        let mut path = path(TOWARDS[0], 0.0);
        path.range_rate = path.range_rate.map(|rate| RangeRate {
            period_m_per_s,
            ..rate
        });
        path
    });
    take(&mut filter, &broken);
    let mut unsure = path(TOWARDS[1], 0.0);
    unsure.range_rate = unsure.range_rate.map(|rate| RangeRate {
        sigma_m_per_s: f32::NAN,
        ..rate
    });
    take(&mut filter, &[unsure, path(TOWARDS[2], 0.0)]);
    assert_eq!(filter.nominal.velocity_m_per_s, KNOWN_M_PER_S);
    assert!(filter.variance(VELOCITY).is_finite());
}

#[test]
fn a_sweep_with_a_line_of_sight_takes_them_too() {
    let mut filter = flying(0.06);
    for axis in 0..3 {
        filter.covariance.reset(POSITION + axis, 0.01);
    }
    let paths = TOWARDS.map(|towards| path(towards, 0.3));
    let towards = Vector3::new(1.0, 0.0, 0.0);
    let line = path(towards, 0.3);
    let mut sweep = sweep(&paths);
    sweep.line_of_sight = Some(PathMeasurement {
        range_rate: None,
        ..line
    });
    sweep.gmt.position_m = filter.nominal.position_m + towards * 50.0;
    let verdict = filter.sweep(&sweep);
    assert!(verdict.is_taken(), "{verdict:?}");
    assert_eq!(counted(&filter), (3, 0));
}

#[test]
fn they_are_taken_whether_lengths_are_compared_or_not() {
    for delta_ranges in [true, false] {
        let mut filter = flying(0.06);
        let mut paths = TOWARDS.map(|towards| path(towards, 0.3));
        for sweeps in 1..=2 {
            let mut sweep = sweep(&paths);
            sweep.delta_ranges = delta_ranges;
            sweep.time_ns += (sweeps - 1) * 500_000_000;
            filter.nominal.time_ns = sweep.time_ns;
            let _verdict = filter.sweep(&sweep);
            for (path, towards) in paths.iter_mut().zip(TOWARDS) {
                path.c_tau_m -= 0.5 * towards.dot(&TRULY_M_PER_S);
            }
        }
        assert_eq!(filter.counters.range_rates, 6);
        assert_eq!(filter.counters.delta_ranges > 0, delta_ranges);
    }
}

/// A velocity and an attitude that are both unknown: the product of their errors is in no derivative.
#[test]
fn the_product_of_the_errors_of_velocity_and_attitude_is_noise() {
    let sigma = |attitude_rad: f32| {
        let mut filter = flying(0.6);
        for axis in 0..3 {
            filter
                .covariance
                .reset(ATTITUDE + axis, attitude_rad * attitude_rad);
        }
        let rate = filter
            .rate(&path(Vector3::new(1.0, 0.0, 0.0), 0.0))
            .expect("a rate");
        libm::sqrt(rate.variance)
    };
    // Along the velocity an arrival's error does nothing: 10 mm/s, and 0.6 m/s times 50 mrad, over two of three axes each.
    assert!((sigma(1e-6) - 0.01).abs() < 1e-4, "{}", sigma(1e-6));
    let expected = libm::hypot(0.01, libm::sqrt(2.0) * 0.6 * 0.05);
    assert!(
        (sigma(0.05) - expected).abs() < 1e-4,
        "{} {expected}",
        sigma(0.05)
    );
}
