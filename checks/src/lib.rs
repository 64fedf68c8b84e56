//! What chips and hosts run to prove themselves: equal outputs of two machines, or of two sets of kernels, mean equal bits.
//!
//! Each module runs a part of the receiver on inputs of its own and gives digests or lines of all that comes of it. Nothing here flies:
//!
//! | module | what it runs |
//! |---|---|
//! | [`front_end`] | the path estimator's kernels, on blocks from silence to full scale |
//! | [`link_state`] | the trees and networks of the link state |
//! | [`association`] | data association, on a round of walls |
//! | [`sweep`] | the whole path estimator, on recorded sweeps |
//!
//! The binaries (`src/bin`) are images for boards that QEMU emulates. A board is chosen by a feature; see `build.rs`. The tests of the
//! workspace run the same on the host and compare.
#![no_std]

pub mod association;
mod digest;
pub mod front_end;
pub mod link_state;
mod random;
pub mod sweep;
