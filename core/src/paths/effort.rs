//! The work of a sweep, counted and bounded.
//!
//! Most sweeps take a third of what the chip has time for. Close to walls, where every second beam shows clusters of paths, and in a sweep in
//! which nothing tells which beams matter, the search could take many times that, and the next sweep would wait. So all that the
//! search does is counted, and there is a limit. Beams come strongest first, so what is spent is spent on the strongest
//! paths: at the limit no joint fit is begun, no further candidate of the beam is looked at, and no further beam is searched but
//! one that is stronger than all before it, for its strongest path. What is left out is counted.
//!
//! What costs most and finds least ends before that, so that more beams are searched. Where surfaces scatter diffusely, no fit of a few paths ever
//! explains a cluster: joint fits would be started again and again, and a third and a fourth member tried, in every beam that
//! shows the cluster. The strongest beams tell it best, so only they get that effort: further starts end at an eighth of the limit, and
//! groups grow beyond two members up to a third of it.

use core::cell::Cell;

/// Part of the limit up to which joint fits are started again, its inverse.
/// Measured: over tuning flights with diffuse scattering as many true paths are found with an eighth as without this end and nearly twice
/// the limit.
const FURTHER_STARTS: u32 = 8;
/// Part of the limit up to which groups grow beyond two members, its inverse.
/// Capacity: a share of the work of a sweep.
const LARGE_GROUPS: u32 = 3;

/// Thousands of instructions of a Cortex-M7 that the search of a sweep may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct WorkLimit(pub u32);

impl WorkLimit {
    /// Capacity: what a Cortex-M7 at 480 MHz has time for beside all else (docs/performance.md).
    pub const FLIGHT: Self = Self(36_000);
    /// None, where nothing waits for the sweep.
    pub const NONE: Self = Self(u32::MAX);
}

impl Default for WorkLimit {
    /// [`WorkLimit::FLIGHT`].
    fn default() -> Self {
        Self::FLIGHT
    }
}

/// What the search does. Its thousands of instructions are those of the kernels (`tests/golden/kernel_cost.txt`) and, where work depends on
/// what is heard, of the stages of the table in docs/performance.md over how often each ran.
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

    /// Whether joint fits may still be started from further places.
    pub(super) fn allows_further_starts(&self) -> bool {
        self.work.get() < self.limit.0 / FURTHER_STARTS
    }

    /// Whether groups of two may still take in a third member.
    pub(super) fn allows_large_groups(&self) -> bool {
        self.work.get() < self.limit.0 / LARGE_GROUPS
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
        assert!(!effort.is_spent() && effort.allows_further_starts());
    }

    /// What finds least for its cost ends first.
    #[test]
    fn further_starts_end_before_large_groups_and_these_before_the_search() {
        let effort = Effort::new(WorkLimit(24 * 1_150));
        let allowed = |transforms: usize| {
            (0..transforms).for_each(|_| effort.spend(Work::Transform));
            [
                effort.allows_further_starts(),
                effort.allows_large_groups(),
                !effort.is_spent(),
            ]
        };
        assert_eq!(allowed(2), [true, true, true]);
        assert_eq!(allowed(1), [false, true, true]);
        assert_eq!(allowed(5), [false, false, true]);
        assert_eq!(allowed(16), [false, false, false]);
    }

    #[test]
    fn without_a_limit_nothing_is_left_out() {
        let effort = Effort::new(WorkLimit::NONE);
        (0..1_000).for_each(|_| effort.spend(Work::Transform));
        assert!(!effort.is_spent() && effort.allows_further_starts() && effort.allows_large_groups());
    }
}
