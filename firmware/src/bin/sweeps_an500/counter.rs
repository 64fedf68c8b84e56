//! Instructions of a sweep and of its stages.

use core::cell::Cell;
use core::ptr;

use cslam_core::ltd::{BeamReport, Meter, Stage};
use cslam_firmware::sweep_check::Observer;

/// 32-bit up-counter of the board's FPGA, 25 MHz.
const COUNTER: usize = 0x4002_8018;

fn ticks() -> u32 {
    // SAFETY: an aligned 32-bit register that exists on this board and that reading does not change.
    unsafe { ptr::read_volatile(COUNTER as *const u32) }
}

/// Adds up what each stage took, in ticks.
pub(crate) struct Stages {
    current: Cell<Stage>,
    since: Cell<u32>,
    sums: [Cell<u64>; Stage::ALL.len()],
}

impl Stages {
    pub(crate) const fn new() -> Self {
        Self {
            current: Cell::new(Stage::Rest),
            since: Cell::new(0),
            sums: [const { Cell::new(0) }; Stage::ALL.len()],
        }
    }
}

impl Meter for Stages {
    fn enter(&self, stage: Stage) -> Stage {
        let now = ticks();
        let before = self.current.replace(stage);
        if let Some(sum) = self.sums.get(before as usize) {
            sum.set(sum.get() + u64::from(now.wrapping_sub(self.since.replace(now))));
        }
        before
    }
}

/// Prints the instructions of every sweep.
pub(crate) struct Counter {
    pub(crate) stages: &'static Stages,
    pub(crate) sweep: u32,
}

impl Counter {
    /// The watch runs only inside the estimator.
    fn watched<R>(&self, work: impl FnOnce() -> R) -> R {
        self.stages.since.set(ticks());
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
            if let Some(sum) = self.stages.sums.get(stage as usize) {
                // 25.6 ticks an instruction.
                let instructions = sum.replace(0) * 10 / 256;
                total += instructions;
                defmt::println!(
                    "sweep {=u32}, {=str}: {=u64}",
                    self.sweep,
                    stage.name(),
                    instructions
                );
            }
        }
        defmt::println!("sweep {=u32}, all: {=u64}", self.sweep, total);
        self.sweep += 1;
        result
    }
}
