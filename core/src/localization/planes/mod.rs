//! Mapped planes: walls and floors whose mirror images of the GMT hold the pose when the GMT itself is out of sight.
//!
//! A wave that was reflected once off a plane seems to come straight from the GMT's mirror image behind it
//! ([`Plane::image`]): delay and angle of arrival then measure the pose as line of sight does (docs/localization.md, "The
//! model").
//!
//! [`PlaneMap`] finds them in the point cloud, bounded in memory and in work per call. Which one a reflection came from is the filter's
//! to say (`localization/filter/reflection.rs`).

mod extract;
mod fit;
mod plane;
#[cfg(test)]
mod tests;

pub use extract::{PlaneConfig, PlaneCounters, PlaneMap, Surface};
pub use fit::{Orientation, PlaneNoise};
pub use plane::Plane;
