//! The paper's calibration (HPC) with what the paper leaves open: where the attitude comes from and what the clock shows.
//!
//! The gyroscope turns the attitude found at rest, its yaw is set by the first line of sight; the clock is that of the last two
//! two-way exchanges.

use core::num::NonZeroU32;

use nalgebra::{Matrix3, Vector3};

use super::filter::{PathMeasurement, SweepMeasurement, SweepVerdict, range_of_delay_m, wrap_delay_m};
use super::hpc::{Hpc, Mode, Start};
use super::imu::{Alignment, ImuStep, Motion, Turn};
use super::two_way_clock::TwoWayClock;
use super::{ClockEstimate, ImuErrors, Pose};
use crate::array::GmtArrays;
use crate::geometry::{Body, Position, Rotation, World};

/// Nanoseconds in a second.
const NS: f64 = 1e-9;

/// Figures of the paper's localization.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HpcConfig {
    /// Where the velocity between fixes comes from.
    pub mode: Mode,
    /// Sweeps between fixes: the paper's T_c.
    pub interval_sweeps: NonZeroU32,
    /// Standard deviation that is claimed for its position, m per axis: HPC has none of its own, the gates need one.
    pub position_sigma_m: f32,
    /// The same of its attitude, rad per axis.
    pub attitude_sigma_rad: f32,
}

impl Default for HpcConfig {
    /// A fix every second sweep (docs/signal-model.md, "Default configuration"); 0.3 m and 0.5 degrees.
    fn default() -> Self {
        Self {
            mode: Mode::default(),
            interval_sweeps: NonZeroU32::new(2).unwrap_or(NonZeroU32::MIN),
            position_sigma_m: 0.3,
            attitude_sigma_rad: 0.009,
        }
    }
}

/// A position fix.
#[derive(Clone, Copy, Debug)]
struct Fix {
    position_m: Vector3<f64>,
    /// Direction from the UAV to the GMT, world axes.
    towards_gmt: Vector3<f64>,
}

/// HPC from the rest on.
#[derive(Clone, Debug)]
pub(super) struct Baseline {
    config: HpcConfig,
    faces: GmtArrays<f64>,
    errors: ImuErrors,
    /// Attitude since rest, of unknown yaw, until the first fix.
    waiting: Option<Turn<f64>>,
    hpc: Option<Hpc>,
}

impl Baseline {
    pub(super) fn new(config: HpcConfig) -> Self {
        Self {
            config,
            faces: GmtArrays::default(),
            errors: ImuErrors::default(),
            waiting: None,
            hpc: None,
        }
    }

    /// Whether there has been a first fix.
    pub(super) fn is_running(&self) -> bool {
        self.hpc.is_some()
    }

    /// Takes over what rest has shown.
    pub(super) fn aligned(&mut self, alignment: &Alignment) {
        if self.hpc.is_none() {
            self.errors.gyro_bias_rad_per_s = alignment.gyro_bias_rad_per_s;
            self.waiting = Some(alignment.attitude(0.0));
        }
    }

    /// Errors of the inertial sensor to take out of its samples.
    pub(super) fn imu_errors(&self) -> ImuErrors {
        self.errors
    }

    /// Moves on. A step that was not measured is left out: the next one is coasted to.
    pub(super) fn step(&mut self, step: &ImuStep) {
        if step.motion == Motion::Coasting {
            return;
        }
        if let Some(hpc) = &mut self.hpc {
            // A step that is out of order or not finite changes nothing.
            let _unchanged = hpc.step(&step.increment, None);
        } else if let Some(attitude) = &mut self.waiting {
            let turn = Turn::from_rotation_vector(&step.increment.delta_angle_rad.map(f64::from));
            *attitude = attitude.then(&turn).renormalised();
        }
    }

    /// Takes in sweep number `sweep`.
    pub(super) fn sweep(
        &mut self,
        clock: &TwoWayClock,
        sweep: u32,
        measurement: &SweepMeasurement<'_>,
    ) -> SweepVerdict {
        let Some(path) = &measurement.line_of_sight else {
            return SweepVerdict::NoSight;
        };
        let Some(fix) = self.fix(clock, measurement, path) else {
            return SweepVerdict::Waiting;
        };
        let Some(hpc) = &mut self.hpc else {
            return self.start(measurement.time_ns, &fix, path);
        };
        if !hpc.fix_due(sweep) {
            return SweepVerdict::NoSight;
        }
        // The inertial sum has gone on since the sweep began.
        let since_s = hpc.time_ns().saturating_sub(measurement.time_ns) as f64 * NS;
        let now = fix.position_m + hpc.velocity_m_per_s() * since_s;
        match Position::from_vector(now) {
            Ok(position) => {
                hpc.fix(position);
                SweepVerdict::Accepted
            }
            Err(_) => SweepVerdict::Rejected,
        }
    }

    /// The pose at the end of the last inertial step.
    pub(super) fn pose(&self, clock: &TwoWayClock) -> Option<Pose> {
        let hpc = self.hpc.as_ref()?;
        let square = |x: f32| x * x;
        let narrow = hpc.attitude().matrix().map(|c| c as f32);
        Some(Pose {
            time_ns: hpc.time_ns(),
            position: Position::from_vector(hpc.position_m()).ok()?,
            velocity_m_per_s: hpc.velocity_m_per_s().map(|c| c as f32),
            attitude: Rotation::<Body, World>::from_matrix(narrow).ok()?,
            clock: ClockEstimate {
                offset_m: wrap_delay_m(clock.offset_m(hpc.time_ns())?),
                offset_sigma_m: 0.0,
                drift_m_per_s: 0.0,
                drift_sigma_m_per_s: 0.0,
            },
            position_covariance_m2: Matrix3::identity() * square(self.config.position_sigma_m),
            velocity_covariance_m2_per_s2: Matrix3::zeros(),
            attitude_covariance_rad2: Matrix3::identity() * square(self.config.attitude_sigma_rad),
            position_attitude_covariance_m_rad: Matrix3::zeros(),
            resets: 0,
        })
    }

    /// Where the line of sight says that the UAV was.
    fn fix(
        &self,
        clock: &TwoWayClock,
        measurement: &SweepMeasurement<'_>,
        path: &PathMeasurement,
    ) -> Option<Fix> {
        let offset_m = clock.offset_m(measurement.time_ns)?;
        let gmt = &measurement.gmt;
        let left = *path.departure?.in_world(&self.faces, &gmt.attitude)?.vector();
        let range_m = range_of_delay_m(path.c_tau_m - offset_m);
        Some(Fix {
            position_m: gmt.position_m + left * range_m,
            towards_gmt: -left,
        })
    }

    /// First fix: yaw turns the level attitude so that the line of sight comes from where the GMT is.
    fn start(&mut self, time_ns: u64, fix: &Fix, path: &PathMeasurement) -> SweepVerdict {
        let Some(level) = self.waiting else {
            return SweepVerdict::Waiting;
        };
        let seen = level.apply(path.aoa.vector());
        let yaw_rad = libm::atan2(fix.towards_gmt.y, fix.towards_gmt.x) - libm::atan2(seen.y, seen.x);
        let turned = Turn::from_rotation_vector(&Vector3::new(0.0, 0.0, yaw_rad)).then(&level);
        let (Ok(attitude), Ok(position)) = (turned.to_attitude(), Position::from_vector(fix.position_m))
        else {
            return SweepVerdict::Rejected;
        };
        let start = Start {
            time_ns,
            position,
            velocity_m_per_s: Vector3::zeros(),
            attitude,
        };
        self.hpc = Some(Hpc::new(self.config.mode, self.config.interval_sweeps, start));
        SweepVerdict::Started
    }
}
