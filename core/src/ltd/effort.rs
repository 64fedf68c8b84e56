//! The work of a sweep, counted and bounded.
//!
//! Most sweeps take a third of what the chip has time for. Close to walls, where every second beam shows clusters of paths, and in a sweep in
//! which nothing tells which beams matter, the search could take many times that, and the next sweep would wait. So all that the
//! search does is counted, and there is a limit. Beams come strongest first, so what is spent is spent on the strongest
//! paths: from then on no joint fit is begun, no further candidate of the beam is looked at, and no further beam is searched but
//! one that is stronger than all before it, for its strongest path. What is left out is counted.

use core::cell::Cell;

/// Thousands of instructions of a Cortex-M7 that the search of a sweep may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct WorkLimit(pub u32);

impl WorkLimit {
    /// What a Cortex-M7 at 480 MHz has time for beside all else (docs/firmware.md).
    pub const FLIGHT: Self = Self(62_000);
    /// None, where nothing waits for the sweep.
    pub const NONE: Self = Self(u32::MAX);
}

impl Default for WorkLimit {
    /// [`WorkLimit::FLIGHT`].
    fn default() -> Self {
        Self::FLIGHT
    }
}

/// What the search does. Its thousands of instructions are those of the kernels (`tests/golden/ltd_cost.txt`) and, where work depends on
/// what is heard, of the stages of the table in docs/firmware.md over how often each ran.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Work {
    /// A beam, transformed in full.
    Transform,
    /// A beam's folded taps.
    Look,
    /// So many known paths in the folded taps, cancelled over so many taps in all.
    Recognise { paths: usize, taps: usize },
    /// Coarse grid for one candidate.
    Grid,
    /// Evaluations of a fit of so many paths.
    Fit { paths: usize, evaluations: usize },
    /// So many paths cancelled together, or put back, over so many taps.
    Cancel { paths: usize, taps: usize },
}

impl Work {
    fn thousands(self) -> u32 {
        let thousands = match self {
            Self::Transform => 1_150,
            Self::Look => 200,
            Self::Recognise { paths, taps } => (22_000 * paths + 310 * taps) / 1_000,
            Self::Grid => 40,
            Self::Fit {
                paths: 1,
                evaluations,
            } => 9 * evaluations,
            Self::Fit { paths, evaluations } => 11 * paths * paths * evaluations,
            Self::Cancel { paths, taps } => taps * (640 + 290 * paths) / 1_000,
        };
        thousands as u32
    }
}

/// Work of a sweep so far.
#[derive(Clone, Debug)]
pub(super) struct Effort {
    limit: WorkLimit,
    work: Cell<u32>,
}

impl Effort {
    /// Nothing done yet.
    pub(super) fn new(limit: WorkLimit) -> Self {
        Self {
            limit,
            work: Cell::new(0),
        }
    }

    /// A new sweep.
    pub(super) fn clear(&mut self) {
        self.work.set(0);
    }

    /// Adds work.
    pub(super) fn spend(&self, work: Work) {
        self.work.set(self.work.get().saturating_add(work.thousands()));
    }

    /// Whether nothing is left.
    pub(super) fn is_spent(&self) -> bool {
        self.work.get() >= self.limit.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_adds_up_to_the_limit_and_a_new_sweep_begins_afresh() {
        let mut effort = Effort::new(WorkLimit(1_580));
        effort.spend(Work::Transform);
        effort.spend(Work::Fit {
            paths: 2,
            evaluations: 9,
        });
        assert!(!effort.is_spent());
        effort.spend(Work::Cancel { paths: 2, taps: 28 });
        assert!(effort.is_spent());
        assert_eq!(effort.work.get(), 1_150 + 396 + 34);
        effort.clear();
        assert!(!effort.is_spent());
    }

    #[test]
    fn without_a_limit_nothing_is_left_out() {
        let effort = Effort::new(WorkLimit::NONE);
        (0..1_000).for_each(|_| effort.spend(Work::Transform));
        assert!(!effort.is_spent());
    }
}
