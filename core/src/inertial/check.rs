//! Whether every number of the configurations of the inertial sensor and of rest can be.

use super::alignment::RestConfig;
use super::config::ImuConfig;
use crate::field::{FieldError, Range, all_in, wide};

/// Fewest samples that have a scatter, and most that are counted.
const SCATTERED: Range = Range::Within(2.0, u16::MAX as f64);

impl ImuConfig {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot.
    pub fn check(&self) -> Result<(), FieldError> {
        all_in(
            Range::AboveZero,
            &[
                ("period_ns", f64::from(self.period_ns)),
                ("step_ns", f64::from(self.step_ns)),
                ("gap_ns", f64::from(self.gap_ns)),
                ("late_ns", self.late_ns as f64),
                wide(("rate_limit_rad_per_s", self.rate_limit_rad_per_s)),
                wide(("force_limit_m_per_s2", self.force_limit_m_per_s2)),
                wide(("rate_spike_rad_per_s", self.rate_spike_rad_per_s)),
                wide(("force_spike_m_per_s2", self.force_spike_m_per_s2)),
                ("spike_samples", f64::from(self.spike_samples)),
            ],
        )?;
        // A step holds one sample at least, and is no gap.
        let (period_ns, gap_ns) = (f64::from(self.period_ns), f64::from(self.gap_ns));
        all_in(
            Range::Within(period_ns, gap_ns),
            &[("step_ns", f64::from(self.step_ns))],
        )
    }
}

impl RestConfig {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot.
    pub fn check(&self) -> Result<(), FieldError> {
        all_in(SCATTERED, &[("block_samples", f64::from(self.block_samples))])?;
        let above = [
            ("rate_scatter_rad_per_s", self.rate_scatter_rad_per_s),
            ("force_scatter_m_per_s2", self.force_scatter_m_per_s2),
            ("rate_drift_rad_per_s", self.rate_drift_rad_per_s),
            ("force_drift_m_per_s2", self.force_drift_m_per_s2),
            ("rate_bias_rad_per_s", self.rate_bias_rad_per_s),
            ("gravity_error_m_per_s2", self.gravity_error_m_per_s2),
            ("gyro_wander_rad_per_s", self.gyro_wander_rad_per_s),
            ("accel_wander_m_per_s2", self.accel_wander_m_per_s2),
        ];
        all_in(Range::AboveZero, &above.map(wide))?;
        all_in(Range::AboveZero, &[("blocks", f64::from(self.blocks))])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_sensor_can_be_is_named() {
        assert_eq!(ImuConfig::default().check(), Ok(()));
        assert_eq!(ImuConfig::default().without_noise().check(), Ok(()));
        let step = |step_ns| {
            let config = ImuConfig {
                step_ns,
                ..ImuConfig::default()
            };
            config.check().map_err(|error| error.field)
        };
        assert_eq!(step(500_000), Err("step_ns"));
        assert_eq!(step(60_000_000), Err("step_ns"));
        let mut rest = RestConfig::default();
        assert_eq!(rest.check(), Ok(()));
        rest.blocks = 0;
        assert_eq!(rest.check().expect_err("no blocks").field, "blocks");
        rest.block_samples = 1;
        assert_eq!(rest.check().expect_err("no scatter").field, "block_samples");
    }
}
