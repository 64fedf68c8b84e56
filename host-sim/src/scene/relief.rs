//! Ground that is level in the mean only: its height as a sum of cosines.

use core::f64::consts::{SQRT_2, TAU};

use crate::seeded::{Seeded, Source};

/// Cosines that are summed.
const WAVES: usize = 64;

/// A surface over the plane of its face, at one point: height along the normal, with its derivatives along two axes of the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shape {
    /// Height over the plane, m.
    pub(crate) height_m: f64,
    /// Slope along the first and the second axis.
    pub(crate) slope: [f64; 2],
    /// Second derivatives: along the first axis, along both, along the second, 1/m.
    pub(crate) bend_per_m: [f64; 3],
}

/// One cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave {
    /// Wave vector, rad/m.
    along_rad_per_m: [f64; 2],
    phase_rad: f64,
}

/// Relief of the ground: isotropic, Gaussian in the mean over many, with the correlation `exp(-(r/length)^2)`.
///
/// Equal amplitudes make the rms over the plane that of every draw. Each component of a wave vector has the standard
/// deviation `sqrt 2/length`, so the slope along any direction is `sqrt 2 rms/length` rms.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Relief {
    amplitude_m: f64,
    waves: Vec<Wave>,
}

impl Relief {
    /// Draws the relief of a seed; `None` for an rms of zero.
    pub(crate) fn draw(rms_m: f64, length_m: f64, seed: u64) -> Option<Self> {
        let mut random = Seeded::new(seed, Source::GroundRelief);
        let spread = SQRT_2 / length_m;
        let waves = (0..WAVES).map(|_| Wave {
            along_rad_per_m: [random.normal() * spread, random.normal() * spread],
            phase_rad: random.between(0.0, TAU),
        });
        let waves = waves.collect();
        (rms_m > 0.0).then(|| Self {
            amplitude_m: rms_m * (2.0 / WAVES as f64).sqrt(),
            waves,
        })
    }

    /// Height over the mean at a place, m.
    pub(crate) fn height_m(&self, [x, y]: [f64; 2]) -> f64 {
        let phase = |wave: &Wave| wave.along_rad_per_m[0] * x + wave.along_rad_per_m[1] * y + wave.phase_rad;
        self.waves.iter().map(|wave| libm::cos(phase(wave))).sum::<f64>() * self.amplitude_m
    }

    /// The surface at a place, with its derivatives along x and y.
    pub(crate) fn at(&self, [x, y]: [f64; 2]) -> Shape {
        let mut shape = Shape::default();
        for wave in &self.waves {
            let [kx, ky] = wave.along_rad_per_m;
            let (sin, cos) = libm::sincos(kx * x + ky * y + wave.phase_rad);
            let (sin, cos) = (self.amplitude_m * sin, self.amplitude_m * cos);
            shape.height_m += cos;
            shape.slope[0] -= kx * sin;
            shape.slope[1] -= ky * sin;
            shape.bend_per_m[0] -= kx * kx * cos;
            shape.bend_per_m[1] -= kx * ky * cos;
            shape.bend_per_m[2] -= ky * ky * cos;
        }
        shape
    }

    /// No height is greater, m.
    pub(crate) fn greatest_m(&self) -> f64 {
        self.amplitude_m * self.waves.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousand_draws_have_the_height_the_slope_and_the_correlation_asked_for() {
        let (rms_m, length_m, draws) = (0.15, 12.0, 1000);
        let (mut height, mut slopes, mut beside, mut beyond) = (0.0, [0.0; 2], 0.0, 0.0);
        for seed in 0..draws {
            let relief = Relief::draw(rms_m, length_m, seed).expect("not level");
            let here = relief.at([31.0, -7.0]);
            height += here.height_m * here.height_m;
            slopes = [0, 1].map(|i| slopes[i] + here.slope[i] * here.slope[i]);
            beside += here.height_m * relief.height_m([31.0 + 7.2, -7.0 + 9.6]);
            beyond += here.height_m * relief.height_m([31.0, -7.0 + 36.0]);
        }
        let mean = |sum: f64| sum / draws as f64;
        let rms = mean(height).sqrt();
        assert!((rms / rms_m - 1.0).abs() < 0.07, "{rms}");
        // One degree.
        for slope in slopes.map(|sum| mean(sum).sqrt()) {
            assert!(
                (slope / (SQRT_2 * rms_m / length_m) - 1.0).abs() < 0.07,
                "{slope}"
            );
            assert!((slope.atan().to_degrees() - 1.0).abs() < 0.1, "{slope}");
        }
        // One correlation length away, and three.
        let correlation = [beside, beyond].map(|sum| mean(sum) / (rms_m * rms_m));
        assert!((correlation[0] - libm::exp(-1.0)).abs() < 0.1, "{correlation:?}");
        assert!(correlation[1].abs() < 0.1, "{correlation:?}");
    }

    #[test]
    fn every_draw_has_its_rms_over_the_plane() {
        for seed in 0..5 {
            let relief = Relief::draw(0.15, 12.0, seed).expect("not level");
            let place = |k: u32| [f64::from(k % 200) * 5.3, f64::from(k / 200) * 5.1];
            let squares: f64 = (0..40_000).map(|k| relief.height_m(place(k)).powi(2)).sum();
            let rms = (squares / 40_000.0).sqrt();
            assert!((rms / 0.15 - 1.0).abs() < 0.06, "{seed}: {rms}");
            assert!((0..40_000).all(|k| relief.height_m(place(k)).abs() < relief.greatest_m()));
        }
    }

    #[test]
    fn derivatives_are_those_of_the_height() {
        let (relief, h) = (Relief::draw(0.15, 12.0, 3).expect("not level"), 1e-4);
        for k in 0..50 {
            let [x, y] = [f64::from(k) * 2.3, f64::from(k * k) * 0.11];
            let here = relief.at([x, y]);
            assert!((here.height_m - relief.height_m([x, y])).abs() < 1e-14);
            let z = |i: f64, j: f64| relief.height_m([x + i * h, y + j * h]);
            let slope = [z(1.0, 0.0) - z(-1.0, 0.0), z(0.0, 1.0) - z(0.0, -1.0)].map(|d| d / (2.0 * h));
            let bend = [
                (z(1.0, 0.0) - 2.0 * z(0.0, 0.0) + z(-1.0, 0.0)) / (h * h),
                (z(1.0, 1.0) - z(1.0, -1.0) - z(-1.0, 1.0) + z(-1.0, -1.0)) / (4.0 * h * h),
                (z(0.0, 1.0) - 2.0 * z(0.0, 0.0) + z(0.0, -1.0)) / (h * h),
            ];
            assert!((0..2).all(|i| (slope[i] - here.slope[i]).abs() < 1e-9), "{k}");
            assert!((0..3).all(|i| (bend[i] - here.bend_per_m[i]).abs() < 1e-6), "{k}");
        }
    }

    #[test]
    fn no_height_is_no_relief() {
        assert_eq!(Relief::draw(0.0, 12.0, 1), None);
        assert_ne!(Relief::draw(0.1, 12.0, 1), Relief::draw(0.1, 12.0, 2));
    }
}
