//! Electrical properties of a face: a homogeneous half-space or a slab in air, with what its surface does to a wave.
//!
//! Values by name are those of ITU-R P.2040-3: relative permittivity `a f^b`, conductivity `c f^d` S/m, f in GHz.

use cslam_core::constants::VACUUM_PERMITTIVITY_F_PER_M;

/// Material of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    relative_permittivity: f64,
    permittivity_exponent: f64,
    conductivity_s_per_m: f64,
    conductivity_exponent: f64,
    thickness_m: Option<f64>,
    roughness: Roughness,
}

/// What a surface that is not smooth does to a wave.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Roughness {
    /// Standard deviation of the height of the grain, m: it weakens the coherent reflection.
    pub rms_height_m: f64,
    /// Lobe of what larger irregularities scatter; `None` when the material does not say.
    pub lobe: Option<Lobe>,
}

/// Effective roughness (Degli-Esposti et al. 2007), directive model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Scattering coefficient S, 0 to 1: the share S^2 of the reflected power is scattered.
    pub coefficient: f64,
    /// Exponent alpha of the lobe about the mirrored direction, 1 or more.
    pub exponent: u32,
}

/// Names that [`Material::named`] knows.
pub const MATERIAL_NAMES: [&str; 8] = [
    "concrete",
    "brick",
    "plasterboard",
    "wood",
    "glass",
    "metal",
    "asphalt",
    "medium_dry_ground",
];

/// a, b, c, d of ITU-R P.2040-3 (asphalt: to 40 GHz; medium dry ground is given to 10 GHz only), then S, alpha and the grain
/// in mm. The last three are typical of measurements between 28 and 60 GHz, with a factor of two of uncertainty.
const VALUES: [([f64; 4], f64, u32, f64); MATERIAL_NAMES.len()] = [
    ([5.24, 0.0, 0.0462, 0.7822], 0.3, 4, 1.0),
    ([3.91, 0.0, 0.0238, 0.16], 0.3, 4, 1.0),
    ([2.73, 0.0, 0.0085, 0.9395], 0.2, 8, 0.3),
    ([1.99, 0.0, 0.0047, 1.0718], 0.2, 8, 0.3),
    ([6.31, 0.0, 0.0036, 1.3394], 0.1, 20, 0.1),
    ([1.0, 0.0, 1e7, 0.0], 0.1, 20, 0.1),
    ([4.83, 0.0, 0.0108, 1.3969], 0.3, 4, 0.7),
    ([15.0, -0.1, 0.035, 1.63], 0.5, 1, 10.0),
];

impl Material {
    /// The material of the paper's simulation: relative permittivity 15, conductivity 0.015 S/m; smooth.
    pub const PAPER: Self = Self {
        relative_permittivity: 15.0,
        permittivity_exponent: 0.0,
        conductivity_s_per_m: 0.015,
        conductivity_exponent: 0.0,
        thickness_m: None,
        roughness: Roughness {
            rms_height_m: 0.0,
            lobe: None,
        },
    };

    /// A material from its relative permittivity (>= 1) and conductivity (>= 0, S/m), the same at all frequencies; `None`
    /// outside these ranges. Smooth.
    pub fn new(relative_permittivity: f64, conductivity_s_per_m: f64) -> Option<Self> {
        let valid = relative_permittivity.is_finite()
            && relative_permittivity >= 1.0
            && conductivity_s_per_m.is_finite()
            && conductivity_s_per_m >= 0.0;
        valid.then_some(Self {
            relative_permittivity,
            conductivity_s_per_m,
            ..Self::PAPER
        })
    }

    /// A material of [`MATERIAL_NAMES`] as a half-space, with the roughness that is typical of it.
    pub fn named(name: &str) -> Option<Self> {
        let index = MATERIAL_NAMES.iter().position(|known| *known == name)?;
        let ([a, b, c, d], coefficient, exponent, rms_height_mm) = VALUES[index];
        Some(Self {
            relative_permittivity: a,
            permittivity_exponent: b,
            conductivity_s_per_m: c,
            conductivity_exponent: d,
            thickness_m: None,
            roughness: Roughness {
                rms_height_m: 1e-3 * rms_height_mm,
                lobe: Some(Lobe {
                    coefficient,
                    exponent,
                }),
            },
        })
    }

    /// The same as a slab in air instead of a half-space; `None` unless the thickness is positive, m.
    pub fn slab(self, thickness_m: f64) -> Option<Self> {
        (thickness_m > 0.0 && thickness_m.is_finite()).then_some(Self {
            thickness_m: Some(thickness_m),
            ..self
        })
    }

    /// The same with another surface; `None` for a negative height, a coefficient beyond 0 to 1, or an exponent of 0.
    pub fn with_roughness(self, roughness: Roughness) -> Option<Self> {
        let lobe_is_sound = roughness
            .lobe
            .is_none_or(|lobe| (0.0..=1.0).contains(&lobe.coefficient) && lobe.exponent > 0);
        let height_is_sound = roughness.rms_height_m >= 0.0 && roughness.rms_height_m.is_finite();
        (lobe_is_sound && height_is_sound).then_some(Self { roughness, ..self })
    }

    /// Relative permittivity, real part; where it depends on frequency, at 1 GHz.
    pub fn relative_permittivity(&self) -> f64 {
        self.relative_permittivity
    }

    /// Conductivity, S/m; where it depends on frequency, at 1 GHz.
    pub fn conductivity_s_per_m(&self) -> f64 {
        self.conductivity_s_per_m
    }

    /// Thickness of a slab, m; `None` for a half-space.
    pub fn thickness_m(&self) -> Option<f64> {
        self.thickness_m
    }

    /// What its surface does to a wave.
    pub fn roughness(&self) -> &Roughness {
        &self.roughness
    }

    /// Complex relative permittivity [re, im], `eps_r - j sigma / (2 pi f eps_0)` for the time convention `e^{+jwt}`.
    pub fn complex_permittivity(&self, frequency_hz: f64) -> [f64; 2] {
        let omega = core::f64::consts::TAU * frequency_hz;
        let power = |exponent: f64| libm::pow(1e-9 * frequency_hz, exponent);
        [
            self.relative_permittivity * power(self.permittivity_exponent),
            -self.conductivity_s_per_m * power(self.conductivity_exponent)
                / (omega * VACUUM_PERMITTIVITY_F_PER_M),
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
    fn materials_by_name_have_their_permittivity_at_30_ghz() {
        // Worked out by hand from the recommendation's law.
        let expected = [
            ("concrete", 5.24, -0.396),
            ("brick", 3.91, -0.025),
            ("plasterboard", 2.73, -0.124),
            ("wood", 1.99, -0.108),
            ("glass", 6.31, -0.205),
            ("asphalt", 4.83, -0.749),
            ("medium_dry_ground", 10.675, -5.362),
        ];
        for (name, re, im) in expected {
            let [ours_re, ours_im] = Material::named(name).unwrap().complex_permittivity(30e9);
            assert!(
                (ours_re - re).abs() < 1e-3 && (ours_im - im).abs() < 6e-4,
                "{name}: {ours_re} {ours_im}"
            );
        }
        assert!(MATERIAL_NAMES.iter().all(|name| Material::named(name).is_some()));
        assert_eq!(Material::named("Brick"), None);
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for (permittivity, conductivity) in [(0.9, 0.0), (f64::NAN, 0.0), (2.0, -1e-9), (2.0, f64::INFINITY)]
        {
            assert_eq!(Material::new(permittivity, conductivity), None);
        }
        assert!(
            [0.0, -1.0, f64::NAN, f64::INFINITY]
                .iter()
                .all(|&d| Material::PAPER.slab(d).is_none())
        );
        for (rms_height_m, coefficient, exponent) in
            [(-1e-3, 0.1, 4), (0.0, 1.1, 4), (0.0, 0.1, 0), (f64::NAN, 0.1, 1)]
        {
            let lobe = Some(Lobe {
                coefficient,
                exponent,
            });
            assert_eq!(
                Material::PAPER.with_roughness(Roughness { rms_height_m, lobe }),
                None
            );
        }
    }
}
