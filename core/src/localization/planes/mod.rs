//! Mapped planes: walls and floors whose mirror images of the GMT hold the pose when the GMT itself is out of sight.
//!
//! A wave that was reflected once off a plane seems to come straight from the GMT's mirror image behind it
//! ([`Plane::image`]): delay and angle of arrival then measure the pose as line of sight does (localization.md section 2).

mod plane;

pub use plane::Plane;
