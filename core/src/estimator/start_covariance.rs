//! The covariance of a pose from a window: every error that it is made of, carried through to place, velocity and attitude.
//!
//! Across the sight the attitude is known to a hundredth of a radian, about it to degrees. Velocity and place were reckoned with that
//! attitude and err with it, and so does what the inertial sensor and the clock are off by. A filter that does not know it takes the
//! errors apart wrongly with the first path lengths that it hears, and a start whose sight goes at once has nothing else to go by.
//!
//! Left out: the rate that a turned sensor shows about the wrong axis, scale and misalignment of the gyroscope. What departures err by
//! for good is among what they share here, not the state of their face.

use super::Filter;
use super::layout::{ACCEL_BIAS, ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, GYRO_BIAS, MOUNTING, POSITION};
use super::measurement::{LEAST_RANGE_M, Transmitter};
use super::window::{Cause, SIGHT_SCATTER_RAD, Solution};
use crate::geometry::Real;
use nalgebra::Vector3;

/// What departures err by together, [`SIGHT_SCATTER_RAD`], is half another after so long, s.
/// Measured: of the errors of 5629 lines of sight in 44 flights of `real` (tuning seeds), departures that claim 4 mrad or less, two fifths of
/// the square last; half of these are left after ten seconds.
pub(super) const LASTING_S: f64 = 10.0;
/// Standard deviation of an angle of arrival by the arrays' calibration, rad: their states learn it only later.
/// Derived: slope and tilt of an array in the error budget, 1.7 and 1.75 mrad, in squares.
const ARRIVAL_SIGMA_RAD: f64 = 2.5e-3;

impl<T: Real, const N: usize> Filter<T, N> {
    /// Sets the covariance of place and velocity at the last fix of a window, and of the attitude unless that was `given`.
    // Rare, and flash is short: never inlined.
    #[inline(never)]
    pub(super) fn set_window_covariance(&mut self, gmt: &Transmitter, solution: &Solution, given: bool) {
        let own = if given { ATTITUDE } else { GYRO_BIAS };
        for state in POSITION..own {
            self.covariance.reset(state, T::zero());
        }
        self.share_window_errors(solution, own);
        let errors = &solution.errors;
        let mut add = |cause: &Cause, sigma: f64| {
            let mut along = [T::zero(); N];
            let off = errors.of_pose(cause, given);
            let each = off.iter().flat_map(|vector| vector.iter());
            for (value, off) in along.iter_mut().zip(each).take(own) {
                *value = T::of(*off * sigma);
            }
            self.covariance.spread(&along);
        };
        let range_m = (solution.position_m - gmt.position_m).norm().max(LEAST_RANGE_M);
        let shared_m = SIGHT_SCATTER_RAD * range_m;
        let arrival_rad2 = ARRIVAL_SIGMA_RAD * ARRIVAL_SIGMA_RAD + errors.sight_variance_rad2;
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let across = errors.across(&axis);
            let sight = Cause {
                sight: across,
                ..Cause::default()
            };
            add(&sight, libm::sqrt(arrival_rad2));
            // What is new in the error of a fix stays in those after it, ever less.
            let mut later = [0.0; 4];
            for share in errors.shares.iter().rev() {
                let alone = errors.by_place(share.weights, &axis, range_m);
                add(&alone, libm::sqrt(share.variance_m2.dot(&axis) * errors.excess));
                let mut weights = share.weights;
                for (weight, later) in weights.iter_mut().zip(later) {
                    *weight += later;
                }
                let left = share
                    .since_s
                    .map_or(0.0, |since_s| LASTING_S / (LASTING_S + since_s));
                let together = errors.by_place(weights, &across, range_m);
                add(&together, shared_m * libm::sqrt(1.0 - left * left));
                later = weights.map(|weight| weight * left);
            }
        }
    }

    /// What the errors of the states from `own` on do to the pose: of the inertial sensor, of the clock, of a given attitude.
    fn share_window_errors(&mut self, solution: &Solution, own: usize) {
        let errors = &solution.errors;
        let attitude = self.nominal.attitude;
        // Backwards: the pose's own covariance comes last, of what it shares with the causes.
        for k in (0..N).rev() {
            let at = |state: usize| {
                let with = |i: usize| self.covariance.at(state + i, k).to_f64();
                Vector3::new(with(0), with(1), with(2))
            };
            let clock = [CLOCK_OFFSET, CLOCK_DRIFT].map(|state| self.covariance.at(state, k).to_f64());
            let cause = Cause {
                // A force is turned with the sensor in the body.
                inside: attitude * at(ACCEL_BIAS) + errors.force.cross(&(attitude * at(MOUNTING))),
                rate: attitude * at(GYRO_BIAS),
                line: clock.map(|late| errors.towards * -late),
                given: -at(ATTITUDE),
                ..Cause::default()
            };
            let off = errors.of_pose(&cause, own == ATTITUDE);
            let each = off.iter().flat_map(|vector| vector.iter());
            for (state, off) in (POSITION..own).zip(each) {
                // The states are true less estimated.
                self.covariance.correlate(state, k, T::of(-*off));
            }
        }
    }
}
