//! The state itself, about which the covariance describes the errors.
//!
//! In double precision: a clock that runs off by kilometres, a position of a hundred metres and increments of
//! millimetres meet here, fifty times per second. A Cortex-M7 does that in hardware; the covariance, where the work is,
//! needs single precision only.

use nalgebra::{Matrix3, Vector3};

use super::layout::{
    ACCEL_BIAS, ARRAY_AXIS, ARRAY_SLOPE, ARRAYS, ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, CLOCK_RAMP, FACE_BIAS,
    FACES, GYRO_BIAS, GYRO_MATRIX, MOUNTING, POSITION, TWO_WAY_BIAS, VELOCITY,
};
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::inertial::{ImuErrors, ImuIncrement};
use crate::signal::DelayPeriod;

/// Square of an angle up to which the series are exact to round-off, rad^2.
/// Derived: the next term of each series is below the last bit.
const SERIES_LIMIT: f64 = 0.01;

/// Position, velocity, attitude, clock, and everything that is calibrated on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nominal {
    /// UAV clock, ns.
    pub time_ns: u64,
    /// Body origin, world frame, m.
    pub position_m: Vector3<f64>,
    /// Velocity, world frame, m/s.
    pub velocity_m_per_s: Vector3<f64>,
    /// Attitude R_wb.
    pub attitude: Matrix3<f64>,
    /// Period by which the clock offset is wrapped: that of the delays it is taken out of.
    pub delay_period: DelayPeriod,
    /// Clock offset, m, wrapped.
    pub clock_offset_m: f64,
    /// Clock drift, m/s.
    pub clock_drift_m_per_s: f64,
    /// Rate of that, m/s^2.
    pub clock_ramp_m_per_s2: f64,
    /// Constant error of two-way timing, m.
    pub two_way_bias_m: f64,
    /// Errors of the inertial sensor.
    pub imu: ImuErrors,
    /// Bias of the direction cosines (s_x, s_z) per GMT face.
    pub face_bias: [[f64; 2]; FACES],
    /// Slope of the element phases per UAV array.
    pub array_slope: [f64; ARRAYS],
    /// Axis tilts per UAV array, rad.
    pub array_axis_rad: [[f64; 2]; ARRAYS],
}

impl Nominal {
    /// At rest in the origin, axes aligned, nothing calibrated.
    pub fn origin(time_ns: u64, delay_period: DelayPeriod) -> Self {
        Self {
            time_ns,
            position_m: Vector3::zeros(),
            velocity_m_per_s: Vector3::zeros(),
            attitude: Matrix3::identity(),
            delay_period,
            clock_offset_m: 0.0,
            clock_drift_m_per_s: 0.0,
            clock_ramp_m_per_s2: 0.0,
            two_way_bias_m: 0.0,
            imu: ImuErrors::default(),
            face_bias: [[0.0; 2]; FACES],
            array_slope: [0.0; ARRAYS],
            array_axis_rad: [[0.0; 2]; ARRAYS],
        }
    }

    /// Moves on by an increment, and gives the mean specific force over it in world axes (m/s^2) and the mean angular rate
    /// (rad/s, body axes).
    pub fn advance(&mut self, increment: &ImuIncrement) -> (Vector3<f64>, Vector3<f64>) {
        let increment = increment.with_errors(&self.imu);
        let dt = increment.end_ns.saturating_sub(self.time_ns) as f64 * 1e-9;
        let gained = self.attitude * increment.delta_velocity_m_per_s.map(f64::from);
        let moved = self.attitude * increment.delta_position_m.map(f64::from);
        let gravity = Vector3::z() * -STANDARD_GRAVITY_M_PER_S2;
        self.position_m += self.velocity_m_per_s * dt + moved + gravity * (0.5 * dt * dt);
        self.velocity_m_per_s += gained + gravity * dt;
        let turn = increment.delta_angle_rad.map(f64::from);
        self.attitude = orthonormal(&(self.attitude * rotation(&turn)));
        self.coast_clock(dt);
        self.time_ns = increment.end_ns;
        if dt > 0.0 {
            (gained / dt, turn / dt)
        } else {
            (Vector3::zeros(), Vector3::zeros())
        }
    }

    /// Moves on without inertial data: velocity and attitude stay.
    pub fn coast(&mut self, until_ns: u64) {
        let dt = until_ns.saturating_sub(self.time_ns) as f64 * 1e-9;
        self.position_m += self.velocity_m_per_s * dt;
        self.coast_clock(dt);
        self.time_ns = until_ns;
    }

    fn coast_clock(&mut self, dt_s: f64) {
        let drift = self.clock_drift_m_per_s + 0.5 * self.clock_ramp_m_per_s2 * dt_s;
        self.clock_offset_m = self.delay_period.wrap_m(self.clock_offset_m + drift * dt_s);
        self.clock_drift_m_per_s += self.clock_ramp_m_per_s2 * dt_s;
    }

    /// Adds estimated errors. Planes are not part of it.
    pub fn correct<const N: usize>(&mut self, dx: &[f64; N]) {
        let at = |i: usize| dx.get(i).copied().unwrap_or(0.0);
        let vector = |i: usize| Vector3::new(at(i), at(i + 1), at(i + 2));
        self.position_m += vector(POSITION);
        self.velocity_m_per_s += vector(VELOCITY);
        self.attitude = orthonormal(&(rotation(&vector(ATTITUDE)) * self.attitude));
        let narrow = |v: Vector3<f64>| v.map(|c| c as f32);
        self.imu.gyro_bias_rad_per_s += narrow(vector(GYRO_BIAS));
        self.imu.accel_bias_m_per_s2 += narrow(vector(ACCEL_BIAS));
        let [x, y, z] = [0, 3, 6].map(|k| narrow(vector(GYRO_MATRIX + k)));
        self.imu.gyro_matrix += Matrix3::new(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z);
        self.imu.mounting_rad += narrow(vector(MOUNTING));
        self.clock_offset_m = self.delay_period.wrap_m(self.clock_offset_m + at(CLOCK_OFFSET));
        self.clock_drift_m_per_s += at(CLOCK_DRIFT);
        self.clock_ramp_m_per_s2 += at(CLOCK_RAMP);
        self.two_way_bias_m += at(TWO_WAY_BIAS);
        for (s, bias) in self.face_bias.iter_mut().flatten().enumerate() {
            *bias += at(FACE_BIAS + s);
        }
        for (j, slope) in self.array_slope.iter_mut().enumerate() {
            *slope += at(ARRAY_SLOPE + j);
        }
        for (k, tilt) in self.array_axis_rad.iter_mut().flatten().enumerate() {
            *tilt += at(ARRAY_AXIS + k);
        }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.position_m.iter().all(|c| c.is_finite())
            && self.velocity_m_per_s.iter().all(|c| c.is_finite())
            && self.attitude.iter().all(|c| c.is_finite())
            && self.clock_offset_m.is_finite()
            && (self.clock_drift_m_per_s + self.clock_ramp_m_per_s2 + self.two_way_bias_m).is_finite()
            && self.imu.gyro_bias_rad_per_s.iter().all(|c| c.is_finite())
            && self.imu.accel_bias_m_per_s2.iter().all(|c| c.is_finite())
    }
}

/// Rotation matrix of a rotation vector, rad (Rodrigues).
pub(super) fn rotation(angle_rad: &Vector3<f64>) -> Matrix3<f64> {
    let square = angle_rad.norm_squared();
    // sin a / a and (1 - cos a) / a^2: nested series up to 0.1 rad, which is exact to round-off and every step of a sound
    // flight; a fifth of the instructions.
    let (first, second) = if square < SERIES_LIMIT {
        let s = square;
        (
            1.0 - s
                * (1.0 / 6.0)
                * (1.0 - s * (1.0 / 20.0) * (1.0 - s * (1.0 / 42.0) * (1.0 - s * (1.0 / 72.0)))),
            0.5 - s
                * (1.0 / 24.0)
                * (1.0 - s * (1.0 / 30.0) * (1.0 - s * (1.0 / 56.0) * (1.0 - s * (1.0 / 90.0)))),
        )
    } else {
        let angle = libm::sqrt(square);
        (libm::sin(angle) / angle, (1.0 - libm::cos(angle)) / square)
    };
    let cross = angle_rad.cross_matrix();
    Matrix3::identity() + cross * first + cross * cross * second
}

/// One Newton step towards the nearest rotation: removes rounding, which is all that ever accumulates.
fn orthonormal(r: &Matrix3<f64>) -> Matrix3<f64> {
    r * (Matrix3::identity() * 1.5 - r.transpose() * r * 0.5)
}
