//! Probabilities from logits.

use libm::expf;

/// What a path may be: line of sight, first order, higher order, artefact.
pub const CLASSES: usize = 4;

/// How probable each class is, each 0..=1, together 1 within rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Probabilities {
    /// Line of sight.
    pub los: f32,
    /// One reflection.
    pub first_order: f32,
    /// Two reflections or more.
    pub higher_order: f32,
    /// No path at all: what estimation makes beside a stronger path, or of several that it does not resolve. 0 by the networks, which are
    /// trained on paths.
    pub artefact: f32,
}

impl Probabilities {
    /// Softmax of logits divided by a temperature: `exp(z_i / T) / sum exp(z_j / T)`, in `f32` with `libm`'s exponential.
    ///
    /// The largest logit is subtracted first, so that no exponential overflows. Source: Mou and Gao, section "Link State
    /// Classification Neural Network"; the temperature is fitted on validation data and makes the probabilities calibrated.
    pub fn softmax(logits: [f32; CLASSES], temperature: f32) -> Self {
        let [a, b, c, d] = logits;
        let largest = a.max(b).max(c).max(d);
        let [a, b, c, d] = logits.map(|logit| expf((logit - largest) / temperature));
        let sum = a + b + c + d;
        Self {
            los: a / sum,
            first_order: b / sum,
            higher_order: c / sum,
            artefact: d / sum,
        }
    }

    /// Of the states, in the order line of sight, first order, higher order: together less than 1 by what an artefact has.
    pub fn to_array(self) -> [f32; 3] {
        [self.los, self.first_order, self.higher_order]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn softmax_is_the_textbooks() {
        let all = |p: Probabilities| [p.los, p.first_order, p.higher_order, p.artefact];
        let p = all(Probabilities::softmax([1.0, 2.0, 4.0, 0.5], 1.0));
        let sum: f64 = [1.0_f64, 2.0, 4.0, 0.5].iter().map(|&z| libm::exp(z)).sum();
        for (p, z) in p.iter().zip([1.0, 2.0, 4.0, 0.5]) {
            assert!((f64::from(*p) - libm::exp(z) / sum).abs() < 1e-7);
        }
        let sharper = all(Probabilities::softmax([0.5, 1.0, 2.0, 0.25], 0.5));
        assert_eq!(p, sharper);
    }

    #[test]
    fn extreme_logits_stay_probabilities() {
        let none = f32::NEG_INFINITY;
        for logits in [
            [1e30, -1e30, 0.0, none],
            [-3e38, -3e38, -3e38, -3e38],
            [0.0, 88.8, 200.0, -1.0],
        ] {
            let p = Probabilities::softmax(logits, 0.1);
            let p = [p.los, p.first_order, p.higher_order, p.artefact];
            assert!(p.iter().all(|p| (0.0..=1.0).contains(p)), "{p:?}");
            assert!((p.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        }
    }
}
