//! Other radios than the default (docs/radio.md): one path over its Cramer-Rao bound, the whole receiver in a small scene, and a simulated world
//! that has another radio's antennas.
//!
//! The samples of the first two are made here, from docs/signal-model.md, by no code of the receiver; those of the world are held against such. What is
//! measured is printed: `cargo test -p cslam-host-sim --test other_radio -- --nocapture`; docs/radio.md has the tables.

mod flight;
mod paths;
mod signal;
mod whole_receiver;
mod world;
