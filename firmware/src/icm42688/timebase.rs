//! From the sensor's microseconds to nanoseconds of the UAV clock.
//!
//! The sensor stamps packets by a clock of its own that is off by a percent and wraps after 65 ms; the board captures
//! the edge of the data-ready line by the UAV clock. A line is fitted through the edges over the stamps, by least
//! squares while it is young and with a memory of [`MEMORY`] samples later; what a packet is stamped with is a point of
//! the line. So a late interrupt, a missed edge and a burst of packets do no harm: every packet has its own time.

/// Chip's microseconds from one sample to the next.
const INTERVAL_US: u32 = 1000;
/// Memory of the line, samples.
const MEMORY: u32 = 64;
/// An interval may differ from whole samples by this much, us.
const TOLERANCE_US: u32 = 200;
/// An edge belongs to a packet whose time is within this, ns: half a sample.
const NEAR_NS: i64 = 500_000;
/// The sensor's clock is within this of the UAV's.
const RATE_LIMIT: f64 = 0.05;
/// Samples in a row of no regular interval after which the stamps are taken to have jumped.
const IRREGULAR_MAX: u8 = 3;
/// Nanoseconds in a microsecond.
const NS_PER_US: f64 = 1000.0;

/// What became of a packet's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stamped {
    /// End of the sample's interval by the UAV clock, ns, and how many samples before it never came.
    At { time_ns: u64, missing: u32 },
    /// The packet before had this stamp.
    Repeated,
    /// The stamp is not a whole number of samples after the one before: it is damaged.
    Irregular,
}

/// A packet on the line.
#[derive(Clone, Copy, Debug)]
struct Last {
    stamp_us: u16,
    time_ns: u64,
}

/// The line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timebase {
    last: Option<Last>,
    /// Nanoseconds of the UAV clock in a microsecond of the sensor.
    rate: f64,
    /// Edges in the line.
    edges: u32,
    irregular: u8,
}

impl Timebase {
    /// Nothing is known.
    pub(super) const fn new() -> Self {
        Self {
            last: None,
            rate: NS_PER_US,
            edges: 0,
            irregular: 0,
        }
    }

    /// Places a packet. `ahead_us` is the span from it to the newest packet of its burst, and `edge_ns` the last edge, if
    /// that burst is known to be all there is.
    pub(super) fn place(&mut self, stamp_us: u16, ahead_us: u32, edge_ns: Option<u64>) -> Stamped {
        // By the edge, when the newest packet of the burst is the one it announced.
        let by_edge = edge_ns.map(|edge| edge.saturating_sub(self.span_ns(ahead_us)));
        let Some(last) = self.last else {
            // Without an edge there is no saying when this was. It is not used, and not lost either.
            let Some(time_ns) = by_edge else {
                return Stamped::Irregular;
            };
            self.last = Some(Last { stamp_us, time_ns });
            self.edges = 1;
            return Stamped::At { time_ns, missing: 0 };
        };
        let Some(elapsed_us) = self.elapsed_us(last, stamp_us, by_edge) else {
            return self.irregular();
        };
        if elapsed_us == 0 {
            return Stamped::Repeated;
        }
        let samples = (elapsed_us + INTERVAL_US / 2) / INTERVAL_US;
        if samples == 0 || elapsed_us.abs_diff(samples * INTERVAL_US) > TOLERANCE_US {
            return self.irregular();
        }
        self.irregular = 0;
        let mut time_ns = last.time_ns.saturating_add(self.span_ns(elapsed_us));
        if let Some(by_edge) = by_edge {
            time_ns = self.correct(time_ns, by_edge, elapsed_us);
        }
        self.last = Some(Last { stamp_us, time_ns });
        Stamped::At {
            time_ns,
            missing: samples - 1,
        }
    }

    /// Microseconds of the sensor since the last packet. Whole turns of the stamp are told by the edge; `None` when stamp and
    /// edge contradict each other.
    fn elapsed_us(&self, last: Last, stamp_us: u16, by_edge: Option<u64>) -> Option<u32> {
        let within = u32::from(stamp_us.wrapping_sub(last.stamp_us));
        let Some(now_ns) = by_edge else {
            return Some(within);
        };
        let by_clock_us = now_ns.saturating_sub(last.time_ns) as f64 / self.rate;
        let turns = libm::floor((by_clock_us - f64::from(within)) / 65_536.0 + 0.5);
        // Half an hour without the sensor is no gap any more.
        let turns = turns.clamp(0.0, 30_000.0) as u32;
        let elapsed_us = within + turns * 65_536;
        // The edge may be that of the sample before or after, and the rate is not known well in the beginning.
        let allowed_us = 1.5 * f64::from(INTERVAL_US) + RATE_LIMIT * by_clock_us;
        (libm::fabs(f64::from(elapsed_us) - by_clock_us) <= allowed_us).then_some(elapsed_us)
    }

    fn irregular(&mut self) -> Stamped {
        self.irregular = self.irregular.saturating_add(1);
        if self.irregular >= IRREGULAR_MAX {
            *self = Self::new();
        }
        Stamped::Irregular
    }

    /// Draws the line towards an edge; gives the packet's time on it.
    fn correct(&mut self, predicted_ns: u64, edge_ns: u64, elapsed_us: u32) -> u64 {
        let mut error_ns = edge_ns.wrapping_sub(predicted_ns).cast_signed();
        // The sensor may have put in another packet since the edge, or the edge is the next packet's already.
        let interval_ns = self.span_ns(INTERVAL_US).cast_signed();
        for _ in 0..2 {
            if error_ns > NEAR_NS && error_ns - interval_ns > -NEAR_NS {
                error_ns -= interval_ns;
            } else if error_ns < -NEAR_NS && error_ns + interval_ns < NEAR_NS {
                error_ns += interval_ns;
            }
        }
        if error_ns.unsigned_abs() > NEAR_NS.unsigned_abs() {
            // The line has lost the sensor, as after a long gap with a clock that drifts: it begins anew here.
            self.edges = 1;
            return edge_ns;
        }
        self.edges = (self.edges + 1).min(MEMORY);
        // Growing-memory least squares of a line: gains of its value and of its slope.
        let n = f64::from(self.edges);
        let value = 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0));
        let slope = 6.0 / (n * (n + 1.0));
        let error = error_ns as f64;
        // A gap must not count as one interval: the slope is per microsecond.
        self.rate = (self.rate + slope * error / f64::from(elapsed_us.max(1)))
            .clamp(NS_PER_US * (1.0 - RATE_LIMIT), NS_PER_US * (1.0 + RATE_LIMIT));
        let moved = libm::floor(value * error + 0.5) as i64;
        predicted_ns.saturating_add_signed(moved)
    }

    fn span_ns(&self, us: u32) -> u64 {
        libm::floor(f64::from(us) * self.rate + 0.5) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time of sample `n` by the UAV clock, ns, for a sensor whose clock is fast by `error`; and its stamp.
    fn sample(n: u64, error: f64) -> (u64, u16) {
        let chip_us = 60_123 + 1000 * n;
        let time_ns = 5_000_000 + (n as f64 * 1e6 / (1.0 + error)) as u64;
        (time_ns, chip_us as u16)
    }

    fn time(stamped: Stamped) -> (u64, u32) {
        match stamped {
            Stamped::At { time_ns, missing } => (time_ns, missing),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_clock_that_is_off_by_two_percent_is_followed_through_jitter() {
        for error in [-0.02, 0.0, 0.02] {
            let mut base = Timebase::new();
            for n in 0..5000 {
                let (true_ns, stamp) = sample(n, error);
                // The interrupt is late by up to 20 us, mean 10.
                let edge = true_ns + n * 7919 % 20_000;
                let (time_ns, missing) = time(base.place(stamp, 0, Some(edge)));
                assert_eq!(missing, 0);
                let off = time_ns as f64 - (true_ns + 10_000) as f64;
                let limit = if n < 100 { 25_000.0 } else { 6_000.0 };
                assert!(off.abs() < limit, "sample {n}: {off} ns");
            }
            assert!((base.rate * (1.0 + error) / 1000.0 - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn exact_edges_give_exact_times() {
        let mut base = Timebase::new();
        for n in 0..1000 {
            let (true_ns, stamp) = sample(n, 0.0);
            assert_eq!(time(base.place(stamp, 0, Some(true_ns))), (true_ns, 0));
        }
    }

    #[test]
    fn a_burst_gets_the_times_of_its_samples() {
        let mut base = Timebase::new();
        for n in 0..300 {
            let (true_ns, stamp) = sample(n, 0.01);
            base.place(stamp, 0, Some(true_ns));
        }
        // Seven samples wait; the edge is that of the last one.
        let (edge, _) = sample(306, 0.01);
        for n in 300..307 {
            let (true_ns, stamp) = sample(n, 0.01);
            let ahead = 1000 * (306 - n) as u32;
            let (time_ns, missing) = time(base.place(stamp, ahead, Some(edge)));
            assert_eq!(missing, 0);
            assert!(time_ns.abs_diff(true_ns) < 500, "{n}");
        }
        // The edge of the next sample has not come when its packet is read, and comes late.
        for n in [307, 308] {
            let (before, _) = sample(n - 1, 0.01);
            let (true_ns, stamp) = sample(n, 0.01);
            let (time_ns, _) = time(base.place(stamp, 0, Some(before)));
            assert!(time_ns.abs_diff(true_ns) < 500, "{n}");
        }
        let (true_ns, stamp) = sample(309, 0.01);
        let (time_ns, _) = time(base.place(stamp, 0, None));
        assert!(time_ns.abs_diff(true_ns) < 500);
    }

    #[test]
    fn gaps_longer_than_the_stamp_s_turn_are_counted_to_the_sample() {
        for gap in [2, 64, 65, 66, 67, 131, 132, 1000, 3000] {
            let mut base = Timebase::new();
            for n in 0..500 {
                let (true_ns, stamp) = sample(n, -0.005);
                base.place(stamp, 0, Some(true_ns));
            }
            let (true_ns, stamp) = sample(499 + gap, -0.005);
            let (time_ns, missing) = time(base.place(stamp, 0, Some(true_ns)));
            assert_eq!(u64::from(missing), gap - 1);
            assert!(time_ns.abs_diff(true_ns) < 2_000, "gap {gap}");
        }
    }

    #[test]
    fn repeated_and_damaged_stamps_are_told_apart_and_do_no_harm() {
        let mut base = Timebase::new();
        for n in 0..200 {
            let (true_ns, stamp) = sample(n, 0.0);
            assert_eq!(time(base.place(stamp, 0, Some(true_ns))).0, true_ns);
            assert_eq!(base.place(stamp, 0, Some(true_ns)), Stamped::Repeated);
            assert_eq!(base.place(stamp ^ 0x0200, 0, Some(true_ns)), Stamped::Irregular);
        }
    }

    #[test]
    fn stamps_that_have_jumped_are_followed_after_three() {
        let mut base = Timebase::new();
        for n in 0..100 {
            let (true_ns, stamp) = sample(n, 0.0);
            base.place(stamp, 0, Some(true_ns));
        }
        for n in 100..103 {
            let (true_ns, stamp) = sample(n, 0.0);
            let jumped = stamp.wrapping_add(500);
            assert_eq!(base.place(jumped, 0, Some(true_ns)), Stamped::Irregular);
        }
        let (true_ns, stamp) = sample(103, 0.0);
        assert_eq!(
            time(base.place(stamp.wrapping_add(500), 0, Some(true_ns))).0,
            true_ns
        );
    }
}
