//! Surfaces that reflect: one store, one entry for each wall, floor and the ground, whatever paths show it.
//!
//! A surface is a plane with mean and covariance, and a Bernoulli existence, as a master virtual anchor is (Leitinger et al.,
//! arXiv 2211.09241). Paths give birth to it ([`birth`]), say for or against it ([`Evidence`]) and correct its plane; which path
//! is of which surface is the association's to say (`association`).

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
