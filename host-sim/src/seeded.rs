//! Seeded random numbers that are the same on every machine, for any number of threads.
//!
//! One ChaCha8 generator per source of randomness: the seed picks the world, the stream number picks the source. So a
//! source that draws more or fewer numbers never disturbs another one, and an error switched off leaves all other
//! errors as they were.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The sources of randomness of a flight and its sensors. The number of a source is part of what a seed means: add at
/// the end, never renumber.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Source {
    /// Scale, misalignment and turn-on bias of the gyroscope.
    GyroscopeBuild = 0x5e00,
    /// White noise of the gyroscope.
    GyroscopeNoise,
    /// In-run bias of the gyroscope.
    GyroscopeDrift,
    /// Scale, misalignment and turn-on bias of the accelerometer.
    AccelerometerBuild,
    /// White noise of the accelerometer.
    AccelerometerNoise,
    /// In-run bias of the accelerometer.
    AccelerometerDrift,
    /// Hard and soft iron of the magnetometer.
    MagnetometerBuild,
    /// White noise of the magnetometer.
    MagnetometerNoise,
    /// Magnetic disturbance by the surroundings.
    MagneticDisturbance,
    /// Heading and tilt error of the GMT.
    GmtAttitude,
    /// Position error of the GMT.
    GmtPosition,
    /// Fixed and white error of the two-way timing, and its lost slots.
    Timing,
    /// Offset and frequency of the UAV clock.
    Clock,
    /// Waypoints and speeds of the UAV.
    UavRoute,
    /// Stops of the GMT.
    GmtRoute,
    /// Lost beacons.
    BeaconLoss,
}

/// A seeded generator of uniform and normal numbers.
#[derive(Clone, Debug)]
pub struct Seeded {
    rng: ChaCha8Rng,
    spare: Option<f64>,
}

impl Seeded {
    /// The generator of one source in the world of `seed`.
    pub fn new(seed: u64, source: Source) -> Self {
        Self::with_stream(seed, source as u64)
    }

    /// The generator of one of several alike sources, such as the attempts of a planner.
    pub fn numbered(seed: u64, source: Source, number: u32) -> Self {
        Self::with_stream(seed, source as u64 | (u64::from(number) + 1) << 32)
    }

    fn with_stream(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self { rng, spare: None }
    }

    /// Uniform in [0, 1), with 53 random bits.
    pub fn uniform(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1u64 << 53) as f64;
        (self.rng.next_u64() >> 11) as f64 * STEP
    }

    /// Uniform in [`low`, `high`).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// A uniform index in 0..`count`; 0 when `count` is 0.
    pub fn index(&mut self, count: usize) -> usize {
        // The product stays below `count` for every count that fits memory: the largest uniform is 1 - 2^-53.
        (self.uniform() * count as f64) as usize
    }

    /// Standard normal, by Box and Muller's transform on [`libm`].
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        // 1 - uniform lies in (0, 1]: the logarithm is finite.
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        let (sin, cos) = libm::sincos(2.0 * core::f64::consts::PI * self.uniform());
        self.spare = Some(radius * sin);
        radius * cos
    }

    /// Three independent standard normals.
    pub fn normal_vector(&mut self) -> Vector3<f64> {
        let (x, y, z) = (self.normal(), self.normal(), self.normal());
        Vector3::new(x, y, z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_have_the_moments_of_the_normal_law() {
        let mut seeded = Seeded::new(1, Source::Clock);
        let n = 200_000;
        let x: Vec<f64> = (0..n).map(|_| seeded.normal()).collect();
        let moment = |p: i32| x.iter().map(|v| v.powi(p)).sum::<f64>() / f64::from(n);
        // Standard errors of the four moments: 0.0022, 0.0032, 0.0087, 0.022.
        assert!(moment(1).abs() < 0.01);
        assert!((moment(2) - 1.0).abs() < 0.015);
        assert!(moment(3).abs() < 0.04);
        assert!((moment(4) - 3.0).abs() < 0.1);
        // The two halves of a Box-Muller pair are independent.
        let pairs: f64 = x.chunks_exact(2).map(|c| c[0] * c[1]).sum::<f64>() / f64::from(n / 2);
        assert!(pairs.abs() < 0.015);
    }

    #[test]
    fn sources_are_independent_and_repeatable() {
        let draw = |seed, source| Seeded::new(seed, source).uniform().to_bits();
        assert_eq!(draw(7, Source::Clock), draw(7, Source::Clock));
        assert_ne!(draw(7, Source::Clock), draw(7, Source::Timing));
        assert_ne!(draw(7, Source::Clock), draw(8, Source::Clock));
        let numbered = |n| Seeded::numbered(7, Source::UavRoute, n).uniform().to_bits();
        assert_ne!(numbered(0), draw(7, Source::UavRoute));
        assert_ne!(numbered(0), numbered(1));
    }

    #[test]
    fn uniforms_and_indices_stay_in_range() {
        let mut seeded = Seeded::new(3, Source::Timing);
        let mut seen = [0u32; 5];
        for _ in 0..10_000 {
            let u = seeded.uniform();
            assert!((0.0..1.0).contains(&u));
            seen[seeded.index(5)] += 1;
        }
        assert!(seen.iter().all(|&n| (1800..2200).contains(&n)), "{seen:?}");
    }
}
