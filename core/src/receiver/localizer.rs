//! The pose, by the filter or by the paper's calibration, behind one set of calls.

use nalgebra::{Matrix3, Vector3};

use super::clock::TwoWayClock;
use super::config::{BaselineConfig, Localization};
use crate::array::GmtFace;
use crate::estimator::baseline::{Baseline, Start};
use crate::estimator::{
    ClockEstimate, Counters, FaceDirection, Filter, Health, MappedPlane, PathMeasurement, Pose,
    SweepMeasurement, SweepVerdict, TestRatios, Transmitter,
};
use crate::geometry::{Body, Direction, Gmt, Position, Rotation, World};
use crate::inertial::{Alignment, ImuErrors, ImuStep, MagneticField, Motion, Turn};
use crate::radio::{MOST_FACES, RadioModel};
use crate::signal::DelayPeriod;

/// Nanoseconds in a second.
/// Given: a unit.
const NS: f64 = 1e-9;

/// Either way to a pose.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put the larger one on"
)]
pub(super) enum Localizer<const STATES: usize> {
    /// The filter.
    Filter(Filter<f32, STATES>),
    /// The paper's.
    Baseline(Calibrated),
}

impl<const STATES: usize> Localizer<STATES> {
    pub(super) fn new(localization: &Localization<'_>, radio: &RadioModel) -> Self {
        match localization {
            Localization::Filter(config) => Self::Filter(Filter::new(radio, *config, 0)),
            Localization::Baseline(config, _) => Self::Baseline(Calibrated::new(*config, radio)),
        }
    }

    /// Tells the filter's steps.
    #[cfg(feature = "watch")]
    pub(super) fn watch(&mut self, watch: alloc::sync::Arc<dyn crate::estimator::Watch<f32, STATES>>) {
        if let Self::Filter(filter) = self {
            filter.watch(watch);
        }
    }

    /// Takes over what rest has shown.
    pub(super) fn aligned(&mut self, alignment: &Alignment) {
        match self {
            Self::Filter(filter) => filter.aligned(alignment),
            Self::Baseline(baseline) => baseline.aligned(alignment),
        }
    }

    /// Errors of the inertial sensor to take out of its samples.
    pub(super) fn imu_errors(&self) -> ImuErrors {
        match self {
            Self::Filter(filter) => filter.imu_errors(),
            Self::Baseline(baseline) => baseline.errors,
        }
    }

    /// Moves on.
    pub(super) fn step(&mut self, step: &ImuStep) {
        match self {
            Self::Filter(filter) => filter.step(step),
            Self::Baseline(baseline) => baseline.step(step),
        }
    }

    pub(super) fn two_way(&mut self, time_ns: u64, offset_m: f64) {
        match self {
            Self::Filter(filter) => {
                // The filter counts what it does not take.
                let _counted = filter.two_way(time_ns, offset_m);
            }
            Self::Baseline(baseline) => {
                // The receiver's own clock counts the same refusals.
                let _counted = baseline.clock.exchange(time_ns, offset_m);
            }
        }
    }

    /// Takes note of the magnetic field.
    pub(super) fn magnetic(&mut self, time_ns: u64, field: &MagneticField, seen_ut: &Vector3<f32>) {
        if let Self::Filter(filter) = self {
            filter.magnetic(time_ns, field, seen_ut);
        }
    }

    /// Whether the pose has been told from an image of it.
    pub(super) fn is_confirmed(&self) -> bool {
        match self {
            Self::Filter(filter) => filter.is_confirmed(),
            Self::Baseline(_) => true,
        }
    }

    /// Pose that is expected at a time not before the last sweep.
    pub(super) fn expected(&self) -> Option<Pose> {
        match self {
            Self::Filter(filter) => filter.present(),
            Self::Baseline(baseline) => baseline.pose(),
        }
    }

    /// UAV clock less GMT clock as the filter has it, m, beside whole delay periods.
    pub(super) fn clock_offset_m(&self, time_ns: u64) -> Option<f64> {
        match self {
            Self::Filter(filter) => filter.clock_offset_m(time_ns),
            Self::Baseline(_) => None,
        }
    }

    /// An angle of arrival without the arrays' errors, as far as they are known.
    pub(super) fn corrected(&self, aoa: &Direction<Body>) -> Direction<Body> {
        match self {
            Self::Filter(filter) => filter.corrected_aoa(aoa),
            Self::Baseline(_) => *aoa,
        }
    }

    /// Takes in a sweep.
    pub(super) fn sweep(&mut self, sweep: u32, measurement: &SweepMeasurement<'_>) -> SweepVerdict {
        match self {
            Self::Filter(filter) => filter.sweep(measurement),
            Self::Baseline(baseline) => baseline.sweep(sweep, measurement),
        }
    }

    /// The GMT as it would be taken if it claimed this.
    pub(super) fn plausible(&self, time_ns: u64, claimed: &Transmitter) -> Transmitter {
        match self {
            Self::Filter(filter) => filter.plausible(time_ns, claimed),
            Self::Baseline(_) => *claimed,
        }
    }

    /// The GMT as it was taken at the last sweep, where it is not just as its beacon claims.
    pub(super) fn transmitter(&self) -> Option<&Transmitter> {
        match self {
            Self::Filter(filter) => filter.transmitter(),
            Self::Baseline(_) => None,
        }
    }

    /// Pose that is predicted for the sweep in hand. Nothing older can be taken in afterwards.
    pub(super) fn predict_to(&mut self, time_ns: u64) -> Option<Pose> {
        match self {
            Self::Filter(filter) => {
                filter.advance(time_ns);
                filter.pose()
            }
            Self::Baseline(baseline) => baseline.pose(),
        }
    }

    /// Surfaces that correct the pose and are corrected with it.
    pub(super) fn planes(&self) -> impl Iterator<Item = &MappedPlane> {
        let filter = match self {
            Self::Filter(filter) => Some(filter),
            Self::Baseline(_) => None,
        };
        filter.into_iter().flat_map(Filter::planes)
    }

    /// Lets them go.
    pub(super) fn release_planes(&mut self) {
        if let Self::Filter(filter) = self {
            filter.release_planes();
        }
    }

    /// Pose at the last sweep.
    pub(super) fn pose(&self) -> Option<Pose> {
        match self {
            Self::Filter(filter) => filter.pose(),
            Self::Baseline(baseline) => baseline.pose(),
        }
    }

    /// Innovation test ratios of the filter.
    pub(super) fn test_ratios(&self) -> Option<TestRatios> {
        match self {
            Self::Filter(filter) => Some(filter.test_ratios()),
            Self::Baseline(_) => None,
        }
    }

    /// What happened to the filter; nothing happens to HPC.
    pub(super) fn counters(&self) -> Counters {
        match self {
            Self::Filter(filter) => filter.counters(),
            Self::Baseline(_) => Counters::default(),
        }
    }

    pub(super) fn health(&self) -> Health {
        match self {
            Self::Filter(filter) => filter.health(),
            Self::Baseline(baseline) => Health {
                starting: baseline.baseline.is_none(),
                ..Health::default()
            },
        }
    }
}

/// The paper's calibration with what it leaves open: where the attitude comes from and what the clock shows. The gyroscope
/// turns the attitude found at rest, its yaw is set by the first line of sight; the clock is that of the last two
/// two-way exchanges.
#[derive(Clone, Debug)]
pub(super) struct Calibrated {
    config: BaselineConfig,
    faces: heapless::Vec<GmtFace<f64>, MOST_FACES>,
    delay_period: DelayPeriod,
    errors: ImuErrors,
    /// Attitude since rest, of unknown yaw, until the first fix.
    waiting: Option<Turn<f64>>,
    baseline: Option<Baseline>,
    clock: TwoWayClock,
}

impl Calibrated {
    fn new(config: BaselineConfig, radio: &RadioModel) -> Self {
        Self {
            config,
            faces: radio.faces.clone(),
            delay_period: radio.waveform.delay_period(),
            errors: ImuErrors::default(),
            waiting: None,
            baseline: None,
            clock: TwoWayClock::default(),
        }
    }

    fn aligned(&mut self, alignment: &Alignment) {
        if self.baseline.is_none() {
            self.errors.gyro_bias_rad_per_s = alignment.gyro_bias_rad_per_s;
            self.waiting = Some(alignment.attitude(0.0));
        }
    }

    /// A step that was not measured is left out: the next one is coasted to.
    fn step(&mut self, step: &ImuStep) {
        if step.motion == Motion::Coasting {
            return;
        }
        if let Some(baseline) = &mut self.baseline {
            // A step that is out of order or not finite changes nothing.
            let _unchanged = baseline.step(&step.increment, None);
        } else if let Some(attitude) = &mut self.waiting {
            let turn = Turn::from_rotation_vector(&step.increment.delta_angle_rad.map(f64::from));
            *attitude = attitude.then(&turn).renormalised();
        }
    }

    /// Where the line of sight says that the UAV was.
    fn fix(&self, measurement: &SweepMeasurement<'_>, path: &PathMeasurement) -> Option<Fix> {
        let offset_m = self.clock.offset_m(measurement.time_ns)?;
        let departure = path.departure?;
        let left = *left(&self.faces, &departure, &measurement.gmt)?.vector();
        let range_m = self.delay_period.range_m(path.c_tau_m - offset_m);
        Some(Fix {
            position_m: measurement.gmt.position_m + left * range_m,
            towards_gmt: -left,
        })
    }

    fn sweep(&mut self, sweep: u32, measurement: &SweepMeasurement<'_>) -> SweepVerdict {
        let Some(path) = &measurement.line_of_sight else {
            return SweepVerdict::NoSight;
        };
        let Some(fix) = self.fix(measurement, path) else {
            return SweepVerdict::Waiting;
        };
        let Some(baseline) = &mut self.baseline else {
            return self.start(measurement.time_ns, &fix, path);
        };
        if !baseline.fix_due(sweep) {
            return SweepVerdict::NoSight;
        }
        // The inertial sum has gone on since the sweep began.
        let since_s = baseline.time_ns().saturating_sub(measurement.time_ns) as f64 * NS;
        let now = fix.position_m + baseline.velocity_m_per_s() * since_s;
        match Position::from_vector(now) {
            Ok(position) => {
                baseline.fix(position);
                SweepVerdict::Accepted
            }
            Err(_) => SweepVerdict::Rejected,
        }
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
        self.baseline = Some(Baseline::new(
            self.config.mode,
            self.config.interval_sweeps,
            start,
        ));
        SweepVerdict::Started
    }

    fn pose(&self) -> Option<Pose> {
        let baseline = self.baseline.as_ref()?;
        let square = |x: f32| x * x;
        let narrow = baseline.attitude().matrix().map(|c| c as f32);
        Some(Pose {
            time_ns: baseline.time_ns(),
            position: Position::from_vector(baseline.position_m()).ok()?,
            velocity_m_per_s: baseline.velocity_m_per_s().map(|c| c as f32),
            attitude: Rotation::<Body, World>::from_matrix(narrow).ok()?,
            clock: ClockEstimate {
                offset_m: self.delay_period.wrap_m(self.clock.offset_m(baseline.time_ns())?),
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
}

/// Direction in which a path left, by the face that measured it.
pub(super) fn left(
    faces: &[GmtFace<f64>],
    departure: &FaceDirection,
    gmt: &Transmitter,
) -> Option<Direction<World, f64>> {
    let face = faces.get(departure.face)?;
    let [x, z] = departure.cosines;
    let ahead = libm::sqrt((1.0 - x * x - z * z).max(0.0));
    let up = face.normal.cross(&face.tangent);
    let left: Direction<Gmt, f64> =
        Direction::from_vector(face.normal * ahead + face.tangent * x + up * z).ok()?;
    Some(gmt.attitude.apply(left))
}

/// A position fix.
#[derive(Clone, Copy, Debug)]
struct Fix {
    position_m: Vector3<f64>,
    /// Direction from the UAV to the GMT, world axes.
    towards_gmt: Vector3<f64>,
}
