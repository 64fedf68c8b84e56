//! Noise floor and constant-false-alarm threshold of a power-delay profile.
//!
//! Under noise alone `E = sum |h|^2` over C channels is Gamma(C) times the noise variance of a tap: a chi-square variable
//! with 2 C degrees of freedom (docs/signal-model.md, "Path estimation"). The noise variance comes from the median of `E`, which few
//! strong taps do not move; the threshold is the variance times a factor that depends on C and the false-alarm rate only.
//! Both are quantiles of Gamma(C), solved once by bisection.

use libm::exp;

/// Survival function of Gamma(shape, 1) for a whole shape: `exp(-y) sum_{i < shape} y^i / i!`.
fn survival(shape: usize, y: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for i in 1..shape {
        term *= y / i as f64;
        sum += term;
    }
    exp(-y) * sum
}

/// `y` at which [`survival`] equals `probability`, by bisection to the last bit that f64 resolves.
pub(crate) fn quantile(shape: usize, probability: f64) -> f64 {
    // exp(-y) stays normal up to 700; a shape above 300 would need another formula.
    let (mut low, mut high) = (0.0, 700.0);
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if survival(shape, middle) > probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// A tap that stands out of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Index of the strongest tap.
    pub tap: usize,
    /// Its `sum |h|^2`, squared LSB.
    pub power: u64,
    /// Noise variance of one tap of one channel, squared LSB.
    pub noise: f32,
}

/// Detector for profiles over a given number of channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detector {
    threshold: f32,
    median: f32,
}

impl Detector {
    /// Detector for profiles over `channels` (1..=256; clamped) that fires with probability `false_alarm` when
    /// `tests` noise taps are tried. The default sweep tries 72 beams x 512 taps with 1e-2. (Taps of 416 subcarriers are
    /// not quite independent, but peaks over so high a threshold come as often as if they were: measured, see the tests.)
    #[must_use]
    pub fn new(channels: usize, false_alarm: f64, tests: usize) -> Self {
        let shape = channels.clamp(1, 256);
        Self {
            threshold: quantile(shape, false_alarm / tests.max(1) as f64) as f32,
            median: quantile(shape, 0.5) as f32,
        }
    }

    /// Threshold on `sum |h|^2` in units of the noise variance of one tap of one channel: 68.8 for 32 channels and the
    /// default sweep.
    #[must_use]
    pub fn threshold(&self) -> f32 {
        self.threshold
    }

    /// Noise variance of one tap of one channel, squared LSB, from the median of a profile. Sidelobes of a strong path
    /// lift the median: the value is then an upper bound until that path is cancelled.
    #[must_use]
    pub fn noise<const TAPS: usize>(&self, profile: &[u64; TAPS]) -> f32 {
        median(profile) as f32 / self.median
    }

    /// The strongest tap (the first of equals), if it stands out of the noise.
    #[must_use]
    pub fn peak<const TAPS: usize>(&self, profile: &[u64; TAPS]) -> Option<Peak> {
        let (mut tap, mut power) = (0, 0);
        for (i, &e) in profile.iter().enumerate() {
            if e > power {
                (tap, power) = (i, e);
            }
        }
        let noise = self.noise(profile);
        (power as f32 > self.threshold * noise).then_some(Peak { tap, power, noise })
    }
}

/// Noise variances that the fit of a candidate must explain so that noise alone gives `false_alarms` a sweep.
///
/// The profile adds powers of all elements, the fit adds them coherently within each array: it tells a path from noise 3 dB
/// further down, at any fraction of a tap. What it explains under noise is the largest of many variables of four complex
/// degrees of freedom, over a search in three parameters: a tail like `x^(3 + 3/2) exp(-x)`, of slope 0.86 there. Its place
/// was measured: 14 of 1e5 beams of noise explain more than 32.8.
#[must_use]
pub fn fit_threshold(false_alarms: f64, beams: usize) -> f32 {
    let per_beam = false_alarms.clamp(1e-12, 1.0) / beams.max(1) as f64;
    (33.0 - libm::log(per_beam / 1.4e-4) / 0.86) as f32
}

/// Lower median of a profile, rounded down to nine significant bits (0.2 % at most): the octave in one counting pass,
/// then the eight bits below its leading one in another.
// A call a beam costs nothing, a copy at each of five callers two kilobytes of flash.
#[inline(never)]
fn median<const TAPS: usize>(profile: &[u64; TAPS]) -> u64 {
    const { assert!(TAPS > 0 && TAPS <= u16::MAX as usize) };
    let mut octaves = [0_u16; 65];
    for power in profile {
        octaves[power.leading_zeros() as usize] += 1;
    }
    // From the largest number of leading zeros, that is from the smallest values.
    let (zeros, rank) = locate(octaves.iter().rev(), (TAPS - 1) / 2);
    let zeros = 64 - zeros as u32;
    if zeros == 64 {
        return 0;
    }
    let mut mantissas = [0_u16; 256];
    for power in profile {
        if power.leading_zeros() == zeros {
            mantissas[((power << zeros) >> 55 & 0xff) as usize] += 1;
        }
    }
    let (mantissa, _) = locate(mantissas.iter(), rank);
    ((256 | mantissa as u64) << 55) >> zeros
}

/// Bin in which the value of a rank falls, and its rank in the bin.
fn locate<'a>(counts: impl Iterator<Item = &'a u16>, rank: usize) -> (usize, usize) {
    let mut rest = rank;
    for (bin, &count) in counts.enumerate() {
        if rest < usize::from(count) {
            return (bin, rest);
        }
        rest -= usize::from(count);
    }
    (0, 0)
}
