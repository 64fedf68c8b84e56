//! The path estimator's kernels: sample blocks from the quiet to the extreme, and digests of all that the front
//! end makes of them. Equal digests of two kernel sets, or of two machines, mean equal bits.

use core::fmt;

use cslam_core::kernels::Kernels;
use cslam_core::profile::Samples;
use cslam_core::signal::{BeamBlock, Correlator, Iq, SAMPLES, Waveform, Workspace};
use libm::{cos, floor, sin, sqrt};

use crate::digest::Digest;
use crate::random::Random;

/// Number of different blocks.
pub const BLOCKS: u32 = 32;
/// Channels of the detection stage: two of each array.
pub const SUBSET: [u8; 8] = [2, 5, 10, 13, 18, 21, 26, 29];

impl Random {
    /// Near-normal of an rms, from eight bytes.
    fn normal(&mut self, rms: i32) -> i16 {
        let sum: i32 = self.word().to_le_bytes().iter().map(|&b| i32::from(b)).sum();
        // Mean 1020, standard deviation sqrt(8 (256^2 - 1) / 12) = 209.02.
        ((sum - 1020) * rms / 209).clamp(-32_768, 32_767) as i16
    }
}

/// Fills block `index` (taken modulo [`BLOCKS`]).
pub fn fill(block: &mut Samples, index: u32) {
    const LOW: i16 = i16::MIN;
    const HIGH: i16 = i16::MAX;
    let index = index % BLOCKS;
    let mut random = Random::new(u64::from(index));
    let path = match index {
        29 => paths(&[(37.0, 8_000.0)]),
        30 => paths(&[(200.5, 8_000.0)]),
        31 => paths(&[(63.8, 7_000.0), (66.1, 3_500.0)]),
        _ => [(0.0, 0.0); SAMPLES],
    };
    for (c, channel) in block.iter_mut().enumerate() {
        for (n, x) in channel.iter_mut().enumerate() {
            *x = match index {
                0 => Iq::ZERO,
                1 => Iq::new(HIGH, HIGH),
                2 => Iq::new(LOW, LOW),
                3 => Iq::new(HIGH, LOW),
                // Alternating extremes, by one, by two and by c samples.
                4 => extreme(n & 1 == 0, n & 1 == 0),
                5 => extreme(n & 2 == 0, n & 1 == 0),
                6 => extreme((n / (c + 1)) & 1 == 0, (n / (c + 2)) & 1 == 0),
                // One sample at full scale, at another place in each channel.
                7 => {
                    if n == 16 * c + c {
                        Iq::new(LOW, HIGH)
                    } else {
                        Iq::ZERO
                    }
                }
                8 => Iq::new(1, 0),
                9 => Iq::new(-1, -1),
                // A tone per channel, from weak to full scale.
                10..=13 => {
                    let phase =
                        core::f64::consts::TAU * ((n * (13 * c + 1)) % SAMPLES) as f64 / SAMPLES as f64;
                    let amplitude = [900.0, 4_000.0, 9_000.0, 32_767.0][(index & 3) as usize];
                    Iq::new((amplitude * cos(phase)) as i16, (amplitude * sin(phase)) as i16)
                }
                // Random extremes, and random words.
                14 | 15 => {
                    let word = random.word();
                    extreme(word & 1 == 0, word & 2 == 0)
                }
                16 | 17 => Iq::from_word((random.word() >> 32) as u32),
                // Noise from under one LSB to clipping.
                18..=24 => {
                    let rms = [1, 30, 900, 5_820, 6_600, 12_000, 30_000][(index - 18) as usize];
                    Iq::new(random.normal(rms), random.normal(rms))
                }
                // 12-bit noise at the level of the gain control, left-aligned; -12 dB of full scale per channel.
                25..=28 => Iq::new(random.normal(5_820) & !15, random.normal(5_820) & !15),
                // One path, then two, 12 bits, some 30 dB over the noise.
                _ => {
                    let (re, im) = path[n];
                    // Another phase in each channel: a multiple of 1/32 turn.
                    let (cos, sin) = (
                        cos(core::f64::consts::TAU * c as f64 / 32.0),
                        sin(core::f64::consts::TAU * c as f64 / 32.0),
                    );
                    let part = |x: f64, noise: i16| (floor(x) as i16).saturating_add(noise) & !15;
                    Iq::new(
                        part(re * cos - im * sin, random.normal(200)),
                        part(re * sin + im * cos, random.normal(200)),
                    )
                }
            };
        }
    }
}

/// Samples of paths: delay in samples and rms amplitude.
fn paths(paths: &[(f64, f64)]) -> [(f64, f64); SAMPLES] {
    let waveform = Waveform::default();
    let mut samples = [(0.0, 0.0); SAMPLES];
    let roots: [(f64, f64); SAMPLES] = core::array::from_fn(|n| {
        let phase = core::f64::consts::TAU * n as f64 / SAMPLES as f64;
        (cos(phase), sin(phase))
    });
    let times = |a: (f64, f64), b: (f64, f64)| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    for index in 0..waveform.active {
        let symbol = waveform.symbol::<f64>(index);
        let mut sum = (0.0, 0.0);
        for &(delay, amplitude) in paths {
            let phase = -core::f64::consts::TAU * f64::from(waveform.offset(index)) * delay / SAMPLES as f64;
            // The mean square of the waveform's samples is the number of subcarriers.
            let amplitude = amplitude / sqrt(waveform.active as f64);
            let turned = times(
                (symbol.re, symbol.im),
                (amplitude * cos(phase), amplitude * sin(phase)),
            );
            sum = (sum.0 + turned.0, sum.1 + turned.1);
        }
        let bin = waveform.bin(index);
        for (n, x) in samples.iter_mut().enumerate() {
            let term = times(sum, roots[bin * n % SAMPLES]);
            *x = (x.0 + term.0, x.1 + term.1);
        }
    }
    samples
}

/// A corner of the square of int16.
fn extreme(re: bool, im: bool) -> Iq {
    let part = |high| if high { i16::MAX } else { i16::MIN };
    Iq::new(part(re), part(im))
}

/// What the front end makes of a block, in one number each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Digest of the spectrum, the detection profile and its taps, the profile and all taps.
    pub digest: u64,
    /// Lanes that clipped in the correlation, as far as examined.
    pub clips: u32,
    /// Strained passes that were not examined.
    pub unexamined: u32,
    /// Exponent of the taps.
    pub exponent: i32,
}

/// Digest, clips, unexamined passes and exponent, as the images print them after `block INDEX`.
impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            digest,
            clips,
            unexamined,
            exponent,
        } = self;
        write!(f, "{digest:016x} {clips} {unexamined} {exponent}")
    }
}

/// Runs everything on block `index`.
pub fn run<K: Kernels>(
    correlator: &Correlator<K>,
    block: &mut Samples,
    index: u32,
    work: &mut Workspace,
) -> Outcome {
    fill(block, index);
    let mut digest = Digest::new();
    let mut spectrum = [Iq::ZERO; SAMPLES];
    for channel in block.iter() {
        digest.add(u64::from(correlator.spectrum(channel, &mut spectrum, work)));
        spectrum.iter().for_each(|x| digest.add(u64::from(x.word())));
    }
    let beam = correlator.scale(as_captured(block, index));
    digest.add(beam.mean_power().to_bits());
    let folded = correlator.detect(&beam, &SUBSET, work);
    folded.profile.iter().for_each(|&power| digest.add(power));
    for x in folded.taps.iter().flatten() {
        digest.add(u64::from(x.word()));
    }
    let taps = correlator.correlate(beam, work);
    taps.profile().iter().for_each(|&power| digest.add(power));
    let (clips, unexamined, exponent) = (taps.clips(), taps.unexamined(), taps.exponent());
    for x in taps.into_block().samples.iter().flatten() {
        digest.add(u64::from(x.word()));
    }
    Outcome {
        digest: digest.value(),
        clips,
        unexamined,
        exponent,
    }
}

/// A filled block as the front end takes it.
pub fn as_captured(samples: &mut Samples, index: u32) -> BeamBlock<'_> {
    BeamBlock {
        samples,
        beam: index as u16,
        exponent: 0,
    }
}
