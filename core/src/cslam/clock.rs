//! The UAV's clock by two-way timing alone: what there is before a filter runs, and all that the paper's calibration has.
//!
//! A crystal that is off by one part per million runs away by 150 m of delay between two exchanges, so the last offset is
//! not enough: its rate, from the last two, carries it on.

/// Exchanges further apart than this tell no rate, ns.
const LONGEST_GAP_NS: u64 = 5_000_000_000;
/// A rate beyond this is a step of the clock, or a wrong exchange, m/s: 20 parts per million.
const MOST_DRIFT_M_PER_S: f64 = 6_000.0;

/// Offset of the UAV's clock from the GMT's, as the last two exchanges have it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TwoWayClock {
    /// UAV clock, ns, and offset, m, of the last exchange.
    last: Option<(u64, f64)>,
    drift_m_per_s: Option<f64>,
}

impl TwoWayClock {
    /// Takes in an exchange: UAV clock less GMT clock, m. It must be finite.
    pub(super) fn exchange(&mut self, time_ns: u64, offset_m: f64) {
        self.drift_m_per_s = self
            .last
            .and_then(|(before_ns, before_m)| {
                let dt_ns = time_ns.checked_sub(before_ns)?;
                let rate = (offset_m - before_m) / (dt_ns as f64 * 1e-9);
                (dt_ns > 0 && dt_ns <= LONGEST_GAP_NS && rate.abs() <= MOST_DRIFT_M_PER_S).then_some(rate)
            })
            .or(self.drift_m_per_s);
        self.last = Some((time_ns, offset_m));
    }

    /// Offset at a time, m, with all whole delay periods; `None` before the second exchange, when the rate is unknown.
    pub(super) fn offset_m(&self, time_ns: u64) -> Option<f64> {
        let (last_ns, last_m) = self.last?;
        let since_s = if time_ns >= last_ns {
            (time_ns - last_ns) as f64 * 1e-9
        } else {
            (last_ns - time_ns) as f64 * -1e-9
        };
        Some(last_m + self.drift_m_per_s? * since_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    #[test]
    fn two_exchanges_tell_offset_and_rate() {
        let mut clock = TwoWayClock::default();
        assert_eq!(clock.offset_m(0), None);
        clock.exchange(SECOND_NS, 1000.0);
        assert_eq!(clock.offset_m(SECOND_NS), None);
        clock.exchange(SECOND_NS * 3 / 2, 1150.0);
        // 300 m/s: half a second later another 150 m, and a quarter before the exchange 75 m less.
        assert_eq!(clock.offset_m(2 * SECOND_NS), Some(1300.0));
        assert_eq!(clock.offset_m(SECOND_NS * 5 / 4), Some(1075.0));
    }

    #[test]
    fn a_step_keeps_the_rate() {
        let mut clock = TwoWayClock::default();
        for (half_seconds, offset_m) in [(0, 0.0), (1, 10.0), (2, 20.0), (3, 90_000.0)] {
            clock.exchange(half_seconds * SECOND_NS / 2, offset_m);
        }
        assert_eq!(clock.offset_m(2 * SECOND_NS), Some(90_010.0));
        // A long silence, and an exchange out of order, tell no rate either.
        clock.exchange(20 * SECOND_NS, 90_020.0);
        clock.exchange(19 * SECOND_NS, 0.0);
        assert_eq!(clock.offset_m(20 * SECOND_NS), Some(20.0));
    }
}
