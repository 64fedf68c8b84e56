//! C interface of the receiver: `include/cslam.h` is made of this crate, docs/bindings.md shows it at work.
//!
//! What holds everywhere:
//! - Memory is the caller's: `_size` and `_align` say how much, `_init` builds in it, `_end` gives it back. Nothing is allocated.
//! - Every function gives a [`CslamStatus`] and reads no pointer before it is checked for null and alignment. What a status cannot
//!   tell is whether a pointer that looks right points to memory that is there.
//! - Every struct begins with its size, set by the caller, so that it can grow.
//! - A handle is good for one thread at a time: a second one that comes meanwhile gets [`CslamStatus::Busy`].
//! - No callback, no global state, no `errno`.
#![no_std]

#[cfg(target_endian = "big")]
compile_error!("samples are pairs of little-endian int16: a big-endian processor would swap I and Q");

#[cfg(feature = "std")]
extern crate std;

mod classifier;
mod estimator;
mod estimator_values;
#[cfg(all(feature = "panic-handler", not(feature = "std")))]
mod panic;
mod pointer;
mod receiver;
mod receiver_outputs;
mod receiver_parts;
mod receiver_values;
mod slot;
mod solver;
mod status;
mod values;

pub use classifier::*;
pub use estimator::*;
pub use estimator_values::*;
pub use receiver::*;
pub use receiver_outputs::*;
pub use receiver_values::*;
pub use solver::*;
pub use status::*;
pub use values::*;
