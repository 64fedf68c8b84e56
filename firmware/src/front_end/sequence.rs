//! Which frames have come.

/// How far back a frame may come, in frames: more than a sweep has.
pub const WINDOW: u32 = u128::BITS;

/// How a whole frame came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Arrival {
    /// The newest so far.
    Newest {
        /// Numbers between this frame and the newest before it, of which none has come yet.
        missing: u32,
    },
    /// After a newer one; it had been counted as lost.
    Late,
}

/// Why a number is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    Repeated,
    Stale { newest: u32 },
}

/// The newest number and, by bit k, whether the number k before it has come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sequence {
    newest: u32,
    seen: u128,
}

impl Sequence {
    /// Nothing has come; the first number will be 0.
    pub(super) const fn new() -> Self {
        Self {
            newest: u32::MAX,
            // What would lie before the first has no business coming.
            seen: u128::MAX,
        }
    }

    /// Takes a number that a whole frame had.
    pub(super) fn take(&mut self, number: u32) -> Result<Arrival, Refusal> {
        let ahead = number.wrapping_sub(self.newest);
        // The half of the circle ahead is new, the half behind is old.
        if ahead != 0 && ahead < 1 << 31 {
            self.newest = number;
            self.seen = self.seen.checked_shl(ahead).unwrap_or(0) | 1;
            return Ok(Arrival::Newest { missing: ahead - 1 });
        }
        let behind = self.newest.wrapping_sub(number);
        let Some(bit) = 1u128.checked_shl(behind) else {
            return Err(Refusal::Stale { newest: self.newest });
        };
        if self.seen & bit != 0 {
            return Err(Refusal::Repeated);
        }
        self.seen |= bit;
        Ok(Arrival::Late)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_apart_over_the_wrap() {
        let mut sequence = Sequence {
            newest: u32::MAX - 2,
            seen: u128::MAX,
        };
        assert_eq!(sequence.take(u32::MAX), Ok(Arrival::Newest { missing: 1 }));
        assert_eq!(sequence.take(1), Ok(Arrival::Newest { missing: 1 }));
        assert_eq!(sequence.take(u32::MAX - 1), Ok(Arrival::Late));
        assert_eq!(sequence.take(u32::MAX - 1), Err(Refusal::Repeated));
        assert_eq!(sequence.take(0), Ok(Arrival::Late));
        assert_eq!(sequence.take(1), Err(Refusal::Repeated));
    }

    #[test]
    fn the_window_ends_where_it_is_said_to() {
        let mut sequence = Sequence::new();
        assert_eq!(sequence.take(WINDOW), Ok(Arrival::Newest { missing: WINDOW }));
        assert_eq!(sequence.take(1), Ok(Arrival::Late));
        assert_eq!(sequence.take(0), Err(Refusal::Stale { newest: WINDOW }));
    }

    #[test]
    fn nothing_comes_before_the_first() {
        let mut sequence = Sequence::new();
        assert_eq!(sequence.take(u32::MAX), Err(Refusal::Repeated));
        assert_eq!(sequence.take(0), Ok(Arrival::Newest { missing: 0 }));
    }
}
