//! The downlink's waveform: one OFDM symbol with a Zadoff-Chu sequence on its active subcarriers, sent twice.
//!
//! The second repetition is the block that the receiver keeps, so delays are cyclic. Source: docs/signal-model.md, "Waveform and
//! link budget".
//!
//! Given: there.

use super::{DelayPeriod, SAMPLES};
use crate::array::phasor;
use crate::constants::SPEED_OF_LIGHT_M_PER_S;
use crate::geometry::{Complex, Real};

/// Description of the waveform. Subcarrier offsets run over the `active` ones centred on the carrier, -208..=207.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waveform {
    /// Carrier frequency, Hz.
    pub carrier_hz: f64,
    /// Complex sample rate, Hz.
    pub sample_rate_hz: f64,
    /// Active subcarriers, even, at most [`SAMPLES`].
    pub active: usize,
    /// Length of the Zadoff-Chu sequence, odd; extended cyclically over the active subcarriers.
    pub sequence_length: u32,
    /// Root of the sequence, coprime to its length.
    pub root: u32,
}

impl Default for Waveform {
    /// 30 GHz, 245.76 Msps, 416 subcarriers of 480 kHz, length 409 with root 273 (2.8 dB peak to average).
    fn default() -> Self {
        Self {
            carrier_hz: 30e9,
            sample_rate_hz: 245.76e6,
            active: 416,
            sequence_length: 409,
            root: 273,
        }
    }
}

/// What a waveform cannot be: the field, in the words of [`WaveformError::field`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WaveformError {
    /// `carrier_hz` is not a positive number.
    Carrier,
    /// `sample_rate_hz` is not a positive number.
    SampleRate,
    /// `active` is zero, odd or more than [`SAMPLES`].
    Active,
    /// `sequence_length` is even, or 1 and less.
    SequenceLength,
    /// `root` is zero, or has a divisor in common with the length: the sequence repeats within a symbol, and delays are ambiguous.
    Root,
}

impl WaveformError {
    /// Name of the field that is wrong.
    #[must_use]
    pub fn field(self) -> &'static str {
        match self {
            Self::Carrier => "waveform.carrier_hz",
            Self::SampleRate => "waveform.sample_rate_hz",
            Self::Active => "waveform.active",
            Self::SequenceLength => "waveform.sequence_length",
            Self::Root => "waveform.root",
        }
    }

    /// What was expected of it.
    #[must_use]
    pub fn expected(self) -> &'static str {
        match self {
            Self::Carrier | Self::SampleRate => "a positive number",
            Self::Active => "an even number of 2 to 512",
            Self::SequenceLength => "an odd number of 3 or more",
            Self::Root => "a number coprime to the sequence's length",
        }
    }
}

impl core::fmt::Display for WaveformError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}: expected {}", self.field(), self.expected())
    }
}

impl core::error::Error for WaveformError {}

impl Waveform {
    /// Name of the default waveform in recordings.
    pub const NAME: &'static str = "zc409-273";
    /// Time from the first beam of a sweep to that of its first pilots, the beams sent again, s.
    pub const PILOT_DELAY_S: f64 = 1e-3;
    /// Time from a beam's first pilot to its second, s: lengths that change by less than a wavelength in it are told from each other, 2.5 m/s.
    pub const PILOT_INTERVAL_S: f64 = 4e-3;

    /// Whether the receiver can work with it.
    ///
    /// # Errors
    /// [`WaveformError`] naming the first field that is wrong.
    pub fn check(&self) -> Result<(), WaveformError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let coprime = |(mut a, mut b): (u32, u32)| {
            while b != 0 {
                (a, b) = (b, a % b);
            }
            a == 1
        };
        let sound = [
            (positive(self.carrier_hz), WaveformError::Carrier),
            (positive(self.sample_rate_hz), WaveformError::SampleRate),
            (
                (2..=SAMPLES).contains(&self.active) && self.active.is_multiple_of(2),
                WaveformError::Active,
            ),
            (
                self.sequence_length > 2 && !self.sequence_length.is_multiple_of(2),
                WaveformError::SequenceLength,
            ),
            (
                self.root > 0 && coprime((self.sequence_length, self.root)),
                WaveformError::Root,
            ),
        ];
        match sound.into_iter().find(|(is_sound, _)| !is_sound) {
            Some((_, error)) => Err(error),
            None => Ok(()),
        }
    }

    /// Subcarrier offset of active index 0..active.
    pub fn offset(&self, index: usize) -> i32 {
        index as i32 - (self.active / 2) as i32
    }

    /// Bin of the transform that holds active index 0..active: negative offsets lie in the upper half.
    pub fn bin(&self, index: usize) -> usize {
        (self.offset(index).rem_euclid(SAMPLES as i32)) as usize
    }

    /// Symbol on active index 0..active: `exp(-j pi q n(n+1)/L)`, n = index mod L. The phase is reduced in integers, so
    /// the value is as exact as one sine and cosine.
    pub fn symbol<T: Real>(&self, index: usize) -> Complex<T> {
        let length = u64::from(self.sequence_length.max(1));
        let n = index as u64 % length;
        let half_turns = u64::from(self.root) * (n * (n + 1)) % (2 * length);
        phasor(-T::pi() * T::of(half_turns as f64 / length as f64))
    }

    /// Wavelength of the carrier, m: 1 cm.
    pub fn wavelength_m(&self) -> f64 {
        SPEED_OF_LIGHT_M_PER_S / self.carrier_hz
    }

    /// Subcarrier spacing, Hz: 480 kHz.
    pub fn spacing_hz(&self) -> f64 {
        self.sample_rate_hz / SAMPLES as f64
    }

    /// Length of light in a sample, m: 1.22 m.
    pub fn metres_per_sample(&self) -> f64 {
        SPEED_OF_LIGHT_M_PER_S / self.sample_rate_hz
    }

    /// Length after which delays repeat, for the symbol is cyclic: 625 m.
    // Two divisions, and ten callers.
    #[inline(never)]
    pub fn delay_period(&self) -> DelayPeriod {
        DelayPeriod::new(SPEED_OF_LIGHT_M_PER_S / self.spacing_hz())
    }

    /// Duration of a block, s: 2.083 us.
    pub fn block_s(&self) -> f64 {
        1.0 / self.spacing_hz()
    }

    /// Time between the blocks of two beams, s: the symbol is sent twice, 4.17 us.
    pub fn beam_period_s(&self) -> f64 {
        2.0 * self.block_s()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectrum_follows_its_definition() {
        let waveform = Waveform::default();
        for k in -208..208_i32 {
            let index = (k + 208) as usize;
            assert_eq!(waveform.offset(index), k);
            assert_eq!(waveform.bin(index), if k < 0 { k + 512 } else { k } as usize);
            let n = f64::from((k + 208) % 409);
            let expected = phasor(-core::f64::consts::PI * 273.0 * n * (n + 1.0) / 409.0);
            assert!(
                (waveform.symbol::<f64>(index) - expected).norm_sqr() < 1e-18,
                "subcarrier {k}"
            );
        }
    }

    #[test]
    fn lengths_are_those_of_the_design() {
        let waveform = Waveform::default();
        assert_eq!(waveform.spacing_hz(), 480e3);
        assert!((waveform.delay_period().length_m() - 624.568).abs() < 1e-3);
        assert!((waveform.beam_period_s() * 72.0 - 300e-6).abs() < 1e-12);
    }

    #[test]
    fn sequence_has_a_flat_autocorrelation_over_its_length() {
        let waveform = Waveform::default();
        for shift in [1, 57, 408] {
            let sum = (0..409).fold(Complex::new(0.0, 0.0), |acc: Complex<f64>, n| {
                acc + waveform.symbol::<f64>(n) * waveform.symbol::<f64>((n + shift) % 409).conj()
            });
            assert!(sum.norm_sqr() < 1e-18, "shift {shift}: {sum}");
        }
    }

    #[test]
    fn peak_to_average_is_low() {
        let waveform = Waveform::default();
        let (mut peak, mut mean) = (0.0_f64, 0.0);
        // Oversampled by four, as a converter's reconstruction filter would see it.
        for n in 0..4 * SAMPLES {
            let x = (0..waveform.active).fold(Complex::new(0.0, 0.0), |acc: Complex<f64>, i| {
                let turns = f64::from(waveform.offset(i)) * n as f64 / (4 * SAMPLES) as f64;
                acc + waveform.symbol::<f64>(i) * phasor(core::f64::consts::TAU * turns)
            });
            peak = peak.max(x.norm_sqr());
            mean += x.norm_sqr() / (4 * SAMPLES) as f64;
        }
        let papr_db = 10.0 * libm::log10(peak / mean);
        assert!((2.5..3.1).contains(&papr_db), "{papr_db}");
    }

    #[test]
    fn what_cannot_work_is_refused_by_its_field() {
        let sound = Waveform::default();
        assert_eq!(sound.check(), Ok(()));
        let wrong: [(Waveform, &str); 12] = [
            (
                Waveform {
                    carrier_hz: f64::NAN,
                    ..sound
                },
                "waveform.carrier_hz",
            ),
            (
                Waveform {
                    carrier_hz: 0.0,
                    ..sound
                },
                "waveform.carrier_hz",
            ),
            (
                Waveform {
                    sample_rate_hz: -1.0,
                    ..sound
                },
                "waveform.sample_rate_hz",
            ),
            (
                Waveform {
                    sample_rate_hz: f64::INFINITY,
                    ..sound
                },
                "waveform.sample_rate_hz",
            ),
            (Waveform { active: 0, ..sound }, "waveform.active"),
            (Waveform { active: 415, ..sound }, "waveform.active"),
            (Waveform { active: 514, ..sound }, "waveform.active"),
            (
                Waveform {
                    sequence_length: 0,
                    ..sound
                },
                "waveform.sequence_length",
            ),
            (
                Waveform {
                    sequence_length: 410,
                    ..sound
                },
                "waveform.sequence_length",
            ),
            (Waveform { root: 0, ..sound }, "waveform.root"),
            (Waveform { root: 409, ..sound }, "waveform.root"),
            (
                Waveform {
                    sequence_length: 405,
                    root: 25,
                    ..sound
                },
                "waveform.root",
            ),
        ];
        for (waveform, field) in wrong {
            assert_eq!(
                waveform.check().map_err(WaveformError::field),
                Err(field),
                "{waveform:?}"
            );
        }
    }
}
