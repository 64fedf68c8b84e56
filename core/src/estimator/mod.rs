//! Error-state Kalman filter: position, velocity, attitude, sensor biases, clock, and the calibration that decides the
//! result (docs/localization.md).
//!
//! The state lives at a horizon a little in the past: the time of the last sweep. Inertial increments newer than that
//! wait in a history; a measurement takes the horizon to its own time stamp, however late its processing ended, and the
//! present is the horizon carried forward over the history. So delay costs nothing but memory.
//!
//! ```text
//! increments --> history ......... head (present pose)
//!                   |
//!                horizon (state, covariance) <-- sweeps, two-way timing, at their time stamps
//! ```
//!
//! A sweep's path is taken in whole or not at all (`gate`). A filter that contradicts several sweeps in a row which
//! agree among each other is fixed anew from these (`window`), which is also how it starts.
//!
//! Not modelled: g-sensitivity of the gyroscope, accelerometer scale (it brings nothing), a wrong heading
//! of the GMT's mast (unobservable without a map of known heading).
//!
//! ```text
//! r = z - h(x),  S = H P H' + R,  K = P H' / S,  dx = K r,  P <- (I - K H) P (I - K H)' + K R K'
//! ```
//!
//! # Example
//! What every measurement ends as: a row that corrects all states at once. Here the first state, of variance 4, is measured with
//! variance 1, and is 2 above what was expected.
//! ```
//! use cslam_core::estimator::{Covariance, Row, states};
//!
//! let mut covariance: Covariance<f64, { states(0) }> = Covariance::zero();
//! covariance.reset(0, 4.0);
//! covariance.reset(1, 1.0);
//! let mut row = Row::new(2.0, 1.0);
//! row.push(0, 1.0);
//! let gain = covariance.update(&row).expect("a positive variance");
//! assert!((gain[0] * row.residual - 1.6).abs() < 1e-12 && gain[1] == 0.0); // 4 / (4 + 1) of the residual
//! assert!((covariance.at(0, 0) - 0.8).abs() < 1e-12);
//! ```

mod ahead;
pub mod baseline;
mod beacon;
mod check;
mod claim;
mod clock;
mod config;
mod contrary;
mod covariance;
mod delta_range;
mod face_direction;
mod gate;
mod health;
mod layout;
mod measurement;
mod nominal;
mod pose;
mod predict;
mod range_rate;
mod reflection;
mod row;
mod scalar;
mod start;
mod start_covariance;
mod sweep;
mod sweep_measurement;
mod tilt;
mod timing;
mod watch;
mod window;

pub(crate) use beacon::GMT_PACE_M_PER_S;
pub use beacon::{BeaconLimits, BeaconMonitor, BeaconVerdict, Setup};
pub use config::{FilterConfig, Gates, Priors, ProcessNoise, RadioNoise};
pub use covariance::{Covariance, Transition};
pub use face_direction::FaceDirection;
pub use health::{Counters, Health, TestRatios};
pub use layout::{
    ACCEL_BIAS, ARRAY_AXIS, ARRAY_SLOPE, ATTITUDE, CLOCK_DRIFT, CLOCK_OFFSET, CLOCK_RAMP, FACE_BIAS,
    GYRO_BIAS, GYRO_MATRIX, MOUNTING, PLANES, POSITION, TWO_WAY_BIAS, VELOCITY, planes, states,
};
pub use measurement::{Bounces, MappedPlane, Model, PathMeasurement, ReflectedPath, Transmitter};
pub use nominal::Nominal;
pub use pose::{ClockEstimate, Pose};
pub use row::{ROW_CAPACITY, Row};
pub use scalar::TimingVerdict;
pub use sweep_measurement::{SweepMeasurement, SweepVerdict};
#[cfg(feature = "watch")]
pub use watch::{Step, Watch};

use self::contrary::{Doubt, Magnetic};
use self::delta_range::Lengths;
use self::gate::Innovation;
use self::scalar::Exchange;
use self::tilt::RestTilt;
use self::timing::Suspect;
use self::window::Window;
use crate::geometry::{Body, Direction, Position, Real, Rotation};
use crate::inertial::{Alignment, ImuErrors, ImuStep};
use crate::numeric::elapsed_s;
use crate::radio::RadioModel;
use nalgebra::{Matrix3, Vector3};

/// Increments that may wait for a late measurement.
/// Capacity: 0.64 s at 100 Hz, 1.28 s at 50 Hz.
pub const HISTORY: usize = 64;
/// Most planes in a filter's state.
/// Capacity: memory of the covariance.
pub const MAX_PLANES: usize = 4;

/// A filter without planes.
pub type Filter49 = Filter<f32, { states(0) }>;
/// The default: four mapped planes at a time.
pub type Filter61 = Filter<f32, { states(MAX_PLANES) }>;

#[cfg(test)]
mod tests;

/// A plane in the state, and when it was last of use.
#[derive(Clone, Copy, Debug)]
struct Slot {
    plane: MappedPlane,
    used_ns: u64,
}

/// Error-state filter of `N` states (49, and three for each plane that is held at a time), its covariance in `T`.
#[derive(Clone, Debug)]
pub struct Filter<T: Real, const N: usize> {
    config: FilterConfig,
    model: Model,
    nominal: Nominal,
    covariance: Covariance<T, N>,
    slots: heapless::Vec<Slot, MAX_PLANES>,
    history: heapless::Deque<ImuStep, HISTORY>,
    pending: heapless::Deque<Exchange, 8>,
    head: Nominal,
    window: Window,
    beacon: BeaconMonitor,
    /// The mast as it was before its beacon told another attitude, which a line of sight has refuted.
    refuted_mast: Option<claim::Mast>,
    /// The GMT as it was taken at the last sweep.
    last_gmt: Option<(u64, Transmitter)>,
    /// Standard deviation of the beacon's error that stays from sweep to sweep, m per axis.
    beacon_sigma_m: f64,
    /// Paths of the last sweep, and motion since then, m.
    lengths: Lengths,
    moved_m: Vector3<f64>,
    running: bool,
    clock_known: bool,
    /// Exchanges in agreement since the clock was set for the first time.
    acquired: u32,
    /// What rest before the flight has shown.
    rest: Option<Alignment>,
    rest_tilt: Option<RestTilt>,
    last_innovation: Option<Innovation>,
    contested: u32,
    /// Sweeps held back in a row.
    held: u32,
    sure: bool,
    /// Whether the contradiction began small, while the filter was unsure of itself or long without sight.
    doubtful: bool,
    /// Whether the contradiction began in sight, and small: sweeps and inertial data part from each other, as they do when ranges
    /// are wrong. A pose that was captured, or led astray without sight, is contradicted at once.
    parted: bool,
    last_sight_ns: u64,
    /// Last line of sight that was heard, whatever became of it.
    last_line_ns: u64,
    last_aid_ns: u64,
    suspect_clock: Option<Suspect>,
    doubt: Doubt,
    magnetic: Option<Magnetic>,
    resets: u32,
    health: Health,
    counters: Counters,
    ratios: TestRatios,
    /// Last increment that was missing or doubtful, ns.
    last_gap_ns: Option<u64>,
    #[cfg(feature = "watch")]
    watch: Option<alloc::sync::Arc<dyn Watch<T, N>>>,
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// A filter that knows nothing yet, at `time_ns` of the UAV clock, for this radio.
    pub fn new(radio: &RadioModel, config: FilterConfig, time_ns: u64) -> Self {
        let mut filter = Self {
            model: Model::new(radio.clone(), config.radio),
            config,
            nominal: Nominal::origin(time_ns, radio.waveform.delay_period()),
            covariance: Covariance::zero(),
            slots: heapless::Vec::new(),
            history: heapless::Deque::new(),
            pending: heapless::Deque::new(),
            head: Nominal::origin(time_ns, radio.waveform.delay_period()),
            window: Window::new(),
            beacon: BeaconMonitor::new(config.beacon),
            refuted_mast: None,
            last_gmt: None,
            beacon_sigma_m: 0.0,
            lengths: Lengths::default(),
            moved_m: Vector3::zeros(),
            running: false,
            clock_known: false,
            acquired: 0,
            rest: None,
            rest_tilt: None,
            last_innovation: None,
            contested: 0,
            held: 0,
            sure: false,
            doubtful: false,
            parted: false,
            last_sight_ns: time_ns,
            last_line_ns: time_ns,
            last_aid_ns: time_ns,
            suspect_clock: None,
            doubt: Doubt::default(),
            magnetic: None,
            resets: 0,
            health: Health {
                starting: true,
                ..Health::default()
            },
            counters: Counters::default(),
            ratios: TestRatios::default(),
            last_gap_ns: None,
            #[cfg(feature = "watch")]
            watch: None,
        };
        filter.set_priors();
        filter
    }

    /// Whether there is a pose.
    pub fn is_running(&self) -> bool {
        self.running
    }

    /// Flags at the horizon.
    pub fn health(&self) -> Health {
        self.health
    }

    /// What happened so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Innovation test ratios.
    pub fn test_ratios(&self) -> TestRatios {
        self.ratios
    }

    /// The estimated sensor errors: the strapdown integration takes them out of the samples.
    pub fn imu_errors(&self) -> ImuErrors {
        self.nominal.imu
    }

    /// The state at the horizon.
    pub fn nominal(&self) -> &Nominal {
        &self.nominal
    }

    /// The covariance at the horizon.
    pub fn covariance(&self) -> &Covariance<T, N> {
        &self.covariance
    }

    /// An angle of arrival without the estimated calibration errors of the arrays. The reflection solver wants this one:
    /// attitude and arrays share an error that cancels only when both corrections are applied (docs/localization.md, "The model").
    pub fn corrected_aoa(&self, aoa: &Direction<Body>) -> Direction<Body> {
        self.model.corrected_arrival(aoa, &self.nominal)
    }

    /// Pose at the horizon, the time of the last sweep; `None` while starting.
    pub fn pose(&self) -> Option<Pose> {
        self.pose_of(&self.nominal)
    }

    /// Pose now, carried over the history. Its covariance is that of the horizon, grown by the velocity's and by what the steps since
    /// then are in doubt: motion that nobody measured is soon not known, and a path must not be judged by an attitude that was guessed.
    pub fn present(&self) -> Option<Pose> {
        let mut pose = self.pose_of(&self.head)?;
        let since = |from_ns: u64| self.head.time_ns.saturating_sub(from_ns) as f32 * 1e-9;
        let dt = since(self.nominal.time_ns);
        let (mut angle, mut velocity, mut position) = (0.0, 0.0, 0.0);
        for step in &self.history {
            let left = since(step.increment.end_ns);
            angle += step.angle_variance_rad2;
            velocity += step.velocity_variance_m2_per_s2;
            position += step.velocity_variance_m2_per_s2 * left * left;
        }
        let each = Matrix3::identity();
        pose.position_covariance_m2 += pose.velocity_covariance_m2_per_s2 * (dt * dt) + each * position;
        pose.velocity_covariance_m2_per_s2 += each * velocity;
        pose.attitude_covariance_rad2 += each * angle;
        Some(pose)
    }

    /// UAV clock less GMT clock at a time that is near the horizon's, m, beside whole delay periods; `None` before the start.
    pub fn clock_offset_m(&self, time_ns: u64) -> Option<f64> {
        let since_s = elapsed_s(self.nominal.time_ns, time_ns);
        self.running
            .then_some(self.nominal.clock_offset_m + self.nominal.clock_drift_m_per_s * since_s)
    }

    fn pose_of(&self, state: &Nominal) -> Option<Pose> {
        if !self.running {
            return None;
        }
        let block = |i, j| self.covariance.block(i, j).map(|c| c.to_f64() as f32);
        let sigma = |i| libm::sqrtf(self.variance(i).max(0.0) as f32);
        // The state is the pose against the beacon's and its mast's heading. How these err is not for the filter to know: it shows
        // in no measurement.
        let beacon = (self.beacon_sigma_m * self.beacon_sigma_m) as f32;
        let mast = self.config.priors.mast_rad as f32;
        let from = self
            .last_gmt
            .map_or(Vector3::zeros(), |(_, gmt)| state.position_m - gmt.position_m);
        let aside = Vector3::new(-from.y as f32, from.x as f32, 0.0) * mast;
        let turned = Vector3::z() * mast;
        Some(Pose {
            time_ns: state.time_ns,
            position: Position::from_vector(state.position_m).ok()?,
            velocity_m_per_s: state.velocity_m_per_s.map(|c| c as f32),
            attitude: attitude(&state.attitude)?,
            clock: ClockEstimate {
                offset_m: state.clock_offset_m,
                offset_sigma_m: sigma(CLOCK_OFFSET),
                drift_m_per_s: state.clock_drift_m_per_s as f32,
                drift_sigma_m_per_s: sigma(CLOCK_DRIFT),
            },
            position_covariance_m2: block(POSITION, POSITION)
                + Matrix3::identity() * beacon
                + aside * aside.transpose(),
            velocity_covariance_m2_per_s2: block(VELOCITY, VELOCITY),
            attitude_covariance_rad2: block(ATTITUDE, ATTITUDE) + turned * turned.transpose(),
            position_attitude_covariance_m_rad: block(POSITION, ATTITUDE) + aside * turned.transpose(),
            resets: self.resets,
        })
    }

    /// Variance of a state.
    fn variance(&self, state: usize) -> f64 {
        self.covariance.at(state, state).to_f64()
    }

    /// Norm of the standard deviations of three neighbouring states.
    fn sigma(&self, first: usize) -> f64 {
        let sum = self.variance(first) + self.variance(first + 1) + self.variance(first + 2);
        libm::sqrt(sum.max(0.0))
    }
}

/// A rotation matrix as an attitude.
fn attitude(matrix: &Matrix3<f64>) -> Option<Rotation<Body, crate::geometry::World>> {
    Rotation::from_matrix(matrix.map(|c| c as f32)).ok()
}
