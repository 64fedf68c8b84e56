//! The world around the receiver, and the `cslam` command that puts the two together.

pub mod cli;
mod commands;
pub mod input;
pub mod paths;
pub mod scene;
pub mod tracer;
