//! The cheap stage of detection loses no path that is reported without it.

use cslam_core::paths::{EstimatedPath, Estimator, EstimatorConfig, PathEstimator};
use cslam_host_sim::channel::{Impairments, Ray};

use crate::recorder::Recorder;

type Best = Estimator<4, 8, 32, 72, 3, 8, 8, 360, 9>;

fn estimator(screening: bool) -> Box<Best> {
    let config = EstimatorConfig {
        screening,
        ..EstimatorConfig::single_sweeps()
    };
    Box::new(Best::new(&config))
}

/// Estimates with and without screening, and the number of beams that were passed over.
struct Both {
    with: Vec<EstimatedPath>,
    without: Vec<EstimatedPath>,
    skipped: u32,
}

fn both(recorder: &Recorder, rays: &[Ray], index: u32, estimators: &mut [Box<Best>; 2]) -> Both {
    let sweep = recorder.sweep(rays, index);
    let mut skipped = 0;
    let [with, without] = [0, 1].map(|which| {
        for block in &mut sweep.clone().blocks {
            let report = estimators[which].push_beam(block.view());
            skipped += u32::from(which == 0 && report.weak);
        }
        estimators[which].finish().to_vec()
    });
    Both {
        with,
        without,
        skipped,
    }
}

/// Whether two estimates are of one path.
fn same(a: &EstimatedPath, b: &EstimatedPath) -> bool {
    (a.path.c_tau_m - b.path.c_tau_m).abs() < 0.3 && a.path.aoa.angle_to_rad(&b.path.aoa) < 0.035
}

#[test]
fn nine_paths_are_found_with_and_without() {
    let mut recorder = Recorder::new(Impairments::budget(), 41);
    let mut estimators = [true, false].map(estimator);
    for (snr_db, least_skipped) in [(40.0, 8), (30.0, 8), (20.0, 4), (10.0, 0), (0.0, 0)] {
        let mut skipped = 0;
        for index in 0..4 {
            let rays = recorder.nine(snr_db);
            let both = both(&recorder, &rays, index, &mut estimators);
            for path in &both.without {
                assert!(
                    both.with.iter().any(|p| same(p, path)),
                    "lost at {snr_db} dB: {path:?}"
                );
            }
            assert_eq!(both.with.len(), both.without.len(), "{snr_db} dB");
            skipped += both.skipped;
        }
        println!("{snr_db} dB: {skipped} of 288 beams passed over");
        assert!(skipped >= least_skipped, "{snr_db} dB: {skipped}");
    }
}

#[test]
fn single_paths_are_found_with_and_without() {
    let mut recorder = Recorder::new(Impairments::budget(), 42);
    let mut estimators = [true, false].map(estimator);
    for snr_db in [-20.0, -15.0, -5.0, 5.0, 15.0, 25.0] {
        for index in 0..6 {
            let rays = [recorder.ray(snr_db)];
            let both = both(&recorder, &rays, index, &mut estimators);
            assert_eq!(both.with.len(), both.without.len(), "{snr_db} dB");
            assert!(both.with.iter().zip(&both.without).all(|(a, b)| same(a, b)));
            if snr_db < 10.0 {
                // Where a look could not tell, there is none: the same bits.
                assert_eq!((both.skipped, &both.with), (0, &both.without), "{snr_db} dB");
            }
        }
    }
}
