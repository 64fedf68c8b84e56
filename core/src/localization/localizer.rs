//! Inertial unit, alignment and filter as one: every measurement in, the pose out.
//!
//! The order in which these parts meet is the same on a chip, in the Monte Carlo and in a test, so it stands here.

use nalgebra::Vector3;

use super::filter::{self, Filter, FilterConfig, SweepMeasurement, SweepVerdict, TimingVerdict};
use super::imu::{
    Alignment, HeadingRefusal, Imu, ImuConfig, ImuHealth, ImuStep, MagneticField, RestAlignment, RestConfig,
    RestStatus,
};
use super::{ImuSample, Pose};
use crate::geometry::Real;

/// Time between two magnetic headings, ns: their error is slow, so that more of them say no more.
const HEADING_INTERVAL_NS: u64 = 1_000_000_000;

/// What the parts need to know. The default has no magnetometer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LocalizerConfig {
    /// Inertial sensor.
    pub imu: ImuConfig,
    /// Alignment at rest.
    pub rest: RestConfig,
    /// Filter.
    pub filter: FilterConfig,
    /// The earth's magnetic field; `None` without a magnetometer.
    pub magnetic: Option<MagneticField>,
}

/// Trouble of the filter and of the inertial sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LocalizerHealth {
    /// Of the filter, as of the last sweep.
    pub filter: filter::Health,
    /// Of the inertial sensor.
    pub imu: ImuHealth,
}

impl LocalizerHealth {
    /// Whether any flag stands.
    pub fn is_degraded(&self) -> bool {
        self.filter.is_degraded() || !self.imu.is_sound()
    }
}

/// Localization of one UAV with `N` filter states; covariance in `T`.
#[derive(Clone, Debug)]
pub struct Localizer<T: Real, const N: usize> {
    imu: Imu,
    rest: RestAlignment,
    alignment: Option<Alignment>,
    filter: Filter<T, N>,
    magnetic: Option<MagneticField>,
    last_heading_ns: Option<u64>,
}

impl<T: Real, const N: usize> Localizer<T, N> {
    /// Knows nothing yet, at `time_ns` of the UAV clock.
    pub fn new(config: &LocalizerConfig, time_ns: u64) -> Self {
        Self {
            imu: Imu::new(config.imu),
            rest: RestAlignment::new(config.rest),
            alignment: None,
            filter: Filter::new(config.filter, time_ns),
            magnetic: config.magnetic,
            last_heading_ns: None,
        }
    }

    /// Takes a sample of the inertial sensor. Before the filter runs, samples at rest align it. The step that the sample
    /// completes, if any, comes back for whoever wants to look.
    pub fn sample(&mut self, sample: &ImuSample) -> Option<ImuStep> {
        if self.alignment.is_none()
            && !self.filter.is_running()
            && let RestStatus::Aligned(found) = self.rest.push(sample)
        {
            self.align(&found);
        }
        let step = self.imu.push(sample);
        if let Some(step) = &step {
            self.filter.step(step);
        }
        step
    }

    /// Takes over what rest has shown, wherever it was found.
    pub fn align(&mut self, found: &Alignment) {
        self.filter.aligned(found);
        self.imu.set_errors(self.filter.imu_errors());
        self.alignment = Some(*found);
    }

    /// Tells the time (UAV clock, ns), so that a silent inertial sensor is noticed. Every measurement does so too.
    pub fn tick(&mut self, now_ns: u64) {
        // The measured step before the silence, then the silence: no more than two.
        for _ in 0..2 {
            match self.imu.elapse(now_ns) {
                Some(step) => self.filter.step(&step),
                None => break,
            }
        }
    }

    /// Takes a two-way timing exchange: clock offset as a length, m.
    pub fn two_way(&mut self, time_ns: u64, offset_m: f64) -> TimingVerdict {
        self.tick(time_ns);
        self.filter.two_way(time_ns, offset_m)
    }

    /// Takes a sample of the magnetometer (uT, body axes). It is used at most once a second, and by the filter only without
    /// line of sight.
    ///
    /// # Errors
    /// [`HeadingRefusal`]: why no heading was made of it.
    pub fn magnetic(&mut self, time_ns: u64, field_ut: &Vector3<f32>) -> Result<(), HeadingRefusal> {
        self.tick(time_ns);
        let field = self.magnetic.ok_or(HeadingRefusal::NoField)?;
        let early = |then: u64| time_ns.saturating_sub(then) < HEADING_INTERVAL_NS;
        if self.last_heading_ns.is_some_and(early) {
            return Err(HeadingRefusal::TooSoon);
        }
        let pose = self.filter.present().ok_or(HeadingRefusal::NoAttitude)?;
        let covariance = &pose.attitude_covariance_rad2;
        let tilt_sigma = libm::sqrtf(covariance.m11.max(covariance.m22).max(0.0));
        let heading = field.heading(field_ut, &pose.attitude, tilt_sigma)?;
        self.last_heading_ns = Some(time_ns);
        let nose = pose.attitude.matrix().column(0);
        let yaw = nose.y.atan2_libm(nose.x) + heading.yaw_error_rad;
        self.filter
            .heading(time_ns, f64::from(yaw), f64::from(heading.sigma_rad));
        Ok(())
    }

    /// Moves the filter to the time stamp of a sweep that is still being worked on.
    pub fn announce_sweep(&mut self, time_ns: u64) {
        self.catch_up(time_ns);
        self.filter.advance(time_ns);
    }

    /// Takes a sweep.
    pub fn sweep(&mut self, measurement: &SweepMeasurement<'_>) -> SweepVerdict {
        self.catch_up(measurement.time_ns);
        let verdict = self.filter.sweep(measurement);
        self.imu.set_errors(self.filter.imu_errors());
        verdict
    }

    /// The pose now; `None` while starting.
    pub fn present(&self) -> Option<Pose> {
        self.filter.present()
    }

    /// Flags by the UAV clock at `now_ns`.
    pub fn health(&self, now_ns: u64) -> LocalizerHealth {
        LocalizerHealth {
            filter: self.filter.health(),
            imu: self.imu.health(now_ns),
        }
    }

    /// The filter.
    pub fn filter(&self) -> &Filter<T, N> {
        &self.filter
    }

    /// The inertial unit.
    pub fn imu(&self) -> &Imu {
        &self.imu
    }

    /// What rest has shown, if there was rest.
    pub fn alignment(&self) -> Option<&Alignment> {
        self.alignment.as_ref()
    }

    /// Gives the filter all that is known of the motion up to `time_ns`. Without the step in the making it would take the
    /// rest for a gap.
    fn catch_up(&mut self, time_ns: u64) {
        self.tick(time_ns);
        if let Some(step) = self.imu.finish_step_before(time_ns) {
            self.filter.step(&step);
        }
    }
}
