//! What a face does to a wave that it reflects, at the scene's frequency: half-space or slab, grain, scattering lobe.
//! docs/propagation.md has the formulas.

use core::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::Propagation;
use crate::scene::{Lobe, Material, Patch, Scene};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

/// A material at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surface {
    /// Complex relative permittivity.
    eta: Complex<f64>,
    /// Of a slab: thickness over wavelength, times 2 pi.
    slab_rad: Option<f64>,
    /// Of a rough surface: `8 (pi sigma/lambda)^2`.
    grain: Option<f64>,
    /// With diffuse scattering: the lobe, and the amplitude that it leaves to the reflection.
    lobe: Option<(Lobe, f64)>,
}

impl Surface {
    pub(super) fn new(material: &Material, frequency_hz: f64, propagation: &Propagation) -> Self {
        let [re, im] = material.complex_permittivity(frequency_hz);
        let wavelength_m = SPEED_OF_LIGHT_M_PER_S / frequency_hz;
        let height = PI * material.roughness().rms_height_m / wavelength_m;
        let lobe = propagation.diffuse.map(|diffuse| {
            let lobe = material.roughness().lobe.unwrap_or(diffuse.lobe);
            (lobe, (1.0 - lobe.coefficient * lobe.coefficient).sqrt())
        });
        Self {
            eta: Complex::new(re, im),
            slab_rad: material
                .thickness_m()
                .map(|thickness_m| TAU * thickness_m / wavelength_m),
            grain: (propagation.roughness && height > 0.0).then_some(8.0 * height * height),
            lobe,
        }
    }

    /// Reflection coefficients [r_s, r_p] of the coherent wave at a cosine of incidence, 0 to 1.
    pub(super) fn reflection(&self, cos: f64) -> [Complex<f64>; 2] {
        let mut coefficients = self.smooth(cos);
        if self.grain.is_some() || self.lobe.is_some() {
            let left = self.lobe.map_or(1.0, |(_, left)| left) * self.coherent(cos);
            coefficients = coefficients.map(|r| r * left);
        }
        coefficients
    }

    /// The same of a smooth surface.
    pub(super) fn smooth(&self, cos: f64) -> [Complex<f64>; 2] {
        let half_space = fresnel(self.eta, cos);
        match self.slab_rad {
            None => half_space,
            Some(slab_rad) => {
                let phase = sqrt(self.eta - (1.0 - cos * cos)) * slab_rad;
                half_space.map(|r| slab(r, phase)[0])
            }
        }
    }

    /// Transmission coefficients [t_s, t_p] of a slab at a cosine of incidence, without the turn of its excess length, and that, rad;
    /// `None` for a half-space.
    pub(super) fn transmission(&self, cos: f64) -> Option<([Complex<f64>; 2], f64)> {
        let slab_rad = self.slab_rad?;
        let phase = sqrt(self.eta - (1.0 - cos * cos)) * slab_rad;
        let (sin, cosine) = libm::sincos(phase.re);
        let turned_back = Complex::new(cosine, sin);
        let through = fresnel(self.eta, cos).map(|r| slab(r, phase)[1] * turned_back);
        Some((through, phase.re - slab_rad * cos))
    }

    /// Share of the amplitude that the grain leaves to the coherent wave, `exp(-g) I0(g)`, 0 to 1.
    pub(super) fn coherent(&self, cos: f64) -> f64 {
        self.grain
            .map_or(1.0, |grain| scaled_bessel_i0(grain * cos * cos))
    }

    /// The scattering lobe.
    pub(super) fn lobe(&self) -> Option<Lobe> {
        self.lobe.map(|(lobe, _)| lobe)
    }
}

/// The surfaces of all faces of a scene.
#[derive(Clone, Debug)]
pub(super) struct Surfaces<'s> {
    scene: &'s Scene,
    /// One for all faces, or one for each of the scene's materials.
    surfaces: Vec<Surface>,
    uniform: bool,
    /// Of the windows in a facade, where they are of another material than the face.
    window: Option<Surface>,
}

impl<'s> Surfaces<'s> {
    /// As the scene has them.
    pub(super) fn of_scene(scene: &'s Scene, propagation: &Propagation) -> Self {
        let surface = |material| Surface::new(material, scene.frequency_hz(), propagation);
        let surfaces: Vec<Surface> = scene.materials().iter().map(surface).collect();
        let pane = scene.uneven().and_then(|_| Scene::pane());
        Self {
            scene,
            uniform: surfaces.len() == 1,
            surfaces,
            window: pane.as_ref().map(surface),
        }
    }

    /// One material on every face.
    pub(super) fn all_of(material: &Material, scene: &'s Scene, propagation: &Propagation) -> Self {
        Self {
            scene,
            surfaces: vec![Surface::new(material, scene.frequency_hz(), propagation)],
            uniform: true,
            window: None,
        }
    }

    /// That of a part of a face.
    pub(super) fn at(&self, face: u32, patch: &Patch<'_>) -> &Surface {
        let window = self.window.as_ref().filter(|_| patch.is_window());
        window.unwrap_or_else(|| self.of(face))
    }

    /// That of a face.
    pub(super) fn of(&self, face: u32) -> &Surface {
        &self.surfaces[if self.uniform {
            0
        } else {
            self.scene.material_of(face)
        }]
    }
}

/// Amplitudes [reflected, transmitted] of a slab in air whose one face reflects by r, of phase q across it (ITU-R P.2040-3,
/// 2.2.2): `R = r (1 - e^{-2jq})/(1 - r^2 e^{-2jq})`, `T = (1 - r^2) e^{-jq}/(1 - r^2 e^{-2jq})`.
pub(super) fn slab(r: Complex<f64>, q: Complex<f64>) -> [Complex<f64>; 2] {
    // e^{-jq}
    let (sin, cos) = libm::sincos(q.re);
    let across = Complex::new(cos, -sin) * libm::exp(q.im);
    let twice = across * across;
    let echo = Complex::new(1.0, 0.0) - r * r * twice;
    [
        r * (Complex::new(1.0, 0.0) - twice) / echo,
        (Complex::new(1.0, 0.0) - r * r) * across / echo,
    ]
}

/// `exp(-x) I0(x)` for x >= 0: the series, whose terms are all positive, below 30, and the asymptotic one above, to 1e-6.
fn scaled_bessel_i0(x: f64) -> f64 {
    if x < 30.0 {
        let quarter = 0.25 * x * x;
        let (mut sum, mut term, mut k) = (0.0, libm::exp(-x), 1.0);
        while term > 1e-17 * sum || k * k < quarter {
            sum += term;
            term *= quarter / (k * k);
            k += 1.0;
        }
        return sum;
    }
    let u = 1.0 / (8.0 * x);
    (1.0 + u * (1.0 + u * (4.5 + u * 37.5))) / (TAU * x).sqrt()
}

/// Fresnel coefficients [r_s, r_p] of a half-space of relative permittivity `eta` at the given cosine of incidence.
pub(super) fn fresnel(eta: Complex<f64>, cos: f64) -> [Complex<f64>; 2] {
    let q = sqrt(eta - (1.0 - cos * cos));
    let c = Complex::new(cos, 0.0);
    [(c - q) / (c + q), (eta * cos - q) / (eta * cos + q)]
}

/// Principal square root by real square roots alone, which are exact on every machine; without cancellation.
pub(super) fn sqrt(z: Complex<f64>) -> Complex<f64> {
    let magnitude = (z.re * z.re + z.im * z.im).sqrt();
    let larger = (0.5 * (magnitude + z.re.abs())).sqrt();
    if larger == 0.0 {
        return Complex::new(0.0, 0.0);
    }
    let smaller = z.im / (2.0 * larger);
    if z.re >= 0.0 {
        Complex::new(larger, smaller)
    } else {
        Complex::new(smaller.abs(), larger.copysign(z.im))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Roughness;

    #[test]
    fn fresnel_meets_its_limits() {
        let eta = Complex::new(15.0, 0.0);
        let n = 15.0_f64.sqrt();
        let [s, p] = fresnel(eta, 1.0);
        assert!((s.re - (1.0 - n) / (1.0 + n)).abs() < 1e-15 && s.im == 0.0);
        assert!((p + s).norm() < 1e-15, "at normal incidence r_p = -r_s");
        let [s, p] = fresnel(eta, 1e-12);
        assert!(
            (s + 1.0).norm() < 1e-10 && (p + 1.0).norm() < 1e-10,
            "grazing: both -1"
        );
        // Brewster's angle, tan = n.
        assert!(fresnel(eta, 1.0 / (1.0 + 15.0_f64).sqrt())[1].norm() < 1e-15);
    }

    #[test]
    fn complex_root_squares_back() {
        for z in [[3.0, -4.0], [14.2, -0.009], [-2.0, 0.5], [-2.0, -0.5], [0.0, 0.0]] {
            let z = Complex::new(z[0], z[1]);
            let root = sqrt(z);
            assert!((root * root - z).norm() < 1e-14 && root.re >= 0.0);
        }
    }

    fn surface(material: Material, roughness: bool) -> Surface {
        let propagation = Propagation {
            roughness,
            ..Propagation::default()
        };
        Surface::new(&material, 30e9, &propagation)
    }

    fn db(r: Complex<f64>) -> f64 {
        -20.0 * libm::log10(r.norm())
    }

    #[test]
    fn materials_reflect_as_the_table_says() {
        // Loss of a half-space at 30 GHz, dB: level, then TE and TM at 45 and 70 degrees. Worked out by hand.
        let table = [
            ("concrete", [8.1, 5.8, 11.7, 2.9, 22.0]),
            ("brick", [9.7, 7.0, 14.0, 3.5, 18.0]),
            ("plasterboard", [12.2, 8.9, 18.0, 4.5, 15.0]),
            ("wood", [15.3, 11.4, 23.0, 5.8, 13.0]),
            ("glass", [7.3, 5.2, 10.5, 2.6, 28.0]),
            ("metal", [0.0, 0.0, 0.0, 0.0, 0.0]),
            ("asphalt", [8.4, 6.1, 12.0, 3.0, 20.0]),
            ("medium_dry_ground", [5.0, 3.6, 7.1, 1.7, 17.0]),
        ];
        for (name, expected) in table {
            let surface = surface(Material::named(name).unwrap(), false);
            let at = |degrees: f64| surface.reflection(libm::cos(degrees.to_radians())).map(db);
            let ([level, _], [te_45, tm_45], [te_70, tm_70]) = (at(0.0), at(45.0), at(70.0));
            let ours = [level, te_45, tm_45, te_70, tm_70];
            for (ours, expected) in ours.iter().zip(expected) {
                let digits = if expected >= 12.0 { 0.6 } else { 0.06 };
                assert!((ours - expected).abs() < digits, "{name}: {ours} {expected}");
            }
        }
    }

    #[test]
    fn slabs_lose_what_the_table_says_and_no_more_when_lossless() {
        let loss_db = |name: &str, thickness_m: f64| {
            let surface = surface(Material::named(name).unwrap().slab(thickness_m).unwrap(), false);
            let phase = sqrt(surface.eta) * surface.slab_rad.unwrap();
            db(slab(fresnel(surface.eta, 1.0)[0], phase)[1])
        };
        for (name, thickness_m, least_db, most_db) in [
            ("concrete", 0.1, 48.0, 50.0),
            ("brick", 0.1, 4.0, 6.0),
            ("brick", 0.24, 8.0, 10.0),
            ("plasterboard", 0.0125, 2.8, 3.0),
            ("wood", 0.04, 8.5, 8.7),
            ("glass", 0.004, 1.2, 2.7),
            ("glass", 0.006, 1.8, 3.9),
        ] {
            let loss_db = loss_db(name, thickness_m);
            assert!((least_db..most_db).contains(&loss_db), "{name}: {loss_db}");
        }
        for (thickness, degrees) in (1..40).flat_map(|i| (0..9).map(move |j| (0.13 * f64::from(i), 10 * j))) {
            let cos = libm::cos(f64::from(degrees).to_radians());
            let eta = Complex::new(6.31, 0.0);
            let q = sqrt(eta - (1.0 - cos * cos)) * thickness;
            for r in fresnel(eta, cos) {
                let [reflected, transmitted] = slab(r, q);
                let power = reflected.norm_sqr() + transmitted.norm_sqr();
                assert!((power - 1.0).abs() < 1e-12, "{thickness} {degrees}: {power}");
            }
        }
        // With loss, a thick slab is a half-space, and a thin one is nothing.
        let concrete = Material::named("concrete").unwrap();
        let [thick, thin] = [2.0, 1e-7].map(|d| surface(concrete.slab(d).unwrap(), false).reflection(0.4));
        let half_space = surface(concrete, false).reflection(0.4);
        for i in 0..2 {
            assert!((thick[i] - half_space[i]).norm() < 1e-12 && thin[i].norm() < 1e-3);
        }
    }

    #[test]
    fn nothing_of_the_field_in_the_plane_is_reflected_at_brewsters_angle() {
        for eta in [2.73_f64, 6.31, 15.0] {
            let angle = libm::atan(eta.sqrt());
            let surface = surface(Material::new(eta, 0.0).unwrap(), false);
            let [s, p] = surface.reflection(libm::cos(angle));
            assert!(p.norm() < 1e-15 && s.norm() > 0.4, "{eta}: {s} {p}");
            // A slab's two faces have it in common.
            let pane = Material::new(eta, 0.0).unwrap().slab(0.0137).unwrap();
            assert!(self::surface(pane, false).reflection(libm::cos(angle))[1].norm() < 1e-15);
        }
    }

    #[test]
    fn the_grain_costs_the_coherent_wave_what_the_law_says() {
        let loss_db = |rms_height_m: f64, degrees: f64| {
            let roughness = Roughness {
                rms_height_m,
                lobe: None,
            };
            let rough = surface(Material::PAPER.with_roughness(roughness).unwrap(), true);
            -20.0 * libm::log10(rough.coherent(libm::cos(degrees.to_radians())))
        };
        for (height_mm, degrees, expected_db) in [
            (0.3, 0.0, 0.6),
            (1.0, 0.0, 5.6),
            (2.0, 0.0, 12.5),
            (0.3, 70.0, 0.1),
            (1.0, 70.0, 0.8),
            (2.0, 70.0, 2.9),
        ] {
            let loss_db = loss_db(1e-3 * height_mm, degrees);
            assert!(
                (loss_db - expected_db).abs() < 0.06,
                "{height_mm} mm, {degrees}: {loss_db} {expected_db}"
            );
        }
        // I0 by its integral, (1/pi) int_0^pi e^{x (cos t - 1)} dt, across the seam.
        for x in [0.0_f64, 0.01, 1.0, 12.0, 29.9, 30.1, 80.0] {
            let steps = 4000;
            let mean = (0..steps)
                .map(|i| libm::exp(x * (libm::cos(PI * (f64::from(i) + 0.5) / f64::from(steps)) - 1.0)))
                .sum::<f64>()
                / f64::from(steps);
            assert!((scaled_bessel_i0(x) - mean).abs() < 1e-6 * mean, "{x}");
        }
        // Off unless asked for.
        let brick = Material::named("brick").unwrap();
        assert_eq!(
            surface(brick, false).reflection(0.7),
            surface(brick, false).smooth(0.7)
        );
        assert_ne!(
            surface(brick, true).reflection(0.7),
            surface(brick, true).smooth(0.7)
        );
    }
}
