//! Where each error stands in the state vector (docs/localization.md, "The model").
//!
//! 17 errors of motion, sensors and clock, 27 of calibration, two more of the clock, three of the mounting, then three of each mapped plane. Attitude errors are small
//! rotation vectors in WORLD axes.
//!
//! Given: numbers here are the order of the states.

pub(super) use crate::array::MOST_ARRAYS as ARRAYS;
pub(super) use crate::radio::MOST_FACES as FACES;

/// Position, m, world axes.
pub const POSITION: usize = 0;
/// Velocity, m/s, world axes.
pub const VELOCITY: usize = 3;
/// Attitude: small rotation vector in world axes, rad; `R_true = exp(th) R`.
pub const ATTITUDE: usize = 6;
/// Gyroscope bias, rad/s, body axes.
pub const GYRO_BIAS: usize = 9;
/// Accelerometer bias, m/s^2, body axes.
pub const ACCEL_BIAS: usize = 12;
/// Clock offset, m.
pub const CLOCK_OFFSET: usize = 15;
/// Clock drift, m/s.
pub const CLOCK_DRIFT: usize = 16;
/// Bias of the direction cosines (s_x, s_z) of each GMT face.
pub const FACE_BIAS: usize = 17;
/// Slope of the element phases of each UAV array, as a direction cosine.
pub const ARRAY_SLOPE: usize = 23;
/// Tilt of the axis of each UAV array about two directions, rad.
pub const ARRAY_AXIS: usize = 27;
/// Scale and misalignment of the gyroscope: error for a rate about x, about y, about z, three each.
pub const GYRO_MATRIX: usize = 35;
/// Clock ramp: rate of the drift, m/s^2. A temperature that rises keeps rising.
pub const CLOCK_RAMP: usize = 44;
/// Constant error of two-way timing, m: unequal delays of the two radios.
pub const TWO_WAY_BIAS: usize = 45;
/// Rotation of the inertial sensor's axes into those of the arrays, which are the body's: a small rotation vector, rad, body axes.
pub const MOUNTING: usize = 46;
/// First plane: offset (m) and two tilts (rad) each.
pub const PLANES: usize = 49;

/// Number of states of a filter that holds up to `planes` planes at a time.
pub const fn states(planes: usize) -> usize {
    PLANES + 3 * planes
}

/// Number of planes of a filter with `states` states.
pub const fn planes(states: usize) -> usize {
    states.saturating_sub(PLANES) / 3
}

/// First state of plane `slot`.
pub(super) const fn plane(slot: usize) -> usize {
    PLANES + 3 * slot
}
