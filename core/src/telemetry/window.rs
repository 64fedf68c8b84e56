//! Which counters were seen: each packet is taken once.

use super::TelemetryError;

/// Counters that may come late, after newer ones.
pub const REORDERING: u32 = 64;

/// The newest counter and which of those before it were seen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Window {
    /// One more than the highest counter seen; 33 bits, since the highest may be the last.
    next: u64,
    /// Bit `i` stands for counter `next - 1 - i`.
    seen: u64,
}

impl Window {
    /// Takes counters from `first` on; everything before counts as seen.
    pub(super) const fn new(first: u32) -> Self {
        Self {
            next: first as u64,
            seen: u64::MAX,
        }
    }

    /// The lowest counter that is newer than all seen.
    pub(super) fn next(&self) -> u32 {
        u32::try_from(self.next).unwrap_or(u32::MAX)
    }

    /// Takes a counter, once.
    pub(super) fn take(&mut self, counter: u32) -> Result<(), TelemetryError> {
        let counter = u64::from(counter);
        if let Some(ahead) = counter.checked_sub(self.next) {
            let shift = u32::try_from(ahead + 1).unwrap_or(u32::MAX);
            self.seen = self.seen.checked_shl(shift).unwrap_or(0) | 1;
            self.next = counter + 1;
            return Ok(());
        }
        let age = self.next - 1 - counter;
        if age >= u64::from(REORDERING) {
            return Err(TelemetryError::Stale);
        }
        let bit = 1 << age;
        if self.seen & bit != 0 {
            return Err(TelemetryError::Replayed);
        }
        self.seen |= bit;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against a set that remembers everything.
        #[test]
        fn every_counter_is_taken_once(counters in prop::collection::vec(0..300_u32, 0..400), first in 0..100_u32) {
            let (mut window, mut taken, mut next) = (Window::new(first), BTreeSet::new(), first);
            for counter in counters {
                let expected = if counter >= next {
                    Ok(())
                } else if next - 1 - counter >= REORDERING {
                    Err(TelemetryError::Stale)
                } else if counter < first || taken.contains(&counter) {
                    Err(TelemetryError::Replayed)
                } else {
                    Ok(())
                };
                prop_assert_eq!(window.take(counter), expected);
                if expected.is_ok() {
                    taken.insert(counter);
                    next = next.max(counter + 1);
                }
                prop_assert_eq!(window.next(), next);
            }
        }
    }

    #[test]
    fn the_last_counter_is_a_counter_too() {
        let mut window = Window::new(u32::MAX);
        assert_eq!(window.take(u32::MAX), Ok(()));
        assert_eq!(window.take(u32::MAX), Err(TelemetryError::Replayed));
        assert_eq!(window.take(u32::MAX - 63), Err(TelemetryError::Replayed));
        assert_eq!(window.take(u32::MAX - 64), Err(TelemetryError::Stale));
    }

    #[test]
    fn a_leap_over_the_whole_window_forgets_nothing() {
        let mut window = Window::new(0);
        assert_eq!(window.take(0), Ok(()));
        assert_eq!(window.take(64), Ok(()));
        assert_eq!(window.take(0), Err(TelemetryError::Stale));
        assert_eq!(window.take(1), Ok(()));
        assert_eq!(window.take(1), Err(TelemetryError::Replayed));
        assert_eq!(window.take(4_000_000_000), Ok(()));
        assert_eq!(window.take(64), Err(TelemetryError::Stale));
    }
}
