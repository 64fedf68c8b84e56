extern crate std;

use std::boxed::Box;

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::*;
use crate::geometry::{Direction, Rotation};
use crate::map::PointCloud;
use crate::path::{Departure, Path};
use crate::paths::{Estimator, EstimatorConfig};
use crate::receiver::{Beacon, Config, Departures, LinkStates, Memory, Rules};

type Best = Estimator<4, 8, 32, 72, 3, 8, 8, 360, 9>;
type Radio = crate::receiver::Antennas<Best, 4, 8, 32, 3, 8, 8, 3, 3, 8, 11, 416>;
type Small<'m> = Receiver<'m, Radio, 64>;

/// Calls `with` with a receiver that knows the clock and the GMT, with sweep 1 in hand.
fn with_receiver(departures: Departures, with: impl FnOnce(&mut Small<'_>)) {
    let mut config = Config::best(LinkStates::Rules(Rules::default()));
    config.departures = departures;
    let mut estimator = Box::new(Best::new(&EstimatorConfig::default()));
    let mut squint = Box::new(config.beam_squint::<Radio>().expect("the default"));
    let mut map = Box::new(PointCloud::new());
    let memory = Memory {
        estimator: &mut *estimator,
        squint: &mut *squint,
        map: &mut map,
    };
    let mut receiver = Receiver::new(config, memory);
    for time_ns in [250_000_000, 750_000_000] {
        receiver.timing(time_ns, 0.0);
    }
    receiver.sweep(1_000_000_000, 0);
    let beacon = Beacon {
        sweep: 0,
        position_m: Vector3::new(0.0, 0.0, 1.5),
        sigma_m: 0.02,
        attitude: Rotation::identity(),
        sweeps_per_stop: 100,
    };
    receiver.beacon(1_001_000_000, &beacon);
    receiver.end_sweep().expect("one was in hand");
    receiver.sweep(1_500_000_000, 1);
    with(&mut receiver);
}

/// A path of 30 m from the east, and one behind it.
fn paths(energy: f32) -> Vec<EstimatedPath, PATHS> {
    let east = Direction::from_vector(Vector3::x()).expect("a direction");
    let path = |c_tau_m, energy| EstimatedPath {
        path: Path {
            c_tau_m,
            aoa: Direction::from_vector(-Vector3::x()).expect("a direction"),
            aod: Some(Departure {
                direction: east,
                sigma_rad: 0.01,
            }),
            covariance: Matrix3::identity() * 1e-6,
        },
        beam: 12,
        snr_db: 30.0,
        energy,
        range_rate: None,
    };
    [path(30.0, energy), path(42.0, 0.1 * energy)]
        .into_iter()
        .collect()
}

/// The paths with an energy at which the first is taken for the line of sight.
fn sighted_paths(departures: Departures) -> Vec<EstimatedPath, PATHS> {
    for decibel in 0..40_u16 {
        let paths = paths(libm::powf(10.0, 0.5 * f32::from(decibel) - 10.0));
        let mut sighted = None;
        with_receiver(departures, |receiver| sighted = receiver.paths(72, paths.clone()));
        if sighted == Some(0) {
            return paths;
        }
    }
    panic!("no energy is that of a line of sight");
}

fn bearing() -> Bearing {
    Bearing {
        face: 1,
        cosines: [0.1, -0.2],
        covariance: Matrix2::identity() * 1e-6,
        delay: None,
    }
}

#[test]
fn the_paths_and_the_bearing_that_are_given_are_those_of_the_sweep() {
    let paths = sighted_paths(Departures::SquintFit);
    with_receiver(Departures::SquintFit, |receiver| {
        assert!(receiver.estimated().is_none());
        assert_eq!(receiver.paths(70, paths.clone()), Some(0));
        assert_eq!(receiver.estimated(), Some((&paths[..], Some(0))));
        assert!(!receiver.bearing(1, Ok(bearing())), "of another path");
        assert!(receiver.bearing(0, Ok(bearing())));
        let report = receiver.end_sweep().expect("in hand");
        assert_eq!(
            (report.sweep, report.beams, report.bearing),
            (1, 70, Ok(bearing()))
        );
        assert_eq!(report.paths.len(), 2);
        assert_eq!(receiver.counters().stray_blocks, 0);
        assert!(receiver.estimated().is_none());
    });
}

#[test]
fn why_there_is_no_bearing_is_told() {
    let paths = sighted_paths(Departures::SquintFit);
    for (given, told) in [
        (Some(Refusal::NoPeak), Refusal::NoPeak),
        (None, Refusal::SymbolsMissing),
    ] {
        with_receiver(Departures::SquintFit, |receiver| {
            let _sighted = receiver.paths(72, paths.clone());
            if let Some(refusal) = given {
                assert!(receiver.bearing(0, Err(refusal)));
            }
            assert_eq!(receiver.end_sweep().map(|report| report.bearing), Some(Err(told)));
        });
    }
}

#[test]
fn a_receiver_without_beam_squint_takes_no_bearing() {
    let paths = sighted_paths(Departures::Beams);
    with_receiver(Departures::Beams, |receiver| {
        assert_eq!(receiver.paths(72, paths), Some(0));
        assert!(!receiver.bearing(0, Ok(bearing())));
        let report = receiver.end_sweep().expect("in hand");
        assert_eq!(report.bearing, Err(Refusal::NotBegun));
    });
}

#[test]
fn stray_paths_are_counted_and_not_used() {
    with_receiver(Departures::SquintFit, |receiver| {
        let _sighted = receiver.paths(72, paths(1.0));
        assert_eq!(receiver.paths(9, Vec::new()), None);
        assert_eq!(receiver.counters().stray_blocks, 1);
        let report = receiver.end_sweep().expect("in hand");
        assert_eq!((report.beams, report.paths.len()), (72, 2));
        assert_eq!(receiver.paths(72, paths(1.0)), None);
        assert_eq!(receiver.counters().stray_blocks, 2);
        assert!(!receiver.bearing(0, Ok(bearing())));
    });
}
