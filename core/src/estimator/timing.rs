//! Two-way timing against the clock: which exchanges are believed, which ones have stamped another path than the first, and whether the
//! clock or the timing's own error has stepped when they contradict.

use super::Filter;
use super::clock::SHORTEST_STEP_S;
use super::layout::{CLOCK_OFFSET, POSITION, TWO_WAY_BIAS, VELOCITY};
use super::measurement::{LEAST_RANGE_M, Transmitter};
use super::row::Row;
use super::sweep::BLIND_AFTER_NS;
use super::watch::Step;
use super::window::{Departure, SUSPECT_S};
use crate::geometry::Real;
use crate::signal::DelayPeriod;

/// Measurements that agree on a new offset within this may set the clock anew, m (besides what its drift explains).
/// Derived: what a TCXO's ramp that turns round makes of them, 0.15 m/s^2 times the square of [`SUSPECT_S`].
const STEP_AGREEMENT_M: f64 = 1.0;
/// The same of exchanges that have told a rate of their own.
/// Derived: four standard deviations of the difference of two.
const LINE_AGREEMENT_M: f64 = 0.5;
/// A constant error of timing beyond this is a lie.
/// Derived: ten times what radios have, m.
const TIMING_OFF_M: f64 = 0.3;
/// Share of the exchanges in which another path than the first was stamped, in sight of the transmitter and without, and the standard
/// deviation of the error that this makes, m.
/// Measured: over the air and without sight one exchange in six errs by more than 0.36 m and one in ten by more than 1 m; in sight three
/// and one in a hundred (docs/localization.md, "What it believes").
const STRAY: [f64; 2] = [0.03, 0.2];
/// Measured: with [`STRAY`].
const STRAY_M: f64 = 1.5;
/// As many exchanges in agreement contradict the clock.
/// Derived: A single one may be right after an outlier that a silence has let pass (docs/localization.md, "When the GMT lies").
const CONTRADICTION: u32 = 2;

/// A step that timing alone has told leaves the clock no less sure than it is long, up to this, m.
/// Numerical: single precision holds no more beside the centimetres of an exchange.
const MOST_DOUBT_M: f64 = 100.0;
/// Standard deviation of the error of timing when ranges are doubted, m.
/// Numerical: single precision holds centimetres beside it.
const RANGE_DOUBT_M: f64 = 30.0;

/// Exchanges that contradict the clock and agree with each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Suspect {
    /// Time of the last, UAV clock, ns.
    time_ns: u64,
    /// Its offset, m.
    offset_m: f64,
    /// By how much it contradicts the clock, m.
    contradicts_m: f64,
    /// How many.
    exchanges: u32,
    /// Time and offset of the first of them.
    first: (u64, f64),
    /// Rate of the last two, m/s.
    rate_m_per_s: Option<f64>,
    /// A line of sight in between has agreed with the clock.
    refuted: bool,
}

impl Suspect {
    /// How far an exchange is from where these have the clock by now, m, and the time since the last of them, s.
    fn apart(&self, time_ns: u64, offset_m: f64, drift_m_per_s: f64, period: &DelayPeriod) -> (f64, f64) {
        let dt_s = time_ns.saturating_sub(self.time_ns) as f64 * 1e-9;
        (
            period.wrap_m(offset_m - self.offset_m - drift_m_per_s * dt_s),
            dt_s,
        )
    }
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes in an exchange at the horizon.
    pub(super) fn take_two_way(&mut self, time_ns: u64, offset_m: f64) {
        let variance = self.config.radio.two_way_m * self.config.radio.two_way_m;
        if !self.clock_known {
            self.acquire(offset_m, variance);
            return;
        }
        let expected = self.nominal.clock_offset_m + self.nominal.two_way_bias_m;
        let mut row = Row::new(self.nominal.delay_period.wrap_m(offset_m - expected), variance);
        row.push(CLOCK_OFFSET, 1.0);
        row.push(TWO_WAY_BIAS, 1.0);
        let gate = self.config.gates.one;
        let ratio = self.scalar_ratio(&row, gate);
        self.ratios.two_way = ratio as f32;
        if ratio <= 1.0 {
            if let Some(doubt_m) = self.unresolved_m(time_ns, offset_m, row.residual.to_f64()) {
                self.doubt_timing_by(doubt_m);
            }
            self.suspect_clock = None;
            self.acquired = self.acquired.saturating_add(1);
            self.apply_or_stray(&row);
            self.health.clock_contested = self.timing_is_off();
            return;
        }
        self.health.clock_contested = true;
        self.counters.timing_rejected = self.counters.timing_rejected.saturating_add(1);
        if !self.running {
            // Nothing stands on the clock yet, and the one before may have been the wrong one.
            self.acquire(offset_m, variance);
            return;
        }
        let period = &self.nominal.delay_period;
        let agreeing = self.suspect_clock.and_then(|before| {
            let (apart_m, dt_s) = before.apart(time_ns, offset_m, self.nominal.clock_drift_m_per_s, period);
            // A clock that has changed its rate runs on at the new one.
            let (off_m, limit_m) = match before.rate_m_per_s {
                Some(rate) => (before.apart(time_ns, offset_m, rate, period).0, LINE_AGREEMENT_M),
                None => (apart_m, STEP_AGREEMENT_M),
            };
            let agrees = dt_s < SUSPECT_S && off_m.abs() < limit_m;
            agrees.then_some((before, (apart_m, dt_s)))
        });
        let exchanges = agreeing.map_or(1, |(before, _)| before.exchanges.saturating_add(1));
        let refuted = agreeing.is_some_and(|(before, _)| before.refuted);
        match agreeing {
            // As many as a pose that is contradicted rides out. Either the clock has stepped or the timing's own error has.
            Some((before, _)) if exchanges >= self.gates().refix_after => {
                let (first_ns, first_m) = before.first;
                let run_s = time_ns.saturating_sub(first_ns) as f64 * 1e-9;
                let drift = self.nominal.clock_drift_m_per_s;
                let ran_m = self
                    .nominal
                    .delay_period
                    .wrap_m(offset_m - first_m - drift * run_s);
                self.doubt_timing_by(row.residual.to_f64());
                if refuted {
                    // Lines of sight have said which: they know the clock.
                    self.suspect_clock = None;
                    self.apply(&row);
                    self.health.clock_contested = self.timing_is_off();
                } else {
                    // The next one will tell.
                    self.nominal.clock_drift_m_per_s += ran_m / run_s.max(SHORTEST_STEP_S);
                    self.clock_step(offset_m, variance, (0.0, run_s));
                }
            }
            _ => {
                self.suspect_clock = Some(Suspect {
                    time_ns,
                    offset_m,
                    contradicts_m: row.residual.to_f64(),
                    exchanges,
                    first: agreeing.map_or((time_ns, offset_m), |(before, _)| before.first),
                    rate_m_per_s: agreeing.map(|(_, (apart_m, dt_s))| {
                        self.nominal.clock_drift_m_per_s + apart_m / dt_s.max(SHORTEST_STEP_S)
                    }),
                    refuted,
                });
            }
        }
    }

    /// Whether the timing's own error is one that no radio has, or may be.
    pub(super) fn timing_is_off(&self) -> bool {
        let sigma_m = libm::sqrt(self.variance(TWO_WAY_BIAS).max(0.0));
        self.nominal.two_way_bias_m.abs().max(sigma_m) > TIMING_OFF_M
    }

    /// The timing's own error may have changed by this, m.
    #[inline(never)]
    fn doubt_timing_by(&mut self, doubt_m: f64) {
        let doubt_m = doubt_m.abs().min(MOST_DOUBT_M);
        self.tell(Step::Stands);
        self.covariance.add(TWO_WAY_BIAS, T::of(doubt_m * doubt_m));
        self.tell(Step::Doubted);
    }

    /// What the exchanges before have contradicted the clock by, when this one is as they were: it passes the gate only because the
    /// clock has become unsure since, and nothing has told which of the two has stepped.
    fn unresolved_m(&self, time_ns: u64, offset_m: f64, residual_m: f64) -> Option<f64> {
        let suspect = self.suspect_clock.as_ref()?;
        let (apart_m, dt_s) = suspect.apart(
            time_ns,
            offset_m,
            self.nominal.clock_drift_m_per_s,
            &self.nominal.delay_period,
        );
        let same = suspect.exchanges >= CONTRADICTION && dt_s < SUSPECT_S && apart_m.abs() < residual_m.abs();
        same.then_some(suspect.contradicts_m)
    }

    /// Sweeps have parted from a pose that was in sight and sure of itself, and agree with each other. So what turns delays into ranges
    /// is doubted: the pose is one of those along the departure, each with its own error of timing. Motion will tell.
    pub(super) fn doubt_timing(&mut self, departure: &Departure) {
        let mut along = [T::zero(); N];
        // A sight that turns is that of a motion as much faster as it is further off.
        for (first, vector) in [(POSITION, departure.way), (VELOCITY, departure.turn_per_s)] {
            for (k, c) in vector.iter().enumerate() {
                if let Some(a) = along.get_mut(first + k) {
                    *a = T::of(c * RANGE_DOUBT_M);
                }
            }
        }
        for (state, share) in [(CLOCK_OFFSET, -1.0), (TWO_WAY_BIAS, 1.0)] {
            if let Some(a) = along.get_mut(state) {
                *a = T::of(share * RANGE_DOUBT_M);
            }
        }
        self.tell(Step::Stands);
        self.covariance.spread(&along);
        self.tell(Step::Doubted);
        self.health.clock_contested = true;
    }

    /// Whether exchanges that agree with each other contradict the clock.
    pub(super) fn timing_contradicts(&self) -> bool {
        (self.suspect_clock.as_ref()).is_some_and(|suspect| suspect.exchanges >= CONTRADICTION)
    }

    /// A line of sight agrees with the clock: if timing contradicts it, it is the timing that is wrong. A pose that is unsure of its range by a
    /// good part of the contradiction agrees with anything: clock and range have erred together.
    pub(super) fn refute_timing(&mut self, gmt: &Transmitter) {
        let way = (self.nominal.position_m - gmt.position_m).try_normalize(LEAST_RANGE_M);
        let variance = way.map_or(0.0, |way| {
            way.dot(&(self.covariance.block(POSITION, POSITION).map(T::to_f64) * way))
        });
        let gate = self.config.gates.one;
        if let Some(suspect) = &mut self.suspect_clock
            && gate * variance < suspect.contradicts_m * suspect.contradicts_m
        {
            suspect.refuted = true;
            self.counters.timing_refuted = self.counters.timing_refuted.saturating_add(1);
        }
    }

    /// When a rejected exchange and the delay of a sweep differ from the clock by the same amount, the clock is wrong and
    /// both are right. True when it was set.
    pub(super) fn clock_step_by_delay(&mut self, delay_residual_m: f64) -> bool {
        let Some(suspect) = self.suspect_clock else {
            return false;
        };
        let dt = self.nominal.time_ns.saturating_sub(suspect.time_ns) as f64 * 1e-9;
        let stepped = suspect.offset_m + self.nominal.clock_drift_m_per_s * dt;
        let jump = self
            .nominal
            .delay_period
            .wrap_m(stepped - self.nominal.clock_offset_m);
        // Of a short step, nothing agrees with everything.
        let agreement_m = STEP_AGREEMENT_M.min(0.5 * jump.abs());
        if dt > 1.0 || (jump - delay_residual_m).abs() > agreement_m {
            return false;
        }
        let variance = self.config.radio.two_way_m * self.config.radio.two_way_m;
        self.clock_step(stepped, variance, (jump - delay_residual_m, dt));
        true
    }

    /// Takes in an exchange that may be of another path than the first. Of the two posteriors, as an exchange and as a stray one, the filter
    /// keeps mean and covariance (Bar-Shalom and Tse 1975): it is the less sure of its clock the less it can tell which of both this is.
    fn apply_or_stray(&mut self, row: &Row<T>) {
        let along = self.covariance.product(row);
        let shared = row.dot(&along).to_f64();
        let residual = row.residual.to_f64();
        let innovation = shared + row.variance.to_f64();
        let wide = innovation + STRAY_M * STRAY_M;
        let blind = self.nominal.time_ns.saturating_sub(self.last_line_ns) > BLIND_AFTER_NS;
        let [seen, unseen] = STRAY;
        let share = if blind { unseen } else { seen };
        let density = |variance: f64| libm::exp(-0.5 * residual * residual / variance) / libm::sqrt(variance);
        let (own, stray) = ((1.0 - share) * density(innovation), share * density(wide));
        let own = own / (own + stray);
        // The gain is `along` times the mean of both inverses; their scatter is what not knowing costs.
        let inverse = own / innovation + (1.0 - own) / wide;
        let apart = residual * (1.0 / innovation - 1.0 / wide);
        let learnt = inverse - own * (1.0 - own) * apart * apart;
        if learnt > 0.0 {
            let mut merged = *row;
            merged.variance = T::of(1.0 / learnt - shared);
            if self.covariance.update(&merged).is_none() {
                return;
            }
        } else {
            let unsure = T::of(libm::sqrt(-learnt));
            self.covariance.spread(&along.map(|p| p * unsure));
        }
        let step = T::of(inverse * residual);
        self.correct(&along.map(|p| p * step));
    }
}
