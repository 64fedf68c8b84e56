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
#[cfg(all(feature = "panic-handler", not(feature = "std")))]
mod panic;
mod pointer;
mod receiver;
mod slot;
mod solver;
mod status;
mod values;

pub use classifier::{CslamProbabilities, cslam_classify};
pub use estimator::{
    CslamBeamReport, CslamEstimator, CslamEstimatorConfig, CslamPath, cslam_block_power,
    cslam_estimator_align, cslam_estimator_config_default, cslam_estimator_config_wrong_field,
    cslam_estimator_end, cslam_estimator_finish, cslam_estimator_init, cslam_estimator_push_beam,
    cslam_estimator_size, cslam_estimator_sweep,
};
pub use receiver::{
    CslamBeacon, CslamMapPoint, CslamPose, CslamReceiver, CslamReceiverConfig, cslam_receiver_align,
    cslam_receiver_beacon, cslam_receiver_beam, cslam_receiver_close, cslam_receiver_elapse,
    cslam_receiver_end, cslam_receiver_imu, cslam_receiver_init, cslam_receiver_magnetometer,
    cslam_receiver_map, cslam_receiver_pose, cslam_receiver_powers, cslam_receiver_size,
    cslam_receiver_squint, cslam_receiver_take_packets, cslam_receiver_timing, cslam_receiver_uplink,
};
pub use solver::{CslamGates, CslamPoint, cslam_gates_default, cslam_solve, cslam_verdict_text};
pub use status::{CslamStatus, cslam_status_text};
pub use values::{CslamLink, CslamMeasuredPath};
