//! The reflection solver against known geometry, and its own derivatives.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a helper of a test fails by panicking"
)]

mod hostile;

use core::f64::consts::{FRAC_PI_2, PI};

use cslam_core::geometry::{Direction, Matrix3, Position, Real, Vector3, World};
use cslam_core::path::{Departure, Path, diagonal_covariance};
use cslam_core::reflection::{
    Bounds, Ends, Form, Gates, InputError, Jacobians, Rejection, Verdict, paper_point, solve, vector_point,
};
use proptest::prelude::*;

fn position<T: Real>(p: [f64; 3]) -> Position<World, T> {
    Position::new(T::of(p[0]), T::of(p[1]), T::of(p[2])).expect("finite")
}

fn ends<T: Real>(gmt: [f64; 3], uav: [f64; 3]) -> Ends<T> {
    Ends {
        uav: position(uav),
        uav_covariance: Matrix3::zeros(),
        gmt: position(gmt),
    }
}

/// The path over `point`, computed in f64 and then rounded once, as a perfect receiver would measure it.
fn path_over<T: Real>(gmt: [f64; 3], uav: [f64; 3], point: [f64; 3]) -> Path<World, T> {
    let (g, r, p) = (Vector3::from(gmt), Vector3::from(uav), Vector3::from(point));
    let aoa = (p - r).map(T::of);
    let aod = (p - g).map(T::of);
    Path {
        c_tau_m: T::of((p - r).norm() + (p - g).norm()),
        aoa: Direction::from_vector(aoa).expect("non-zero"),
        aod: Some(Departure {
            direction: Direction::from_vector(aod).expect("non-zero"),
            sigma_rad: T::of(0.03),
        }),
        covariance: Matrix3::zeros(),
    }
}

fn accepted<T: Real>(verdict: Result<Verdict<T>, InputError>) -> Vector3<f64> {
    match verdict {
        Ok(Verdict::Accepted(point)) => point.position.vector().map(|c| c.to_f64()),
        other => panic!("not accepted: {other:?}"),
    }
}

const GMT: [f64; 3] = [28.20, 23.04, 2.0];
const UAV: [f64; 3] = [53.97, 23.24, 2.0];
const POINT: [f64; 3] = [41.59, 39.09, 2.0];

#[test]
fn the_papers_worked_example() {
    for form in [Form::Vector, Form::Paper] {
        let point = accepted(solve::<f32>(
            &ends(GMT, UAV),
            &path_over(GMT, UAV, POINT),
            form,
            &Gates::default(),
        ));
        assert!((point - Vector3::from(POINT)).norm() < 1e-3, "{form:?}: {point}");
    }
}

#[test]
fn both_forms_agree_in_f64_away_from_the_papers_singularities() {
    let mut rng = Lcg(1);
    let (mut compared, mut worst) = (0, 0.0_f64);
    while compared < 20_000 {
        let (gmt, uav, point) = (rng.point(2.0), rng.point(20.0), rng.point(20.0));
        let (ends, path) = (ends::<f64>(gmt, uav), path_over::<f64>(gmt, uav, point));
        let azimuth_cosine = path.aoa.azimuth_rad().cos().abs();
        let zenith_sine = path.aoa.zenith_rad().sin();
        let Some(solution) = vector_point(&ends.uav.from_origin(&ends.gmt), path.aoa.vector(), path.c_tau_m)
        else {
            continue;
        };
        if azimuth_cosine < 0.01 || zenith_sine < 0.01 || solution.one_plus_cos_bistatic < 0.01 {
            continue;
        }
        let vector = ends.uav.vector() + path.aoa.vector() * solution.distance_m;
        let paper = paper_point(&ends.uav, &ends.gmt, &path.aoa, path.c_tau_m);
        worst = worst.max((vector - paper).norm());
        compared += 1;
    }
    assert!(worst < 1e-6, "largest difference of 20 000 cases: {worst:e} m");
}

#[test]
fn the_vector_form_has_no_singular_directions() {
    // Zenith 0 and 180 degrees, azimuth exactly +-90 degrees, seen from a UAV at (20, 30, 10).
    let uav = [20.0, 30.0, 10.0];
    for (zenith, azimuth) in [
        (0.0, 0.0),
        (PI, 0.0),
        (FRAC_PI_2, FRAC_PI_2),
        (FRAC_PI_2, -FRAC_PI_2),
    ] {
        for distance in [1.0, 8.0, 60.0] {
            let u = match (zenith, azimuth) {
                (0.0, _) => Vector3::z(),
                (z, _) if z == PI => -Vector3::z(),
                (_, a) => Vector3::y() * a.signum(),
            };
            let point: [f64; 3] = (Vector3::from(uav) + u * distance).into();
            let mut path = path_over::<f32>(GMT, uav, point);
            path.aoa = Direction::from_zenith_azimuth(zenith as f32, azimuth as f32).expect("valid");
            let solved = accepted(solve(&ends(GMT, uav), &path, Form::Vector, &Gates::open()));
            let error = (solved - Vector3::from(point)).norm();
            assert!(
                error < 1e-3,
                "zenith {zenith} azimuth {azimuth} distance {distance}: {error} m"
            );
        }
    }
}

#[test]
fn the_papers_form_fails_there_and_says_so() {
    let uav = [20.0, 30.0, 10.0];
    let mut path = path_over::<f32>(GMT, uav, [20.0, 30.0, 18.0]);
    path.aoa = Direction::from_zenith_azimuth(0.0, 0.0).expect("valid");
    let verdict = solve(&ends(GMT, uav), &path, Form::Paper, &Gates::default());
    assert_eq!(verdict, Ok(Verdict::Rejected(Rejection::Singular)));
}

#[test]
fn jacobians_equal_finite_differences() {
    let mut rng = Lcg(7);
    for _ in 0..200 {
        let (gmt, uav, point) = (rng.point(2.0), rng.point(20.0), rng.point(20.0));
        let (ends, path) = (ends::<f64>(gmt, uav), path_over::<f64>(gmt, uav, point));
        let baseline = ends.uav.from_origin(&ends.gmt);
        let Some(solution) = vector_point(&baseline, path.aoa.vector(), path.c_tau_m) else {
            continue;
        };
        if solution.one_plus_cos_bistatic < 0.2 {
            continue;
        }
        let jacobians = Jacobians::at(&baseline, &path, &solution);
        let at = |r: Vector3<f64>, c_tau: f64, u: Vector3<f64>| {
            let u = u.normalize();
            r + u * vector_point(&(r - ends.gmt.vector()), &u, c_tau)
                .expect("solvable")
                .distance_m
        };
        let (r, u) = (*ends.uav.vector(), *path.aoa.vector());
        let (e1, e2) = path.aoa.tangents();
        let h = 1e-5;
        let central = |plus: Vector3<f64>, minus: Vector3<f64>| (plus - minus) / (2.0 * h);
        let by_path = Matrix3::from_columns(&[
            central(at(r, path.c_tau_m + h, u), at(r, path.c_tau_m - h, u)),
            central(at(r, path.c_tau_m, u + e1 * h), at(r, path.c_tau_m, u - e1 * h)),
            central(at(r, path.c_tau_m, u + e2 * h), at(r, path.c_tau_m, u - e2 * h)),
        ]);
        let axis = |i: usize| Vector3::from_fn(|k, _| if k == i { h } else { 0.0 });
        let by_uav = Matrix3::from_columns(
            &[0, 1, 2].map(|i| central(at(r + axis(i), path.c_tau_m, u), at(r - axis(i), path.c_tau_m, u))),
        );
        let scale = jacobians.path.norm() + jacobians.uav.norm();
        assert!(
            (jacobians.path - by_path).norm() < 1e-6 * scale,
            "path: {} {by_path}",
            jacobians.path
        );
        assert!(
            (jacobians.uav - by_uav).norm() < 1e-6 * scale,
            "UAV: {} {by_uav}",
            jacobians.uav
        );
    }
}

#[test]
fn the_covariance_is_the_spread_of_noisy_solutions() {
    let (sigma_m, sigma_rad, sigma_uav) = (0.05, 0.002, 0.04);
    let mut exact = path_over::<f64>(GMT, UAV, POINT);
    exact.covariance = diagonal_covariance(sigma_m, sigma_rad);
    let mut ends = ends::<f64>(GMT, UAV);
    ends.uav_covariance = Matrix3::identity() * (sigma_uav * sigma_uav);
    let Ok(Verdict::Accepted(point)) = solve(&ends, &exact, Form::Vector, &Gates::default()) else {
        panic!("the example must be accepted");
    };
    let (e1, e2) = exact.aoa.tangents();
    let mut rng = Lcg(3);
    let mut spread = Matrix3::<f64>::zeros();
    let trials = 40_000;
    for _ in 0..trials {
        let shift = Vector3::from_fn(|_, _| rng.normal() * sigma_uav);
        let mut noisy_ends = ends;
        noisy_ends.uav = Position::from_vector(ends.uav.vector() + shift).expect("finite");
        let u = exact.aoa.vector() + e1 * (rng.normal() * sigma_rad) + e2 * (rng.normal() * sigma_rad);
        let c_tau_m = exact.c_tau_m + rng.normal() * sigma_m;
        let noisy = Path {
            c_tau_m,
            aoa: Direction::from_vector(u).expect("unit"),
            aod: None,
            ..exact
        };
        // The believed position is the noisy one; the wave knows nothing of it.
        let solved = accepted(solve(&noisy_ends, &noisy, Form::Vector, &Gates::open()));
        let error = solved - point.position.vector();
        spread += error * error.transpose() / f64::from(trials);
    }
    assert!(
        (spread - point.covariance).norm() < 0.03 * point.covariance.norm(),
        "{spread} {}",
        point.covariance
    );
}

/// One verdict for one change to the worked example.
fn verdict_of(change: impl Fn(&mut Ends, &mut Path<World>, &mut Gates)) -> Result<Verdict, InputError> {
    let mut ends = ends::<f32>(GMT, UAV);
    let mut path = path_over::<f32>(GMT, UAV, POINT);
    path.covariance = diagonal_covariance(0.05, 0.002);
    let mut gates = Gates::default();
    change(&mut ends, &mut path, &mut gates);
    solve(&ends, &path, Form::Vector, &gates)
}

fn direction(v: [f32; 3]) -> Direction<World> {
    Direction::from_vector(Vector3::from(v)).expect("non-zero")
}

#[test]
fn every_gate_names_its_reason() {
    let rejected = |r: Rejection| Ok(Verdict::Rejected(r));
    let straight = Vector3::from(UAV) - Vector3::from(GMT);
    let to_gmt = direction([-straight.x as f32, -straight.y as f32, 0.0]);
    let length = straight.norm() as f32;

    let los = verdict_of(|_, p, _| (p.c_tau_m, p.aoa) = (length, to_gmt));
    assert_eq!(los, rejected(Rejection::LineOfSight));
    let noisy_los = verdict_of(|_, p, _| (p.c_tau_m, p.aoa) = (length - 0.1, to_gmt));
    assert_eq!(noisy_los, rejected(Rejection::LineOfSight));
    let however_open =
        verdict_of(|_, p, g| (p.c_tau_m, p.aoa, g.excess_sigmas) = (length - 0.1, to_gmt, 0.0));
    assert_eq!(however_open, rejected(Rejection::LineOfSight));
    let elsewhere = verdict_of(|_, p, _| (p.c_tau_m, p.aoa) = (length + 0.1, direction([0.0, 1.0, 0.0])));
    assert_eq!(elsewhere, rejected(Rejection::ExcessDelayTooSmall));
    let along = verdict_of(|_, p, _| {
        (p.c_tau_m, p.aoa, p.aod) = (length + 0.5, direction([-1.0, 0.19, 0.0]), None);
    });
    assert_eq!(along, rejected(Rejection::IllConditioned));
    let Ok(Verdict::Accepted(point)) = verdict_of(|_, _, _| ()) else {
        panic!("unchanged, it is accepted");
    };
    let no_better = verdict_of(|_, _, g| g.max_sigma_m = 0.99 * point.sigma_m());
    assert_eq!(no_better, rejected(Rejection::IllConditioned));
    let as_good = verdict_of(|_, _, g| g.max_sigma_m = point.sigma_m());
    assert_eq!(as_good, Ok(Verdict::Accepted(point)));
    let at_uav = verdict_of(|_, p, _| {
        (p.c_tau_m, p.aoa, p.aod) = (length + 0.4, direction([1.0, 0.0, 0.0]), None);
    });
    assert_eq!(at_uav, rejected(Rejection::TooCloseToUav));
    let at_gmt = verdict_of(|_, p, _| {
        (p.c_tau_m, p.aoa, p.aod) = (length + 0.4, to_gmt, None);
    });
    assert_eq!(at_gmt, rejected(Rejection::TooCloseToGmt));
    let departure = verdict_of(|_, p, _| {
        p.aod = Some(Departure {
            direction: direction([0.0, -1.0, 0.0]),
            sigma_rad: 0.03,
        });
    });
    assert_eq!(departure, rejected(Rejection::DepartureMismatch));
    let under = verdict_of(|_, p, g| {
        (p.aoa, p.aod, g.ground_z_m) = (direction([-0.5, 0.5, -0.5]), None, Some(0.0));
    });
    assert_eq!(under, rejected(Rejection::UnderGround));
    let outside = verdict_of(|_, _, g| {
        let (min, max) = (position([0.0; 3]), position([120.0, 30.0, 20.0]));
        g.bounds = Some(Bounds { min, max });
    });
    assert_eq!(outside, rejected(Rejection::OutOfBounds));
}

#[test]
fn a_claim_of_perfection_does_not_turn_line_of_sight_into_a_point() {
    let ends = ends::<f64>(GMT, UAV);
    let aoa = Direction::from_vector(ends.gmt.from_origin(&ends.uav)).expect("apart");
    for rounding_m in [-1e-6, 0.0, 1e-6] {
        let c_tau_m = ends.uav.distance_m(&ends.gmt) + rounding_m;
        let path = Path {
            c_tau_m,
            aoa,
            aod: None,
            covariance: Matrix3::zeros(),
        };
        for gates in [Gates::default(), Gates::open()] {
            let verdict = solve(&ends, &path, Form::Vector, &gates);
            assert_eq!(
                verdict,
                Ok(Verdict::Rejected(Rejection::LineOfSight)),
                "{rounding_m}"
            );
        }
    }
}

#[test]
fn input_that_is_no_path_is_an_error() {
    let error = |e: InputError| Err(e);
    assert_eq!(
        verdict_of(|_, p, _| p.c_tau_m = f32::NAN),
        error(InputError::NotFinite)
    );
    assert_eq!(
        verdict_of(|_, p, _| p.c_tau_m = f32::INFINITY),
        error(InputError::NotFinite)
    );
    assert_eq!(verdict_of(|_, p, _| p.c_tau_m = 0.0), error(InputError::NoLength));
    assert_eq!(
        verdict_of(|_, p, _| p.c_tau_m = -5.0),
        error(InputError::NoLength)
    );
    assert_eq!(
        verdict_of(|_, p, _| p.c_tau_m = 20.0),
        error(InputError::DelayShorterThanBaseline)
    );
    assert_eq!(
        verdict_of(|e, _, _| e.uav = e.gmt),
        error(InputError::CoincidentEnds)
    );
    assert_eq!(
        verdict_of(|_, p, _| p.covariance.m11 = -1.0),
        error(InputError::ImpossibleCovariance)
    );
    assert_eq!(
        verdict_of(|e, _, _| e.uav_covariance.m22 = f32::NAN),
        error(InputError::ImpossibleCovariance)
    );
    let sigma = verdict_of(|_, p, _| {
        p.aod = p.aod.map(|d| Departure {
            sigma_rad: f32::NAN,
            ..d
        });
    });
    assert_eq!(sigma, error(InputError::ImpossibleCovariance));
}

/// A small generator for the tests: 64-bit LCG of Knuth's MMIX.
struct Lcg(u64);

impl Lcg {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * PI * self.uniform()).cos()
    }

    fn point(&mut self, height: f64) -> [f64; 3] {
        [
            self.uniform() * 120.0,
            self.uniform() * 120.0,
            self.uniform() * height,
        ]
    }
}
