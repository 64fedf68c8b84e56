//! The fixed-point front end against its definition in f64, at the extremes of its input, and as a detector.

#![allow(clippy::expect_used, reason = "a helper of a test fails by panicking")]

mod accuracy;
mod detection;
mod extremes;
mod oracle;
