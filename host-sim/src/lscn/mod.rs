//! The life of the link-state classifier on the host: data set, measurement errors, training, evaluation.
//!
//! The flight code in `cslam_core::lscn` computes features and runs the integer network. What leads there is here: the
//! ray tracer makes links, errors of the stated size make measurements of them, the flight code's own
//! feature functions make samples, and a small deterministic trainer makes a float model ([`float_model`]).

pub mod float_model;
pub mod model_file;
pub mod quantise;
mod safetensors_file;
