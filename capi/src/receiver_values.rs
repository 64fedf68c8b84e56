//! Values of the whole receiver.

use crate::pointer::Sized32;

/// What a receiver must be told.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CslamReceiverConfig {
    /// `sizeof(cslam_receiver_config)`.
    pub size: u32,
    /// Number of the UAV in its packets.
    pub uav: u8,
    /// 1 when `ground_z_m` is known, else 0.
    pub has_ground: u8,
    /// 1 when `earth_field_ut` is known, else 0: the magnetometer is not used then.
    pub has_earth_field: u8,
    /// 0.
    pub reserved: u8,
    /// Secret of the link, with which packets both ways are signed; not all zero.
    pub key: [u8; 32],
    /// Counter of the first packet: no less than any that was used with this key before.
    pub first_counter: u32,
    /// Height of the ground at the start, m.
    pub ground_z_m: f32,
    /// The earth's magnetic field, world axes (east, north, up), uT.
    pub earth_field_ut: [f32; 3],
}

/// What the transmitter says of a sweep.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CslamBeacon {
    /// `sizeof(cslam_beacon)`.
    pub size: u32,
    /// Number of the sweep that it follows.
    pub sweep: u32,
    /// Position of the antenna during that sweep, world axes, m.
    pub position_m: [f64; 3],
    /// Attitude of the mast: quaternion w, x, y, z from its axes to the world's.
    pub attitude_wxyz: [f32; 4],
    /// Standard deviation of the position, m per axis.
    pub sigma_m: f32,
    /// Sweeps from one place before it moves on, 1 or more.
    pub sweeps_per_stop: u32,
}

/// Where the UAV is.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CslamPose {
    /// `sizeof(cslam_pose)`.
    pub size: u32,
    /// Counts the jumps: poses with different counts must not be differenced.
    pub resets: u32,
    /// Clock of the UAV, ns.
    pub time_ns: u64,
    /// World axes, m.
    pub position_m: [f64; 3],
    /// UAV clock less transmitter clock as a length, m, within half a period of 625 m.
    pub clock_offset_m: f64,
    /// World axes, m/s.
    pub velocity_m_per_s: [f32; 3],
    /// Attitude: the matrix that turns body axes into world axes, row by row.
    pub attitude_wb: [f32; 9],
    /// Covariance of the position, m^2, row by row.
    pub position_covariance_m2: [f32; 9],
    /// Covariance of the velocity, m^2/s^2, row by row.
    pub velocity_covariance_m2_per_s2: [f32; 9],
    /// Covariance of the attitude as a small rotation vector in world axes, rad^2, row by row.
    pub attitude_covariance_rad2: [f32; 9],
    /// Standard deviation of `clock_offset_m`, m.
    pub clock_offset_sigma_m: f32,
}

/// A point of the map.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CslamMapPoint {
    /// `sizeof(cslam_map_point)`.
    pub size: u32,
    /// Reflections that were fused, at most 65535.
    pub hits: u32,
    /// World axes, m.
    pub position_m: [f32; 3],
    /// Trace of its covariance, m^2.
    pub variance_m2: f32,
    /// Number of the surface that it lies on, -1 where none is known.
    pub surface: i32,
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamReceiverConfig {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamBeacon {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamPose {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamMapPoint {}

const _: () = assert!(size_of::<CslamReceiverConfig>() == 60 && size_of::<CslamBeacon>() == 56);
const _: () = assert!(size_of::<CslamPose>() == 208 && size_of::<CslamMapPoint>() == 28);
