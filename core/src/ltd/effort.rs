//! What joint fits and cancellation may take of a sweep.
//!
//! Most sweeps fit a few pairs. Close to walls and to the GMT every second beam shows a cluster, and clusters ask for fits from
//! several starts, each of up to 24 steps: without a limit such a sweep takes three times what the others take, and the next one waits.
//! So the work is counted, in evaluations of a fit times the square of its paths (about 5000 instructions), and becomes thriftier
//! in two steps: first no further
//! starts and few steps, then no joint fits at all. A path that would have been one more of a group is then cancelled but not
//! reported, and that is counted.

use core::cell::Cell;

/// The limit, in evaluations of a fit times the square of its paths (about 5000 instructions of a Cortex-M7 each).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkLimit {
    /// Work after which joint fits are begun once and end early.
    pub thrifty: u32,
    /// Work after which there are none.
    pub spent: u32,
}

impl WorkLimit {
    /// What a Cortex-M7 at 480 MHz has time for beside all else (docs/firmware.md): 45 million instructions.
    pub const FLIGHT: Self = Self {
        thrifty: 5_000,
        spent: 9_000,
    };
    /// None, where nothing waits for the sweep.
    pub const NONE: Self = Self {
        thrifty: u32::MAX,
        spent: u32::MAX,
    };
}

impl Default for WorkLimit {
    /// [`WorkLimit::FLIGHT`].
    fn default() -> Self {
        Self::FLIGHT
    }
}

/// Work of cancelling a path, or of putting it back.
const CANCELLED: u32 = 12;

/// Work of a sweep so far.
#[derive(Clone, Debug)]
pub(super) struct Effort {
    limit: WorkLimit,
    work: Cell<u32>,
    refused: Cell<u32>,
}

impl Effort {
    /// Nothing done yet.
    pub(super) fn new(limit: WorkLimit) -> Self {
        Self {
            limit,
            work: Cell::new(0),
            refused: Cell::new(0),
        }
    }

    /// A new sweep.
    pub(super) fn clear(&mut self) {
        self.work.set(0);
        self.refused.set(0);
    }

    /// Adds work.
    pub(super) fn spend(&self, work: u32) {
        self.work.set(self.work.get().saturating_add(work));
    }

    /// Adds the cancellation of so many paths.
    pub(super) fn cancel(&self, paths: usize) {
        self.spend(CANCELLED.saturating_mul(paths as u32));
    }

    /// Whether to be thrifty from now on.
    pub(super) fn is_thrifty(&self) -> bool {
        self.work.get() >= self.limit.thrifty
    }

    /// Whether nothing is left; asking is counted as a fit that was refused.
    pub(super) fn is_spent(&self) -> bool {
        let spent = self.work.get() >= self.limit.spent;
        if spent {
            self.refused.set(self.refused.get().saturating_add(1));
        }
        spent
    }

    /// Work so far.
    pub(super) fn work(&self) -> u32 {
        self.work.get()
    }

    /// Joint fits that were refused.
    pub(super) fn refused(&self) -> u32 {
        self.refused.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_makes_thrifty_and_then_refuses() {
        let mut effort = Effort::new(WorkLimit {
            thrifty: 30,
            spent: 50,
        });
        effort.spend(29);
        assert!(!effort.is_thrifty() && !effort.is_spent());
        effort.cancel(1);
        assert!(effort.is_thrifty() && !effort.is_spent());
        effort.spend(9);
        assert!(effort.is_spent() && effort.is_spent());
        assert_eq!((effort.work(), effort.refused()), (50, 2));
        effort.clear();
        assert_eq!((effort.work(), effort.refused()), (0, 0));
        assert!(!effort.is_thrifty(), "a new sweep begins afresh");
    }

    #[test]
    fn without_a_limit_no_fit_is_refused() {
        let effort = Effort::new(WorkLimit::NONE);
        effort.spend(100 * WorkLimit::FLIGHT.spent);
        assert!(!effort.is_thrifty() && !effort.is_spent());
        assert_eq!(effort.refused(), 0);
    }
}
