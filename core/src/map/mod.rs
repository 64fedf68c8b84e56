//! The bounded point cloud map.
//!
//! A cube of space (a voxel) holds at most one point. Reflections that fall into an occupied voxel are fused with what
//! is there, weighted by their variances, so flying past the same wall twice sharpens the map instead of filling it.
//!
//! # When the map is full
//! A point for a new voxel competes with a window of [`PointCloud::EVICTION_WINDOW`] stored points that moves on with
//! every such insertion: it replaces the most uncertain of them if that one is more uncertain than itself, and is
//! dropped otherwise. The cost of an insertion stays bounded, good points survive, and both outcomes are counted.

mod cloud;
mod voxel;

pub use cloud::{Counters, Insertion, MapPoint, PointCloud};
pub use voxel::{Voxel, VoxelError};
