//! What path estimation gives: a path with what else was seen of it, and what became of a beam.

use crate::geometry::{Body, Frame, Gmt, Rotation, World};
use crate::path::{Path, RangeRate};

/// A path with what else the receiver saw of it. Its departure is in frame `D`: in the axes of the GMT as it is estimated, for only a beacon tells
/// how these stand in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedPath<D: Frame = Gmt> {
    /// Delay, angles and covariance. The covariance is that of noise (inverse Fisher information) and of the errors of the receive elements
    /// ([`ElementErrors`](super::ElementErrors)), as if each path met another draw of them; what they share, attitude and clock add their own.
    pub path: Path<Body, f32, D>,
    /// Transmit beam in which the path was strongest.
    pub beam: u16,
    /// SNR per element and active subcarrier in that beam, mean over the elements, dB.
    pub snr_db: f32,
    /// Power per active subcarrier in that beam, summed over the elements, amplitude units of the blocks squared.
    pub energy: f32,
    /// How fast it grows, where later looks told.
    pub range_rate: Option<RangeRate>,
}

impl EstimatedPath {
    /// The same path with its departure in world axes, by how the GMT stands.
    #[must_use]
    pub fn with_departure_in_world(&self, gmt_attitude: &Rotation<Gmt, World>) -> EstimatedPath<World> {
        EstimatedPath {
            path: Path {
                c_tau_m: self.path.c_tau_m,
                aoa: self.path.aoa,
                aod: self.path.aod.map(|departure| departure.to_world(gmt_attitude)),
                covariance: self.path.covariance,
            },
            beam: self.beam,
            snr_db: self.snr_db,
            energy: self.energy,
            range_rate: self.range_rate,
        }
    }
}

/// What one beam gave.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BeamReport {
    /// Paths found in it.
    pub paths: u8,
    /// Mean power of a sample, all channels added, amplitude units squared.
    pub power: f32,
    /// The beam was not searched: by its power it holds no path worth reporting, or only noise when it was not its turn, or the cheap stage
    /// saw that no such path is in it but those that an earlier beam showed better.
    pub weak: bool,
    /// The beam was not searched because the sweep's work was spent, see [`WorkLimit`](super::WorkLimit).
    pub left_out: bool,
    /// Lanes that clipped in the transform, see [`crate::signal::BeamTaps::clips`].
    pub clips: u32,
    /// See [`crate::signal::BeamTaps::unexamined`].
    pub unexamined: u32,
}
