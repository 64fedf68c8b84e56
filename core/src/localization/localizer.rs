//! Inertial unit, alignment at rest, clock and pose as one: every measurement in, the pose out.
//!
//! The order in which these parts meet is the same in the receiver, on a chip that checks itself, in the Monte Carlo and in a
//! test, so it stands here. The pose is found by the error-state filter or by the paper's calibration.

use nalgebra::{Matrix3, Vector3};

use super::baseline::{Baseline, HpcConfig};
use super::filter::{
    self, Counters, Filter, FilterConfig, SweepMeasurement, SweepVerdict, TestRatios, Transmitter,
};
use super::imu::{
    Alignment, HeadingRefusal, Imu, ImuConfig, ImuHealth, ImuStep, MagneticField, RestAlignment, RestConfig,
    RestStatus,
};
use super::two_way_clock::TwoWayClock;
use super::{ImuErrors, ImuSample, Pose};
use crate::geometry::{Body, Direction, Real};

/// Time between two magnetic headings, ns: their error is slow, so that more of them say no more.
const HEADING_INTERVAL_NS: u64 = 1_000_000_000;

/// How the pose is found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put the larger one on"
)]
pub enum Method {
    /// Error-state filter.
    Filter(FilterConfig),
    /// The paper's periodic calibration.
    Hpc(HpcConfig),
}

impl Default for Method {
    fn default() -> Self {
        Self::Filter(FilterConfig::default())
    }
}

/// What the parts need to know. The default is the filter without a magnetometer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LocalizerConfig {
    /// Inertial sensor.
    pub imu: ImuConfig,
    /// Alignment at rest.
    pub rest: RestConfig,
    /// How the pose is found.
    pub method: Method,
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

/// Either way to a pose.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put the larger one on"
)]
enum Estimate<T: Real, const N: usize> {
    Filter(Filter<T, N>),
    Baseline(Baseline),
}

impl<T: Real, const N: usize> Estimate<T, N> {
    fn aligned(&mut self, found: &Alignment) {
        match self {
            Self::Filter(filter) => filter.aligned(found),
            Self::Baseline(baseline) => baseline.aligned(found),
        }
    }

    fn imu_errors(&self) -> ImuErrors {
        match self {
            Self::Filter(filter) => filter.imu_errors(),
            Self::Baseline(baseline) => baseline.imu_errors(),
        }
    }

    fn step(&mut self, step: &ImuStep) {
        match self {
            Self::Filter(filter) => filter.step(step),
            Self::Baseline(baseline) => baseline.step(step),
        }
    }
}

/// Localization of one UAV; the filter has `N` states, their covariance is in `T`.
#[derive(Clone, Debug)]
pub struct Localizer<T: Real, const N: usize> {
    imu: Imu,
    /// Until rest has shown what it can.
    rest: Option<RestAlignment>,
    alignment: Option<Alignment>,
    clock: TwoWayClock,
    estimate: Estimate<T, N>,
    magnetic: Option<MagneticField>,
    last_heading_ns: u64,
}

impl<T: Real, const N: usize> Localizer<T, N> {
    /// Knows nothing yet, at `time_ns` of the UAV clock.
    pub fn new(config: &LocalizerConfig, time_ns: u64) -> Self {
        Self {
            imu: Imu::new(config.imu),
            rest: Some(RestAlignment::new(config.rest)),
            alignment: None,
            clock: TwoWayClock::default(),
            estimate: match config.method {
                Method::Filter(config) => Estimate::Filter(Filter::new(config, time_ns)),
                Method::Hpc(config) => Estimate::Baseline(Baseline::new(config)),
            },
            magnetic: config.magnetic,
            last_heading_ns: 0,
        }
    }

    /// Takes a sample of the inertial sensor; samples at rest align it first. The step that the sample completes, if any, comes
    /// back for whoever wants to look.
    pub fn sample(&mut self, sample: &ImuSample) -> Option<ImuStep> {
        if let Some(rest) = &mut self.rest
            && let RestStatus::Aligned(found) = rest.push(sample)
        {
            self.align(&found);
        }
        let step = self.imu.push(sample);
        if let Some(step) = &step {
            self.estimate.step(step);
        }
        step
    }

    /// Takes over what rest has shown, wherever it was found. Samples are not asked for it any more.
    pub fn align(&mut self, found: &Alignment) {
        self.rest = None;
        self.alignment = Some(*found);
        self.estimate.aligned(found);
        self.imu.set_errors(self.estimate.imu_errors());
    }

    /// Tells the time (UAV clock, ns), so that a silent inertial sensor is noticed. Every measurement does so too.
    pub fn tick(&mut self, now_ns: u64) {
        // A gap of an hour ends the loop too: every step takes the sensor's time forward to now.
        while let Some(step) = self.imu.elapse(now_ns) {
            self.estimate.step(&step);
        }
    }

    /// Takes a two-way timing exchange: finite clock offset as a length, m. `false` when it contradicts those before; the filter
    /// judges and counts for itself, since it knows what the sweeps say.
    pub fn two_way(&mut self, time_ns: u64, offset_m: f64) -> bool {
        self.tick(time_ns);
        let agrees = self.clock.exchange(time_ns, offset_m);
        if let Estimate::Filter(filter) = &mut self.estimate {
            let _counted = filter.two_way(time_ns, offset_m);
        }
        agrees
    }

    /// Takes a sample of the magnetometer (uT, body axes). A start must agree with it. Its heading is used at most once a second,
    /// and by the filter only after a while without line of sight; the paper's calibration uses none.
    ///
    /// # Errors
    /// [`HeadingRefusal`]: why no heading was made of it.
    pub fn magnetic(&mut self, time_ns: u64, field_ut: &Vector3<f32>) -> Result<(), HeadingRefusal> {
        self.tick(time_ns);
        let field = self.magnetic.ok_or(HeadingRefusal::NoField)?;
        let Estimate::Filter(filter) = &mut self.estimate else {
            return Err(HeadingRefusal::NoAttitude);
        };
        filter.magnetic(time_ns, &field, field_ut);
        let pose = filter.present().ok_or(HeadingRefusal::NoAttitude)?;
        if time_ns.saturating_sub(self.last_heading_ns) < HEADING_INTERVAL_NS {
            return Err(HeadingRefusal::TooSoon);
        }
        let covariance = &pose.attitude_covariance_rad2;
        let tilt_sigma_rad = libm::sqrtf((0.5 * (covariance.m11 + covariance.m22)).max(0.0));
        let heading = field.heading(field_ut, &pose.attitude, tilt_sigma_rad)?;
        self.last_heading_ns = time_ns;
        let nose = pose.attitude.matrix().column(0);
        let yaw_rad = nose.y.atan2_libm(nose.x) + heading.yaw_error_rad;
        // The filter counts what it does not take.
        let _counted = filter.heading(time_ns, f64::from(yaw_rad), f64::from(heading.sigma_rad));
        Ok(())
    }

    /// A sweep begins: the motion up to its time stamp is taken in, and not up to the end of some step before.
    pub fn begin_sweep(&mut self, time_ns: u64) {
        self.tick(time_ns);
        if let Some(step) = self.imu.finish_step_at(time_ns) {
            self.estimate.step(&step);
        }
    }

    /// Takes the filter to the time stamp of a sweep that has begun, so that what is left to do when its paths are there are the
    /// updates. [`Self::sweep`] does so too. Nothing older can be taken in afterwards.
    pub fn advance(&mut self, time_ns: u64) {
        if let Estimate::Filter(filter) = &mut self.estimate {
            filter.advance(time_ns);
        }
    }

    /// Takes in sweep number `sweep`.
    pub fn sweep(&mut self, sweep: u32, measurement: &SweepMeasurement<'_>) -> SweepVerdict {
        let verdict = match &mut self.estimate {
            Estimate::Filter(filter) => {
                let before = filter.counters();
                let verdict = filter.sweep(measurement);
                let after = filter.counters();
                if after.clock_steps != before.clock_steps {
                    self.clock.confirm();
                } else if after.timing_refuted != before.timing_refuted {
                    self.clock.refute();
                }
                verdict
            }
            Estimate::Baseline(baseline) => baseline.sweep(&self.clock, sweep, measurement),
        };
        self.imu.set_errors(self.estimate.imu_errors());
        verdict
    }

    /// Pose at the last sweep.
    pub fn pose(&self) -> Option<Pose> {
        match &self.estimate {
            Estimate::Filter(filter) => filter.pose(),
            Estimate::Baseline(baseline) => baseline.pose(&self.clock),
        }
    }

    /// The pose now, by the newest inertial data; `None` while starting.
    pub fn present(&self) -> Option<Pose> {
        match &self.estimate {
            Estimate::Filter(filter) => filter.present(),
            Estimate::Baseline(baseline) => baseline.pose(&self.clock),
        }
    }

    /// Whether the pose has been told from an image of it.
    pub fn is_confirmed(&self) -> bool {
        self.filter().is_none_or(Filter::is_confirmed)
    }

    /// Attitude of unknown yaw, before the filter's start.
    pub fn level(&self) -> Option<Matrix3<f64>> {
        self.filter().and_then(Filter::level)
    }

    /// Clock offset by two-way timing alone (UAV less GMT), m, with all whole delay periods; `None` before the second exchange.
    pub fn two_way_offset_m(&self, time_ns: u64) -> Option<f64> {
        self.clock.offset_m(time_ns)
    }

    /// An angle of arrival without the arrays' errors, as far as they are known.
    pub fn corrected(&self, aoa: &Direction<Body>) -> Direction<Body> {
        self.filter()
            .zip(Direction::from_vector(aoa.vector().map(f64::from)).ok())
            .map(|(filter, wide)| filter.corrected_aoa(&wide).map(|c| c as f32))
            .and_then(|corrected| Direction::from_vector(corrected).ok())
            .unwrap_or(*aoa)
    }

    /// The GMT as it would be taken if it claimed this at `time_ns`.
    pub fn plausible(&self, time_ns: u64, claimed: &Transmitter) -> Transmitter {
        self.filter()
            .map_or(*claimed, |filter| filter.plausible(time_ns, claimed))
    }

    /// The GMT as it was taken at the last sweep, where it is not just as its beacon claims.
    pub fn transmitter(&self) -> Option<&Transmitter> {
        self.filter().and_then(Filter::transmitter)
    }

    /// Innovation test ratios of the filter.
    pub fn test_ratios(&self) -> Option<TestRatios> {
        self.filter().map(Filter::test_ratios)
    }

    /// What happened to the filter; nothing happens to the paper's calibration.
    pub fn counters(&self) -> Counters {
        self.filter().map(Filter::counters).unwrap_or_default()
    }

    /// Flags by the UAV clock at `now_ns`.
    pub fn health(&self, now_ns: u64) -> LocalizerHealth {
        LocalizerHealth {
            filter: self.pose_health(),
            imu: self.imu.health(now_ns),
        }
    }

    /// Flags of the pose alone, as of the last sweep.
    pub fn pose_health(&self) -> filter::Health {
        match &self.estimate {
            Estimate::Filter(filter) => filter.health(),
            Estimate::Baseline(baseline) => filter::Health {
                starting: !baseline.is_running(),
                ..filter::Health::default()
            },
        }
    }

    /// The filter, if the pose is found by one.
    pub fn filter(&self) -> Option<&Filter<T, N>> {
        match &self.estimate {
            Estimate::Filter(filter) => Some(filter),
            Estimate::Baseline(_) => None,
        }
    }

    /// The inertial unit.
    pub fn imu(&self) -> &Imu {
        &self.imu
    }

    /// What rest has shown, if there was rest.
    pub fn alignment(&self) -> Option<&Alignment> {
        self.alignment.as_ref()
    }
}
