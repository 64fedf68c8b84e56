//! The motion of a quadrotor along a curve: attitude, body rates and specific force in closed form.
//!
//! A quadrotor is differentially flat: its position and heading over time determine all else. The thrust points along
//! body z and balances acceleration, gravity and linear rotor drag, so z_b is along f = a + g e_z + d v, with v through the air; the heading
//! turns the frame about it. Rates follow from the derivative of the same expressions, never from differences, so an
//! ideal IMU integrates back to the curve to round-off of its own integration.

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector1, Vector3};

use super::Spline;
use super::wind::Wind;
use crate::scene::Placement;

/// True state of the UAV at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Position of the array centre in the world frame, m.
    pub position_m: Vector3<f64>,
    /// Velocity in the world frame, m/s.
    pub velocity_m_per_s: Vector3<f64>,
    /// Acceleration in the world frame, m/s^2.
    pub acceleration_m_per_s2: Vector3<f64>,
    /// Attitude R_wb: turns body vectors into world vectors.
    pub attitude: Rotation3<f64>,
    /// Angular rate of the body against the world, in body axes, rad/s: what an ideal gyroscope senses.
    pub rate_rad_per_s: Vector3<f64>,
    /// Derivative of that rate, in body axes, rad/s^2.
    pub angular_acceleration_rad_per_s2: Vector3<f64>,
    /// Acceleration less gravity, in body axes, m/s^2: what an ideal accelerometer senses.
    pub specific_force_m_per_s2: Vector3<f64>,
}

impl Motion {
    /// Attitude as a Hamilton quaternion [w, x, y, z] with w >= 0.
    pub fn quaternion_wb(&self) -> [f64; 4] {
        let q: Quaternion<f64> = UnitQuaternion::from_rotation_matrix(&self.attitude).into_inner();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        [sign * q.w, sign * q.i, sign * q.j, sign * q.k]
    }

    /// Angle between body z and the vertical, rad.
    pub fn tilt_rad(&self) -> f64 {
        let up = self.attitude.matrix().column(2).into_owned();
        libm::atan2(libm::hypot(up.x, up.y), up.z)
    }
}

/// A curve of position and one of heading, flown by a quadrotor.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    position_m: Spline<3>,
    heading_rad: Spline<1>,
    drag_per_s: f64,
    wind: Option<Wind>,
}

impl Trajectory {
    /// A flight along `position_m` with heading `heading_rad` (of body x, about z, from east). `drag_per_s` is the
    /// linear rotor drag: force over mass and speed.
    ///
    /// The curve must stay away from free fall (a = -g e_z), where a quadrotor's attitude is not defined.
    pub fn new(position_m: Spline<3>, heading_rad: Spline<1>, drag_per_s: f64) -> Self {
        Self {
            position_m,
            heading_rad,
            drag_per_s,
            wind: None,
        }
    }

    /// The same flight in wind.
    #[must_use]
    pub(super) fn in_wind(self, wind: Wind) -> Self {
        Self {
            wind: Some(wind),
            ..self
        }
    }

    /// The same way with another heading.
    #[must_use]
    pub(super) fn with_heading(self, heading_rad: Spline<1>) -> Self {
        Self { heading_rad, ..self }
    }

    /// The same flight turned and moved as a whole, its wind with it.
    #[must_use]
    pub(super) fn placed(self, placement: &Placement) -> Self {
        let heading = Vector1::new(placement.turned_rad());
        Self {
            position_m: self.position_m.with_control(|p| placement.place(p)),
            heading_rad: self.heading_rad.with_control(|h| h + heading),
            wind: self.wind.map(|wind| wind.turned(&placement.rotation())),
            ..self
        }
    }

    /// Level rest at a place for `duration_s`, heading east.
    pub fn at_rest(position_m: Vector3<f64>, duration_s: f64) -> Self {
        let knot_s = duration_s.max(1.0);
        Self::new(
            Spline::constant(position_m, knot_s),
            Spline::constant(Vector1::zeros(), knot_s),
            0.0,
        )
    }

    /// The position curve that was planned; wind blows the UAV off it.
    pub fn position_m(&self) -> &Spline<3> {
        &self.position_m
    }

    /// End of the flight, s.
    pub fn duration_s(&self) -> f64 {
        self.position_m.duration_s().min(self.heading_rad.duration_s())
    }

    /// True position at `time_s`, m.
    pub fn place_m(&self, time_s: f64) -> Vector3<f64> {
        let planned = self.position_m.at(time_s)[0];
        match &self.wind {
            None => planned,
            Some(wind) => planned + wind.excursion_m.at(time_s)[0],
        }
    }

    /// Velocity of the air around the UAV, m/s, world frame; zero in calm.
    pub fn air_m_per_s(&self, time_s: f64) -> Vector3<f64> {
        self.wind
            .as_ref()
            .map_or_else(Vector3::zeros, |wind| wind.air_m_per_s.at(time_s)[0])
    }

    /// True state at `time_s`, which is clamped to the flight.
    pub fn at(&self, time_s: f64) -> Motion {
        let mut curve = self.position_m.at(time_s);
        // Velocity through the air, and its derivatives.
        let mut airspeed = [curve[1], curve[2], curve[3]];
        if let Some(wind) = &self.wind {
            let (excursion, air) = (wind.excursion_m.at(time_s), wind.air_m_per_s.at(time_s));
            curve = core::array::from_fn(|order| curve[order] + excursion[order]);
            airspeed = core::array::from_fn(|order| curve[order + 1] - air[order]);
        }
        let [position, velocity, acceleration, jerk, snap] = curve;
        let [heading, heading_rate, heading_acceleration, ..] = self.heading_rad.at(time_s).map(|v| v.x);
        let thrust = acceleration + Vector3::z() * STANDARD_GRAVITY_M_PER_S2 + airspeed[0] * self.drag_per_s;
        let thrust_rate = jerk + airspeed[1] * self.drag_per_s;
        let thrust_acceleration = snap + airspeed[2] * self.drag_per_s;
        // Each axis with its first and second derivative.
        let [z, z1, z2] = unit([thrust, thrust_rate, thrust_acceleration]);
        let (sin, cos) = libm::sincos(heading);
        let forward = Vector3::new(cos, sin, 0.0);
        let across = Vector3::new(-sin, cos, 0.0);
        let forward1 = across * heading_rate;
        let forward2 = across * heading_acceleration - forward * (heading_rate * heading_rate);
        let [y, y1, y2] = unit([
            z.cross(&forward),
            z1.cross(&forward) + z.cross(&forward1),
            z2.cross(&forward) + z1.cross(&forward1) * 2.0 + z.cross(&forward2),
        ]);
        let (x, x1) = (y.cross(&z), y1.cross(&z) + y.cross(&z1));
        let x2 = y2.cross(&z) + y1.cross(&z1) * 2.0 + y.cross(&z2);
        let attitude = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
        Motion {
            position_m: position,
            velocity_m_per_s: velocity,
            acceleration_m_per_s2: acceleration,
            attitude,
            // R^T dR/dt = [rate]x, element by element.
            rate_rad_per_s: Vector3::new(z.dot(&y1), x.dot(&z1), y.dot(&x1)),
            angular_acceleration_rad_per_s2: Vector3::new(
                z1.dot(&y1) + z.dot(&y2),
                x1.dot(&z1) + x.dot(&z2),
                y1.dot(&x1) + y.dot(&x2),
            ),
            specific_force_m_per_s2: attitude
                .matrix()
                .tr_mul(&(acceleration + Vector3::z() * STANDARD_GRAVITY_M_PER_S2)),
        }
    }

    /// Mean angular rate and mean specific force over an interval, in body axes: what the decimating filter of an IMU
    /// gives for its sample at `end_s`. Two-point Gauss quadrature: at 1 kHz its error is far below a nano-g.
    pub fn inertial_mean(&self, start_s: f64, end_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        const NODE: f64 = 0.577_350_269_189_625_8; // 1 / sqrt 3
        let (middle, half) = ((start_s + end_s) * 0.5, (end_s - start_s) * 0.5);
        let (early, late) = (self.at(middle - half * NODE), self.at(middle + half * NODE));
        (
            (early.rate_rad_per_s + late.rate_rad_per_s) * 0.5,
            (early.specific_force_m_per_s2 + late.specific_force_m_per_s2) * 0.5,
        )
    }
}

/// Unit vector of a vector, with its first and second derivative, from those of the vector.
fn unit([v, v1, v2]: [Vector3<f64>; 3]) -> [Vector3<f64>; 3] {
    let length = v.norm();
    let u = v / length;
    let u1 = (v1 - u * u.dot(&v1)) / length;
    let length1 = u.dot(&v1);
    let length2 = u.dot(&v2) + u1.dot(&v1);
    [u, u1, (v2 - u1 * (2.0 * length1) - u * length2) / length]
}

#[cfg(test)]
mod tests {
    use super::super::wind::{Exposure, WindConfig};
    use super::*;

    /// A brisk flight of 60 s: speeds to 8 m/s, accelerations to 5 m/s^2, turning all the way.
    fn brisk() -> Trajectory {
        let times = || (0..160).map(|k| f64::from(k) * 0.4);
        let position = times().map(|t| {
            Vector3::new(
                9.0 * libm::sin(0.7 * t) + 2.0 * libm::sin(1.1 * t),
                8.0 * libm::cos(0.5 * t),
                8.0 + 3.0 * libm::sin(0.31 * t),
            )
        });
        let heading = times().map(|t| Vector1::new(0.6 * t + libm::sin(0.4 * t)));
        let make = "more than six control points";
        Trajectory::new(
            Spline::new(position.collect(), 0.4).expect(make),
            Spline::new(heading.collect(), 0.4).expect(make),
            0.15,
        )
    }

    /// The same in wind.
    fn blown() -> Trajectory {
        let exposure = Exposure {
            height_m: 9.0,
            drag_per_s: 0.15,
            clearance_m: 3.0,
            duration_s: 65.0,
        };
        brisk().in_wind(Wind::new(&WindConfig::real(), exposure, |_| 1.0, 3).expect("not calm"))
    }

    #[test]
    fn in_wind_thrust_balances_the_drag_of_the_air() {
        let (flight, calm) = (blown(), brisk());
        let wind = flight.wind.clone().expect("not calm");
        let mut leaned = 0.0f64;
        for k in 0..300 {
            let time_s = f64::from(k) * 0.2;
            let (here, planned) = (flight.at(time_s), calm.at(time_s));
            let air = wind.air_m_per_s.at(time_s)[0];
            let drag = here.attitude.inverse() * ((here.velocity_m_per_s - air) * 0.15);
            let thrust = here.specific_force_m_per_s2 + drag;
            assert!(thrust.xy().norm() < 1e-12 && thrust.z > 4.0);
            assert_eq!(here.position_m, flight.place_m(time_s));
            assert!((here.position_m - planned.position_m).norm() < 1.5);
            leaned = leaned.max(here.attitude.angle_to(&planned.attitude).to_degrees());
        }
        assert!((3.0..15.0).contains(&leaned), "{leaned} deg");
    }

    #[test]
    fn rates_are_the_derivative_of_the_attitude() {
        for flight in [brisk(), blown()] {
            check_rates(&flight);
        }
    }

    fn check_rates(flight: &Trajectory) {
        let h = 1e-5;
        for k in 1..300 {
            // Between knots: at one, the derivative of what is compared jumps.
            let t = f64::from(k) * 0.2 + 0.0123;
            let (before, here, after) = (flight.at(t - h), flight.at(t), flight.at(t + h));
            // Skew part of the small turn: its angle by an arc cosine would lose half the digits.
            let turn = (before.attitude.inverse() * after.attitude).into_inner();
            let skew = (turn - turn.transpose()) * 0.5;
            let numeric = Vector3::new(skew.m32, skew.m13, skew.m21) / (2.0 * h);
            assert!((numeric - here.rate_rad_per_s).norm() < 1e-7, "at {t}");
            let numeric = (after.rate_rad_per_s - before.rate_rad_per_s) / (2.0 * h);
            let closed = here.angular_acceleration_rad_per_s2;
            assert!((numeric - closed).norm() < 1e-6, "{numeric} at {t}");
            let r = here.attitude.matrix();
            assert!((r.transpose() * r - Matrix3::identity()).norm() < 1e-14 && r.determinant() > 0.0);
        }
    }

    #[test]
    fn thrust_along_body_z_balances_gravity_acceleration_and_drag() {
        let flight = brisk();
        for k in 0..300 {
            let here = flight.at(f64::from(k) * 0.2);
            let drag = here.attitude.inverse() * (here.velocity_m_per_s * 0.15);
            let thrust = here.specific_force_m_per_s2 + drag;
            assert!(thrust.xy().norm() < 1e-12 && thrust.z > 4.0);
        }
        // The nose points along the heading: body y stays horizontal across it.
        let here = flight.at(17.0);
        let heading = flight.heading_rad.at(17.0)[0].x;
        let forward = Vector3::new(libm::cos(heading), libm::sin(heading), 0.0);
        assert!((here.attitude.inverse() * forward).y.abs() < 1e-14);
        assert!((here.attitude.inverse() * forward).x > 0.5);
    }

    #[test]
    fn an_ideal_imu_at_1_khz_integrates_back_to_the_curve() {
        for flight in [brisk(), blown()] {
            check_integration(&flight);
        }
    }

    fn check_integration(flight: &Trajectory) {
        let start = flight.at(0.0);
        let mut attitude = UnitQuaternion::from_rotation_matrix(&start.attitude);
        let (mut position, mut velocity) = (start.position_m, start.velocity_m_per_s);
        let (dt, gravity) = (1e-3, Vector3::new(0.0, 0.0, -STANDARD_GRAVITY_M_PER_S2));
        let (mut worst_m, mut worst_rad) = (0.0f64, 0.0f64);
        let (mut last_turn, mut last_push) = (Vector3::zeros(), Vector3::zeros());
        for k in 0..60_000u32 {
            let t = f64::from(k) * dt;
            let (rate, force) = flight.inertial_mean(t, t + dt);
            let (turn, push) = (rate * dt, force * dt);
            // Rotation, sculling and coning of one sample with the one before it (Savage's second-order form).
            let sculling = (last_turn.cross(&push) + last_push.cross(&turn)) / 12.0;
            let coning = last_turn.cross(&turn) / 12.0;
            (last_turn, last_push) = (turn, push);
            let push = attitude * (push + turn.cross(&push) * 0.5 + sculling) + gravity * dt;
            position += (velocity + push * 0.5) * dt;
            velocity += push;
            attitude *= UnitQuaternion::from_scaled_axis(turn + coning);
            let truth = flight.at(t + dt);
            worst_m = worst_m.max((truth.position_m - position).norm());
            worst_rad =
                worst_rad.max(UnitQuaternion::from_rotation_matrix(&truth.attitude).angle_to(&attitude));
        }
        // Measured 0.21 mm: gravity seen through the 1e-8 rad that third-order coning, left out above, costs in 60 s.
        assert!(worst_m < 5e-4, "position leaves the curve by {worst_m} m");
        assert!(worst_rad < 1e-7, "attitude leaves the curve by {worst_rad} rad");
    }
}
