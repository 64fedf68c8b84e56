//! From what the arrays measured to what the pose makes of it: body axes to world axes, cyclic delays with a clock offset
//! to lengths.

use nalgebra::Matrix3;

use crate::estimator::Pose;
use crate::field::{FieldError, Range, all_in, wide};
use crate::geometry::{Body, Direction, Position, World};
use crate::path::{Departure, Path};
use crate::paths::EstimatedPath;
use crate::reflection::{Ends, InputError};
use crate::signal::DelayPeriod;

/// Delays this much shorter than nothing are errors of a short path, not the end of the period, m.
/// Derived: beyond every error of a short delay, and far from the period's end.
const SHORTEST_M: f64 = -5.0;

/// What calibration leaves: errors that the estimator's own covariance, which is that of noise, does not hold.
/// Given: the filter's radio noise (docs/localization.md); departures as the link state networks were trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residuals {
    /// Delay, m.
    pub delay_m: f32,
    /// Angle of arrival along any tangent, rad.
    pub angle_rad: f32,
    /// Angle of departure along any tangent, rad.
    pub departure_rad: f32,
}

impl Residuals {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot.
    pub fn check(&self) -> Result<(), FieldError> {
        let above = [
            ("delay_m", self.delay_m),
            ("angle_rad", self.angle_rad),
            ("departure_rad", self.departure_rad),
        ];
        all_in(Range::AboveZero, &above.map(wide))
    }
}

impl Default for Residuals {
    /// Of the filter's radio noise (docs/localization.md, "The model"): 35 mm and 0.06 degrees. Departures: 2 degrees, what the link
    /// state networks were trained with. Noise explains the least of their errors: a ground bounce within a few degrees and
    /// less than a metre behind shares all beams with its path and draws the peak between the beams towards itself.
    fn default() -> Self {
        Self {
            delay_m: 0.035,
            angle_rad: 1.05e-3,
            departure_rad: 0.035,
        }
    }
}

/// Length of a way from its cyclic delay on the UAV's clock, m.
pub(super) fn length_m(c_tau_m: f32, clock_offset_m: f64, period: &DelayPeriod) -> f64 {
    period.range_from_m(f64::from(c_tau_m) - clock_offset_m, SHORTEST_M)
}

/// The two ends of the link as the pose has them.
pub(super) fn ends(pose: &Pose, gmt_m: &nalgebra::Vector3<f64>) -> Result<Ends, InputError> {
    Ok(Ends {
        uav: Position::from_vector(pose.position.vector().map(|c| c as f32))?,
        uav_covariance: pose.position_covariance_m2,
        gmt: Position::from_vector(gmt_m.map(|c| c as f32))?,
    })
}

/// Departure of an estimate with what calibration leaves in it.
pub(super) fn departure(estimated: &EstimatedPath<World>, residuals: &Residuals) -> Option<Departure> {
    let square = |x: f32| x * x;
    estimated.path.aod.map(|departure| Departure {
        sigma_rad: libm::sqrtf(square(departure.sigma_rad) + square(residuals.departure_rad)),
        ..departure
    })
}

/// A path in world axes with the clock offset taken out. `corrected`: its angle of arrival without the arrays' estimated
/// errors.
pub(super) fn to_world(
    estimated: &EstimatedPath<World>,
    corrected: Direction<Body>,
    pose: &Pose,
    period: &DelayPeriod,
    residuals: &Residuals,
) -> Path<World> {
    let square = |x: f32| x * x;
    let angle = square(residuals.angle_rad);
    let added = Matrix3::from_diagonal(&nalgebra::Vector3::new(
        square(residuals.delay_m) + square(pose.clock.offset_sigma_m),
        angle,
        angle,
    ));
    Path {
        c_tau_m: length_m(estimated.path.c_tau_m, pose.clock.offset_m, period) as f32,
        aoa: corrected,
        aod: departure(estimated, residuals),
        covariance: estimated.path.covariance + added,
    }
    .to_world(&pose.attitude, &pose.attitude_covariance_rad2)
}
