//! The transmissions that blocks can belong to.

use cslam_firmware::front_end::PILOTS_OF_A_BEAM;

/// Which transmissions the blocks belong to; `cslam:beam` counts within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Codebook {
    /// The 72 beams of a sweep.
    Beams,
    /// Pilots, the beams of a sweep each sent twice again: a first one has the number of its beam, a second one 72 more.
    Pilots,
    /// Beam squint symbols, sequential scheme: 11 a face.
    SquintSequential,
    /// Beam squint symbols, raster scheme: one a face.
    SquintRaster,
}

impl Codebook {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Beams,
        Self::Pilots,
        Self::SquintSequential,
        Self::SquintRaster,
    ];

    /// Value of `cslam:codebook`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Beams => "gmt-72",
            Self::Pilots => "gmt-72-pilots",
            Self::SquintSequential => "bsm-seq",
            Self::SquintRaster => "bsm-raster",
        }
    }

    /// Transmissions in it.
    pub const fn len(self) -> usize {
        match self {
            Self::Beams => 72,
            Self::Pilots => PILOTS_OF_A_BEAM as usize * Self::Beams.len(),
            Self::SquintSequential => 33,
            Self::SquintRaster => 3,
        }
    }

    /// Never.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The one of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }
}
