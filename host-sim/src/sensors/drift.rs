//! In-run bias of an inertial sensor: flicker noise (bias instability) and a random walk.
//!
//! Flicker noise has no finite-state model, but a sum of first-order Gauss-Markov processes of equal variance, whose
//! time constants rise by a constant ratio, has a spectrum of 1/f between the shortest and the longest. Ten of them
//! with ratio 4 make an Allan deviation that is flat within 4 % from a second to two hours.

use nalgebra::Vector3;

use crate::seeded::Seeded;

/// Number of Gauss-Markov processes of an axis.
const PROCESSES: usize = 10;
/// Time constants rise by this ratio.
const RATIO: f64 = 4.0;
/// Shortest time constant, s.
const SHORTEST_S: f64 = 0.1;

/// The wandering bias of three like axes.
#[derive(Clone, Debug)]
pub struct BiasDrift {
    random: Seeded,
    flicker: [Vector3<f64>; PROCESSES],
    /// What is left of each process after a step, and the deviation of what is added.
    step: [(f64, f64); PROCESSES],
    walk: Vector3<f64>,
    walk_step: f64,
}

impl BiasDrift {
    /// A drift advanced in steps of `step_s` s. `instability` is the floor of the Allan deviation in the unit of the
    /// signal, `walk` the coefficient of the random walk in that unit per root second. The flicker starts in its steady
    /// state, the walk at zero.
    pub fn new(instability: f64, walk: f64, step_s: f64, mut random: Seeded) -> Self {
        let sigma = process_sigma(instability);
        let step = core::array::from_fn(|k| {
            let kept = libm::exp(-step_s / time_constant_s(k));
            (kept, sigma * (1.0 - kept * kept).sqrt())
        });
        Self {
            flicker: core::array::from_fn(|_| random.normal_vector() * sigma),
            random,
            step,
            walk: Vector3::zeros(),
            walk_step: walk * step_s.sqrt(),
        }
    }

    /// Advances by one step and returns the bias.
    pub fn advance(&mut self) -> Vector3<f64> {
        for (state, (kept, added)) in self.flicker.iter_mut().zip(self.step) {
            *state = *state * kept + self.random.normal_vector() * added;
        }
        self.walk += self.random.normal_vector() * self.walk_step;
        self.flicker.iter().sum::<Vector3<f64>>() + self.walk
    }
}

fn time_constant_s(process: usize) -> f64 {
    SHORTEST_S * libm::pow(RATIO, process as f64)
}

/// Standard deviation of each process. Their one-sided spectra add up to sigma^2 / (f ln RATIO), and flicker noise of
/// spectrum h / f has an Allan variance of 2 ln 2 h.
fn process_sigma(instability: f64) -> f64 {
    instability * (libm::log(RATIO) / (2.0 * core::f64::consts::LN_2)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allan::{Allan, pooled};
    use crate::seeded::Source;

    #[test]
    fn the_ensemble_is_flat_from_a_second_to_two_hours() {
        // Closed-form Allan variance of a Gauss-Markov process of variance s^2, with x = tau / T:
        // s^2 / x^2 (2x - 3 + 4 exp(-x) - exp(-2x)).
        let deviation = |tau_s: f64| {
            let sum: f64 = (0..PROCESSES)
                .map(|k| tau_s / time_constant_s(k))
                .map(|x| (2.0 * x - 3.0 + 4.0 * libm::exp(-x) - libm::exp(-2.0 * x)) / (x * x))
                .sum();
            process_sigma(1.0) * sum.sqrt()
        };
        for k in 0..=120 {
            let tau_s = libm::pow(7200.0, f64::from(k) / 120.0);
            assert!(
                (deviation(tau_s) - 1.0).abs() < 0.04,
                "{} at {tau_s} s",
                deviation(tau_s)
            );
        }
    }

    #[test]
    fn what_is_drawn_has_the_deviation_it_should() {
        let step_s = 0.05;
        let mut axes = Vec::new();
        for seed in 0..8 {
            let mut drift = BiasDrift::new(2.0, 0.0, step_s, Seeded::new(seed, Source::GyroscopeDrift));
            let bias: Vec<_> = (0..40_000).map(|_| drift.advance()).collect();
            axes.extend((0..3).map(|i| Allan::new(bias.iter().map(|b| b[i]), step_s)));
        }
        for tau_s in [1.0, 10.0, 50.0] {
            let measured = pooled(&axes, (tau_s / step_s) as usize).expect("long enough");
            assert!((measured / 2.0 - 1.0).abs() < 0.05, "{measured} at {tau_s} s");
        }
    }

    #[test]
    fn the_walk_grows_with_the_root_of_time() {
        let runs = 300;
        let mut squares = 0.0;
        for seed in 0..runs {
            let mut drift = BiasDrift::new(0.0, 0.5, 0.1, Seeded::new(seed, Source::GyroscopeDrift));
            let end = (0..1000).map(|_| drift.advance()).last().expect("a thousand");
            squares += end.norm_squared() / 3.0;
        }
        let sigma = (squares / runs as f64).sqrt();
        // 0.5 * sqrt(100 s); 900 draws leave 2.4 %.
        assert!((sigma / 5.0 - 1.0).abs() < 0.08, "{sigma}");
    }

    #[test]
    fn zero_is_exactly_zero() {
        let mut drift = BiasDrift::new(0.0, 0.0, 0.01, Seeded::new(1, Source::GyroscopeDrift));
        assert!((0..100).all(|_| drift.advance() == Vector3::zeros()));
    }
}
