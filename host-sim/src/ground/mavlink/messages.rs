//! The messages that are sent, with their fields in wire order (largest first) and their CRC_EXTRA, as the published definitions
//! give them: `common.xml`, and `ardupilotmega.xml` for OBSTACLE_DISTANCE_3D.

use nalgebra::Matrix3;

use crate::ground::model::Severity;

/// Forward-right-down (MAV_FRAME_BODY_FRD).
const BODY_FRD: u8 = 12;

/// The frame that ODOMETRY names for its position and attitude. The numbers are the same in both: north, east and down of the
/// world, from its origin. What differs is what an autopilot makes of the name (docs/autopilots.md).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Frame {
    /// MAV_FRAME_LOCAL_FRD: local axes whose heading need not be north's. ArduPilot takes no other, PX4 takes it.
    #[default]
    Frd,
    /// MAV_FRAME_LOCAL_NED: the first axis is true north. For PX4; ArduPilot ignores it without a word.
    Ned,
}

impl Frame {
    /// Its number (MAV_FRAME of `common.xml`).
    pub fn id(self) -> u8 {
        match self {
            Self::Frd => 20,
            Self::Ned => 1,
        }
    }
}

/// How the estimate was made (MAV_ESTIMATOR_TYPE_VIO): by bearings to things outside and an inertial unit. PX4 refuses kinds that it
/// takes for satellites' or its own, and ignores covariances of the kind called naive.
const VISUAL_INERTIAL: u8 = 3;

/// Flags of ESTIMATOR_STATUS (ESTIMATOR_STATUS_FLAGS).
pub mod estimator_flags {
    /// Attitude estimate is good.
    pub const ATTITUDE: u16 = 1;
    /// Horizontal velocity estimate is good.
    pub const VELOCITY_HORIZONTAL: u16 = 2;
    /// Vertical velocity estimate is good.
    pub const VELOCITY_VERTICAL: u16 = 4;
    /// Horizontal position relative to the origin is good.
    pub const POSITION_HORIZONTAL: u16 = 8;
    /// Vertical position relative to the origin is good.
    pub const POSITION_VERTICAL: u16 = 32;
}

/// HEARTBEAT (0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// Whether the UAV is heard and has a pose.
    pub is_active: bool,
}

/// ODOMETRY (331), position in a local frame, velocity in body FRD.
#[derive(Clone, Debug, PartialEq)]
pub struct Odometry {
    /// UAV clock, us.
    pub time_us: u64,
    /// What the local frame is called.
    pub frame: Frame,
    /// North, east, down, m.
    pub position_m: [f64; 3],
    /// Body FRD to the local frame, [w, x, y, z].
    pub quaternion: [f64; 4],
    /// Forward, right, down, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Covariance of north, east, down, m^2.
    pub position_covariance: Matrix3<f64>,
    /// Covariance of the rotations about forward, right, down (roll, pitch, yaw), rad^2.
    pub attitude_covariance: Matrix3<f64>,
    /// Covariance of the velocity in its axes, (m/s)^2.
    pub velocity_covariance: Matrix3<f64>,
    /// Rises by one, and wraps, at every jump of the pose.
    pub reset_counter: u8,
    /// Quality, 1..=100; 0 unknown, -1 failed.
    pub quality: i8,
}

/// STATUSTEXT (253), cut at 50 bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StatusText {
    /// How bad.
    pub severity: Severity,
    /// Text.
    pub text: String,
}

/// ESTIMATOR_STATUS (230).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorStatus {
    /// UAV clock, us.
    pub time_us: u64,
    /// [`estimator_flags`].
    pub flags: u16,
    /// Standard deviation of the horizontal position, m.
    pub horizontal_m: f64,
    /// Standard deviation of the height, m.
    pub vertical_m: f64,
}

/// OBSTACLE_DISTANCE_3D (11037): a reflection point in body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// UAV clock, ms.
    pub time_ms: u32,
    /// Forward, right, down from the UAV, m.
    pub position_m: [f64; 3],
    /// Tells obstacles apart.
    pub id: u16,
}

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// Once a second.
    Heartbeat(Heartbeat),
    /// With every pose.
    Odometry(Box<Odometry>),
    /// With every event.
    StatusText(StatusText),
    /// Once a second.
    EstimatorStatus(EstimatorStatus),
    /// With every point.
    Obstacle(Obstacle),
}

/// Appends fields.
#[derive(Default)]
struct Payload(Vec<u8>);

impl Payload {
    fn put<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        self.0.extend(bytes);
        self
    }

    fn floats<'a>(mut self, values: impl IntoIterator<Item = &'a f64>) -> Self {
        for value in values {
            self.0.extend((*value as f32).to_le_bytes());
        }
        self
    }
}

impl Message {
    /// Message id, CRC_EXTRA and payload.
    pub(super) fn encode(&self) -> (u32, u8, Vec<u8>) {
        let payload = Payload::default();
        match self {
            Self::Heartbeat(heartbeat) => {
                // custom mode; onboard controller (18); not an autopilot (8); no mode; active (4) or standby (3); version 3.
                let status = if heartbeat.is_active { 4 } else { 3 };
                (
                    0,
                    50,
                    payload.put(0_u32.to_le_bytes()).put([18, 8, 0, status, 3]).0,
                )
            }
            Self::Odometry(odometry) => (331, 91, encode_odometry(odometry)),
            Self::StatusText(status) => {
                let severity = match status.severity {
                    Severity::Info => 6,
                    Severity::Warning => 4,
                    Severity::Error => 3,
                };
                let mut text = [0; 50];
                for (to, from) in text.iter_mut().zip(status.text.bytes().filter(u8::is_ascii)) {
                    *to = from;
                }
                // Extensions: id 0 and chunk 0, a whole text.
                (253, 83, payload.put([severity]).put(text).put([0; 3]).0)
            }
            Self::EstimatorStatus(status) => {
                // Test ratios are not sent down: 0.
                let ratios = [0.0; 6];
                let accuracies = [status.horizontal_m, status.vertical_m];
                let payload = payload
                    .put(status.time_us.to_le_bytes())
                    .floats(&ratios)
                    .floats(&accuracies);
                (230, 163, payload.put(status.flags.to_le_bytes()).0)
            }
            Self::Obstacle(obstacle) => {
                // Least and greatest distance of the sensor, m; radar is the kind of sensor that it is nearest to (3).
                let payload = payload
                    .put(obstacle.time_ms.to_le_bytes())
                    .floats(&obstacle.position_m)
                    .floats(&[0.5, 600.0]);
                (
                    11037,
                    130,
                    payload.put(obstacle.id.to_le_bytes()).put([3, BODY_FRD]).0,
                )
            }
        }
    }
}

fn encode_odometry(odometry: &Odometry) -> Vec<u8> {
    // Upper triangle, row by row.
    let upper = |entry: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        (0..6)
            .flat_map(|i| (i..6).map(move |j| (i, j)))
            .map(|(i, j)| entry(i, j))
            .collect()
    };
    // The UAV sends no covariance between position and attitude: zero.
    let pose = upper(&|i, j| match (i, j) {
        (0..3, 0..3) => odometry.position_covariance[(i, j)],
        (3..6, 3..6) => odometry.attitude_covariance[(i - 3, j - 3)],
        _ => 0.0,
    });
    // Angular rates are not sent (NaN). Their variances stay zero: NaN has a meaning in the first element alone, for all of them.
    let velocity = upper(&|i, j| match (i, j) {
        (0..3, 0..3) => odometry.velocity_covariance[(i, j)],
        _ => 0.0,
    });
    Payload::default()
        .put(odometry.time_us.to_le_bytes())
        .floats(&odometry.position_m)
        .floats(&odometry.quaternion)
        .floats(&odometry.velocity_m_per_s)
        .floats(&[f64::NAN; 3])
        .floats(&pose)
        .floats(&velocity)
        .put([odometry.frame.id(), BODY_FRD, odometry.reset_counter])
        // Extensions.
        .put([VISUAL_INERTIAL, odometry.quality.cast_unsigned()])
        .0
}
