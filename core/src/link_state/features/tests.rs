//! Features of made-up links against what geometry says of them.

mod twins;

use super::*;
use crate::geometry::Position;
use crate::path::{Departure, diagonal_covariance};
use crate::signal::Waveform;
use nalgebra::Matrix3;

fn at(x: f32, y: f32, z: f32) -> Position {
    Position::new(x, y, z).expect("finite")
}

/// GMT and UAV in front of a wall at x = 10 and over the ground at z = 0.
fn ends() -> Ends {
    Ends {
        uav: at(2.0, 40.0, 9.0),
        uav_covariance: Matrix3::identity() * 0.09,
        gmt: at(4.0, 5.0, 1.5),
    }
}

/// The path over the given points, from the GMT to the UAV.
fn over(points: &[Position]) -> Received {
    let ends = ends();
    let all = [&[ends.gmt], points, &[ends.uav]].concat();
    let length = all.windows(2).map(|leg| leg[1].distance_m(&leg[0])).sum();
    let towards =
        |from: &Position, to: &Position| Direction::from_vector(to.from_origin(from)).expect("apart");
    let n = all.len();
    Received {
        path: Path {
            c_tau_m: length,
            aoa: towards(&all[n - 1], &all[n - 2]),
            aod: Some(Departure {
                direction: towards(&all[0], &all[1]),
                sigma_rad: 0.035,
            }),
            covariance: diagonal_covariance(0.2, 0.0087),
        },
        gain_db: Some(-95.0),
    }
}

fn mirrored_at_wall() -> Received {
    // Image of the GMT at x = 16: the wall is met where the line from it crosses x = 10.
    let share = 6.0 / 14.0;
    over(&[at(10.0, 5.0 + 35.0 * share, 1.5 + 7.5 * share)])
}

fn named(received: &Received, others: &[Received], name: &str) -> f32 {
    let ends = ends();
    let all = [&[*received], others].concat();
    let features = LinkGeometry::new(&ends, &all, &Waveform::default())
        .expect("apart")
        .features(received)
        .expect("sound");
    let place = GEOMETRIC_NAMES
        .iter()
        .position(|n| *n == name)
        .expect("a feature");
    features.with_departure().expect("has a departure")[place]
}

#[test]
fn a_wall_bounce_fits_its_point() {
    let path = mirrored_at_wall();
    let feature = |name| named(&path, &[over(&[])], name);
    let excess = path.path.c_tau_m - ends().uav.distance_m(&ends().gmt);
    assert!((feature("excess") - libm::asinhf(excess / 0.3)).abs() < 1e-4);
    assert!(
        (feature("behind_first") - feature("excess")).abs() < 1e-4,
        "the line of sight came first"
    );
    assert!(feature("departure_off_point").abs() < 2e-3);
    assert!(
        feature("source_height").abs() < 1e-3,
        "walls keep the height of the source"
    );
    assert!(feature("normal_z").abs() < 1e-4);
    assert!((feature("point_height") - libm::asinhf(7.5 * 6.0 / 14.0)).abs() < 1e-3);
    assert!((feature("uav_share") - 8.0 / 14.0).abs() < 1e-4);
    let cos = 14.0 / (14.0_f32 * 14.0 + 35.0 * 35.0 + 7.5 * 7.5).sqrt();
    assert!((feature("cos_incidence") - cos).abs() < 1e-4);
}

#[test]
fn a_ground_bounce_comes_from_below_the_gmt() {
    let share = 1.5 / 10.5;
    let path = over(&[at(4.0 - 2.0 * share, 5.0 + 35.0 * share, 0.0)]);
    let feature = |name| named(&path, &[], name);
    assert!((feature("source_height") - libm::asinhf(-3.0)).abs() < 1e-3);
    assert!((feature("normal_z") - 1.0).abs() < 1e-4);
    assert!((feature("point_height") - libm::asinhf(-1.5)).abs() < 1e-3);
}

#[test]
fn two_bounces_leave_in_another_direction_than_their_point() {
    // Off the wall at x = 10, then off one at y = 44; from the image at (16, 83).
    let (image, uav) = (at(16.0, 83.0, 1.5), ends().uav);
    let line = image.from_origin(&uav);
    let second = *uav.vector() + line * (4.0 / 43.0);
    let after = at(16.0, 5.0, 1.5);
    let line = second - after.vector();
    let first = *after.vector() + line * ((10.0 - 16.0) / line.x);
    let point = |v: Vector3<f32>| Position::from_vector(v).expect("finite");
    let path = over(&[point(first), point(second)]);
    assert!(
        (path.path.c_tau_m - image.distance_m(&uav)).abs() < 1e-3,
        "the construction holds"
    );
    assert!(named(&path, &[], "departure_off_point") > 2.0);
    assert!(named(&path, &[], "departure_off_point_sigmas") > 2.0);
}

#[test]
fn line_of_sight_has_no_excess_and_free_space_gain() {
    let mut path = over(&[]);
    let db = |r: f32| 20.0 * libm::log10f(r);
    let length = path.path.c_tau_m;
    let sin = (1.0 - (7.5 / length) * (7.5 / length)).sqrt();
    let dipole = 1.281_8 * libm::cosf(core::f32::consts::FRAC_PI_2 * 7.5 / length) / sin;
    path.gain_db = Some(db(Waveform::default().wavelength_m() as f32
        / (4.0 * core::f32::consts::PI * length)
        * dipole
        * dipole));
    for short in [0.0, -0.5] {
        let mut path = path;
        path.path.c_tau_m += short;
        let feature = |name| named(&path, &[mirrored_at_wall()], name);
        assert!((feature("excess") - libm::asinhf(short / 0.3)).abs() < 1e-4);
        assert!(feature("arrival_off_gmt") < 1e-2 && feature("departure_off_uav") < 1e-2);
        assert!(
            feature("gain_over_free_space").abs() < 0.02,
            "{}",
            feature("gain_over_free_space")
        );
        assert_eq!((feature("behind_first"), feature("under_strongest")), (0.0, 0.0));
    }
}

#[test]
fn paths_are_seen_beside_the_others_of_their_link() {
    let (strong, mut weak) = (mirrored_at_wall(), mirrored_at_wall());
    weak.path.c_tau_m += 2.0;
    weak.gain_db = Some(-107.0);
    let los = over(&[]);
    let others = [weak, los];
    assert_eq!(named(&strong, &others, "rank"), 0.0);
    // The last of three: behind the others in the order of strength.
    let ends = ends();
    let all = [los, strong, weak];
    let link = LinkGeometry::new(&ends, &all, &Waveform::default()).expect("apart");
    let of = |received: &Received, name: &str| {
        let place = GEOMETRIC_NAMES
            .iter()
            .position(|n| *n == name)
            .expect("a feature");
        link.features(received).expect("sound").without_departure()[place]
    };
    assert_eq!([los, strong, weak].map(|p| of(&p, "rank")), [0.0, 0.125, 0.25]);
    // Each of the two reflected paths sees the other one, the line of sight the better of them; nobody sees that.
    assert_eq!(of(&weak, "residual_of_others"), of(&strong, "gain_residual"));
    assert_eq!(of(&strong, "residual_of_others"), of(&weak, "gain_residual"));
    assert_eq!(of(&los, "residual_of_others"), of(&strong, "gain_residual"));
    assert_eq!(named(&strong, &[los], "residual_of_others"), -4.0, "alone");
}

#[test]
fn a_wave_that_comes_back_has_no_turn() {
    let turn = |departure: Vector3<f32>| {
        let mut path = mirrored_at_wall();
        path.path.aoa = Direction::from_vector(Vector3::new(0.6, 0.8, 0.1)).expect("some");
        let departure = Direction::from_vector(departure).expect("some");
        path.path.aod = Some(Departure {
            direction: departure,
            sigma_rad: 0.035,
        });
        libm::sinhf(named(&path, &[], "turn")) * 0.05
    };
    assert!(
        turn(Vector3::new(0.6, 0.8, -0.3)).abs() < 1e-5,
        "back the way it came, in plan"
    );
    assert!((turn(Vector3::new(-0.8, 0.6, 0.0)) - core::f32::consts::FRAC_PI_2).abs() < 1e-3);
    assert!((turn(Vector3::new(0.8, -0.6, 0.0)) - core::f32::consts::FRAC_PI_2).abs() < 1e-3);
}

#[test]
fn an_exact_line_of_sight_has_features() {
    for (x, y, z) in [
        (2.0, 40.0, 9.0),
        (111.438, 63.213, 18.709),
        (4.0, 5.0, 30.0),
        (4.5, 5.0, 1.5),
        (-300.0, 20.0, 2.0),
    ] {
        let ends = Ends {
            uav: at(x, y, z),
            ..ends()
        };
        let towards =
            |from: &Position, to: &Position| Direction::from_vector(to.from_origin(from)).expect("apart");
        let mut los = over(&[]);
        los.path.c_tau_m = ends.uav.distance_m(&ends.gmt);
        los.path.aoa = towards(&ends.uav, &ends.gmt);
        los.path.aod = Some(Departure {
            direction: towards(&ends.gmt, &ends.uav),
            sigma_rad: 0.0,
        });
        los.path.covariance = Matrix3::zeros();
        let features = LinkGeometry::new(&ends, &[los], &Waveform::default())
            .and_then(|l| l.features(&los))
            .expect("a measurement");
        assert!(features.without_departure()[0].abs() < 1e-3, "no excess");
    }
}

#[test]
fn what_is_not_known_is_said() {
    let mut path = mirrored_at_wall();
    path.gain_db = None;
    for name in [
        "gain_known",
        "gain_residual",
        "gain_over_free_space",
        "under_strongest",
    ] {
        assert_eq!(named(&path, &[over(&[])], name), 0.0, "{name}");
    }
    assert_eq!(named(&over(&[]), &[], "gain_known"), 1.0);
    let ends = ends();
    let with = LinkGeometry::new(&ends, &[path], &Waveform::default())
        .and_then(|l| l.features(&path))
        .expect("sound");
    path.path.aod = None;
    let without = LinkGeometry::new(&ends, &[path], &Waveform::default())
        .and_then(|l| l.features(&path))
        .expect("sound");
    assert_eq!(without.with_departure(), None);
    assert_eq!(without.without_departure(), with.without_departure());
}

#[test]
fn a_sure_departure_makes_a_mismatch_count_for_more() {
    let mut path = mirrored_at_wall();
    let tilted = path.path.aod.expect("set").direction.vector() + Vector3::new(0.0, 0.0, 0.1);
    let with_sigma = |path: &mut Received, sigma_rad| {
        path.path.aod = Some(Departure {
            direction: Direction::from_vector(tilted).expect("some"),
            sigma_rad,
        });
        named(path, &[], "departure_off_point_sigmas")
    };
    assert!(with_sigma(&mut path, 0.01) > with_sigma(&mut path, 0.1) + 0.5);
}

#[test]
fn of_a_carrier_only_what_free_space_leaves_counts() {
    let (path, second) = (mirrored_at_wall(), twins::mirrored_at_wall_and_ground());
    let ends = ends();
    let features = |waveform: &Waveform, weaker_db: f32| {
        let weaker = |path: &Received| Received {
            gain_db: path.gain_db.map(|gain_db| gain_db - weaker_db),
            ..*path
        };
        let paths = [weaker(&path), weaker(&second)];
        let link = LinkGeometry::new(&ends, &paths, waveform).expect("apart");
        link.features(&paths[0]).expect("sound")
    };
    // Free space weakens a wave of half the length by 6 dB more.
    let own = Waveform::default();
    let half = Waveform {
        carrier_hz: 2.0 * own.carrier_hz,
        ..own
    };
    let halved = features(&half, 20.0 * core::f32::consts::LOG10_2);
    let pairs = |other: Features| {
        let own = features(&own, 0.0);
        own.values
            .into_iter()
            .zip(other.values)
            .collect::<heapless::Vec<_, 32>>()
    };
    assert!(
        pairs(halved)
            .iter()
            .all(|(own, other)| (own - other).abs() < 1e-5)
    );
    let same_gain = features(&half, 0.0);
    assert!(
        pairs(same_gain)
            .iter()
            .any(|(own, other)| (own - other).abs() > 0.1)
    );
}

#[test]
fn hostile_measurements_are_refused_by_name() {
    let good = mirrored_at_wall();
    let ends = ends();
    let features = |received: Received| {
        LinkGeometry::new(&ends, &[good], &Waveform::default()).and_then(|l| l.features(&received))
    };
    let with_length = |c_tau_m| Received {
        path: Path { c_tau_m, ..good.path },
        ..good
    };
    assert_eq!(features(with_length(f32::NAN)), Err(InputError::NotFinite));
    assert_eq!(features(with_length(0.0)), Err(InputError::NoLength));
    assert_eq!(features(with_length(f32::MAX)), Err(InputError::NotFinite));
    let loud = Received {
        gain_db: Some(f32::INFINITY),
        ..good
    };
    assert_eq!(features(loud), Err(InputError::NotFinite));
    let mut unsure = good;
    unsure.path.covariance.m11 = f32::NAN;
    assert_eq!(features(unsure), Err(InputError::NotFinite));
    let same = Ends {
        gmt: ends.uav,
        ..ends
    };
    assert_eq!(
        LinkGeometry::new(&same, &[], &Waveform::default()).expect_err("same place"),
        InputError::CoincidentEnds
    );
}

#[test]
fn the_papers_inputs_are_raw_and_padded() {
    let paths = [over(&[]), mirrored_at_wall()];
    let mut inputs = [9.0; 9];
    paper_inputs(&paths, &mut inputs);
    assert_eq!(inputs[3], paths[1].path.c_tau_m);
    assert!((inputs[5] - paths[1].path.aoa.azimuth_rad()).abs() < 1e-6);
    assert_eq!(inputs[6..], [0.0; 3]);
    let mut one = [0.0; 3];
    paper_inputs(&paths, &mut one);
    assert_eq!(one, inputs[..3]);
}
