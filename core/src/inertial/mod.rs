//! From the inertial sensor's samples to increments that a filter can trust, and what else inertial and magnetic sensors
//! say by themselves.
//!
//! ```text
//! sample --Timeline--> in order, gaps known --Monitor--> spikes out, faults flagged --Integrator--> increment
//!                                                                                         |
//! samples at rest --RestAlignment--> gyroscope bias, tilt        Strapdown (position, velocity, attitude)
//! ```
//! [`Imu`] joins the upper row. Every 10 or 20 ms it gives an [`ImuStep`]: the
//! increment, whether it was measured or is a guess ([`Motion`]), and the variance to add for what the sensor could not
//! see. What happens in a fault is decided here, not in the filter:
//!
//! | fault | found by | policy |
//! |---|---|---|
//! | repeated or late sample | time stamp | dropped, counted |
//! | missing samples | time stamp | bridged by the mean of both sides, variance of an unknown jerk added |
//! | stopped | no sample for [`ImuConfig::gap_ns`] | coasting: constant velocity, variance of an unknown motion |
//! | stuck | an axis repeats its value [`ImuConfig::stuck_samples`] times | coasting until it moves again |
//! | saturated | an axis has jumped to the end of its range and stays | coasting until it comes back |
//! | clipped | an axis has grown to the end of its range | used, variance of an unknown motion added |
//! | spike | far from the median of the last three | replaced by the median; if it lasts, paid back as real |
//! | not a number | value | as missing |
//!
//! Source of the nominal equations: docs/localization.md, "The model". Rotation of the earth (0.004 deg/s) is part of the
//! gyroscope's bias here.

mod alignment;
mod config;
mod health;
mod increment;
mod integrator;
mod magnetometer;
mod monitor;
mod strapdown;
mod timeline;
mod turn;
mod unit;

pub use alignment::{Alignment, RestAlignment, RestConfig, RestStatus};
pub use config::ImuConfig;
pub use health::{ImuCounters, ImuHealth};
pub use increment::{ImuErrors, ImuIncrement, ImuSample};
pub use integrator::Integrator;
pub use magnetometer::{Heading, HeadingRefusal, MagneticField};
pub use strapdown::Strapdown;
pub use turn::Turn;
pub use unit::{Imu, ImuStep, Motion};

#[cfg(test)]
mod motion_tests;
