//! The association over whole sweeps, in worlds of planes.

mod phantoms;
mod surfaces;
pub(super) mod world;
