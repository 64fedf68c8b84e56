//! What joint fits and cancellation may take of a sweep.
//!
//! Most sweeps fit a few pairs. Close to walls and to the GMT every second beam shows a cluster, and clusters ask for fits from
//! several starts, each of up to 24 steps: without a limit such a sweep takes three times what the others take, and the next one waits.
//! So the work is counted, in evaluations of a fit times the square of its paths (about 5000 instructions), and becomes thriftier
//! in two steps: first no further
//! starts and few steps, then no joint fits at all. A path that would have been one more of a group is then cancelled but not
//! reported, and that is counted.

use core::cell::Cell;

/// Work after which joint fits are begun once and end early.
const THRIFTY: u32 = 5_000;
/// Work after which there are none.
const SPENT: u32 = 9_000;

/// Work of cancelling a path, or of putting it back.
const CANCELLED: u32 = 12;

/// Work of a sweep so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Effort {
    work: Cell<u32>,
    refused: Cell<u32>,
}

impl Effort {
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
        self.work.get() >= THRIFTY
    }

    /// Whether nothing is left; asking is counted as a fit that was refused.
    pub(super) fn is_spent(&self) -> bool {
        let spent = self.work.get() >= SPENT;
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
