//! Localization on seeded flights: the table of `cslam reproduce localization`, reduced.
//!
//! docs/localization.md holds the whole table. Few flights scatter more than many: limits that the table keeps with room are
//! those of the table, the others are given the room of four flights, which is said where it is so.

use cslam_core::localization::filter::SweepVerdict;
use cslam_core::localization::hpc::Mode;
use cslam_host_sim::flight::FlightConfig;
use cslam_host_sim::localization::{
    AttitudeSource, Figures, OutageFigures, Outliers, Prepared, Record, Scenario, Start, StartFigures, fly,
    hpc, outage_start_s, planes_of, sighted_start_s,
};
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::SensorsConfig;

const SEEDS: core::ops::Range<u64> = 1..5;
const MAP: Option<(f64, f64)> = Some((0.1, 0.2));

fn prepared(scene: &Scene) -> Vec<Prepared> {
    SEEDS
        .map(|seed| {
            Prepared::new(scene, &FlightConfig::default(), &SensorsConfig::default(), seed).expect("a flight")
        })
        .collect()
}

#[test]
fn whole_flights_keep_the_figures() {
    let scene = Scene::load("outdoor").expect("built in");
    let (planes, flights) = (planes_of(&scene), prepared(&scene));
    let run = |scenario: &Scenario| -> Vec<Vec<Record>> {
        flights
            .iter()
            .map(|flight| match scenario.map {
                Some(_) => fly::<f32, 58>(flight, &planes, scenario),
                None => fly::<f32, 46>(flight, &planes, scenario),
            })
            .collect()
    };
    let plain = Figures::of(&run(&Scenario::default()));
    assert!(plain.settled_m <= 0.17 && plain.all_m <= 0.8, "{plain:?}");
    assert!(
        plain.attitude_deg <= 0.25 && plain.attitude_axes_deg.iter().all(|deg| *deg <= 0.2),
        "{plain:?}"
    );
    assert!(plain.clock_ns <= 0.3 && plain.lost == 0, "{plain:?}");
    let mapped = Figures::of(&run(&Scenario {
        map: MAP,
        ..Scenario::default()
    }));
    assert!(
        mapped.settled_m <= 0.13 && mapped.all_m < plain.all_m,
        "{mapped:?}"
    );
    // 0.20 m over 24 flights; these four have longer gaps without any path.
    assert!(mapped.all_m <= 0.3 && mapped.clock_ns <= 0.3, "{mapped:?}");
    // What the filter says of its own errors is true, and so is what it expects of the next sweep. The mean over four flights lies
    // in the 95 % band of its chi-square for most sweeps; errors that last make it miss for many in a row.
    for figures in [&plain, &mapped] {
        assert!((0.6..1.5).contains(&figures.nees[0]), "{figures:?}");
        assert!(
            figures.nees_in_band.iter().all(|share| *share > 0.8),
            "{figures:?}"
        );
        assert!(
            (0.9..1.1).contains(&figures.nis) && figures.nis_in_band > 0.88,
            "{figures:?}"
        );
    }

    // Single precision covariance against double: the same flight to a fraction of its error.
    let double = fly::<f64, 46>(&flights[0], &planes, &Scenario::default());
    let single = fly::<f32, 46>(&flights[0], &planes, &Scenario::default());
    let apart = double
        .iter()
        .zip(&single)
        .filter(|(r, _)| r.running && r.time_s > 10.0)
        .map(|(a, b)| (a.position_m - b.position_m).norm() / a.position_m.norm().max(0.1))
        .fold(0.0, f64::max);
    assert!(apart < 0.1, "{apart}");
    assert!(double.iter().zip(&single).all(|(a, b)| a.verdict == b.verdict));

    // The paper's HPC on the same flights: the filter's median in sight is at most half of the fairer form's.
    let fair: Vec<_> = flights
        .iter()
        .map(|flight| hpc(flight, Mode::VelocityFromFixes, AttitudeSource::Reference))
        .collect();
    let literal: Vec<_> = flights
        .iter()
        .map(|flight| hpc(flight, Mode::Literal, AttitudeSource::Gyroscope))
        .collect();
    let (fair, literal) = (Figures::of(&fair), Figures::of(&literal));
    assert!(
        plain.sight_median_m < 0.6 * fair.sight_median_m,
        "{plain:?} {fair:?}"
    );
    assert!(
        fair.all_m > 3.0 && literal.all_m > 2.0 * fair.all_m,
        "{fair:?} {literal:?}"
    );
}

#[test]
fn an_outage_is_bridged_by_the_map() {
    let scene = Scene::load("outdoor").expect("built in");
    let (planes, flights) = (planes_of(&scene), prepared(&scene));
    let run = |map, reflected_departure| {
        let flown: Vec<_> = flights
            .iter()
            .filter_map(|flight| outage_start_s(flight).map(|start_s| (start_s, flight)))
            .map(|(start_s, flight)| {
                let scenario = Scenario {
                    map,
                    reflected_departure,
                    outage_s: Some((start_s, start_s + 20.0)),
                    ..Scenario::default()
                };
                (start_s, fly::<f32, 58>(flight, &planes, &scenario))
            })
            .collect();
        OutageFigures::of(&flown)
    };
    let (with, without, alone) = (run(MAP, true), run(MAP, false), run(None, true));
    assert!(with.flights >= 3 && with.end_m[2] <= 0.4, "{with:?}");
    assert!(without.end_m[0] <= 0.8, "{without:?}");
    assert!(alone.end_m[0] > 1.0 && alone.end_m[0] < 6.0, "{alone:?}");
}

#[test]
fn it_starts_in_flight_and_survives_outliers() {
    let scene = Scene::load("outdoor").expect("built in");
    let (planes, flights) = (planes_of(&scene), prepared(&scene));
    let flown: Vec<_> = flights
        .iter()
        .filter_map(|flight| sighted_start_s(flight).map(|start_s| (start_s, flight)))
        .map(|(start_s, flight)| {
            let scenario = Scenario {
                start: Start::Flight(start_s),
                ..Scenario::default()
            };
            (start_s, fly::<f32, 46>(flight, &planes, &scenario))
        })
        .collect();
    let start = StartFigures::of(&flown, [0.5, 1.0]);
    assert!(start.flights >= 3 && start.time_s[1] <= 15.0, "{start:?}");

    for outliers in [Outliers { rate: 0.02, run: 1 }, Outliers { rate: 0.01, run: 5 }] {
        let scenario = Scenario {
            outliers,
            ..Scenario::default()
        };
        let records: Vec<_> = flights
            .iter()
            .map(|flight| fly::<f32, 46>(flight, &planes, &scenario))
            .collect();
        assert_eq!(Figures::of(&records).lost, 0, "{outliers:?}");
        let wrong = records.iter().flatten().filter(|r| r.running && r.outlier);
        let taken = wrong
            .clone()
            .filter(|r| r.verdict == SweepVerdict::Accepted)
            .count();
        assert!(wrong.count() >= 5 * taken, "{taken}");
    }
}

#[test]
fn a_flight_is_the_same_on_every_run() {
    let scene = Scene::load("outdoor").expect("built in");
    let planes = planes_of(&scene);
    let short = FlightConfig {
        duration_s: 15.0,
        ..FlightConfig::default()
    };
    let run = || {
        let flight = Prepared::new(&scene, &short, &SensorsConfig::default(), 9).expect("a flight");
        fly::<f32, 46>(&flight, &planes, &Scenario::default())
            .iter()
            .map(|r| {
                [
                    r.position_m.x.to_bits(),
                    r.attitude_rad.z.to_bits(),
                    r.clock_m.to_bits(),
                ]
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}
