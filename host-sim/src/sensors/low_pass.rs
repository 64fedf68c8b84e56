//! A low-pass filter of second order, as inertial sensors have before they decimate.

use core::f64::consts::{PI, SQRT_2};

use nalgebra::SVector;

/// Butterworth's filter (damping 1/sqrt 2, so that the 3 dB lie at its own frequency) of `N` signals, in equal steps.
#[derive(Clone, Debug)]
pub(super) struct LowPass<const N: usize> {
    /// Angle of the filter's frequency over a step, rad.
    angle: f64,
    output: SVector<f64, N>,
    /// Derivative of the output, in units of the filter's angular frequency.
    slope: SVector<f64, N>,
}

impl<const N: usize> LowPass<N> {
    /// A filter of bandwidth `bandwidth_hz` in steps of `step_s`; before the first one its signals were 0.
    pub(super) fn new(bandwidth_hz: f64, step_s: f64) -> Self {
        Self {
            angle: 2.0 * PI * bandwidth_hz * step_s,
            output: SVector::zeros(),
            slope: SVector::zeros(),
        }
    }

    /// Makes it as if its signals had always been these.
    pub(super) fn settle(&mut self, signals: SVector<f64, N>) {
        self.output = signals;
        self.slope = SVector::zeros();
    }

    /// The output at the end of a step, from the signals in its middle.
    pub(super) fn step(&mut self, input: &SVector<f64, N>) -> SVector<f64, N> {
        // The trapezoidal rule with the input of the middle: x' = angle v, v' = angle (u - x - sqrt 2 v).
        let h = 0.5 * self.angle;
        let (x, v) = (self.output, self.slope);
        let (rx, rv) = (x + v * h, v + (input * 2.0 - x - v * SQRT_2) * h);
        self.slope = (rv - rx * h) / (1.0 + h * SQRT_2 + h * h);
        self.output = rx + self.slope * h;
        self.output
    }

    /// Its delay of slow signals, s.
    pub(super) fn delay_s(bandwidth_hz: f64) -> f64 {
        SQRT_2 / (2.0 * PI * bandwidth_hz)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    const STEP_S: f64 = 1.0 / 8000.0;

    /// Amplitude of what is left of a sine of amplitude 1 at `hz`.
    fn gain(hz: f64) -> f64 {
        let mut filter = LowPass::new(200.0, STEP_S);
        (0..16_000)
            .map(|k| {
                let input = libm::sin(2.0 * PI * hz * (f64::from(k) + 0.5) * STEP_S);
                (k, filter.step(&Vector1::new(input)).x)
            })
            .filter(|(k, _)| *k >= 8000)
            .map(|(_, output)| output.abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn it_has_the_gain_of_its_order() {
        for hz in [10.0, 90.0, 200.0, 400.0] {
            let ratio: f64 = hz / 200.0;
            let expected = 1.0 / (1.0 + ratio * ratio * ratio * ratio).sqrt();
            // The trapezoidal rule shifts frequencies by (pi f T)^2 / 3.
            assert!((gain(hz) / expected - 1.0).abs() < 0.02, "{} at {hz}", gain(hz));
        }
    }

    #[test]
    fn a_ramp_comes_out_later_by_its_delay() {
        let mut filter = LowPass::new(200.0, STEP_S);
        let mut output = 0.0;
        for k in 0..8000 {
            output = filter.step(&Vector1::new((f64::from(k) + 0.5) * STEP_S)).x;
        }
        let late_s = 1.0 - output;
        assert!((late_s - LowPass::<1>::delay_s(200.0)).abs() < 1e-9, "{late_s}");
        assert!((LowPass::<1>::delay_s(258.0) - 872.4e-6).abs() < 1e-7);
        filter.settle(Vector1::new(3.0));
        assert!((filter.step(&Vector1::new(3.0)).x - 3.0).abs() < 1e-15);
    }
}
