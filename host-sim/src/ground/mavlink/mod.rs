//! MAVLink 2 out: what ground software and autopilots of the field read, for each UAV a system of its own.
//!
//! North-east-down and forward-right-down axes exist only here; everything else of this project is east-north-up and
//! forward-left-up. The handful of messages is written out here: one of them is in a dialect that a library would compile whole.
//! `pymavlink`, the reference implementation, reads them in the tests. docs/ground-station.md says what is sent when,
//! docs/autopilots.md what an autopilot makes of it.

mod axes;
mod frame;
mod messages;
mod odometry;
mod out;

pub use axes::{to_frd, to_ned};
pub use frame::Framer;
pub use messages::{
    EstimatorStatus, Frame, Heartbeat, Message, Obstacle, Odometry, StatusText, estimator_flags,
};
pub use out::Out;
