//! From the sensor's ticks to nanoseconds of the UAV clock.
//!
//! The sensor stamps packets by a clock of its own: ticks of 32/30 us (DS-000347 section 12.7: no clock at CLKIN, TMST_RES = 0), off
//! by 3.5 % at most, that wrap after 70 ms. The board captures the edge of the data-ready line by the UAV clock. A line is
//! fitted through the edges over the stamps, by least squares while it is young and with a memory of [`MEMORY`] samples later: a clock
//! servo. What a packet is stamped with is a point of the line, less the delay of the sensor's filters, which run by the sensor's clock
//! too. So a late interrupt, a missed edge and a burst of packets do no harm: every packet has its own time.

/// Twice the chip's ticks from one sample to the next: the stamp rises by 937 and 938 in turn.
const INTERVAL_HALF_TICKS: u32 = 1875;
/// Ticks until the stamp begins anew.
const TURN_TICKS: u32 = 1 << 16;
/// Memory of the line, samples.
const MEMORY: u32 = 64;
/// An interval may differ from whole samples by this much, ticks: a fifth of a sample.
const TOLERANCE_TICKS: u32 = 188;
/// An edge belongs to a packet whose time is within this, ns: half a sample.
const NEAR_NS: i64 = 500_000;
/// The sensor's clock is within this of its nominal rate: 1.5 % at 25 deg C and 2 % over temperature with the gyroscope on (DS-000347
/// table 4), and a reserve for a UAV clock without its reference.
const RATE_LIMIT: f64 = 0.05;
/// Samples in a row of no regular interval after which the stamps are taken to have jumped.
const IRREGULAR_MAX: u8 = 3;
/// Interval of a sensor whose clock is right, ns.
const INTERVAL_NS: f64 = 1e6;
/// From the middle of what a sample measures to its edge, intervals: the group delay at 0 Hz of the filters that `registers` chooses.
///
/// The anti-alias filter is of second order with its 3 dB at 258 Hz: sqrt 2 / (2 pi 258 Hz) = 872 us, within 22 us whatever its damping
/// between 0.6 and 0.8. The filter behind it, of second order at half of 1 kHz, has 0.7 ms (section 5.5); the table gives tenths, and
/// as its lines for 12.5 Hz to 1 kHz lie on one line over the period, it is 0.68 to 0.71 ms.
const FILTERS: f64 = 0.872 + 0.700;
/// From the end of a sample's interval, by which the receiver stamps, to the edge, intervals: a sample counts as the mean of the
/// interval before its stamp, so the middle of what it measures lies half an interval before.
const DELAY: f64 = FILTERS - 0.5;

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
    stamp: u16,
    edge_ns: u64,
}

/// The line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timebase {
    last: Option<Last>,
    /// Nanoseconds of the UAV clock from one sample to the next.
    interval_ns: f64,
    /// Edges in the line.
    edges: u32,
    irregular: u8,
}

impl Timebase {
    /// Nothing is known.
    pub(super) const fn new() -> Self {
        Self {
            last: None,
            interval_ns: INTERVAL_NS,
            edges: 0,
            irregular: 0,
        }
    }

    /// Places a packet. `ahead_ticks` is the span from it to the newest packet of its burst, and `edge_ns` the last edge, if
    /// that burst is known to be all there is.
    pub(super) fn place(&mut self, stamp: u16, ahead_ticks: u16, edge_ns: Option<u64>) -> Stamped {
        // By the edge, when the newest packet of the burst is the one it announced.
        let (ahead, _) = samples_in(u32::from(ahead_ticks));
        let by_edge = edge_ns.map(|edge| edge.saturating_sub(self.span_ns(f64::from(ahead))));
        let Some(last) = self.last else {
            // Without an edge there is no saying when this was. It is not used, and not lost either.
            let Some(edge_ns) = by_edge else {
                return Stamped::Irregular;
            };
            self.last = Some(Last { stamp, edge_ns });
            self.edges = 1;
            return self.sampled(edge_ns, 0);
        };
        let Some(elapsed_ticks) = self.elapsed_ticks(last, stamp, by_edge) else {
            return self.irregular();
        };
        if elapsed_ticks == 0 {
            return Stamped::Repeated;
        }
        let (samples, is_whole) = samples_in(elapsed_ticks);
        if samples == 0 || !is_whole {
            return self.irregular();
        }
        self.irregular = 0;
        // The stamps are cut to whole ticks, the samples are not: they lie whole intervals apart.
        let mut edge_ns = last.edge_ns.saturating_add(self.span_ns(f64::from(samples)));
        if let Some(by_edge) = by_edge {
            edge_ns = self.correct(edge_ns, by_edge, samples);
        }
        self.last = Some(Last { stamp, edge_ns });
        self.sampled(edge_ns, samples - 1)
    }

    /// The sample whose edge was at `edge_ns`.
    fn sampled(&self, edge_ns: u64, missing: u32) -> Stamped {
        Stamped::At {
            time_ns: edge_ns.saturating_sub(self.span_ns(DELAY)),
            missing,
        }
    }

    /// Ticks of the sensor since the last packet. Whole turns of the stamp are told by the edge; `None` when stamp and
    /// edge contradict each other.
    fn elapsed_ticks(&self, last: Last, stamp: u16, by_edge: Option<u64>) -> Option<u32> {
        let within = u32::from(stamp.wrapping_sub(last.stamp));
        let Some(now_ns) = by_edge else {
            return Some(within);
        };
        let interval_ticks = 0.5 * f64::from(INTERVAL_HALF_TICKS);
        let by_clock_ticks = now_ns.saturating_sub(last.edge_ns) as f64 / self.interval_ns * interval_ticks;
        let turns = libm::floor((by_clock_ticks - f64::from(within)) / f64::from(TURN_TICKS) + 0.5);
        // Half an hour without the sensor is no gap any more; and twice the ticks must fit their type.
        let turns = turns.clamp(0.0, 30_000.0) as u32;
        let elapsed_ticks = within + turns * TURN_TICKS;
        // The edge may be that of the sample before or after, and the rate is not known well in the beginning.
        let allowed_ticks = 1.5 * interval_ticks + RATE_LIMIT * by_clock_ticks;
        (libm::fabs(f64::from(elapsed_ticks) - by_clock_ticks) <= allowed_ticks).then_some(elapsed_ticks)
    }

    fn irregular(&mut self) -> Stamped {
        self.irregular = self.irregular.saturating_add(1);
        if self.irregular >= IRREGULAR_MAX {
            *self = Self::new();
        }
        Stamped::Irregular
    }

    /// Draws the line towards an edge, `samples` after the one before; gives the packet's edge on it.
    fn correct(&mut self, predicted_ns: u64, edge_ns: u64, samples: u32) -> u64 {
        let mut error_ns = edge_ns.wrapping_sub(predicted_ns).cast_signed();
        // The sensor may have put in another packet since the edge, or the edge is the next packet's already.
        let interval_ns = self.span_ns(1.0).cast_signed();
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
        // A gap must not count as one interval: the slope is per sample.
        self.interval_ns = (self.interval_ns + slope * error / f64::from(samples.max(1)))
            .clamp(INTERVAL_NS * (1.0 - RATE_LIMIT), INTERVAL_NS * (1.0 + RATE_LIMIT));
        let moved = libm::floor(value * error + 0.5) as i64;
        predicted_ns.saturating_add_signed(moved)
    }

    fn span_ns(&self, intervals: f64) -> u64 {
        libm::floor(intervals * self.interval_ns + 0.5) as u64
    }
}

/// The nearest number of samples in a span by the stamps, at most half an hour, and whether the span is that number within
/// [`TOLERANCE_TICKS`].
fn samples_in(ticks: u32) -> (u32, bool) {
    let half_ticks = 2 * ticks;
    let samples = (half_ticks + INTERVAL_HALF_TICKS / 2) / INTERVAL_HALF_TICKS;
    let off = half_ticks.abs_diff(samples * INTERVAL_HALF_TICKS);
    (samples, off <= 2 * TOLERANCE_TICKS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time of the edge of sample `n` by the UAV clock, ns, for a sensor whose clock is fast by `error`; and its stamp.
    fn sample(n: u64, error: f64) -> (u64, u16) {
        let ticks = 60_123 + 1875 * n / 2;
        let time_ns = 5_000_000 + (n as f64 * 1e6 / (1.0 + error)) as u64;
        (time_ns, ticks as u16)
    }

    /// The edge that a packet was given, ns: 1.072 ms by the sensor's clock after the end of its interval.
    fn time_by(error: f64, stamped: Stamped) -> (u64, u32) {
        match stamped {
            Stamped::At { time_ns, missing } => (time_ns + (1_072_000.0 / (1.0 + error)) as u64, missing),
            other => panic!("{other:?}"),
        }
    }

    fn time(stamped: Stamped) -> (u64, u32) {
        time_by(0.0, stamped)
    }

    #[test]
    fn a_clock_that_is_off_by_two_percent_is_followed_through_jitter() {
        for error in [-0.02, 0.0, 0.02] {
            let mut base = Timebase::new();
            for n in 0..5000 {
                let (true_ns, stamp) = sample(n, error);
                // The interrupt is late by up to 20 us, mean 10.
                let edge = true_ns + n * 7919 % 20_000;
                let (time_ns, missing) = time_by(error, base.place(stamp, 0, Some(edge)));
                assert_eq!(missing, 0);
                let off = time_ns as f64 - (true_ns + 10_000) as f64;
                // In the beginning the sensor's rate is not known, nor how long its filters hold a sample up: 2 % of that.
                let limit = if n < 100 {
                    25_000.0 + 0.02 * 1_072_000.0
                } else {
                    6_000.0
                };
                assert!(off.abs() < limit, "sample {n}: {off} ns");
            }
            assert!((base.interval_ns * (1.0 + error) / INTERVAL_NS - 1.0).abs() < 1e-3);
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
            let ahead = (1875 * (306 - n) / 2) as u16;
            let (time_ns, missing) = time_by(0.01, base.place(stamp, ahead, Some(edge)));
            assert_eq!(missing, 0);
            assert!(time_ns.abs_diff(true_ns) < 500, "{n}");
        }
        // The edge of the next sample has not come when its packet is read, and comes late.
        for n in [307, 308] {
            let (before, _) = sample(n - 1, 0.01);
            let (true_ns, stamp) = sample(n, 0.01);
            let (time_ns, _) = time_by(0.01, base.place(stamp, 0, Some(before)));
            assert!(time_ns.abs_diff(true_ns) < 500, "{n}");
        }
        let (true_ns, stamp) = sample(309, 0.01);
        let (time_ns, _) = time_by(0.01, base.place(stamp, 0, None));
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
            let (time_ns, missing) = time_by(-0.005, base.place(stamp, 0, Some(true_ns)));
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
