//! Surfaces that reflect: one store, one entry for each wall, floor and the ground, whatever paths show it.
//!
//! A surface is a plane with mean and covariance, and a Bernoulli existence, as a master virtual anchor is (Leitinger et al.,
//! arXiv 2211.09241). Paths give birth to it ([`birth`]), say for or against it ([`Evidence`]) and correct its plane; which path
//! is of which surface is the association's to say (`association`).
//!
//! # Example
//! One path suggests a wall; it is kept as tentative until more is seen of it.
//! ```
//! use cslam_core::geometry::{Direction, Matrix3, Vector3};
//! use cslam_core::path::diagonal_covariance;
//! use cslam_core::surfaces::{Status, SurfaceConfig, Surfaces, birth};
//!
//! let path = birth::BirthPath {
//!     transmitter_m: Vector3::new(0.0, 0.0, 2.0),
//!     uav_m: Vector3::new(0.0, 30.0, 2.0),
//!     length_m: 50.0,
//!     arrival: Direction::from_vector(Vector3::new(0.8, -0.6, 0.0))?,
//!     path_covariance: diagonal_covariance(0.02, 2e-3),
//!     uav_covariance_m2: Matrix3::identity() * 1e-4,
//! };
//! let suggested = birth::from_single(&path, &SurfaceConfig::default()).expect("a wall at x = 20 m");
//! let mut surfaces = Surfaces::<8>::new(SurfaceConfig::default());
//! let id = surfaces.add(&suggested, &Vector3::new(0.0, 0.0, 2.0), 1).expect("there is room");
//! let wall = surfaces.get(id).expect("just added");
//! assert!(wall.status == Status::Tentative && (wall.plane.offset_m() + 20.0).abs() < 1e-3); // its normal is (-1, 0, 0)
//! # Ok::<(), cslam_core::geometry::GeometryError>(())
//! ```

pub mod birth;
mod config;
mod evidence;
mod store;
mod surface;
mod waiting;

pub use config::SurfaceConfig;
pub use evidence::{Evidence, Sighting, displacement_log_ratio};
pub(crate) use store::count;
pub use store::{GROUND, StatusChanges, SurfaceCounters, Surfaces};
pub use surface::{Kind, Status, Surface};
pub use waiting::{Waiting, WaitingPoints};

/// Most reflections of a path that is followed.
/// Capacity: work of an association.
pub const MOST_REFLECTIONS: usize = 3;

/// Height over a surface under which an end or a point lies in it, m.
/// Numerical: a guard against legs that run within a surface.
pub(crate) const LEAST_HEIGHT_M: f64 = 0.1;

/// Surfaces that a path met, from the transmitter to the UAV; none: the line of sight.
pub type SurfaceIds = heapless::Vec<u16, MOST_REFLECTIONS>;
