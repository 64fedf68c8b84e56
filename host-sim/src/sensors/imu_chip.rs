//! When an ICM-42688-P samples, what its filters hold up, and how it stamps: after its data sheet (DS-000347, revision 1.8), and
//! without a look at the driver, which has to find all of it out again.
//!
//! Everything in the chip runs by one internal clock, which is off: at 25 degrees by up to 1.5 % with the gyroscope on, and over
//! temperature by another 2 % (table 4). By that clock a sample is taken every millisecond, and its FIFO stamp counts ticks of 32/30 us
//! (section 12.7), 16 bits that wrap. What a sample holds has passed the anti-alias filter, of second order with a programmed bandwidth
//! (section 5.3), and then the filters of the data rate, whose delay the data sheet gives (section 5.5).

use nalgebra::Vector1;

use super::low_pass::LowPass;

/// Samples per second by the chip's clock, Hz.
const RATE_HZ: f64 = 1000.0;
/// Ticks of the stamp a second by the chip's clock, Hz.
const TICKS_HZ: f64 = 30e6 / 32.0;
/// Bandwidth (3 dB) of the anti-alias filter that the driver programs, Hz.
const ANTI_ALIAS_HZ: f64 = 258.0;
/// Delay of the filters behind it: second order, half the data rate, 1 kHz; s by the chip's clock.
const OUTPUT_DELAY_S: f64 = 0.7e-3;
/// Steps of the anti-alias filter from sample to sample.
const STEPS: u32 = 32;
/// Their length, s by the chip's clock.
const STEP_S: f64 = 1.0 / (RATE_HZ * STEPS as f64);

/// The stamp at `time_s` by the chip's clock.
pub(super) fn stamp(time_s: f64) -> u16 {
    // A whole tick is not cut for the last digit of the product.
    (time_s * TICKS_HZ + 1e-6) as u64 as u16
}

/// One chip and how warm it gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuChipConfig {
    /// Error of the clock at 25 degrees, relative; fast is positive. Data sheet: 0.015.
    pub clock_error: f64,
    /// Error that is added from there to 85 degrees, relative, proportional between. Data sheet: 0.02.
    pub clock_error_at_85_deg_c: f64,
    /// Temperature when it is switched on, degrees Celsius.
    pub start_deg_c: f64,
    /// Temperature in the end, degrees Celsius.
    pub end_deg_c: f64,
    /// Time constant of the warming, s.
    pub warming_s: f64,
    /// What the chip's clock reads at true time 0, s.
    pub age_s: f64,
}

/// A sample as it lies in the FIFO.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChipSample {
    /// True time of its edge, s.
    pub edge_s: f64,
    /// Its stamp.
    pub stamp: u16,
    /// What it holds of the signal.
    pub value: f64,
}

/// A chip that is running.
#[derive(Clone, Debug)]
pub struct ImuChip {
    config: ImuChipConfig,
    /// Number of the next sample.
    next: u32,
    anti_alias: LowPass<1>,
}

impl ImuChip {
    /// A chip that takes its first sample a millisecond after true time 0; before, its signal was 0.
    #[must_use]
    pub fn new(config: ImuChipConfig) -> Self {
        Self {
            config,
            next: 1,
            anti_alias: LowPass::new(ANTI_ALIAS_HZ, STEP_S),
        }
    }

    /// Time by the chip's clock since true time 0, s.
    #[must_use]
    pub fn chip_s(&self, true_s: f64) -> f64 {
        let c = &self.config;
        let per_deg_c = c.clock_error_at_85_deg_c / (85.0 - 25.0);
        let settled = c.clock_error + per_deg_c * (c.end_deg_c - 25.0);
        // The warming's share of the integral of the rate.
        let warming = c.warming_s * (1.0 - libm::exp(-true_s / c.warming_s));
        true_s * (1.0 + settled) + per_deg_c * (c.start_deg_c - c.end_deg_c) * warming
    }

    /// True time at which the chip's clock has gone so far, s.
    #[must_use]
    pub fn true_s(&self, chip_s: f64) -> f64 {
        // The rate is within 4 % of one, so each round leaves a twenty-fifth of the error.
        (0..12).fold(chip_s, |true_s, _| true_s + (chip_s - self.chip_s(true_s)))
    }

    /// The next sample of a signal over true time.
    pub fn sample(&mut self, signal: impl Fn(f64) -> f64) -> ChipSample {
        let end_s = f64::from(self.next) / RATE_HZ;
        self.next += 1;
        let mut value = 0.0;
        for step in (0..STEPS).rev() {
            let input_s = end_s - f64::from(step) * STEP_S - 0.5 * STEP_S - OUTPUT_DELAY_S;
            let input = signal(self.true_s(input_s));
            value = self.anti_alias.step(&Vector1::new(input)).x;
        }
        ChipSample {
            edge_s: self.true_s(end_s),
            stamp: stamp(self.config.age_s + end_s),
            value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn right() -> ImuChipConfig {
        ImuChipConfig {
            clock_error: 0.0,
            clock_error_at_85_deg_c: 0.0,
            start_deg_c: 25.0,
            end_deg_c: 25.0,
            warming_s: 20.0,
            age_s: 0.0,
        }
    }

    #[test]
    fn the_stamp_toggles_between_937_and_938_and_wraps() {
        let mut chip = ImuChip::new(right());
        let stamps: Vec<u16> = (0..1000).map(|_| chip.sample(|_| 0.0).stamp).collect();
        let steps: Vec<u16> = stamps
            .windows(2)
            .map(|pair| pair[1].wrapping_sub(pair[0]))
            .collect();
        assert!(steps.iter().all(|step| [937, 938].contains(step)));
        assert!(stamps.windows(2).any(|pair| pair[1] < pair[0]));
        // 937.5 in the mean: 999 steps.
        assert_eq!(steps.iter().map(|step| u32::from(*step)).sum::<u32>(), 936_563);
    }

    #[test]
    fn a_ramp_comes_out_later_by_the_delay_of_the_filters() {
        let mut chip = ImuChip::new(right());
        let last = (0..200)
            .map(|_| chip.sample(|time_s| time_s))
            .last()
            .expect("samples");
        let late_s = last.edge_s - last.value;
        // 872.4 us and 0.7 ms.
        assert!((late_s - 1.5724e-3).abs() < 1e-6, "{late_s}");
    }

    #[test]
    fn the_clock_is_off_by_its_error_and_by_what_the_warmth_adds() {
        let warm = ImuChip::new(ImuChipConfig {
            clock_error: 0.015,
            clock_error_at_85_deg_c: 0.02,
            end_deg_c: 85.0,
            ..right()
        });
        let rate = |at_s: f64| (warm.chip_s(at_s + 0.01) - warm.chip_s(at_s)) / 0.01;
        assert!((rate(0.0) - 1.015).abs() < 1e-5, "{}", rate(0.0));
        assert!((rate(400.0) - 1.035).abs() < 1e-9, "{}", rate(400.0));
        for at_s in [0.0, 1.0, 60.0, 600.0] {
            assert!((warm.true_s(warm.chip_s(at_s)) - at_s).abs() < 1e-12);
        }
    }
}
