//! Do probabilities mean what they say? Temperature scaling, and the expected calibration error.

use super::float_model::{STATES, softmax};

/// Bins of confidence of the expected calibration error.
const BINS: usize = 15;

/// `-log softmax(logits / temperature)[state]`, nat.
pub fn cross_entropy(logits: &[f32; STATES], state: u8, temperature: f32) -> f64 {
    let most = logits.iter().fold(f32::NEG_INFINITY, |m, l| m.max(*l));
    let sum = logits
        .iter()
        .fold(0.0, |sum, l| sum + libm::expf((l - most) / temperature));
    f64::from(libm::logf(sum) - (logits[usize::from(state.min(2))] - most) / temperature)
}

/// Class of the greatest logit, the first one among equals.
pub fn most_likely(logits: &[f32; STATES]) -> u8 {
    let second = usize::from(logits[1] > logits[0]);
    if logits[2] > logits[second] {
        2
    } else {
        second as u8
    }
}

/// The temperature of least cross entropy, by golden section of its logarithm between 1/8 and 8.
pub fn temperature(logits: &[[f32; STATES]], states: &[u8]) -> f32 {
    let loss = |log_t: f64| -> f64 {
        let t = libm::exp(log_t) as f32;
        logits
            .iter()
            .zip(states)
            .map(|(l, s)| cross_entropy(l, *s, t))
            .sum()
    };
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let limit = libm::log(8.0);
    let (mut low, mut high) = (-limit, limit);
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut at_a, mut at_b) = (loss(a), loss(b));
    while high - low > 1e-3 {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - ratio * (high - low);
            at_a = loss(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + ratio * (high - low);
            at_b = loss(b);
        }
    }
    libm::exp(0.5 * (low + high)) as f32
}

/// Expected calibration error: mean gap between confidence and accuracy over 15 equal bins of the greatest probability,
/// weighted by how many fall into each (Guo et al., 2017).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CalibrationError {
    bins: [(usize, f64, usize); BINS],
}

impl CalibrationError {
    /// Adds a classified sample.
    pub fn add(&mut self, probabilities: &[f32; STATES], state: u8) {
        let answer = most_likely(probabilities);
        let confidence = f64::from(probabilities[usize::from(answer)]);
        let bin = ((confidence * BINS as f64) as usize).min(BINS - 1);
        let (count, sum, right) = &mut self.bins[bin];
        *count += 1;
        *sum += confidence;
        *right += usize::from(answer == state);
    }

    /// Of logits at a temperature.
    pub fn of(logits: &[[f32; STATES]], states: &[u8], temperature: f32) -> Self {
        let mut error = Self::default();
        for (logits, state) in logits.iter().zip(states) {
            error.add(&softmax(*logits, temperature), *state);
        }
        error
    }

    /// Adds the samples of another one.
    pub fn append(&mut self, other: &Self) {
        for ((count, sum, right), (c, s, r)) in self.bins.iter_mut().zip(other.bins) {
            (*count, *sum, *right) = (*count + c, *sum + s, *right + r);
        }
    }

    /// The error, 0 to 1; 0 of nothing.
    pub fn value(&self) -> f64 {
        let all: usize = self.bins.iter().map(|(count, ..)| count).sum();
        let gaps = self
            .bins
            .iter()
            .map(|(_, sum, right)| (sum - *right as f64).abs());
        gaps.sum::<f64>() / all.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    /// Logits, and states drawn from their own softmax at a temperature.
    fn drawn(count: usize, temperature: f32) -> (Vec<[f32; STATES]>, Vec<u8>) {
        let mut stream = Stream::new(4, 2);
        (0..count)
            .map(|_| {
                let logits = [0; 3].map(|_| 3.0 * stream.normal() as f32);
                let p = softmax(logits, temperature);
                let u = stream.uniform() as f32;
                (logits, u8::from(u > p[0]) + u8::from(u > p[0] + p[1]))
            })
            .unzip()
    }

    #[test]
    fn temperature_is_found_and_calibrates() {
        for truth in [0.5, 1.0, 2.5] {
            let (logits, states) = drawn(20_000, truth);
            let found = temperature(&logits, &states);
            assert!((found / truth - 1.0).abs() < 0.05, "{found} for {truth}");
            let error = |t| CalibrationError::of(&logits, &states, t).value();
            assert!(error(found) < 0.015, "{}", error(found));
            assert!(error(3.0 * truth) > 0.1);
        }
    }

    #[test]
    fn certainty_that_is_wrong_half_the_time_is_half_off() {
        let logits = [[50.0, 0.0, 0.0]; 10];
        let states = [0, 1, 0, 2, 0, 1, 0, 2, 0, 1];
        assert!((CalibrationError::of(&logits, &states, 1.0).value() - 0.5).abs() < 1e-6);
    }

    #[test]
    fn the_first_of_equal_classes_counts() {
        assert_eq!(
            [[1.0, 1.0, 0.0], [0.0, 2.0, 2.0], [0.0, 1.0, 3.0]].map(|l| most_likely(&l)),
            [0, 1, 2]
        );
        assert!((cross_entropy(&[0.0; 3], 2, 1.0) - 3.0_f64.ln()).abs() < 1e-6);
    }
}
