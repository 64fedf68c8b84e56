//! Mapped planes: walls and floors whose mirror images of the GMT hold the pose when the GMT itself is out of sight.
//!
//! A wave that was reflected once off a plane seems to come straight from the GMT's mirror image behind it
//! ([`Plane::image`]): delay and angle of arrival then measure the pose as line of sight does (docs/localization.md, "The
//! model").

//!
//! [`PlaneMap`] finds them in the point cloud, bounded in memory and in work per call; [`PlaneMap::associate`] says
//! which one a reflection came from, or that it cannot be said.

mod associate;
mod extract;
mod fit;
mod plane;
#[cfg(test)]
mod tests;

pub use associate::Association;
pub use extract::{PlaneConfig, PlaneCounters, PlaneMap, Surface};
pub use fit::{Orientation, PlaneNoise};
pub use plane::Plane;
