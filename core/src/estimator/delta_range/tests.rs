use super::super::layout::VELOCITY;
use super::super::{Filter49, FilterConfig};
use super::*;
use crate::radio::RadioModel;

const DT_NS: u64 = 500_000_000;

fn length(c_tau_m: f64, towards: Vector3<f64>) -> Length {
    Length {
        c_tau_m,
        variance_m2: 1e-4,
        towards: towards.normalize(),
        left: None,
    }
}

fn between(moved_m: Vector3<f64>, shifted_m: Vector3<f64>) -> Between {
    Between {
        dt_s: 0.5,
        moved_m,
        shifted_m,
        drift_m: 0.0,
        delay_period: RadioModel::default().waveform.delay_period(),
    }
}

/// A running filter that has gone east by 2.5 m since the last sweep, its clock drift known, its velocity to 1 m/s.
fn flying() -> Filter49 {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), DT_NS);
    filter.running = true;
    filter.nominal.velocity_m_per_s = Vector3::new(5.0, 0.0, 0.0);
    filter.covariance.reset(CLOCK_DRIFT, 1e-6);
    for axis in 0..3 {
        filter.covariance.reset(ATTITUDE + axis, 1e-6);
    }
    filter
}

fn lengths(time_ns: u64, gmt_m: Vector3<f64>, paths: &[Length]) -> Lengths {
    Lengths {
        time_ns,
        gmt_m,
        paths: Vec::from_slice(paths).expect("room"),
    }
}

const MOVED_M: Vector3<f64> = Vector3::new(2.5, 0.0, 0.0);

#[test]
fn a_path_that_grows_less_than_expected_says_that_the_uav_went_towards_it() {
    let mut filter = flying();
    let north = Vector3::y();
    let before = lengths(0, Vector3::zeros(), &[length(80.0, north)]);
    // In truth it went north by 0.2 m as well: 0.4 m/s.
    filter.lengths = lengths(DT_NS, Vector3::zeros(), &[length(79.8, north)]);
    filter.delta_ranges(&before, MOVED_M);
    let velocity = filter.nominal.velocity_m_per_s;
    // With a spread of 0.5 m, 0.59 to 0.1 that it is the same path: 0.85 of it.
    assert!((velocity.y - 0.341).abs() < 0.001, "{velocity}");
    assert!((velocity.x - 5.0).abs() < 0.01, "{velocity}");
    // And so much less is learnt of it: 0.85 of what one path would teach, less what both answers are apart.
    let unsure = 0.85 * 0.15 * 0.4 * 0.4;
    let variance = filter.variance(VELOCITY + 1);
    assert!((variance - 0.147 - unsure).abs() < 0.002, "{variance}");
    assert!(filter.variance(VELOCITY) > 0.5);
    assert_eq!(
        (
            filter.counters.delta_ranges,
            filter.counters.delta_ranges_rejected
        ),
        (1, 0)
    );
}

#[test]
fn two_paths_of_one_direction_are_no_two_velocities() {
    let mut filter = flying();
    let (a, b) = (Vector3::new(0.0, 1.0, 0.0), Vector3::new(0.1, 1.0, 0.0));
    let grown = |c_tau_m: f64, towards: Vector3<f64>| {
        let truly_m = Vector3::new(2.5, 0.2, 0.0);
        length(c_tau_m - towards.normalize().dot(&truly_m), towards)
    };
    let before = lengths(0, Vector3::zeros(), &[length(80.0, a), length(60.0, b)]);
    filter.lengths = lengths(DT_NS, Vector3::zeros(), &[grown(80.0, a), grown(60.0, b)]);
    filter.delta_ranges(&before, MOVED_M);
    let north_m_per_s = filter.nominal.velocity_m_per_s.y;
    assert!((0.35..0.4).contains(&north_m_per_s), "{north_m_per_s} m/s");
    assert_eq!(filter.counters.delta_ranges, 2);
}

#[test]
fn growth_that_no_velocity_explains_is_rejected_and_counted() {
    let mut filter = flying();
    for axis in 0..3 {
        filter.covariance.reset(VELOCITY + axis, 1e-4);
    }
    let before = lengths(0, Vector3::zeros(), &[length(80.0, Vector3::y())]);
    filter.lengths = lengths(DT_NS, Vector3::zeros(), &[length(80.7, Vector3::y())]);
    filter.delta_ranges(&before, MOVED_M);
    assert_eq!(filter.nominal.velocity_m_per_s.y, 0.0);
    assert_eq!(
        (
            filter.counters.delta_ranges,
            filter.counters.delta_ranges_rejected
        ),
        (0, 1)
    );
}

#[test]
fn sweeps_that_are_far_apart_are_not_compared() {
    let mut filter = flying();
    let path = length(80.0, Vector3::y());
    filter.lengths = lengths(DT_NS, Vector3::zeros(), &[length(79.8, Vector3::y())]);
    filter.lengths.time_ns = 2_000_000_000;
    filter.delta_ranges(&lengths(0, Vector3::zeros(), &[path]), MOVED_M);
    assert_eq!(filter.counters, crate::estimator::Counters::default());
}

#[test]
fn the_gmt_s_motion_counts_along_the_departure() {
    let shifted_m = Vector3::new(0.0, -0.2, 0.0);
    let between = between(Vector3::zeros(), shifted_m);
    let mut path = length(50.0, Vector3::x());
    assert!(
        between.row::<f64>(&path, &path).is_none(),
        "it may have left in any direction"
    );
    // Away from where the wave leaves for: the path grows.
    path.left = Some(Vector3::y());
    let grown = Length {
        c_tau_m: 50.2,
        ..path
    };
    let row = between.row::<f64>(&path, &grown).expect("known");
    assert!(row.residual.abs() < 1e-12);
    let standing = Between {
        shifted_m: Vector3::zeros(),
        ..between
    };
    let row = standing.row::<f64>(&length(50.0, Vector3::x()), &grown);
    assert!((row.expect("it stands").residual - 0.2).abs() < 1e-12);
}

#[test]
fn an_attitude_that_is_off_turns_the_motion_that_a_path_tells_of() {
    let between = between(MOVED_M, Vector3::zeros());
    let towards = Vector3::new(0.3, 0.8, -0.2).normalize();
    let row = between
        .row::<f64>(&length(50.0, towards), &length(50.0, towards))
        .expect("it stands");
    // Turned by the true attitude, the same arrivals would come from elsewhere, and the path would have to grow so much more.
    let theta = Vector3::new(1e-4, -2e-4, 3e-4);
    let turned = towards + theta.cross(&towards);
    let expected = -(turned - towards).dot(&MOVED_M);
    let mut dx = [0.0; crate::estimator::states(2)];
    for axis in 0..3 {
        dx[ATTITUDE + axis] = theta[axis];
    }
    assert!((row.dot(&dx) - expected).abs() < 1e-12);
}

#[test]
fn the_mean_direction_is_exact_to_the_second_order() {
    // 40 m off, 3 m aside: the way back is 11 cm longer, by Pythagoras.
    let (source, from, to) = (
        Vector3::new(0.0, 40.0, 0.0),
        Vector3::zeros(),
        Vector3::new(3.0, 0.0, 0.0),
    );
    let seen = |at: Vector3<f64>| length((source - at).norm(), source - at);
    let between = between(to - from, Vector3::zeros());
    assert!((seen(to).c_tau_m - 40.0 - 0.112).abs() < 1e-3);
    assert!(between.growth_m(&seen(from), &seen(to)).abs() < 1e-3);
}

#[test]
fn a_path_goes_on_from_its_nearest_and_only_if_that_is_mutual() {
    let between = between(Vector3::zeros(), Vector3::zeros());
    let at = |c_tau_m: f64| length(c_tau_m, Vector3::x());
    let (before, now) = ([at(50.0), at(50.6)], [at(50.05), at(50.62)]);
    let partner = |k: usize| between.partner(&now[k], &before, &now).map(|found| found.c_tau_m);
    assert_eq!((partner(0), partner(1)), (Some(50.0), Some(50.6)));
    // Of two that come after one, the nearer goes on from it.
    let one = [at(50.0)];
    let of = |k: usize| between.partner(&now[k], &one, &now).is_some();
    assert!(of(0) && !of(1));
    let aside = [length(50.0, Vector3::new(1.0, 0.1, 0.0))];
    assert!(between.partner(&now[0], &aside, &now).is_none(), "from elsewhere");
    assert!(
        between.partner(&at(52.0), &one, &[at(52.0)]).is_none(),
        "too long"
    );
}

/// Mean and variance after a difference that may be of another path are those of both answers together.
#[test]
fn a_difference_in_doubt_leaves_the_moments_of_both_answers() {
    let mut filter = flying();
    let before = lengths(0, Vector3::zeros(), &[length(80.0, Vector3::y())]);
    filter.lengths = lengths(DT_NS, Vector3::zeros(), &[length(79.2, Vector3::y())]);
    let prior = filter.variance(VELOCITY + 1);
    filter.delta_ranges(&before, MOVED_M);
    // Of one path: 0.5 s times the velocity, known to 26 mm beside what the attitude leaves.
    let of_state = 0.25 * prior + 2.5 * 2.5 * 1e-6;
    let spread = of_state + 2e-4 + PULLED_M * PULLED_M + (2.5 * ARRIVAL_RAD).powi(2);
    let density = libm::exp(-0.32 / spread) / libm::sqrt(core::f64::consts::TAU * spread);
    let same = 0.8 * density / (0.8 * density + 0.1);
    let (mean, variance) = (0.5 * prior * 0.8 / spread, prior - 0.25 * prior * prior / spread);
    let both = same * variance + (1.0 - same) * prior + same * (1.0 - same) * mean * mean;
    let velocity = filter.nominal.velocity_m_per_s.y;
    assert!(
        (velocity - same * mean).abs() < 1e-3,
        "{velocity} and {}",
        same * mean
    );
    let left = filter.variance(VELOCITY + 1);
    assert!((left - both).abs() < 1e-3, "{left} and {both}");
}

/// A path that was exchanged for its neighbour has a tail of decimetres.
#[test]
fn the_further_a_difference_is_off_the_less_it_weighs() {
    let moved = |off_m: f64| {
        let mut filter = flying();
        for axis in 0..3 {
            filter.covariance.reset(VELOCITY + axis, 1e-4);
        }
        let before = lengths(0, Vector3::zeros(), &[length(80.0, Vector3::y())]);
        filter.lengths = lengths(DT_NS, Vector3::zeros(), &[length(80.0 - off_m, Vector3::y())]);
        filter.delta_ranges(&before, MOVED_M);
        (
            filter.nominal.velocity_m_per_s.y,
            filter.counters.delta_ranges_rejected,
        )
    };
    // A difference is known to 26 mm: one, four, and more than five of these.
    let [(near, _), (far, kept), (beyond, refused)] = [0.025, 0.1, 0.2].map(moved);
    assert!(near > 0.0 && far > 0.0 && kept == 0);
    assert!(far < 1.2 * near, "{far} and {near} m/s: four times as far off");
    assert_eq!((beyond, refused), (0.0, 1));
}
