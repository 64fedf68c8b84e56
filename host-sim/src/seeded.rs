//! Seeded random numbers that are the same on every machine, for any number of threads.
//!
//! One ChaCha8 generator per source of randomness: the seed picks the world, the stream number picks the source. So a
//! source that draws more or fewer numbers never disturbs another one, and an error switched off leaves all other
//! errors as they were.

use nalgebra::Vector3;

use crate::random::Stream;

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
    /// Spikes of a faulty inertial sensor.
    ImuFault = 0x5e80,
    /// Events that are lost, doubled or late.
    Transport,
    /// Where a wrong fix is.
    WrongFix,
    /// Where a jammer is, and what it sends.
    Jammer = 0x5ea4,
    /// Which beacons arrive over the air.
    BeaconAir = 0x5ec0,
    /// What the air does to two-way timing.
    TimingAir,
    /// Rotors and the phases of their vibration.
    Vibration = 0x5f00,
    /// What acceleration does to the readings of an inertial sensor.
    GSensitivity,
    /// Where the inertial sensor is and how it is turned.
    ImuMounting,
    /// Jitter of the inertial sensor's time stamps.
    ImuStampJitter,
    /// What warmth does to the readings of an inertial sensor.
    ImuTemperature,
    /// Direction of the mean wind, and gusts.
    Wind,
    /// Direction of the motors' magnetic field.
    MotorField,
    /// Iron in the walls of a building, by face.
    WallIron,
    /// Rate of the inertial sensor's own clock.
    ImuClock,
    /// What the weather does to a barometer.
    BarometerWeather,
    /// White noise of a barometer.
    BarometerNoise,
    /// Relief of the ground.
    GroundRelief = 0x5f40,
    /// Panels of facades, by face.
    Panels,
    /// Cars and people.
    Movers,
    /// Trees.
    Trees,
}

/// A seeded generator of uniform and normal numbers: a [`Stream`] of its own for every source.
#[derive(Clone, Debug)]
pub struct Seeded {
    stream: Stream,
}

impl Seeded {
    /// The generator of one source in the world of `seed`.
    pub fn new(seed: u64, source: Source) -> Self {
        Self {
            stream: Stream::new(seed, source as u64),
        }
    }

    /// The generator of one of several alike sources, such as the attempts of a planner.
    pub fn numbered(seed: u64, source: Source, number: u32) -> Self {
        Self {
            stream: Stream::new(seed, source as u64 | (u64::from(number) + 1) << 32),
        }
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.stream.uniform()
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

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        self.stream.normal()
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
    fn first_draws_are_normal_over_seeds_too() {
        for source in [Source::Clock, Source::Timing, Source::GmtAttitude] {
            let n = 4000;
            let squares: f64 = (0..n)
                .map(|seed| Seeded::new(seed, source).normal())
                .map(|x| x * x)
                .sum();
            let rms = (squares / n as f64).sqrt();
            assert!((rms - 1.0).abs() < 0.045, "{source:?}: {rms}");
        }
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
