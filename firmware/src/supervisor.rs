//! Who feeds the watchdog: nobody, unless every part of the program has made progress.
//!
//! A task marks its [`Progress`] whenever it has been round its loop, which it must do within its deadline even when nothing comes
//! in: it waits with a timeout. The [`Supervisor`] looks at all marks many times a deadline, from one place; as soon as one has
//! stood still for too long it says which, the board records that and resets. The watchdog itself is the net below: it ends a
//! supervisor that does not run any more.

use core::fmt;
use core::sync::atomic::{AtomicU32, Ordering};

/// A task's mark. Lies in a `static`, so that interrupts may mark too; no lock, no wait.
#[derive(Debug, Default)]
pub struct Progress(AtomicU32);

impl Progress {
    /// No progress yet.
    #[must_use]
    pub const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// The task has been round.
    pub fn mark(&self) {
        // One writer: a load and a store are an increment.
        let marks = self.0.load(Ordering::Relaxed);
        self.0.store(marks.wrapping_add(1), Ordering::Release);
    }

    fn marks(&self) -> u32 {
        self.0.load(Ordering::Acquire)
    }
}

/// A task under supervision.
#[derive(Clone, Copy, Debug)]
pub struct Watched<'a> {
    /// Name for people.
    pub name: &'static str,
    /// Its mark.
    pub progress: &'a Progress,
    /// It may stand still this long, ns.
    pub deadline_ns: u64,
}

/// A task that has stood still for too long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hung {
    /// Its number in the supervisor's list.
    pub index: u8,
    /// Its name.
    pub name: &'static str,
    /// How long it has stood still, ns.
    pub still_ns: u64,
}

impl fmt::Display for Hung {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "task `{}` has made no progress for {} ms: the receiver resets",
            self.name,
            self.still_ns / 1_000_000
        )
    }
}

impl core::error::Error for Hung {}

/// Looks at `N` tasks, at most 256.
#[derive(Clone, Debug)]
pub struct Supervisor<'a, const N: usize> {
    tasks: [Watched<'a>; N],
    /// Marks at the last look, and when they changed last, ns.
    seen: [(u32, u64); N],
}

impl<'a, const N: usize> Supervisor<'a, N> {
    /// From now on every task has its deadline.
    #[must_use]
    pub fn new(tasks: [Watched<'a>; N], now_ns: u64) -> Self {
        Self {
            seen: tasks.map(|task| (task.progress.marks(), now_ns)),
            tasks,
        }
    }

    /// Looks at all tasks. `Ok` means: feed the watchdog.
    ///
    /// # Errors
    /// The task that is furthest beyond its deadline.
    pub fn check(&mut self, now_ns: u64) -> Result<(), Hung> {
        let mut worst: Option<(u64, Hung)> = None;
        for (index, (task, seen)) in (0..=u8::MAX).zip(self.tasks.iter().zip(&mut self.seen)) {
            let marks = task.progress.marks();
            if marks != seen.0 {
                *seen = (marks, now_ns);
                continue;
            }
            let still_ns = now_ns.saturating_sub(seen.1);
            let beyond_ns = still_ns.saturating_sub(task.deadline_ns);
            if beyond_ns > 0 && worst.is_none_or(|(most_ns, _)| beyond_ns > most_ns) {
                let hung = Hung {
                    index,
                    name: task.name,
                    still_ns,
                };
                worst = Some((beyond_ns, hung));
            }
        }
        worst.map_or(Ok(()), |(_, hung)| Err(hung))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString;

    use super::*;

    fn watched<'a>(name: &'static str, progress: &'a Progress, deadline_ns: u64) -> Watched<'a> {
        Watched {
            name,
            progress,
            deadline_ns,
        }
    }

    #[test]
    fn all_must_make_progress_each_within_its_own_deadline() {
        let (fast, slow) = (Progress::new(), Progress::new());
        let mut supervisor = Supervisor::new([watched("fast", &fast, 20), watched("slow", &slow, 1000)], 100);
        for now in (101..1100).step_by(5) {
            fast.mark();
            assert_eq!(supervisor.check(now), Ok(()), "at {now}");
        }
        // Only one of them is not enough.
        for now in (1105..1300).step_by(5) {
            fast.mark();
            let hung = supervisor.check(now);
            assert_eq!(
                hung.map_err(|h| (h.index, h.name, h.still_ns)),
                Err((1, "slow", now - 100))
            );
        }
        slow.mark();
        fast.mark();
        assert_eq!(supervisor.check(1300), Ok(()));
        assert_eq!(supervisor.check(1320), Ok(()));
        let hung = supervisor.check(1321).expect_err("no mark for 21 ns");
        assert_eq!((hung.name, hung.still_ns), ("fast", 21));
    }

    #[test]
    fn the_one_furthest_beyond_its_deadline_is_named() {
        let (a, b) = (Progress::new(), Progress::new());
        let mut supervisor = Supervisor::new([watched("a", &a, 10), watched("b", &b, 300_000_000)], 0);
        let hung = supervisor.check(400_000_000).expect_err("both stand still");
        assert_eq!(hung.name, "a");
        assert!(hung.to_string().contains("`a`") && hung.to_string().contains("400 ms"));
    }

    #[test]
    fn marks_may_wrap() {
        let progress = Progress(AtomicU32::new(u32::MAX));
        let mut supervisor = Supervisor::new([watched("task", &progress, 10)], 0);
        progress.mark();
        assert_eq!(supervisor.check(50), Ok(()));
        assert!(supervisor.check(61).is_err());
    }
}
