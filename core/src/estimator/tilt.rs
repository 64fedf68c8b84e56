//! What rest has shown of the tilt, as a measurement of a start.
//!
//! At rest the accelerometer shows which way is up, and the gyroscope carries that on until the start. What it is off by then is what the
//! accelerometer is biased by and turned in the body: one error with states that the filter has, so a start whose attitude comes from a
//! window of sweeps takes the tilt in as two rows, and learns of the three together. A start that contradicts it is none.
//!
//! The bias leans the attitude at rest `A` for good; a sensor that is turned in the body has its own attitude right, and that of the body wrong by
//! the same turn at all times, with `R` the attitude now. With bias `b` and mounting `m`, true less estimated, the tilt is off by
//! ```text
//! th_x = -(A b)_y / g - (R m)_x,  th_y = (A b)_x / g - (R m)_y
//! ```

use nalgebra::{Matrix3, Vector3};

use super::Filter;
use super::gate::chi_square;
use super::layout::{ACCEL_BIAS, ATTITUDE, MOUNTING};
use super::row::Row;
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::Real;
use crate::inertial::Alignment;

/// Gyroscope and accelerometer carry an attitude on for this long, ns: the tilt after rest, and that of a start, which the magnetic heading is asked about
/// as long (docs/localization.md, "Starts").
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
pub(super) const CARRIED_NS: u64 = 10_000_000_000;
/// What a body has turned there and back before a start, rad: the gyroscope's scale and misalignment err by their part of that, and of the turn
/// that is left.
/// Given: how a UAV takes off.
const THERE_AND_BACK_RAD: f64 = 1.0;

/// The tilt of a body that rested.
#[derive(Clone, Copy, Debug)]
pub(super) struct RestTilt {
    /// End of the rest, ns.
    since_ns: u64,
    /// Attitude then, of yaw 0.
    attitude: Matrix3<f64>,
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes over the tilt, about a vertical of unknown yaw, of a body that stands still.
    pub(super) fn set_tilt(&mut self, rest: &Alignment) {
        if self.running || !rest.up.iter().all(|c| c.is_finite()) {
            return;
        }
        let Ok(attitude) = rest.attitude(0.0).to_attitude() else {
            return;
        };
        self.nominal.attitude = attitude.matrix().map(f64::from);
        self.rest_tilt = Some(RestTilt {
            since_ns: rest.time_ns,
            attitude: self.nominal.attitude,
        });
        self.renew_head();
    }

    /// Takes the tilt of rest in, as `carried` (an attitude of unknown yaw) has it by now, of a pose that was just set. False when the pose
    /// contradicts it.
    // Rare, and flash is short: never inlined.
    #[inline(never)]
    pub(super) fn take_rest_tilt(&mut self, carried: &Matrix3<f64>) -> bool {
        let Some(tilt) = self.rest_tilt.take() else {
            return true;
        };
        if self.nominal.time_ns.saturating_sub(tilt.since_ns) > CARRIED_NS {
            return true;
        }
        let turn = self.nominal.attitude * carried.transpose();
        let up = turn * Vector3::z();
        let at_rest = turn * tilt.attitude;
        let axes = |of: &Matrix3<f64>| [of.row(0).transpose(), of.row(1).transpose()];
        let ([bias_x, bias_y], [mounting_x, mounting_y]) = (axes(&at_rest), axes(&self.nominal.attitude));
        let turned_rad = ((carried.tr_mul(&tilt.attitude).trace() - 1.0) * 0.5).acos_libm();
        let sigma_rad = self.config.priors.gyro_matrix * (THERE_AND_BACK_RAD + turned_rad);
        let rows: [Row<T>; 2] = [
            (Vector3::x(), up.y, bias_y, mounting_x),
            (Vector3::y(), -up.x, -bias_x, mounting_y),
        ]
        .map(|(axis, off, by_bias, by_mounting)| {
            let mut row = Row::new(off, sigma_rad * sigma_rad);
            row.push_vector(ATTITUDE, &axis);
            row.push_vector(ACCEL_BIAS, &(by_bias / STANDARD_GRAVITY_M_PER_S2));
            row.push_vector(MOUNTING, &by_mounting);
            row
        });
        let agrees = chi_square(&self.covariance, &rows) <= self.gates().three;
        if agrees {
            self.take_rows(&rows);
        } else {
            self.rest_tilt = Some(tilt);
        }
        agrees
    }
}
