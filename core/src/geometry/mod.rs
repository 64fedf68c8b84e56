//! Frames, directions, positions and rotations.
//!
//! The antenna array measures an angle of arrival in body axes, the reflection solver wants it in world axes, and the
//! two have the same shape. So a frame is a type parameter: [`Direction<Body>`] and [`Direction<World>`] do not mix,
//! and the only way from one to the other is a [`Rotation`].
//!
//! ```
//! use cslam_core::geometry::{Body, Direction, Rotation, World};
//!
//! let ahead: Direction<Body> = Direction::from_zenith_azimuth(core::f32::consts::FRAC_PI_2, 0.0)?;
//! // Nose to the north: a yaw of 90 degrees in east-north-up.
//! let attitude: Rotation<Body, World> = Rotation::from_yaw_pitch_roll(core::f32::consts::FRAC_PI_2, 0.0, 0.0)?;
//! let seen: Direction<World> = attitude.apply(ahead);
//! assert!((seen.azimuth_rad() - core::f32::consts::FRAC_PI_2).abs() < 1e-6);
//! # Ok::<(), cslam_core::geometry::GeometryError>(())
//! ```
//!
//! A body-frame direction where a world-frame one is wanted does not compile:
//!
//! ```compile_fail,E0308
//! use cslam_core::geometry::{Body, Direction, World};
//!
//! fn solve(_aoa: Direction<World>) {}
//!
//! let measured: Direction<Body> = Direction::from_zenith_azimuth(1.0, 0.0).unwrap();
//! solve(measured); // expected `Direction<World>`, found `Direction<Body>`
//! ```

mod direction;
mod error;
mod frame;
mod plane;
mod position;
mod real;
mod rotation;

pub use direction::Direction;
pub use error::GeometryError;
pub use frame::{Body, Frame, Gmt, World};
pub use nalgebra::{Complex, Matrix3, Vector3};
pub use plane::Plane;
pub use position::Position;
pub use real::Real;
pub use rotation::Rotation;
