//! Instructions of the stages of path estimation, as the board's clock counts them under `CSLAM_ICOUNT=10`.

use core::cell::Cell;

use cslam_core::paths::{Meter, Stage};

use crate::clock::{instructions, ticks};

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
