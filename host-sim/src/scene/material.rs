//! Electrical properties of a face: a homogeneous half-space.

use cslam_core::constants::VACUUM_PERMITTIVITY_F_PER_M;

/// Half-space material. The same for every face of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    relative_permittivity: f64,
    conductivity_s_per_m: f64,
}

impl Material {
    /// The material of the paper's simulation: relative permittivity 15, conductivity 0.015 S/m.
    pub const PAPER: Self = Self {
        relative_permittivity: 15.0,
        conductivity_s_per_m: 0.015,
    };

    /// A material from its relative permittivity (>= 1) and conductivity (>= 0, S/m); `None` outside these ranges.
    pub fn new(relative_permittivity: f64, conductivity_s_per_m: f64) -> Option<Self> {
        let valid = relative_permittivity.is_finite()
            && relative_permittivity >= 1.0
            && conductivity_s_per_m.is_finite()
            && conductivity_s_per_m >= 0.0;
        valid.then_some(Self {
            relative_permittivity,
            conductivity_s_per_m,
        })
    }

    /// Relative permittivity, real part.
    pub fn relative_permittivity(&self) -> f64 {
        self.relative_permittivity
    }

    /// Conductivity, S/m.
    pub fn conductivity_s_per_m(&self) -> f64 {
        self.conductivity_s_per_m
    }

    /// Complex relative permittivity [re, im], `eps_r - j sigma / (2 pi f eps_0)` for the time convention `e^{+jwt}`.
    pub fn complex_permittivity(&self, frequency_hz: f64) -> [f64; 2] {
        let omega = core::f64::consts::TAU * frequency_hz;
        [
            self.relative_permittivity,
            -self.conductivity_s_per_m / (omega * VACUUM_PERMITTIVITY_F_PER_M),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paper_material_at_30_ghz_has_the_published_loss() {
        let [re, im] = Material::PAPER.complex_permittivity(30e9);
        assert_eq!(re, 15.0);
        assert!((im + 0.008988).abs() < 5e-7, "{im}");
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for (permittivity, conductivity) in [(0.9, 0.0), (f64::NAN, 0.0), (2.0, -1e-9), (2.0, f64::INFINITY)]
        {
            assert_eq!(Material::new(permittivity, conductivity), None);
        }
    }
}
