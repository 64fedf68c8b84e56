//! Whether every number of the filter's configuration can be.

use super::config::FilterConfig;
use crate::field::{FieldError, Range, all_in};

impl FilterConfig {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot.
    pub fn check(&self) -> Result<(), FieldError> {
        let (p, r, q) = (&self.process, &self.radio, &self.priors);
        let (g, b) = (&self.gates, &self.beacon);
        all_in(
            Range::AboveZero,
            &[
                ("process.accel_m_per_s", p.accel_m_per_s),
                ("process.accel_scale", p.accel_scale),
                ("process.gyro_rad", p.gyro_rad),
                ("process.gyro_bias_rad_per_s", p.gyro_bias_rad_per_s),
                ("process.accel_bias_m_per_s2", p.accel_bias_m_per_s2),
                ("process.clock_offset_m", p.clock_offset_m),
                ("process.clock_drift_m_per_s", p.clock_drift_m_per_s),
                ("process.clock_ramp_m_per_s2", p.clock_ramp_m_per_s2),
                ("process.beacon_m", p.beacon_m),
                ("process.face_bias", p.face_bias),
                ("process.gap_accel_m_per_s", p.gap_accel_m_per_s),
                ("process.gap_gyro_rad", p.gap_gyro_rad),
                ("radio.aoa_rad", r.aoa_rad),
                ("radio.delay_m", r.delay_m),
                ("radio.departure", r.departure),
                ("radio.departure_lasting", r.departure_lasting),
                ("radio.two_way_m", r.two_way_m),
                ("radio.heading_rad", r.heading_rad),
                ("radio.beacon_m", r.beacon_m),
                ("priors.gyro_bias_rad_per_s", q.gyro_bias_rad_per_s),
                ("priors.accel_bias_m_per_s2", q.accel_bias_m_per_s2),
                ("priors.gyro_matrix", q.gyro_matrix),
                ("priors.mounting_rad", q.mounting_rad),
                ("priors.clock_drift_m_per_s", q.clock_drift_m_per_s),
                ("priors.clock_ramp_m_per_s2", q.clock_ramp_m_per_s2),
                ("priors.two_way_bias_m", q.two_way_bias_m),
                ("priors.face_bias", q.face_bias[0]),
                ("priors.face_bias", q.face_bias[1]),
                ("priors.mast_rad", q.mast_rad),
                ("priors.array_slope", q.array_slope),
                ("priors.array_axis_rad", q.array_axis_rad),
                ("gates.five", g.five),
                ("gates.three", g.three),
                ("gates.one", g.one),
                ("gates.trusted_m", g.trusted_m),
                ("gates.lost_m", g.lost_m),
                ("gates.attitude_lost_rad", g.attitude_lost_rad),
                ("gates.refix_after", f64::from(g.refix_after)),
                ("beacon.speed_m_per_s", b.speed_m_per_s),
                ("beacon.slack_m", b.slack_m),
                ("beacon.walk_m", b.walk_m),
                ("beacon.white_m", b.white_m),
            ],
        )?;
        all_in(Range::Within(0.0, 1.0), &[("beacon.memory", b.memory)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_filter_can_reckon_with_is_named() {
        assert_eq!(FilterConfig::default().check(), Ok(()));
        let mut config = FilterConfig::default();
        config.beacon.memory = 1.5;
        assert_eq!(config.check().expect_err("more than all").field, "beacon.memory");
        config.priors.face_bias[1] = f64::NAN;
        assert_eq!(config.check().expect_err("no number").field, "priors.face_bias");
    }
}
