//! The association over whole sweeps, in worlds of planes.

mod flight;
mod phantoms;
mod surfaces;
pub(super) mod world;
