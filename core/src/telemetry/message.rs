//! What a packet says.

use serde::{Deserialize, Serialize};

use crate::reflection::{InputError, Rejection};

/// One packet's content. New kinds are appended: the discriminant is part of the wire format.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Message {
    /// A reflection point went into the map.
    Point(PointReport),
    /// A path was not a first-order reflection.
    Rejection(RejectionReport),
    /// A measurement was no path at all.
    Input(InputReport),
    /// Totals, at the end of a stream.
    Summary(Summary),
}

/// An accepted reflection point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointReport {
    /// Index of the link (one GMT position heard at one UAV position).
    pub link: u32,
    /// Index of the path in the link, 0 is the strongest.
    pub path: u8,
    /// Position in the world, m.
    pub position_m: [f32; 3],
    /// Root of the trace of the position's covariance, m.
    pub sigma_m: f32,
}

/// A rejected path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RejectionReport {
    /// Index of the link.
    pub link: u32,
    /// Index of the path in the link.
    pub path: u8,
    /// Why.
    pub reason: Rejection,
}

/// A measurement that could not be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputReport {
    /// Index of the link.
    pub link: u32,
    /// Index of the path in the link.
    pub path: u8,
    /// Why.
    pub error: InputError,
}

/// Totals since the start; `points + rejected + invalid + damaged` is the number of measurements received.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Summary {
    /// Measurements that became points.
    pub points: u32,
    /// Measurements rejected as not first-order.
    pub rejected: u32,
    /// Measurements that were no paths.
    pub invalid: u32,
    /// Records damaged on the way to the receiver.
    pub damaged: u32,
    /// Occupied voxels of the map.
    pub map_points: u32,
    /// Points that a full or too small map did not take.
    pub map_dropped: u32,
}
