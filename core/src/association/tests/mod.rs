//! The association over whole sweeps, in worlds of planes.

pub(super) mod world;
