//! What a tracer follows besides line of sight and specular reflections.

use crate::scene::Lobe;

/// Effects beyond line of sight and specular reflection; by default none, and then nothing of what a tracer gives changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Propagation {
    /// Diffraction at edges.
    pub diffraction: Option<Diffraction>,
    /// Whether the grain of rough materials weakens their reflections.
    pub roughness: bool,
    /// Diffuse scattering off faces.
    pub diffuse: Option<Diffuse>,
    /// Whether links tell the horizontal component of reflected waves too.
    pub cross_polarisation: bool,
}

impl Propagation {
    /// Whether paths of other kinds than line of sight and reflections may come.
    pub(super) fn has_kinds(&self) -> bool {
        self.diffraction.is_some() || self.diffuse.is_some()
    }
}

/// Single diffraction at edges: kinds D, RD and DR. docs/propagation.md says what is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffraction {
    /// Weaker diffracted paths are dropped: path gain with a vertical half-wave dipole at both ends, dB.
    pub least_gain_db: f64,
    /// No more than so many diffracted paths a link are kept, the strongest ones.
    pub most_paths: usize,
    /// Whether the rims of open faces diffract, as screens that are black on their back. Edges of solids always do.
    pub rims: bool,
}

impl Default for Diffraction {
    /// Down to -165 dB, at most 24, without rims.
    fn default() -> Self {
        Self {
            least_gain_db: -165.0,
            most_paths: 24,
            rims: false,
        }
    }
}

/// Diffuse scattering off faces, single bounce (kind S), as tiles of fixed complex amplitude. Reflections and diffractions lose
/// what is scattered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Seed of the tiles' phases and of where in a tile it scatters.
    pub seed: u64,
    /// Lobe of materials that have none of their own.
    pub lobe: Lobe,
    /// Side of a tile, m: shadows are followed to a quarter of it.
    pub tile_m: f64,
    /// No more than so many scattered paths a link, those that gather weak tiles included.
    pub most_paths: usize,
    /// Tiles this much under the link's strongest path are gathered, one path a face, dB.
    pub range_db: f64,
}

impl Default for Diffuse {
    /// Seed 1, S = 0.3 and exponent 4 (brick and concrete), tiles of 1 m, at most 300 paths, 45 dB.
    fn default() -> Self {
        Self {
            seed: 1,
            lobe: Lobe {
                coefficient: 0.3,
                exponent: 4,
            },
            tile_m: 1.0,
            most_paths: 300,
            range_db: 45.0,
        }
    }
}
