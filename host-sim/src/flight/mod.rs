//! Flights: smooth seeded trajectories of the UAV between the buildings, and the drive of the GMT on the ground.

mod motion;
mod spline;

pub use motion::{Motion, Trajectory};
pub use spline::Spline;
