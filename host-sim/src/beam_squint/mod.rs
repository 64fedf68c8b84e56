//! Accuracy of beam squint localization against its physical limit.
//!
//! Every trial goes the whole way: a UAV somewhere before a face of the GMT, transmit beams and squint symbols through
//! channel, noise, gain control and a 12-bit converter, path estimation for the arrival and the delay of the line of
//! sight, then exactly the code that flies. Trials are independent streams of one seed, so figures do not depend on the
//! number of threads.

pub mod bound;
mod case;
mod near;
mod receiver;
mod trial;

pub use case::Case;
pub use near::{NearRow, near};
pub use trial::{Row, run};
