//! What the errors of the receive arrays leave beside a path, learned from the strongest path of each sweep.
//!
//! No array is as its model has it: channels differ in gain and phase, elements in their patterns, neighbours couple. Of a path of energy P
//! the model of a path explains all but a share of P, which is white over the elements and has the path's own pulse. Two things
//! follow. What is found beside a path and holds no more than that share of it is no path. And the errors act on a fit as noise of that
//! share of P in every channel would, so they widen the claim on its place as noise does.
//!
//! The share is a property of the hardware, so it is learned and not told: after the search of a sweep's strongest beam, what is left at
//! the place of its first path is compared with that path. A neighbour that was not resolved makes it larger, so the median of
//! the last sweeps counts. Until there is one, the share is that of arrays of the poorest kind this receiver is made for: a share that begins
//! too small would take the errors for paths, and cancel what it should learn from.

/// Sweeps whose median counts.
/// Capacity: half a minute, in which the UAV shows its arrays to many directions.
const SWEEPS: usize = 61;

/// Errors of the receive arrays, as standard deviation of an element's response relative to what it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ElementErrors {
    /// Known, 0 for arrays without errors.
    Known(f32),
    /// Learned from sweep to sweep, beginning with this.
    Learned(f32),
}

impl ElementErrors {
    /// Two degrees.
    /// Given: those of the error budget: for a sweep alone, from which nothing can be learned before its paths are wanted.
    pub const BUDGET: Self = Self::Known(0.035);

    /// The standard deviation that is known, or begun with.
    #[must_use]
    pub fn sigma(self) -> f32 {
        match self {
            Self::Known(sigma) | Self::Learned(sigma) => sigma,
        }
    }
}

/// The share of a path's energy that is left beside it.
#[derive(Clone, Debug)]
pub(super) struct Calibration {
    share: f32,
    /// What it never exceeds; `None` when it is not learned.
    most: Option<f32>,
    recent: [f32; SWEEPS],
    count: usize,
}

impl Calibration {
    pub(super) fn new(errors: ElementErrors) -> Self {
        let share = errors.sigma() * errors.sigma();
        Self {
            share,
            most: matches!(errors, ElementErrors::Learned(_)).then_some(share),
            recent: [share; SWEEPS],
            count: 0,
        }
    }

    /// Takes what is left beside a path of this energy, and what noise leaves on average: sums over the channels at a tap. Too much noise
    /// tells nothing.
    pub(super) fn observe(&mut self, left: f32, noise: f32, energy: f32) {
        let Some(most) = self.most else { return };
        if noise >= self.share * energy {
            return;
        }
        if let Some(slot) = self.recent.get_mut(self.count % SWEEPS) {
            *slot = ((left - noise) / energy).max(0.0);
        }
        self.count = self.count.saturating_add(1);
        let seen = self.count.min(SWEEPS);
        let seen = self.recent.get(..seen).and_then(median);
        self.share = seen.unwrap_or(most).min(most);
    }

    /// Share of a path's energy that the arrays' errors leave beside it.
    pub(super) fn share(&self) -> f32 {
        self.share
    }
}

/// The upper median, by rank: a sort for so few would be longer than all else here.
fn median(values: &[f32]) -> Option<f32> {
    let middle = values.len() / 2;
    let count = |holds: &dyn Fn(f32) -> bool| values.iter().filter(|value| holds(**value)).count();
    let is_median = |value: f32| {
        let less = count(&|other| other < value);
        less <= middle && middle < less + count(&|other| other == value)
    };
    values.iter().copied().find(|value| is_median(*value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_the_median_of_what_is_left_and_never_more_than_at_first() {
        let mut learned = Calibration::new(ElementErrors::Learned(0.1));
        assert!((learned.share() - 0.01).abs() < 1e-9);
        for i in 0..200 {
            // Every fourth sweep has a neighbour that was not resolved.
            let left = if i % 4 == 0 { 30.0 } else { 0.2 };
            learned.observe(left + 0.1, 0.1, 100.0);
        }
        assert!((learned.share() - 0.002).abs() < 1e-6, "{}", learned.share());
        for _ in 0..200 {
            learned.observe(50.0, 0.1, 100.0);
        }
        assert!((learned.share() - 0.01).abs() < 1e-9);
    }

    #[test]
    fn the_median_is_that_of_the_sorted_list() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[3.0, 1.0, 2.0, 2.0, 9.0, 7.0]), Some(3.0));
        assert_eq!(median(&[5.0]), Some(5.0));
        assert_eq!(median(&[]), None);
    }

    #[test]
    fn noise_that_hides_the_share_tells_nothing() {
        let mut learned = Calibration::new(ElementErrors::Learned(0.1));
        learned.observe(2.0, 2.0, 100.0);
        assert!((learned.share() - 0.01).abs() < 1e-9);
    }

    #[test]
    fn what_is_known_is_not_learned() {
        let mut known = Calibration::new(ElementErrors::Known(0.05));
        known.observe(0.0, 0.0, 1.0);
        assert!((known.share() - 0.0025).abs() < 1e-9);
    }
}
