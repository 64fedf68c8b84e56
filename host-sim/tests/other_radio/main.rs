//! Another radio than the default, `profile::quad_4x16_gmt_48`: its receiver over samples that are made here from docs/signal-model.md,
//! and a simulated world that has its antennas.
//!
//! What is measured is printed: `cargo test -p cslam-host-sim --test other_radio -- --nocapture`; docs/radio.md has the tables.

mod model;
mod single_path;
mod world;
