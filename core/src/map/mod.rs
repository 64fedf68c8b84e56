//! The bounded point cloud map.
//!
//! A cube of space (a voxel) holds at most one point. Reflections that fall into an occupied voxel are fused with what
//! is there, weighted by their variances, so flying past the same wall twice sharpens the map instead of filling it.
//!
//! # When the map is full
//! A point for a new voxel competes with a window of [`PointCloud::EVICTION_WINDOW`] stored points that moves on with
//! every such insertion: it replaces the most uncertain of them if that one is more uncertain than itself, and is
//! dropped otherwise. The cost of an insertion stays bounded, good points survive, and both outcomes are counted.
//!
//! ```text
//! p = (p1 / s1^2 + p2 / s2^2) s^2,  1 / s^2 = 1 / s1^2 + 1 / s2^2
//! ```
//!
//! # Example
//! A wall is seen twice at one place, the second time three times as surely: one point, nearer to the second.
//! ```
//! use cslam_core::geometry::{Matrix3, Position};
//! use cslam_core::map::{Insertion, PointCloud};
//! use cslam_core::reflection::ReflectionPoint;
//!
//! let mut map = PointCloud::<64>::new();
//! let seen = |x_m, sigma_m: f32| {
//!     let position = Position::new(x_m, 7.1, 2.1)?;
//!     Ok::<_, cslam_core::geometry::GeometryError>(ReflectionPoint { position, covariance: Matrix3::identity() * sigma_m.powi(2), distance_m: 12.0 })
//! };
//! assert_eq!(map.insert(&seen(4.05, 0.3)?), Ok(Insertion::Added));
//! assert_eq!(map.insert(&seen(4.15, 0.1)?), Ok(Insertion::Fused));
//! let point = map.points().next().expect("one");
//! assert!((point.position.to_array()[0] - 4.14).abs() < 1e-3 && point.hits == 2);
//! # Ok::<(), cslam_core::geometry::GeometryError>(())
//! ```

mod cloud;
mod voxel;

pub use cloud::{Counters, Insertion, MapPoint, PointCloud};
pub use voxel::{Voxel, VoxelError};
