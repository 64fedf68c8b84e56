//! Instructions of the stages of path estimation, as the board's clock counts them under `CSLAM_ICOUNT=10`.

use core::cell::Cell;
use core::ptr;

use cslam_core::ltd::{Meter, Stage};

/// 32-bit up-counter of the board's FPGA, 25 MHz.
const COUNTER: usize = 0x4002_8018;

pub(crate) fn ticks() -> u32 {
    // SAFETY: an aligned 32-bit register that exists on this board and that reading does not change.
    unsafe { ptr::read_volatile(COUNTER as *const u32) }
}

/// Instructions of so many ticks: one takes 2^10 ns, a tick 40 ns, so there are 25.6 ticks to an instruction.
pub(crate) fn instructions(ticks: u64) -> u64 {
    ticks * 10 / 256
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

    /// Counts from here on; what came since the last stage began was not path estimation.
    pub(crate) fn begin(&self) {
        self.since.set(ticks());
    }

    /// Instructions of a stage since they were last taken.
    pub(crate) fn take(&self, stage: Stage) -> u64 {
        self.sums
            .get(stage as usize)
            .map_or(0, |sum| instructions(sum.replace(0)))
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
