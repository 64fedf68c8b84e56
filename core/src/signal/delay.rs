//! Delays are cyclic: the length of a way is known but for whole delay periods.

/// Length after which the delays of a waveform repeat ([`super::Waveform::delay_period`]): 624.6 m by default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DelayPeriod {
    length_m: f64,
}

impl DelayPeriod {
    /// Of a waveform.
    pub(super) fn new(length_m: f64) -> Self {
        Self { length_m }
    }

    /// The period itself, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// A length wrapped to half a period on either side of zero, m.
    // Rounding down takes 180 bytes, and there are thirty callers.
    #[inline(never)]
    #[must_use]
    pub fn wrap_m(&self, length_m: f64) -> f64 {
        length_m - self.length_m * libm::floor(length_m / self.length_m + 0.5)
    }

    /// A cyclic delay as the length of a way, m: from 0 up to a whole period.
    #[must_use]
    pub fn range_m(&self, length_m: f64) -> f64 {
        self.range_from_m(length_m, 0.0)
    }

    /// The same from `least_m` on, which is at most half a period below zero: a way of no length may have been measured a little
    /// shorter.
    #[must_use]
    pub fn range_from_m(&self, length_m: f64, least_m: f64) -> f64 {
        let wrapped = self.wrap_m(length_m);
        if wrapped < least_m {
            wrapped + self.length_m
        } else {
            wrapped
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::signal::Waveform;

    #[test]
    fn a_delay_is_a_length_but_for_whole_periods_of_its_waveform() {
        // Twice the sample rate, half the period.
        let waveform = Waveform {
            sample_rate_hz: 491.52e6,
            ..Waveform::default()
        };
        let (slow, fast) = (Waveform::default().delay_period(), waveform.delay_period());
        assert!((slow.length_m() - 624.567_620_8).abs() < 1e-6);
        assert_eq!(fast.length_m(), 0.5 * slow.length_m());
        for period in [slow, fast] {
            let length_m = period.length_m();
            for k in [-3.0, 0.0, 2.0] {
                assert!((period.wrap_m(40.0 + k * length_m) - 40.0).abs() < 1e-9);
                assert!((period.wrap_m(-40.0 + k * length_m) + 40.0).abs() < 1e-9);
                assert!((period.range_m(-40.0 + k * length_m) - (length_m - 40.0)).abs() < 1e-9);
                assert!((period.range_from_m(-4.0 + k * length_m, -5.0) + 4.0).abs() < 1e-9);
                assert!((period.range_from_m(-6.0 + k * length_m, -5.0) - (length_m - 6.0)).abs() < 1e-9);
            }
        }
    }
}
