//! Instructions of a sweep and of its stages.

use cslam_checks::sweep::Observer;
use cslam_core::paths::{BeamReport, Meter, Stage};

use crate::stages::Stages;

/// Prints the instructions of every sweep.
pub(crate) struct Counter {
    pub(crate) stages: &'static Stages,
    pub(crate) sweep: u32,
}

impl Counter {
    /// The watch runs only inside the estimator.
    fn watched<R>(&self, work: impl FnOnce() -> R) -> R {
        self.stages.begin();
        let result = work();
        self.stages.enter(Stage::Rest);
        result
    }
}

impl Observer for Counter {
    fn push(&mut self, work: impl FnOnce() -> BeamReport) -> BeamReport {
        self.watched(work)
    }

    fn finish<R>(&mut self, work: impl FnOnce() -> R) -> R {
        let result = self.watched(work);
        let mut total = 0;
        for stage in Stage::ALL {
            let instructions = self.stages.take(stage);
            total += instructions;
            defmt::println!(
                "sweep {=u32}, {=str}: {=u64}",
                self.sweep,
                stage.name(),
                instructions
            );
        }
        defmt::println!("sweep {=u32}, all: {=u64}", self.sweep, total);
        self.sweep += 1;
        result
    }
}
