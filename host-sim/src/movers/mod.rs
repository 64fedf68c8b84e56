//! Cars and people: where they are at every instant of a flight.
//!
//! A mover goes back and forth on a straight line, or stands, in closed form: where everything is at a time depends on the seed and
//! that time alone. Lines are found in free space when a world is made. What movers do to waves is the tracer's affair.

mod body;
mod config;
mod course;
mod draw;
mod room;

pub use body::{Body, BodyKind, Finish, Plate};
pub use config::{GivenMover, MoversConfig};
pub use course::Course;
pub use draw::Movers;
pub(crate) use room::{Floor, Room};

#[cfg(test)]
mod tests;
