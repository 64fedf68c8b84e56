//! Flights: smooth seeded trajectories of the UAV between the buildings, and the drive of the GMT on the ground.
//!
//! A [`FlightPlan`] is drawn from an [`Obstacles`] world by a roadmap of free lines, walked within the [`Limits`] of a
//! quadrotor, and smoothed into a [`Spline`] whose [`Motion`] is known in closed form at every instant.

mod config;
mod contact;
mod dryden;
mod given;
mod gmt;
mod heading;
mod knots;
mod motion;
mod obstacles;
mod plan;
mod roadmap;
mod route;
mod scene;
mod spline;
mod wind;

pub use config::{FlightConfig, Limits};
pub use contact::Contact;
pub use given::{GivenFlight, GivenPlace};
pub use gmt::{GmtTrack, Schedule};
pub use heading::Heading;
pub use motion::{Motion, Trajectory};
pub use obstacles::{Obstacles, Tube};
pub use plan::FlightPlan;
pub use spline::Spline;
pub use wind::WindConfig;
