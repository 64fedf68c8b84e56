//! Shape of the fixes over time: the line through them, and how they bend from it.

use super::{Fix, LEAST_NORM, Segment, WINDOW};

/// The times of some fixes.
pub(super) struct Times {
    /// How many.
    pub(super) n: f64,
    pub(super) mean_s: f64,
    /// Sum of squares about the mean.
    pub(super) spread: f64,
}

impl Times {
    pub(super) fn over(motion: &[(Segment, Fix)]) -> Self {
        let n = motion.len() as f64;
        let mean_s = motion.iter().map(|(since, _)| since.dt_s).sum::<f64>() / n;
        let mut times = Self {
            n,
            mean_s,
            spread: 0.0,
        };
        for entry in motion {
            let t = times.of(entry);
            times.spread += t * t;
        }
        times
    }

    /// Time of a fix from the mean, s.
    pub(super) fn of(&self, (since, _): &(Segment, Fix)) -> f64 {
        since.dt_s - self.mean_s
    }
}

/// The part of a curve through the times of some fixes that is neither constant nor slope.
pub(super) struct Bend {
    /// Weights of the fixes that give its coefficient.
    pub(super) weights: heapless::Vec<f64, WINDOW>,
    /// The shape is `t^2 - level - lean t`, t from the mean time.
    level: f64,
    lean: f64,
}

impl Bend {
    pub(super) fn over(motion: &[(Segment, Fix)], times: &Times) -> Option<Self> {
        let from_mean = || motion.iter().map(|entry| times.of(entry));
        let mut s3 = 0.0;
        for t in from_mean() {
            s3 += t * t * t;
        }
        if times.spread.is_nan() || times.spread <= 0.0 {
            return None;
        }
        let mut bend = Self {
            weights: heapless::Vec::new(),
            level: times.spread / times.n,
            lean: s3 / times.spread,
        };
        let square = |t: f64| {
            let [shape, _] = bend.shape(t);
            shape * shape
        };
        let norm: f64 = from_mean().map(square).sum();
        if norm.is_nan() || norm < LEAST_NORM {
            return None;
        }
        for t in from_mean() {
            let [shape, _] = bend.shape(t);
            // Collecting would panic on one too many; there are as many as fixes.
            bend.weights.push(shape / norm).ok()?;
        }
        Some(bend)
    }

    /// The shape and its slope, `t` from the mean time.
    pub(super) fn shape(&self, t: f64) -> [f64; 2] {
        [t * t - self.level - self.lean * t, 2.0 * t - self.lean]
    }
}
