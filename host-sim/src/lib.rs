//! The world around the receiver, and the `cslam` command that puts the two together.

pub mod allan;
pub mod cli;
mod commands;
pub mod flight;
pub mod input;
pub mod paths;
pub mod seeded;
pub mod sensors;
