//! Time stamps: which samples are used, and how much motion nobody measured.

use super::{ImuConfig, ImuCounters};

/// What a time stamp says about its sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stamp {
    /// The first one: nothing is known of the interval before it.
    First,
    /// It ends an interval of this length, ns, that begins where the last one ended. `missing` samples were lost in it.
    Next { interval_ns: u32, missing: u32 },
    /// The last sample lies further back than a gap may be: the motion in between is unknown.
    AfterStop { interval_ns: u64 },
    /// Not to be used: the same time again, or older than what has been used.
    Refused,
    /// So much older than the last one that the clock must have been set back: begin anew.
    Restarted,
}

/// Time stamp of the newest sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Timeline {
    newest_ns: Option<u64>,
}

impl Timeline {
    /// Judges a time stamp and takes it as the newest when it is.
    pub(super) fn accept(&mut self, time_ns: u64, config: &ImuConfig, counters: &mut ImuCounters) -> Stamp {
        let Some(newest) = self.newest_ns else {
            self.newest_ns = Some(time_ns);
            return Stamp::First;
        };
        let Some(interval) = time_ns.checked_sub(newest) else {
            if newest - time_ns > config.late_ns {
                self.newest_ns = Some(time_ns);
                return Stamp::Restarted;
            }
            counters.late = counters.late.saturating_add(1);
            return Stamp::Refused;
        };
        if interval == 0 {
            counters.repeated = counters.repeated.saturating_add(1);
            return Stamp::Refused;
        }
        self.newest_ns = Some(time_ns);
        let period = u64::from(config.period_ns.max(1));
        // Round half up; a sample that is only delayed by half a period lost nothing.
        let missing = (interval.saturating_add(period / 2) / period).saturating_sub(1);
        let missing = u32::try_from(missing).unwrap_or(u32::MAX);
        counters.missing = counters.missing.saturating_add(missing);
        match u32::try_from(interval) {
            Ok(interval_ns) if interval_ns <= config.gap_ns => Stamp::Next { interval_ns, missing },
            _ => Stamp::AfterStop {
                interval_ns: interval,
            },
        }
    }

    /// How long ago the newest sample was, ns; 0 without any, or when `now_ns` is before it.
    pub(super) fn silence_ns(&self, now_ns: u64) -> u64 {
        self.newest_ns.map_or(0, |newest| now_ns.saturating_sub(newest))
    }

    /// Time stamp of the newest sample, or the time up to which was coasted, ns.
    pub(super) fn newest_ns(&self) -> Option<u64> {
        self.newest_ns
    }

    /// Moves on without a sample: what arrives for the time before is late.
    pub(super) fn coasted_to(&mut self, time_ns: u64) {
        self.newest_ns = Some(time_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(stamps: &[u64]) -> (heapless::Vec<Stamp, 16>, ImuCounters) {
        let (mut timeline, mut counters) = (Timeline::default(), ImuCounters::default());
        let config = ImuConfig::default();
        let verdicts = stamps
            .iter()
            .map(|&t| timeline.accept(t, &config, &mut counters))
            .collect();
        (verdicts, counters)
    }

    fn next(interval_ns: u32, missing: u32) -> Stamp {
        Stamp::Next { interval_ns, missing }
    }

    const MS: u64 = 1_000_000;

    #[test]
    fn intervals_end_at_the_stamp_and_jitter_loses_nothing() {
        let (verdicts, counters) = judge(&[7, MS, 2 * MS + 400_000, 3 * MS, 4 * MS]);
        assert_eq!(
            verdicts[..],
            [
                Stamp::First,
                next(999_993, 0),
                next(1_400_000, 0),
                next(600_000, 0),
                next(1_000_000, 0)
            ]
        );
        assert_eq!(counters, ImuCounters::default());
    }

    #[test]
    fn missing_repeated_and_late_samples_are_counted_and_only_the_gap_is_used() {
        let (verdicts, counters) = judge(&[MS, 4 * MS, 4 * MS, 3 * MS, 5 * MS]);
        assert_eq!(
            verdicts[..],
            [
                Stamp::First,
                next(3_000_000, 2),
                Stamp::Refused,
                Stamp::Refused,
                next(1_000_000, 0)
            ]
        );
        assert_eq!((counters.missing, counters.repeated, counters.late), (2, 1, 1));
    }

    #[test]
    fn a_long_gap_is_a_stop_and_a_long_way_back_a_restart() {
        let (verdicts, counters) = judge(&[MS, 52 * MS, 2000 * MS, 999 * MS, 1000 * MS]);
        assert_eq!(
            verdicts[..],
            [
                Stamp::First,
                Stamp::AfterStop { interval_ns: 51 * MS },
                Stamp::AfterStop {
                    interval_ns: 1948 * MS
                },
                Stamp::Restarted,
                next(1_000_000, 0)
            ]
        );
        assert_eq!(counters.missing, 50 + 1947);
        // Exactly the longest gap is bridged.
        assert_eq!(judge(&[0, 50 * MS]).0[1], next(50_000_000, 49));
        assert_eq!(
            judge(&[0, u64::MAX]).0[1],
            Stamp::AfterStop {
                interval_ns: u64::MAX
            }
        );
    }
}
