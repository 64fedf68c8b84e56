//! Reflection points and the map made of them.

use cslam_core::map::MapPoint;
use serde::{Deserialize, Serialize};

/// An accepted reflection point: the receiver's side only. The truth is found through its sweep and path, by
/// [`FlightLog::truth_of`](super::FlightLog::truth_of).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointRecord {
    /// Number of the sweep.
    pub sweep: u32,
    /// Index of the path among the measured ones of that sweep.
    pub path: u8,
    /// Reflections that the path is taken to have had.
    pub order: u8,
    /// Which of them this is: 1 is the first after the GMT.
    pub reflection: u8,
    /// Number of the surface that it lies on; `None` where paths are taken alone.
    #[serde(default)]
    pub surface: Option<u16>,
    /// Number of the sweep with which it came into the map: its own, or the later one that confirmed its surface; `None` when nobody said.
    #[serde(default)]
    pub mapped_sweep: Option<u32>,
    /// Time of its sweep by the UAV's clock, s.
    pub time_s: f64,
    /// Index of the GMT position.
    pub gmt_index: u32,
    /// Position, world frame, m.
    pub position_m: [f64; 3],
    /// Trace of the covariance of the position, m^2.
    pub covariance_trace_m2: f64,
    /// Probability that the surfaces of its path exist, or that a path taken alone was reflected once; `None` when nobody said.
    pub probability: Option<f64>,
    /// SNR per element and active subcarrier, dB.
    pub snr_db: Option<f64>,
}

/// An occupied voxel of the receiver's map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapVoxel {
    /// Fused position, world frame, m.
    pub position_m: [f64; 3],
    /// Trace of the covariance of the fused position, m^2.
    pub covariance_trace_m2: f64,
    /// Number of reflections fused.
    pub hits: u32,
}

impl From<&MapPoint> for MapVoxel {
    fn from(point: &MapPoint) -> Self {
        Self {
            position_m: point.position.to_array().map(f64::from),
            covariance_trace_m2: f64::from(point.variance_m2),
            hits: u32::from(point.hits),
        }
    }
}
