//! What a flight shall be like.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{Heading, Obstacles, Schedule, WindConfig};
use crate::input::InputError;

/// Limits of the quadrotor along its planned curve. Speed, acceleration and jerk hold at every instant, not only on a grid; wind
/// comes on top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Speed, m/s.
    pub speed_m_per_s: f64,
    /// Acceleration, m/s^2; below a third of gravity, so that a descent never comes near free fall.
    pub acceleration_m_per_s2: f64,
    /// Jerk, m/s^3.
    pub jerk_m_per_s3: f64,
    /// Tilt, deg.
    pub tilt_deg: f64,
    /// Rate of the heading, deg/s.
    pub heading_rate_dps: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            speed_m_per_s: 6.0,
            acceleration_m_per_s2: 3.0,
            jerk_m_per_s3: 12.0,
            tilt_deg: 30.0,
            heading_rate_dps: 60.0,
        }
    }
}

/// A flight to be planned. Lengths that are left out follow from the size of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlightConfig {
    /// Length of the flight, s.
    pub duration_s: f64,
    /// The UAV stands still for this long first: gyroscope bias and tilt are found at rest.
    pub rest_s: f64,
    /// When the GMT sounds and moves.
    pub schedule: Schedule,
    /// Limits of the quadrotor.
    pub limits: Limits,
    /// Wind, which blows the UAV off the planned curve; calm by default.
    pub wind: WindConfig,
    /// Where the nose points.
    pub heading: Heading,
    /// Linear rotor drag, 1/s.
    pub drag_per_s: f64,
    /// Distance kept from walls and ground by the UAV, m. Default: a tenth of the scene's height, at most 1.5.
    pub clearance_m: Option<f64>,
    /// Number of levels at which the UAV flies.
    pub levels: u32,
    /// Height of the GMT's antenna above the ground, m.
    pub mast_m: f64,
    /// Distance kept from walls by the GMT, m. Default: as the UAV's, at most 1.
    pub gmt_clearance_m: Option<f64>,
    /// Way of the GMT from stop to stop, m.
    pub gmt_step_m: f64,
    /// Route wanted: at least this share of sweeps with line of sight between GMT and UAV, 0..=1.
    pub visible_share: f64,
    /// Route preferred: at most this share, 0..=1, so that a flight shows what outages do. One that never leaves the GMT's
    /// sight is taken when no other is as wanted.
    pub most_visible_share: f64,
    /// Route wanted: no longer without line of sight than this, s.
    pub longest_outage_s: f64,
    /// Route wanted: line of sight in all sweeps up to this time, s.
    pub visible_start_s: f64,
    /// Route wanted: up to that time the UAV is no higher above the GMT's horizon than this, deg; 90 asks for nothing. The
    /// GMT's beams end at 30: above, it is heard through sidelobes, which tell no direction to start from.
    pub start_elevation_deg: f64,
    /// Route wanted: a path of one reflection in at least this share of the sweeps without line of sight, 0..=1; 0 asks for
    /// nothing.
    pub reflected_share: f64,
}

impl Default for FlightConfig {
    fn default() -> Self {
        Self {
            duration_s: 120.0,
            rest_s: 3.0,
            schedule: Schedule::default(),
            limits: Limits::default(),
            wind: WindConfig::default(),
            heading: Heading::Along,
            drag_per_s: 0.15,
            clearance_m: None,
            levels: 4,
            mast_m: 1.5,
            gmt_clearance_m: None,
            gmt_step_m: 0.2,
            visible_share: 0.6,
            most_visible_share: 1.0,
            longest_outage_s: 18.0,
            visible_start_s: 10.0,
            start_elevation_deg: 90.0,
            reflected_share: 0.0,
        }
    }
}

impl FlightConfig {
    /// A flight in calm air: the default.
    pub fn ideal() -> Self {
        Self::default()
    }

    /// The default flight in a wind of 15 kn at 20 ft.
    pub fn real() -> Self {
        Self {
            wind: WindConfig::real(),
            ..Self::default()
        }
    }

    /// A flight planned for reflections too, under the conditions that the accuracy of a whole flight is stated for
    /// (docs/localization.md, "The model"): the GMT in sight in 60 to 80 % of the sweeps, a path of one reflection in 70 % of
    /// the others; and the start where the GMT's beams reach.
    #[must_use]
    pub fn covered() -> Self {
        Self {
            most_visible_share: 0.8,
            start_elevation_deg: 30.0,
            reflected_share: 0.7,
            ..Self::default()
        }
    }

    /// Distance that the UAV keeps in this scene, m.
    pub(super) fn clearance_in(&self, world: &dyn Obstacles) -> f64 {
        let (low, high) = world.bounds();
        self.clearance_m
            .unwrap_or_else(|| (0.1 * (high[2] - low[2])).min(1.5))
    }

    /// Distance that the GMT keeps in this scene, m.
    pub(super) fn gmt_clearance_in(&self, world: &dyn Obstacles) -> f64 {
        self.gmt_clearance_m
            .unwrap_or_else(|| self.clearance_in(world).min(1.0))
    }

    /// Cruise speed that suits the scene, m/s: a fifth of the shorter side in two seconds, within the limit.
    pub(super) fn cruise_in(&self, world: &dyn Obstacles) -> f64 {
        let (low, high) = world.bounds();
        let size = Vector3::from(high) - Vector3::from(low);
        (0.1 * size.x.min(size.y)).min(self.limits.speed_m_per_s)
    }

    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        let above = |key: &str, value: f64, least: f64, most: f64| {
            if value.is_finite() && value > least && value <= most {
                Ok(())
            } else {
                Err(InputError::at_key(
                    key,
                    format!("is {value}, expected above {least}, up to {most}"),
                ))
            }
        };
        let within = |key: &str, value: f64, most: f64| {
            if (0.0..=most).contains(&value) {
                Ok(())
            } else {
                Err(InputError::at_key(
                    key,
                    format!("is {value}, expected 0 to {most}"),
                ))
            }
        };
        let hour = 3600.0;
        above("flight.duration_s", self.duration_s, 0.0, hour)?;
        within("flight.rest_s", self.rest_s, hour)?;
        above(
            "flight.schedule.sweep_period_s",
            self.schedule.sweep_period_s,
            0.02,
            60.0,
        )?;
        if self.schedule.sweeps_per_stop == 0 {
            return Err(InputError::at_key(
                "flight.schedule.sweeps_per_stop",
                "is 0, expected at least 1",
            ));
        }
        above(
            "flight.limits.speed_m_per_s",
            self.limits.speed_m_per_s,
            0.0,
            30.0,
        )?;
        above(
            "flight.limits.acceleration_m_per_s2",
            self.limits.acceleration_m_per_s2,
            0.0,
            3.2,
        )?;
        above(
            "flight.limits.jerk_m_per_s3",
            self.limits.jerk_m_per_s3,
            0.0,
            1000.0,
        )?;
        above("flight.limits.tilt_deg", self.limits.tilt_deg, 0.0, 60.0)?;
        above(
            "flight.limits.heading_rate_dps",
            self.limits.heading_rate_dps,
            0.0,
            720.0,
        )?;
        self.wind.check()?;
        within("flight.drag_per_s", self.drag_per_s, 1.0)?;
        for (key, value) in [
            ("flight.clearance_m", self.clearance_m),
            ("flight.gmt_clearance_m", self.gmt_clearance_m),
        ] {
            value.map_or(Ok(()), |value| above(key, value, 0.0, 10.0))?;
        }
        if !(1..=100).contains(&self.levels) {
            return Err(InputError::at_key(
                "flight.levels",
                format!("is {}, expected 1 to 100", self.levels),
            ));
        }
        above("flight.mast_m", self.mast_m, 0.0, 20.0)?;
        within("flight.gmt_step_m", self.gmt_step_m, 10.0)?;
        within("flight.visible_share", self.visible_share, 1.0)?;
        within("flight.most_visible_share", self.most_visible_share, 1.0)?;
        within("flight.longest_outage_s", self.longest_outage_s, hour)?;
        within("flight.visible_start_s", self.visible_start_s, hour)?;
        within("flight.start_elevation_deg", self.start_elevation_deg, 90.0)?;
        within("flight.reflected_share", self.reflected_share, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_figures_are_named() {
        let message = |change: fn(&mut FlightConfig)| {
            let mut config = FlightConfig::default();
            change(&mut config);
            config.check().expect_err("must be refused").to_string()
        };
        assert!(FlightConfig::default().check().is_ok());
        assert!(message(|c| c.duration_s = 0.0).contains("flight.duration_s"));
        assert!(message(|c| c.duration_s = f64::NAN).contains("flight.duration_s"));
        assert!(message(|c| c.schedule.sweeps_per_stop = 0).contains("sweeps_per_stop"));
        assert!(message(|c| c.limits.acceleration_m_per_s2 = 9.0).contains("acceleration"));
        assert!(message(|c| c.clearance_m = Some(-1.0)).contains("flight.clearance_m"));
        assert!(message(|c| c.visible_share = 1.1).contains("flight.visible_share"));
        assert!(message(|c| c.wind.w20_kn = 31.0).contains("flight.wind.w20_kn"));
        assert!(message(|c| c.wind.loop_damping = 0.0).contains("flight.wind.loop_damping"));
        assert!(FlightConfig::real().check().is_ok() && FlightConfig::ideal().check().is_ok());
        assert!(message(|c| c.levels = 0).contains("flight.levels"));
        assert!(toml::from_str::<FlightConfig>("duration = 3.0").is_err());
        assert_eq!(
            toml::from_str::<FlightConfig>("").expect("all default"),
            FlightConfig::default()
        );
    }
}
