//! Alignment at rest: gyroscope bias and tilt from a few seconds before take-off (docs/localization.md, "The model").
//!
//! At rest the gyroscope shows its bias, and the accelerometer the vertical. Whether it is rest is judged block by block:
//! the scatter within a block must be that of a sensor at rest, the means of blocks must agree, and their sizes must be
//! those of a bias and of gravity. Any sign of motion begins the alignment anew. A slow steady turn about the vertical
//! cannot be told from a bias; its rate is bounded by the largest bias that is believed.

use nalgebra::Vector3;

use super::Turn;
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::Real;
use crate::inertial::ImuSample;

/// Standard gravity as the numbers here are.
const G: f32 = STANDARD_GRAVITY_M_PER_S2 as f32;
/// One degree per second, rad/s.
/// Given: a unit.
const DPS: f32 = core::f32::consts::PI / 180.0;
/// Square of the standard deviations that two means of one block differ by at most.
/// Derived: five, of honest blocks one in a million.
const GATE: f32 = 25.0;

/// What counts as rest. Defaults: the sensors of design section 6.
/// Given: rest as the sensor of the error budget shows it (docs/localization.md, "The inertial sensor").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestConfig {
    /// Samples in a block (at least 2): a quarter of a second.
    pub block_samples: u16,
    /// Blocks that make an alignment: three seconds.
    pub blocks: u16,
    /// Largest scatter of the rate within a block, rad/s per axis. The sensor's own: 0.0016.
    pub rate_scatter_rad_per_s: f32,
    /// Largest scatter of the specific force within a block, m/s^2 per axis. The sensor's own: 0.022.
    pub force_scatter_m_per_s2: f32,
    /// By how much the mean rate of a block may differ from that of the blocks before it, rad/s, besides five times what
    /// noise explains.
    pub rate_drift_rad_per_s: f32,
    /// The same of the specific force, m/s^2.
    pub force_drift_m_per_s2: f32,
    /// Largest rate that is believed to be a bias, rad/s per axis: four standard deviations of the turn-on bias.
    pub rate_bias_rad_per_s: f32,
    /// Largest difference of the specific force from gravity that is believed, m/s^2.
    pub gravity_error_m_per_s2: f32,
    /// Standard deviation of the gyroscope's bias as it moves during the alignment, rad/s.
    pub gyro_wander_rad_per_s: f32,
    /// Standard deviation of what the accelerometer shows of gravity at rest and no longer in flight, m/s^2: 0.15 mg/K over 20 K (data sheet).
    pub accel_wander_m_per_s2: f32,
}

impl Default for RestConfig {
    fn default() -> Self {
        Self {
            block_samples: 250,
            blocks: 12,
            rate_scatter_rad_per_s: 0.005,
            force_scatter_m_per_s2: 0.1,
            rate_drift_rad_per_s: 0.02 * DPS,
            force_drift_m_per_s2: 0.01,
            rate_bias_rad_per_s: 2.0 * DPS,
            gravity_error_m_per_s2: 0.1 * G,
            gyro_wander_rad_per_s: 0.002 * DPS,
            accel_wander_m_per_s2: 0.003 * G,
        }
    }
}

/// What rest has shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Bias of the gyroscope, rad/s.
    pub gyro_bias_rad_per_s: Vector3<f32>,
    /// Its standard deviation, rad/s per axis.
    pub gyro_bias_sigma_rad_per_s: Vector3<f32>,
    /// Direction of up in body axes, unit length. Nearly all of its error is the accelerometer's bias, with which it stays correlated:
    /// `tilt = bias / g`.
    pub up: Vector3<f32>,
    /// What the accelerometer shows along `up` beyond standard gravity, m/s^2: its bias there, scale and local gravity included.
    pub accel_bias_up_m_per_s2: f32,
    /// Its standard deviation later in the flight, m/s^2.
    pub accel_bias_up_sigma_m_per_s2: f32,
    /// Time stamp of the last sample used, ns.
    pub time_ns: u64,
}

impl Alignment {
    /// Roll (about x) and pitch (about y, positive with the nose down), rad.
    pub fn roll_pitch_rad(&self) -> (f32, f32) {
        let level = libm::sqrtf(self.up.y * self.up.y + self.up.z * self.up.z);
        let roll = self.up.y.atan2_libm(self.up.z);
        (roll, (-self.up.x).atan2_libm(level))
    }

    /// The attitude with this tilt and a yaw (about the vertical, from east) that something else must tell, rad.
    pub fn attitude(&self, yaw_rad: f32) -> Turn<f64> {
        let (roll, pitch) = self.roll_pitch_rad();
        let about = |x: f32, y: f32, z: f32| {
            Turn::from_rotation_vector(&Vector3::new(f64::from(x), f64::from(y), f64::from(z)))
        };
        about(0.0, 0.0, yaw_rad)
            .then(&about(0.0, pitch, 0.0))
            .then(&about(roll, 0.0, 0.0))
    }
}

/// How an alignment stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RestStatus {
    /// Blocks of rest so far.
    Gathering {
        /// Number of them.
        blocks: u16,
    },
    /// The block that has just ended was not at rest: the alignment begins anew.
    Moving,
    /// Enough: the result. The next sample begins another one.
    Aligned(Alignment),
}

/// Sums of one signal over a block, less its first sample, so that `f32` holds a variance beside gravity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    first: Vector3<f32>,
    sum: Vector3<f32>,
    squares: Vector3<f32>,
}

impl Sums {
    fn add(&mut self, value: &Vector3<f32>, is_first: bool) {
        if is_first {
            *self = Self {
                first: *value,
                ..Self::default()
            };
        }
        let d = value - self.first;
        self.sum += d;
        self.squares += d.component_mul(&d);
    }

    /// Mean and variance of `n` samples.
    fn mean_variance(&self, n: f32) -> (Vector3<f32>, Vector3<f32>) {
        let mean = self.sum / n;
        let variance = (self.squares / n - mean.component_mul(&mean)) * (n / (n - 1.0));
        (self.first + mean, variance.map(|v| v.max(0.0)))
    }
}

/// Means over the blocks accepted so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Blocks {
    count: u16,
    mean: Vector3<f32>,
    variance: Vector3<f32>,
}

impl Blocks {
    fn add(&mut self, mean: &Vector3<f32>, variance: &Vector3<f32>) {
        self.count = self.count.saturating_add(1);
        let share = 1.0 / f32::from(self.count);
        self.mean += (mean - self.mean) * share;
        self.variance += (variance - self.variance) * share;
    }

    /// Whether a block's mean agrees with those before it: five standard deviations of the difference, and the drift.
    fn agrees(&self, mean: &Vector3<f32>, variance: &Vector3<f32>, n: f32, drift: f32) -> bool {
        if self.count == 0 {
            return true;
        }
        let difference = mean - self.mean;
        let noise = (variance + self.variance / f32::from(self.count)) / n;
        // |d| <= drift + sqrt(GATE v), without the root.
        let within = |d: f32, v: f32| {
            let beyond = d.abs() - drift;
            beyond <= 0.0 || beyond * beyond <= GATE * v
        };
        within(difference.x, noise.x) && within(difference.y, noise.y) && within(difference.z, noise.z)
    }
}

/// Alignment in the making.
#[derive(Clone, Copy, Debug)]
pub struct RestAlignment {
    config: RestConfig,
    samples: u16,
    rate: Sums,
    force: Sums,
    rates: Blocks,
    forces: Blocks,
    moved: u32,
}

impl RestAlignment {
    /// An alignment that begins with the next sample.
    pub fn new(config: RestConfig) -> Self {
        Self {
            config,
            samples: 0,
            rate: Sums::default(),
            force: Sums::default(),
            rates: Blocks::default(),
            forces: Blocks::default(),
            moved: 0,
        }
    }

    /// Blocks that were refused because of motion, saturating.
    pub fn moved(&self) -> u32 {
        self.moved
    }

    /// Takes a sample.
    pub fn push(&mut self, sample: &ImuSample) -> RestStatus {
        let is_first = self.samples == 0;
        self.rate.add(&sample.rate_rad_per_s, is_first);
        self.force.add(&sample.specific_force_m_per_s2, is_first);
        self.samples = self.samples.saturating_add(1);
        if self.samples < self.config.block_samples.max(2) {
            return RestStatus::Gathering {
                blocks: self.rates.count,
            };
        }
        let n = f32::from(self.samples);
        self.samples = 0;
        let (rate, rate_variance) = self.rate.mean_variance(n);
        let (force, force_variance) = self.force.mean_variance(n);
        if !self.is_rest(n, (&rate, &rate_variance), (&force, &force_variance)) {
            self.moved = self.moved.saturating_add(1);
            self.rates = Blocks::default();
            self.forces = Blocks::default();
            return RestStatus::Moving;
        }
        self.rates.add(&rate, &rate_variance);
        self.forces.add(&force, &force_variance);
        if self.rates.count < self.config.blocks {
            return RestStatus::Gathering {
                blocks: self.rates.count,
            };
        }
        let alignment = self.result(n, sample.time_ns);
        self.rates = Blocks::default();
        self.forces = Blocks::default();
        RestStatus::Aligned(alignment)
    }

    /// Whether a block was at rest. Comparisons are written so that NaN is not rest.
    fn is_rest(
        &self,
        n: f32,
        (rate, rate_variance): (&Vector3<f32>, &Vector3<f32>),
        (force, force_variance): (&Vector3<f32>, &Vector3<f32>),
    ) -> bool {
        let config = &self.config;
        let below =
            |v: &Vector3<f32>, limit: f32| v.x.abs() <= limit && v.y.abs() <= limit && v.z.abs() <= limit;
        let square = |s: f32| s * s;
        let length = force.x * force.x + force.y * force.y + force.z * force.z;
        below(rate_variance, square(config.rate_scatter_rad_per_s))
            && below(force_variance, square(config.force_scatter_m_per_s2))
            && below(rate, config.rate_bias_rad_per_s)
            && length >= square(G - config.gravity_error_m_per_s2)
            && length <= square(G + config.gravity_error_m_per_s2)
            && self
                .rates
                .agrees(rate, rate_variance, n, config.rate_drift_rad_per_s)
            && self
                .forces
                .agrees(force, force_variance, n, config.force_drift_m_per_s2)
    }

    fn result(&self, n: f32, time_ns: u64) -> Alignment {
        let config = &self.config;
        let total = n * f32::from(self.rates.count);
        let wander = config.gyro_wander_rad_per_s * config.gyro_wander_rad_per_s;
        let force = self.forces.mean;
        // Not zero: it differs little from gravity.
        let length = libm::sqrtf(force.x * force.x + force.y * force.y + force.z * force.z);
        let scatter = self.forces.variance;
        let noise = scatter.x.max(scatter.y).max(scatter.z) / total;
        Alignment {
            gyro_bias_rad_per_s: self.rates.mean,
            gyro_bias_sigma_rad_per_s: self.rates.variance.map(|v| libm::sqrtf(v / total + wander)),
            up: force / length,
            accel_bias_up_m_per_s2: length - G,
            accel_bias_up_sigma_m_per_s2: libm::sqrtf(
                config.accel_wander_m_per_s2 * config.accel_wander_m_per_s2 + noise,
            ),
            time_ns,
        }
    }
}

#[cfg(test)]
#[path = "alignment_tests.rs"]
mod tests;
