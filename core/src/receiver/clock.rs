//! The UAV's clock by two-way timing alone: what there is before a filter runs, and all that the paper's calibration has.
//!
//! A crystal that is off by one part per million runs away by 150 m of delay between two exchanges, so the last offset is
//! not enough: its rate, from the last two, carries it on.

use crate::numeric::elapsed_s;

/// Exchanges further apart than this tell no rate, ns.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const LONGEST_GAP_NS: u64 = 5_000_000_000;
/// A rate beyond this is a step of the clock, or a wrong exchange, m/s.
/// Given: 20 parts per million.
const MOST_DRIFT_M_PER_S: f64 = 6_000.0;

/// An exchange is off what the ones before it say by no more than this, m, besides what the clock's ramp explains.
/// Derived: their noise carries a third of it.
const AGREEMENT_M: f64 = 1.0;
/// The ramp of a TCXO, 0.5 ns/s^2, m/s^2: it may turn round in between.
/// Given: a data sheet.
const RAMP_M_PER_S2: f64 = 0.15;
/// Exchanges that contradict the ones before and agree with each other, until they are believed.
/// Derived: as many as the filter wants.
const STEP_EXCHANGES: u32 = 6;

/// Exchanges on one line: the last of them, and the rate from the last two.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    /// UAV clock, ns, and offset, m, of the last exchange.
    last: (u64, f64),
    drift_m_per_s: Option<f64>,
    exchanges: u32,
}

impl Line {
    fn of(exchange: (u64, f64)) -> Self {
        Self {
            last: exchange,
            drift_m_per_s: None,
            exchanges: 1,
        }
    }

    /// The line with one exchange more; `None` when that is not on it.
    fn with(&self, now: (u64, f64)) -> Option<Self> {
        let dt_s = elapsed_s(self.last.0, now.0);
        if dt_s <= 0.0 {
            return None;
        }
        let rate = (now.1 - self.last.1) / dt_s;
        let tells_rate = now.0 - self.last.0 <= LONGEST_GAP_NS && rate.abs() <= MOST_DRIFT_M_PER_S;
        let on_it = match self.drift_m_per_s {
            Some(drift) => {
                let off_m = (now.1 - self.last.1 - drift * dt_s).abs();
                off_m <= AGREEMENT_M + RAMP_M_PER_S2 * dt_s * dt_s
            }
            None => tells_rate,
        };
        on_it.then_some(Self {
            last: now,
            drift_m_per_s: if tells_rate {
                Some(rate)
            } else {
                self.drift_m_per_s
            },
            exchanges: self.exchanges.saturating_add(1),
        })
    }
}

/// Offset of the UAV's clock from the GMT's, as the last two exchanges have it that agree with those before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TwoWayClock {
    line: Option<Line>,
    /// Those that contradict it and agree with each other. Their rate is their own: what they contradict may be no more than a rate that a
    /// stray exchange has left.
    doubted: Option<Line>,
}

impl TwoWayClock {
    /// Takes in an exchange: UAV clock less GMT clock, m. It must be finite. `false` when it contradicts those before, or is older: then
    /// it changes nothing, until so many in a row agree that the clock must have stepped.
    #[must_use]
    pub(super) fn exchange(&mut self, time_ns: u64, offset_m: f64) -> bool {
        let now = (time_ns, offset_m);
        let Some(line) = self.line else {
            self.line = Some(Line::of(now));
            return true;
        };
        if time_ns <= line.last.0 {
            return false;
        }
        if let Some(longer) = line.with(now) {
            (self.line, self.doubted) = (Some(longer), None);
            return true;
        }
        if line.drift_m_per_s.is_none() {
            // One of two that tell no rate is as good as the other: the newer one.
            self.line = Some(Line::of(now));
            return false;
        }
        let doubted = (self.doubted.and_then(|doubted| doubted.with(now))).unwrap_or(Line::of(now));
        self.doubted = Some(doubted);
        if doubted.exchanges >= STEP_EXCHANGES {
            self.confirm();
        }
        false
    }

    /// The filter has found that the clock has stepped: what was doubted is right. A single exchange keeps the rate.
    pub(super) fn confirm(&mut self) {
        if let Some(doubted) = self.doubted.take() {
            let before = self.line.and_then(|line| line.drift_m_per_s);
            self.line = Some(Line {
                drift_m_per_s: doubted.drift_m_per_s.or(before),
                ..doubted
            });
        }
    }

    /// The filter has found that it is the timing that is wrong.
    pub(super) fn refute(&mut self) {
        self.doubted = None;
    }

    /// Offset at a time, m, with all whole delay periods; `None` before the second exchange, when the rate is unknown.
    pub(super) fn offset_m(&self, time_ns: u64) -> Option<f64> {
        let line = self.line?;
        let (last_ns, last_m) = line.last;
        Some(last_m + line.drift_m_per_s? * elapsed_s(last_ns, time_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    /// A clock of these exchanges, a half second each, and how many it took.
    fn clock(offsets_m: impl IntoIterator<Item = f64>) -> (TwoWayClock, usize) {
        let mut clock = TwoWayClock::default();
        let times_ns = (0..).map(|k| k * SECOND_NS / 2);
        let taken = times_ns
            .zip(offsets_m)
            .filter(|(time_ns, offset_m)| clock.exchange(*time_ns, *offset_m))
            .count();
        (clock, taken)
    }

    #[test]
    fn two_exchanges_tell_offset_and_rate() {
        let (mut clock, _) = clock([1000.0]);
        assert_eq!(clock.offset_m(0), None);
        assert!(clock.exchange(SECOND_NS / 2, 1150.0));
        // 300 m/s: half a second later another 150 m, and a quarter before the exchange 75 m less.
        assert_eq!(clock.offset_m(SECOND_NS), Some(1300.0));
        assert_eq!(clock.offset_m(SECOND_NS / 4), Some(1075.0));
    }

    #[test]
    fn a_jump_is_believed_when_six_exchanges_agree_on_it() {
        let steady = [0.0, 10.0, 20.0, 30.0];
        let stepped = (4..).map(|k| 90_000.0 + 10.0 * f64::from(k));
        for (lies, offset_m) in [(1, 80.0), (5, 80.0), (6, 90_080.0)] {
            let (clock, taken) = clock(steady.into_iter().chain(stepped.clone().take(lies)));
            assert_eq!(
                (clock.offset_m(4 * SECOND_NS), taken),
                (Some(offset_m), 4),
                "{lies}"
            );
        }
        // Lies that do not agree with each other are none the more believed for being many.
        let wild = (4..40).map(|k| 1000.0 * f64::from(k * k));
        assert_eq!(clock(steady.into_iter().chain(wild)).0.offset_m(0), Some(0.0));
    }

    #[test]
    fn a_rate_that_strays_have_left_is_unlearnt() {
        // Two strays that are within the agreement, the second of the rate that the first has left: 23.6 m/s instead of 20.
        let strays = [0.0, 10.0, 20.0, 30.0, 40.9, 52.7];
        let right = (6..12).map(|k| 10.0 * f64::from(k));
        let (clock, taken) = clock(strays.into_iter().chain(right));
        assert_eq!((clock.offset_m(6 * SECOND_NS), taken), (Some(120.0), 6));
    }

    #[test]
    fn the_filter_knows_better() {
        let jump = [0.0, 10.0, 20.0, 100.0, 110.0];
        let (mut confirmed, _) = clock(jump);
        confirmed.confirm();
        assert_eq!(confirmed.offset_m(2 * SECOND_NS), Some(110.0));
        let (mut refuted, _) = clock(jump);
        for k in 5..20 {
            refuted.refute();
            assert!(!refuted.exchange(k * SECOND_NS / 2, 70.0 + 10.0 * k as f64));
        }
        assert_eq!(refuted.offset_m(2 * SECOND_NS), Some(40.0));
    }

    #[test]
    fn what_comes_out_of_order_changes_nothing_and_a_silence_keeps_the_rate() {
        let (mut clock, _) = clock([0.0, 10.0, 20.0]);
        assert!(!clock.exchange(SECOND_NS / 4, 5.0) && !clock.exchange(SECOND_NS, 20.0));
        assert_eq!(clock.offset_m(SECOND_NS), Some(20.0));
        // A minute of the ramp: 540 m at most.
        assert!(clock.exchange(61 * SECOND_NS, 20.0 + 20.0 * 60.0 + 500.0));
        assert_eq!(clock.offset_m(62 * SECOND_NS), Some(1740.0));
    }
}
