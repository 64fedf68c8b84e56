//! What a face does to a wave that it reflects, at the scene's frequency.

use nalgebra::Complex;

use crate::scene::{Material, Scene};

/// A material at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surface {
    /// Complex relative permittivity.
    eta: Complex<f64>,
}

impl Surface {
    pub(super) fn new(material: &Material, frequency_hz: f64) -> Self {
        let [re, im] = material.complex_permittivity(frequency_hz);
        Self {
            eta: Complex::new(re, im),
        }
    }

    /// Reflection coefficients [r_s, r_p] of the coherent wave at a cosine of incidence, 0 to 1.
    pub(super) fn reflection(&self, cos: f64) -> [Complex<f64>; 2] {
        fresnel(self.eta, cos)
    }
}

/// The surfaces of all faces of a scene.
#[derive(Clone, Debug)]
pub(super) struct Surfaces<'s> {
    scene: &'s Scene,
    /// One, or one for each of the scene's materials.
    surfaces: Vec<Surface>,
}

impl<'s> Surfaces<'s> {
    /// As the scene has them.
    pub(super) fn of_scene(scene: &'s Scene) -> Self {
        Self::all_of(scene.material(), scene)
    }

    /// One material on every face.
    pub(super) fn all_of(material: &Material, scene: &'s Scene) -> Self {
        Self {
            scene,
            surfaces: vec![Surface::new(material, scene.frequency_hz())],
        }
    }

    /// That of a face.
    pub(super) fn of(&self, face: u32) -> &Surface {
        debug_assert!((face as usize) < self.scene.faces().len());
        &self.surfaces[0]
    }
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
}
