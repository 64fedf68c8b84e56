//! Random numbers that are the same on every machine and for every number of threads.
//!
//! One ChaCha8 stream for each independent piece of work (a link, a sweep), so the order in which pieces are done does
//! not matter. Normal deviates are made here, by Box-Muller with `libm`: a library's may change with its version.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// A stream of uniform and normal deviates.
#[derive(Clone, Debug)]
pub struct Stream {
    rng: ChaCha8Rng,
    spare: Option<f64>,
}

impl Stream {
    /// Stream `index` of a seed.
    pub fn new(seed: u64, index: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index);
        Self { rng, spare: None }
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.rng.random()
    }

    /// Normal with mean 0 and standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        if let Some(value) = self.spare.take() {
            return value;
        }
        // 1 - u lies in (0, 1]: the logarithm is finite.
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        let angle = core::f64::consts::TAU * self.uniform();
        self.spare = Some(radius * libm::sin(angle));
        radius * libm::cos(angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_reproducible_and_differ() {
        let take = |seed, index| {
            let mut stream = Stream::new(seed, index);
            [stream.normal(), stream.normal(), stream.uniform()]
        };
        assert_eq!(take(1, 2), take(1, 2));
        assert_ne!(take(1, 2), take(1, 3));
        assert_ne!(take(1, 2), take(2, 2));
    }

    #[test]
    fn normal_deviates_have_the_moments_of_a_normal() {
        let mut stream = Stream::new(5, 0);
        let n = 200_000;
        let moments = (0..n).map(|_| stream.normal()).fold([0.0; 4], |mut m, x| {
            for (power, sum) in m.iter_mut().enumerate() {
                *sum += x.powi(power as i32 + 1) / f64::from(n);
            }
            m
        });
        // Five standard errors of each sample moment.
        let tolerance = [0.0112, 0.0158, 0.0433, 0.11];
        for ((moment, expected), tolerance) in moments.into_iter().zip([0.0, 1.0, 0.0, 3.0]).zip(tolerance) {
            assert!((moment - expected).abs() < tolerance, "{moments:?}");
        }
    }
}
