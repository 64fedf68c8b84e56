//! A start without an angle of departure: the UAV at rest knows which way is down, and yaw comes from outside.
//!
//! At rest the accelerometer shows the tilt, and its bias and the tilt's error are one: what the filter believes to be level
//! keeps the velocity at zero until the body turns. Delay and angle of arrival of a line of sight then place the UAV: p = G -
//! R u rho. The error of that attitude is the error of that place, turned about the GMT, and the covariance says so; the
//! first departures that are heard take both out together.

use super::Filter;
use super::gate::Innovation;
use super::layout::{ACCEL_BIAS, ATTITUDE, CLOCK_OFFSET, MOUNTING, POSITION, VELOCITY};
use super::measurement::{PathMeasurement, Transmitter};
use super::nominal::rotation;
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::Real;
use crate::inertial::Alignment;
use nalgebra::{Matrix3, Vector3};

/// Gyroscope and accelerometer carry an attitude on for this long, ns: the level one after rest, and the heading without a line of sight,
/// beyond which the magnetic one is better than none (docs/localization.md, "The model").
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
pub(super) const CARRIED_NS: u64 = 10_000_000_000;
/// Standard deviation of the velocity of a UAV whose places of the last second are one, m/s per axis.
/// Derived: a start's places lie within 0.25 m in up to 1.2 s (`core/src/receiver/level.rs`).
const STILL_SIGMA_M_PER_S: f64 = 0.2;
/// Part of the tilt's standard deviation that is not the accelerometer's bias, rad: how the gyroscope has carried it on.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const CARRIED_SIGMA_RAD: f64 = 2e-3;
/// Standard deviation of an angle of arrival by the arrays' calibration, rad: their states learn it only later.
/// Derived: slope and tilt of an array in the error budget, 1.7 and 1.75 mrad, in squares.
pub(super) const ARRIVAL_SIGMA_RAD: f64 = 2.5e-3;

/// Yaw of the world against the level attitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelYaw {
    /// Angle about the vertical that turns the level attitude into that of the body, rad.
    pub yaw_rad: f64,
    /// Its standard deviation, rad.
    pub sigma_rad: f64,
}

/// What rest has left to a filter that does not run yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// End of the rest, ns.
    since_ns: u64,
    /// Standard deviation of the tilt about each horizontal axis, rad.
    tilt_sigma_rad: f64,
    /// Attitude at rest, of yaw 0: where the tilt's error and the bias are one.
    attitude: Matrix3<f64>,
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Takes over the tilt, about a vertical of unknown yaw, of a body that stands still.
    pub(super) fn set_level(&mut self, rest: &Alignment) {
        if self.running || !(rest.up.iter().all(|c| c.is_finite()) && rest.tilt_sigma_rad.is_finite()) {
            return;
        }
        let Ok(attitude) = rest.attitude(0.0).to_attitude() else {
            return;
        };
        self.nominal.attitude = attitude.matrix().map(f64::from);
        self.level = Some(Level {
            since_ns: rest.time_ns,
            tilt_sigma_rad: f64::from(rest.tilt_sigma_rad),
            attitude: self.nominal.attitude,
        });
        self.renew_head();
    }

    /// The attitude now, of a yaw that is not known: for a while after rest, until the start.
    pub fn level(&self) -> Option<Matrix3<f64>> {
        self.level_of().map(|_| self.head.attitude)
    }

    fn level_of(&self) -> Option<Level> {
        let age_ns = |level: &Level| self.head.time_ns.saturating_sub(level.since_ns);
        self.level
            .filter(|level| !self.running && age_ns(level) < CARRIED_NS)
    }

    /// Starts from a line of sight and a yaw, standing still.
    pub(super) fn start_level(&mut self, gmt: &Transmitter, path: &PathMeasurement, yaw: &LevelYaw) -> bool {
        let Some(level) = self.level_of() else {
            return false;
        };
        if !(self.clock_known && yaw.yaw_rad.is_finite() && yaw.sigma_rad.is_finite()) {
            return false;
        }
        let turn = rotation(&Vector3::new(0.0, 0.0, yaw.yaw_rad));
        let attitude = turn * self.nominal.attitude;
        if !self.heading_allows(&attitude, libm::hypot(level.tilt_sigma_rad, yaw.sigma_rad)) {
            return false;
        }
        let towards = attitude * self.model.corrected(&path.aoa, &self.nominal);
        let range_m = self
            .nominal
            .delay_period
            .range_m(path.c_tau_m - self.nominal.clock_offset_m);
        self.nominal.attitude = attitude;
        self.nominal.velocity_m_per_s = Vector3::zeros();
        self.nominal.position_m = gmt.position_m - towards * range_m;
        let at_rest = Level {
            attitude: turn * level.attitude,
            ..level
        };
        self.set_level_covariance(&towards, range_m, path, &at_rest, yaw.sigma_rad);
        self.last_innovation = Some(Innovation::none(self.nominal.time_ns));
        (self.contested, self.held) = (0, 0);
        self.doubt_anew();
        self.level = None;
        self.running = true;
        true
    }

    /// The covariance of that start. The accelerometer's bias hides in the tilt, `R dba = g (th_y, -th_x, 0)`, and so does what the sensor is
    /// turned by in the body, `R m = -th` about the horizontal axes, both with the attitude `R` at rest. The place errs by
    /// `J th` with `J th = rho l x th`, along the way by the clock's error, and by what the path itself does not know.
    // Rare, and flash is short: never inlined.
    #[inline(never)]
    fn set_level_covariance(
        &mut self,
        towards: &Vector3<f64>,
        range_m: f64,
        path: &PathMeasurement,
        level: &Level,
        yaw_sigma_rad: f64,
    ) {
        for i in 0..3 {
            self.covariance.reset(POSITION + i, T::zero());
            self.covariance
                .reset(VELOCITY + i, T::of(STILL_SIGMA_M_PER_S * STILL_SIGMA_M_PER_S));
        }
        let square = |x: f64| x * x;
        let tilt = square(level.tilt_sigma_rad);
        let mounting = square(self.config.priors.mounting_rad);
        let leant = tilt + mounting + square(CARRIED_SIGMA_RAD);
        let turned = Matrix3::from_diagonal(&Vector3::new(leant, leant, square(yaw_sigma_rad)));
        self.covariance.reset_block(ATTITUDE, &turned.map(T::of));
        let bias = tilt * square(STANDARD_GRAVITY_M_PER_S2);
        self.forget_accel_bias(libm::sqrt(bias));
        // th_x = -(R dba)_y / g, th_y = (R dba)_x / g.
        let aside = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0) / STANDARD_GRAVITY_M_PER_S2;
        let with_bias = aside * level.attitude * bias;
        for i in 0..3 {
            for j in 0..3 {
                let shared = with_bias.get((i, j)).copied().unwrap_or(0.0);
                self.covariance
                    .correlate(ATTITUDE + i, ACCEL_BIAS + j, T::of(shared));
            }
        }
        for i in 0..3 {
            self.covariance.reset(MOUNTING + i, T::of(mounting));
        }
        for i in 0..2 {
            for j in 0..3 {
                let shared = -mounting * level.attitude.get((i, j)).copied().unwrap_or(0.0);
                self.covariance
                    .correlate(ATTITUDE + i, MOUNTING + j, T::of(shared));
            }
        }
        let lever = towards.cross_matrix() * range_m;
        let (l, along) = (towards, towards * towards.transpose());
        for k in 0..N {
            let with = |state: usize| self.covariance.at(state, k).to_f64();
            let angle = Vector3::new(with(ATTITUDE), with(ATTITUDE + 1), with(ATTITUDE + 2));
            let shared = lever * angle + l * with(CLOCK_OFFSET);
            if k >= VELOCITY {
                for (i, value) in shared.iter().enumerate() {
                    self.covariance.correlate(POSITION + i, k, T::of(*value));
                }
            }
        }
        let noise = self.config.radio;
        let arrival = square(path.aoa_sigma_rad) + square(noise.aoa_rad) + square(ARRIVAL_SIGMA_RAD);
        let across = (Matrix3::identity() - along) * (square(range_m) * arrival);
        let delay = square(path.c_tau_sigma_m) + square(noise.delay_m);
        let clock = self.variance(CLOCK_OFFSET);
        let place = lever * turned * lever.transpose() + along * (delay + clock) + across;
        for i in 0..3 {
            for j in 0..=i {
                let shared = place.get((i, j)).copied().unwrap_or(0.0);
                self.covariance
                    .correlate(POSITION + i, POSITION + j, T::of(shared));
            }
        }
    }
}
