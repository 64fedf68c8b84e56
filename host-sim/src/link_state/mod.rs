//! The life of the link-state classifier on the host: data set, measurement errors, training, evaluation.
//!
//! The flight code in `cslam_core::link_state` computes features and runs the integer network. What leads there is here: the
//! ray tracer makes links ([`protocol`], [`dataset`]), errors of the stated size ([`errors`]) make measurements of them,
//! the flight code's own feature functions make samples ([`samples`]), a small deterministic trainer ([`training`]) makes
//! a float model ([`float_model`]), and that is rounded to the flight code's integers ([`quantise`], [`model_file`]).

pub mod boosting;
pub mod calibration;
pub mod curves;
pub mod dataset;
pub mod errors;
pub mod flight_samples;
pub mod float_model;
pub mod judge;
pub mod links;
pub mod model_file;
pub mod protocol;
pub mod quantise;
mod safetensors_file;
pub mod samples;
pub mod scores;
pub mod shipped;
pub mod training;
