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
//!
//! # Example
//! Hovering while turning to the left at a quarter of a turn a second, 1000 samples a second:
//! ```
//! use cslam_core::geometry::Vector3;
//! use cslam_core::inertial::{Imu, ImuConfig, ImuSample, Motion};
//!
//! let mut imu = Imu::new(ImuConfig::default());
//! let sample = |k: u64| ImuSample {
//!     time_ns: k * 1_000_000,
//!     // The noise that a sensor has: an axis that repeats its value is taken for stuck.
//!     rate_rad_per_s: Vector3::new(1e-3, -1e-3, 1.5708 + 1e-3) * if k % 2 == 0 { 1.0 } else { 0.999 },
//!     specific_force_m_per_s2: Vector3::new(0.01, -0.01, 9.81) * if k % 2 == 0 { 1.0 } else { 0.999 },
//! };
//! let steps: Vec<_> = (0..=100).filter_map(|k| imu.push(&sample(k))).collect();
//! assert!(steps.iter().all(|step| step.motion == Motion::Measured));
//! let turned_rad: f32 = steps.iter().map(|step| step.increment.delta_angle_rad.z).sum();
//! assert!((turned_rad - 0.157).abs() < 0.02, "{turned_rad}"); // a tenth of a second
//! ```

mod alignment;
mod check;
mod config;
mod health;
mod increment;
mod integrator;
mod magnetometer;
mod monitor;
mod step;
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
pub use step::{ImuStep, Motion};
pub use strapdown::Strapdown;
pub use turn::Turn;
pub use unit::Imu;

#[cfg(test)]
mod motion_tests;
