//! Where the UAV is, how it is turned, and what its clock shows: the pose behind every point of the map.
//!
//! A point's error is the pose's error times its distance, so this floor decides the map. Inertial increments
//! ([`ImuIncrement`]) carry the pose from one radio measurement to the next; the measurements carry it back.
//!
//! Types that all parts share stand here: what an inertial sensor delivers ([`ImuSample`]), its integral over a step
//! ([`ImuIncrement`]), the errors that are taken out of it ([`ImuErrors`]), and the result ([`Pose`]).
//!
//! [`crate::cslam`] joins the parts. [`imu`]: from samples to increments, whatever happens to the sensor. [`filter`]: the
//! error-state filter. [`bsm`]: direction and delay from beam squint symbols.
//! [`hpc`]: the paper's localization, the baseline.

pub mod bsm;
pub mod filter;
pub mod hpc;
pub mod imu;
mod inertial;
mod pose;

pub use inertial::{ImuErrors, ImuIncrement, ImuSample};
pub use pose::{ClockEstimate, Pose};
