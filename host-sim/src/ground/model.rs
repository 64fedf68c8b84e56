//! What a UAV says, decoded: in SI units and names, whatever the wire format packs it into.

use nalgebra::Matrix3;
use serde::{Serialize, Serializer};

/// A packet that came from a UAV.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Heard {
    /// Link id of the UAV.
    pub uav: u8,
    /// Number of the packet on its link: a gap is a lost packet.
    pub counter: u32,
    /// Content.
    #[serde(flatten)]
    pub message: Message,
}

/// Content of a packet.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Message {
    /// Reflection points.
    Points {
        /// In the order of sweeps.
        points: Vec<Point>,
    },
    /// Where the UAV believes to be.
    Pose(Pose),
    /// How a sweep went.
    Link(Link),
    /// How the receiver is.
    Health(Health),
    /// Something happened.
    Event(Event),
    /// What the receiver runs with.
    Config(Config),
}

impl Message {
    /// Time of the UAV's clock that it tells, s.
    pub fn time_s(&self) -> Option<f64> {
        match self {
            Self::Pose(pose) => Some(pose.time_s),
            Self::Link(link) => Some(link.time_s),
            Self::Health(health) => Some(health.time_s),
            Self::Event(event) => Some(event.time_s),
            Self::Points { .. } | Self::Config(_) => None,
        }
    }
}

/// A reflection point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// World frame, m.
    pub position_m: [f64; 3],
    /// Root of the trace of its covariance, m.
    pub sigma_m: f64,
    /// Probability that it was reflected once.
    pub probability: f64,
    /// Number of the sweep.
    pub sweep: u32,
    /// Number of the place that the GMT had, counted from 0.
    pub gmt_index: u16,
    /// Number of the surface that it lies on; `None` from a receiver that has no surfaces.
    pub surface: Option<u16>,
}

/// A symmetric covariance of three components as standard deviations and correlations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Standard deviation of each component.
    pub sigma: [f64; 3],
    /// Correlation of x with y, x with z, y with z.
    pub correlation: [f64; 3],
}

impl Spread {
    /// The covariance.
    pub fn matrix(&self) -> Matrix3<f64> {
        let [x, y, z] = self.sigma;
        let [xy, xz, yz] = self.correlation;
        let (xy, xz, yz) = (xy * x * y, xz * x * z, yz * y * z);
        Matrix3::new(x * x, xy, xz, xy, y * y, yz, xz, yz, z * z)
    }

    /// Root of its trace.
    pub fn total(&self) -> f64 {
        libm::sqrt(self.sigma.iter().map(|s| s * s).sum())
    }
}

/// State of a UAV.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pose {
    /// UAV clock, s.
    pub time_s: f64,
    /// World frame, m.
    pub position_m: [f64; 3],
    /// World frame, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Body to world, [w, x, y, z].
    pub quaternion_wb: [f64; 4],
    /// Uncertainty of the position in the world, m.
    pub position: Spread,
    /// Uncertainty of the velocity in the world, m/s.
    pub velocity: Spread,
    /// Uncertainty of the attitude as a small rotation vector in world axes, rad.
    pub attitude: Spread,
    /// UAV clock less GMT clock, s.
    pub clock_offset_s: Option<f64>,
    /// Rises by one, and wraps, whenever the pose was set anew.
    pub resets: u8,
    /// How far it may be trusted.
    pub flags: PoseFlags,
}

/// How far a pose may be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PoseFlags {
    /// There is no pose yet.
    pub starting: bool,
    /// Measurements contradict the pose.
    pub contested: bool,
    /// Delays contradict the clock.
    pub clock_contested: bool,
    /// The GMT's beacon says what cannot be.
    pub beacon_implausible: bool,
    /// The inertial unit is silent or broken.
    pub inertial_missing: bool,
    /// Nothing but the inertial unit for a while.
    pub dead_reckoning: bool,
    /// The position is lost.
    pub lost: bool,
    /// The attitude is lost.
    pub attitude_lost: bool,
    /// The last sweep had a line of sight that was taken.
    pub line_of_sight: bool,
}

impl PoseFlags {
    /// Whether position and attitude may be used.
    pub fn is_sound(&self) -> bool {
        !(self.starting || self.contested || self.lost || self.attitude_lost)
    }
}

/// How a sweep went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Link {
    /// Number of the sweep.
    pub sweep: u32,
    /// UAV clock at its start, s.
    pub time_s: f64,
    /// 0 outage, 1 line of sight, 2 one reflection, 3 more.
    pub state: u8,
    /// What became of each path, strongest first.
    pub outcomes: Vec<&'static str>,
    /// SNR of the strongest path, dB.
    pub snr_db: Option<f64>,
    /// Transmit beams heard.
    pub beams: u8,
    /// Where the GMT was, world frame, m; `None` when no beacon told.
    pub gmt_m: Option<[f64; 3]>,
    /// What the line of sight did to the pose.
    pub verdict: &'static str,
}

/// How the receiver is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Health {
    /// UAV clock, s.
    pub time_s: f64,
    /// Since reset, s.
    pub uptime_s: f64,
    /// Load of the processor, 0..=1.
    pub cpu_load: f64,
    /// Stack that was never used, bytes.
    pub free_stack_bytes: u32,
    /// Why it was last reset.
    pub reset_cause: &'static str,
    /// Counters by name, saturating.
    #[serde(serialize_with = "as_map")]
    pub counters: Vec<(&'static str, u32)>,
}

/// Something happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Event {
    /// UAV clock, s.
    pub time_s: f64,
    /// How bad it is.
    pub severity: Severity,
    /// In words.
    pub text: String,
    /// What it means for the points that were sent before it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change: Option<SurfaceChange>,
}

/// What became of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SurfaceChange {
    /// The surface of this number was refuted.
    Withdrawn(u16),
    /// Two surfaces were one.
    Merged {
        /// Number that no surface has any more.
        gone: u16,
        /// Number that both have now.
        stays: u16,
    },
}

/// How bad an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// As it should be.
    Info,
    /// Worth a look.
    Warning,
    /// Something does not work.
    Error,
}

/// What the receiver runs with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// Names with values in words.
    #[serde(serialize_with = "as_map")]
    pub entries: Vec<(&'static str, String)>,
}

/// Pairs as a JSON object, in their order.
fn as_map<S: Serializer, V: Serialize>(pairs: &[(&'static str, V)], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(pairs.iter().map(|(name, value)| (name, value)))
}
