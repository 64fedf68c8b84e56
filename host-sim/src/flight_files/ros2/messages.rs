//! The messages themselves.
//!
//! ROS has our axes: world east-north-up, body forward-left-up (REP 103). Frames: `map` is the world, `base_link` the array centre of
//! the UAV, `gmt` the antenna of the GMT.

use cslam_core::inertial::ImuSample;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::cdr::Cdr;
use crate::flight_log::{MapVoxel, PointRecord, PoseEstimate, PoseTruth};

const MAP: &str = "map";
pub(super) const BODY: &str = "base_link";
/// Variance of what nobody measures or estimates, in the unit of its place.
const UNKNOWN: f64 = 1e6;
/// Of a covariance's first element: the quantity is not in the message.
const ABSENT: f64 = -1.0;
/// Data types of point fields.
const UINT32: u8 = 6;
const FLOAT32: u8 = 7;

/// A message that begins with the time and the frame.
fn stamped(time_ns: u64, frame: &str) -> Cdr {
    let mut cdr = Cdr::new();
    header(&mut cdr, time_ns, frame);
    cdr
}

fn header(cdr: &mut Cdr, time_ns: u64, frame: &str) {
    // A flight is shorter than 68 years.
    cdr.u32((time_ns / 1_000_000_000) as u32);
    cdr.u32((time_ns % 1_000_000_000) as u32);
    cdr.string(frame);
}

/// x, y, z, w.
fn quaternion(cdr: &mut Cdr, [w, x, y, z]: [f64; 4]) {
    cdr.f64s([x, y, z, w]);
}

/// A covariance of six numbers, row by row, of two blocks of three.
fn covariance(cdr: &mut Cdr, blocks: [Matrix3<f64>; 2]) {
    for row in 0..6 {
        for column in 0..6 {
            let (block, other) = (row / 3, column / 3);
            let value = blocks[block][(row % 3, column % 3)];
            cdr.f64(if block == other { value } else { 0.0 });
        }
    }
}

/// What an odometry says.
pub(super) struct State {
    position_m: [f64; 3],
    quaternion_wb: [f64; 4],
    velocity_m_per_s: [f64; 3],
    /// Of position, attitude, velocity, world axes.
    covariances: [Matrix3<f64>; 3],
}

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

impl From<&PoseEstimate> for State {
    fn from(estimate: &PoseEstimate) -> Self {
        Self {
            position_m: estimate.position_m,
            quaternion_wb: estimate.quaternion_wb,
            velocity_m_per_s: estimate.velocity_m_per_s,
            covariances: [
                matrix(&estimate.position_covariance_m2),
                matrix(&estimate.attitude_covariance_rad2),
                matrix(&estimate.velocity_covariance_m2_per_s2),
            ],
        }
    }
}

impl From<&PoseTruth> for State {
    fn from(truth: &PoseTruth) -> Self {
        Self {
            position_m: truth.position_m,
            quaternion_wb: truth.quaternion_wb,
            velocity_m_per_s: truth.velocity_m_per_s,
            covariances: [Matrix3::zeros(); 3],
        }
    }
}

/// `nav_msgs/msg/Odometry`: the pose in `map`, the velocity in `child`; rates of rotation are not estimated.
pub(super) fn odometry(time_ns: u64, child: &str, state: &State) -> Vec<u8> {
    let [w, x, y, z] = state.quaternion_wb;
    let to_body = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
        .to_rotation_matrix()
        .inverse();
    let velocity = to_body * Vector3::from(state.velocity_m_per_s);
    let [position, attitude, of_velocity] = state.covariances;
    let of_velocity = to_body.matrix() * of_velocity * to_body.matrix().transpose();
    let mut cdr = stamped(time_ns, MAP);
    cdr.string(child);
    cdr.f64s(state.position_m);
    quaternion(&mut cdr, state.quaternion_wb);
    covariance(&mut cdr, [position, attitude]);
    cdr.f64s(velocity.iter().copied());
    cdr.f64s([0.0; 3]);
    covariance(&mut cdr, [of_velocity, Matrix3::identity() * UNKNOWN]);
    cdr.finish()
}

/// `tf2_msgs/msg/TFMessage` of one frame in `map`.
pub(super) fn transform(time_ns: u64, child: &str, position_m: [f64; 3], quaternion_wb: [f64; 4]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.length(1);
    header(&mut cdr, time_ns, MAP);
    cdr.string(child);
    cdr.f64s(position_m);
    quaternion(&mut cdr, quaternion_wb);
    cdr.finish()
}

/// `sensor_msgs/msg/Imu`: rate and specific force as measured, no orientation; what it errs by is not said (zeros).
pub(super) fn imu(sample: &ImuSample) -> Vec<u8> {
    let mut cdr = stamped(sample.time_ns, BODY);
    quaternion(&mut cdr, [1.0, 0.0, 0.0, 0.0]);
    cdr.f64s([ABSENT, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for measured in [&sample.rate_rad_per_s, &sample.specific_force_m_per_s2] {
        cdr.f64s(measured.iter().map(|c| f64::from(*c)));
        cdr.f64s([0.0; 9]);
    }
    cdr.finish()
}

/// `sensor_msgs/msg/PointCloud2` of accepted reflections.
pub(super) fn points(time_ns: u64, points: &[PointRecord]) -> Vec<u8> {
    let names = [
        "x",
        "y",
        "z",
        "covariance_trace",
        "probability",
        "snr_db",
        "gmt_index",
    ];
    let rows = points.iter().map(|point| {
        let [x, y, z] = point.position_m;
        let unknown = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let floats = [
            x,
            y,
            z,
            point.covariance_trace_m2,
            unknown(point.probability),
            unknown(point.snr_db),
        ];
        (floats, point.gmt_index)
    });
    cloud(time_ns, &names, rows)
}

/// `sensor_msgs/msg/PointCloud2` of the fused map.
pub(super) fn map(time_ns: u64, map: &[MapVoxel]) -> Vec<u8> {
    let names = ["x", "y", "z", "covariance_trace", "hits"];
    let rows = map.iter().map(|voxel| {
        let [x, y, z] = voxel.position_m;
        ([x, y, z, voxel.covariance_trace_m2], voxel.hits)
    });
    cloud(time_ns, &names, rows)
}

/// A cloud of floats and, last, one count a point.
fn cloud<const FLOATS: usize>(
    time_ns: u64,
    names: &[&str],
    rows: impl Iterator<Item = ([f64; FLOATS], u32)>,
) -> Vec<u8> {
    let mut data = Vec::new();
    for (floats, count) in rows {
        for value in floats {
            data.extend_from_slice(&(value as f32).to_le_bytes());
        }
        data.extend_from_slice(&count.to_le_bytes());
    }
    let step = 4 * names.len();
    let mut cdr = stamped(time_ns, MAP);
    cdr.u32(1);
    cdr.length(data.len() / step);
    cdr.length(names.len());
    for (index, name) in names.iter().enumerate() {
        cdr.string(name);
        cdr.length(4 * index);
        cdr.u8(if index < FLOATS { FLOAT32 } else { UINT32 });
        cdr.u32(1);
    }
    cdr.u8(0);
    cdr.length(step);
    cdr.length(data.len());
    cdr.bytes(&data);
    // A point whose figure is not known has NaN there.
    cdr.u8(0);
    cdr.finish()
}
