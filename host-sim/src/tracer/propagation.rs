//! What a tracer follows besides line of sight and specular reflections.

/// Effects beyond line of sight and specular reflection; by default none, and then nothing of what a tracer gives changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Propagation {
    /// Diffraction at edges.
    pub diffraction: Option<Diffraction>,
}

impl Propagation {
    /// Whether paths of other kinds than line of sight and reflections may come.
    pub(super) fn has_kinds(&self) -> bool {
        self.diffraction.is_some()
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
