//! Screening: tells from an eighth of the work that a beam holds nothing worth reporting.
//!
//! A path is reported when it comes within the dynamic range of the sweep's strongest one. Once that one is known, so is
//! the energy below which a beam need not be searched, and where it stands well over the noise, two elements of each array
//! and the even subcarriers are enough to see it: 9 dB less than the whole beam gathers (docs/signal-model.md, "Fixed point"). The
//! screen never asks whether something stands out of the noise, only whether a path of reportable energy would have been
//! missed with a probability of [`MISS_SIGMAS`]; where it cannot tell, the beam is searched. So nothing is lost at low SNR,
//! where nothing is screened.

use heapless::Vec;

use crate::signal::{Detector, FOLDED_CHANNELS, FOLDED_TAPS, Folded, quantile};

/// Standard deviations by which a path at the floor may fall short of its mean.
/// Derived: one in ten does, and one in forty 1 dB over the floor.
const MISS_SIGMAS: f32 = 1.28;
/// Power of a path's two strongest neighbouring taps over that of a tap at its peak, at the worst fraction of a tap.
/// Derived: D(0)^2 + D(1)^2.
const PAIR_SHARE: f32 = 1.05;
/// Chance that a beam of noise passes for more than noise, from which on a look is worth its cost.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const WORTH: f64 = 0.25;

/// Screen for `C` channels.
#[derive(Clone, Debug)]
pub(super) struct Screen<const C: usize> {
    channels: Vec<u8, C>,
    /// For the noise floor of the folded profile.
    detector: Detector,
    /// Level of neighbouring taps' sum that a beam of noise exceeds half the time, noise variances.
    quiet: f32,
}

impl<const C: usize> Screen<C> {
    /// Screen that looks at two elements in each array of `E`, a quarter of its length from either end, where the cheap stage has room for
    /// them; else at one of these two by turns in as many arrays as there is room for, evenly.
    pub(super) fn new<const E: usize>() -> Self {
        const { assert!(E > 0 && C <= 256) };
        let arrays = C / E;
        let [low, high] = [E / 4, E - 1 - E / 4];
        let mut channels = Vec::new();
        // At most C of them.
        let mut look = |array: usize, element: usize| {
            let _ = channels.push((array * E + element) as u8);
        };
        if arrays * 2 <= FOLDED_CHANNELS {
            for array in 0..arrays {
                look(array, low);
                if high != low {
                    look(array, high);
                }
            }
        } else {
            let count = arrays.min(FOLDED_CHANNELS);
            for nth in 0..count {
                let element = if nth.is_multiple_of(2) { low } else { high };
                look(nth * arrays / count, element);
            }
        }
        let count = channels.len();
        Self {
            detector: Detector::new(count, WORTH, FOLDED_TAPS),
            quiet: quantile(2 * count, WORTH / FOLDED_TAPS as f64) as f32,
            channels,
        }
    }

    /// Channels to be looked at.
    pub(super) fn channels(&self) -> &[u8] {
        &self.channels
    }

    /// Whether a look can tell a path of energy `floor` (sum over all channels at a tap's peak) from `noise`, the variance of
    /// a tap of one channel.
    pub(super) fn can_tell(&self, floor: f32, noise: f32) -> bool {
        // Half the subcarriers: half the noise.
        self.least(floor, 0.5 * noise) > self.quiet * 0.5 * noise
    }

    /// Noise of an energy that only the cheap stage has measured, relative to one of the whole beam.
    pub(super) fn noise_gain(&self) -> f32 {
        2.0 * C as f32 / self.channels.len().max(1) as f32
    }

    /// Whether no path of energy `floor` is in the beam.
    pub(super) fn is_empty(&self, folded: &Folded<'_>, floor: f32) -> bool {
        let least = self.least(floor, self.detector.noise(folded.profile));
        let ends = folded.profile.last().into_iter().chain(folded.profile.iter());
        let most = ends.zip(folded.profile.iter()).map(|(a, b)| a + b).max();
        !folded.strained && (most.unwrap_or(0) as f32) < least
    }

    /// What the strongest two neighbouring folded taps hold at least when a path of energy `floor` is there.
    fn least(&self, floor: f32, noise: f32) -> f32 {
        // A path's tap is half as large in the folded profile; only some channels add up.
        let count = self.channels.len() as f32;
        2.0 * count * noise + least_excess(0.25 * floor * count / C as f32, noise, count)
    }
}

/// What a path of power `peak` at its peak, summed over `channels`, adds at least to its two strongest neighbouring taps: its
/// mean less [`MISS_SIGMAS`].
pub(super) fn least_excess(peak: f32, noise: f32, channels: f32) -> f32 {
    let mean = PAIR_SHARE * peak;
    mean - MISS_SIGMAS * libm::sqrtf(noise * (2.0 * channels * noise + 2.0 * mean))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cheap_stage_has_room_for_what_is_looked_at() {
        assert_eq!(
            Screen::<32>::new::<8>().channels(),
            [2, 5, 10, 13, 18, 21, 26, 29]
        );
        assert_eq!(
            Screen::<64>::new::<16>().channels(),
            [4, 11, 20, 27, 36, 43, 52, 59]
        );
        assert_eq!(Screen::<3>::new::<1>().channels(), [0, 1, 2]);
        // A planar array of eight rows and one of sixteen: every row, and every other.
        assert_eq!(
            Screen::<64>::new::<8>().channels(),
            [2, 13, 18, 29, 34, 45, 50, 61]
        );
        assert_eq!(
            Screen::<64>::new::<4>().channels(),
            [1, 10, 17, 26, 33, 42, 49, 58]
        );
    }
}
