//! The limit on a sweep's work: it ends the search at the weakest beams, and never before the strongest path is found.

use cslam_core::paths::{EstimatedPath, Estimator, EstimatorConfig, PathEstimator, WorkLimit};
use cslam_host_sim::channel::{Impairments, Sweep};

use crate::recorder::Recorder;

type Best = Estimator<4, 8, 32, 72, 3, 8, 8, 360, 9>;

/// Paths of a sweep with so much work, and how many beams were left out.
fn estimated(sweep: &Sweep, work_limit: WorkLimit, weakest_first: bool) -> (Vec<EstimatedPath>, u32) {
    let mut estimator = Box::new(Best::new(&EstimatorConfig {
        work_limit,
        ..EstimatorConfig::single_sweeps()
    }));
    let (mut sweep, mut left_out) = (sweep.clone(), 0);
    let mut blocks: Vec<_> = sweep.strongest_first().collect();
    if weakest_first {
        blocks.reverse();
    }
    for block in blocks {
        left_out += u32::from(estimator.push_beam(block.view()).left_out);
    }
    (estimator.finish().to_vec(), left_out)
}

#[test]
fn what_is_spent_is_spent_on_the_strongest_paths() {
    let mut recorder = Recorder::new(Impairments::budget(), 43);
    for index in 0..4 {
        let rays = recorder.nine(10.0);
        let sweep = recorder.sweep(&rays, index);
        let (all, none) = estimated(&sweep, WorkLimit::NONE, false);
        assert_eq!(none, 0);
        let mut before = 0;
        // One beam; some; half of them.
        for thousands in [1, 10_000, 30_000] {
            let (paths, left_out) = estimated(&sweep, WorkLimit(thousands), false);
            println!(
                "{thousands}: {} of {} paths, {left_out} beams left out",
                paths.len(),
                all.len()
            );
            assert!(
                left_out > 10 && paths.len() >= before,
                "{left_out} {}",
                paths.len()
            );
            let off_m = |path: &EstimatedPath| (path.path.c_tau_m - paths[0].path.c_tau_m).abs();
            // The strongest beam may be that of two weaker paths.
            let place = all.iter().position(|path| off_m(path) < 0.05);
            assert!(
                place.is_some_and(|place| place == 0 || thousands == 1),
                "{thousands}: {place:?}"
            );
            before = paths.len();
        }
    }
}

#[test]
fn a_front_end_that_sends_the_strongest_beam_last_loses_no_strongest_path() {
    let mut recorder = Recorder::new(Impairments::budget(), 44);
    for index in 0..4 {
        let rays = recorder.nine(10.0);
        let sweep = recorder.sweep(&rays, index);
        let (all, _) = estimated(&sweep, WorkLimit::NONE, false);
        let (paths, _) = estimated(&sweep, WorkLimit(1), true);
        let off_m = (paths[0].path.c_tau_m - all[0].path.c_tau_m).abs();
        assert!(off_m < 0.05, "the strongest is {off_m} m off");
    }
}
