//! The radio channel: from the propagation paths of a link to the int16 samples that a receiver's front end makes of them.
//!
//! A crate of its own because most of the work of a simulated flight is done here: it is optimised in builds for tests as well.

pub mod input;
pub mod paths;
pub mod random;
pub mod synthesis;
