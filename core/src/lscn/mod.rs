//! Link state classification (LSCN): how probable it is that a path is the line of sight, one reflection, or more.
//!
//! The networks look at [`features`](LinkGeometry) of measured paths. Source: link-state.md.

mod bounce;
mod features;

pub use features::{
    Features, GEOMETRIC_INPUTS, GEOMETRIC_NAMES, GEOMETRIC_WITH_DEPARTURE_INPUTS, LinkGeometry,
    PAPER_INPUTS_PER_PATH, PAPER_NAMES, Received, paper_inputs,
};
