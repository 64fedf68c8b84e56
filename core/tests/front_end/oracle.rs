//! The definition in f64, and captures to try it on.

use std::f64::consts::PI;

use cslam_core::kernels::Channel;
use cslam_core::signal::{BeamBlock, BeamTaps, Correlator, Iq, SAMPLES, Waveform, Workspace, bin_at};
use nalgebra::Complex;

pub(crate) type C64 = Complex<f64>;

pub(crate) fn polar(magnitude: f64, phase: f64) -> C64 {
    C64::new(magnitude * phase.cos(), magnitude * phase.sin())
}

/// Xorshift64*: a test needs repeatable numbers, not good ones.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn word(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        ((self.word() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Circular complex normal of variance one.
    pub(crate) fn normal(&mut self) -> C64 {
        polar((-self.uniform().ln()).sqrt(), 2.0 * PI * self.uniform())
    }
}

/// Spectrum of the default waveform: Zadoff-Chu 409, root 273, on subcarriers -208..=207.
pub(crate) fn waveform() -> Vec<C64> {
    let mut x = vec![C64::new(0.0, 0.0); SAMPLES];
    for k in -208..208_i32 {
        let n = f64::from((k + 208) % 409);
        x[k.rem_euclid(512) as usize] = polar(1.0, -PI * 273.0 * n * (n + 1.0) / 409.0);
    }
    x
}

pub(crate) fn correlator() -> Correlator {
    Correlator::new(&Waveform::default())
}

/// Delay in samples, amplitude.
pub(crate) type Path = (f64, C64);

/// Plain discrete Fourier transform, `sign` -1 forward and +1 inverse, no scale.
pub(crate) fn dft(x: &[C64], sign: f64) -> Vec<C64> {
    let n = x.len();
    let roots: Vec<C64> = (0..n)
        .map(|k| polar(1.0, sign * 2.0 * PI * k as f64 / n as f64))
        .collect();
    (0..n)
        .map(|k| (0..n).map(|i| x[i] * roots[i * k % n]).sum())
        .collect()
}

pub(crate) fn float(samples: &[Iq]) -> Vec<C64> {
    samples
        .iter()
        .map(|x| C64::new(f64::from(x.re()), f64::from(x.im())))
        .collect()
}

/// `h[n] = 1/512 sum_k R[k] conj(X[k]) exp(+j 2 pi k n / 512)`.
pub(crate) fn taps(samples: &[Iq]) -> Vec<C64> {
    let product: Vec<C64> = dft(&float(samples), -1.0)
        .iter()
        .zip(waveform())
        .map(|(r, x)| r * x.conj() / 512.0)
        .collect();
    dft(&product, 1.0)
}

/// Samples of `paths` (delay in samples, amplitude) plus noise of an SNR per active subcarrier, with an rms of
/// `rms`, quantised to `bits` left-aligned in 16.
pub(crate) fn capture(paths: &[Path], snr_db: f64, rms: f64, bits: u32, random: &mut Random) -> Channel {
    let spectrum: Vec<C64> = waveform()
        .iter()
        .enumerate()
        .map(|(k, x)| {
            let frequency = if k < 256 { k as f64 } else { k as f64 - 512.0 };
            let h: C64 = paths
                .iter()
                .map(|(delay, a)| a * polar(1.0, -2.0 * PI * frequency * delay / 512.0))
                .sum();
            h * x + random.normal() * 10_f64.powf(-snr_db / 20.0)
        })
        .collect();
    let x = dft(&spectrum, 1.0);
    let scale = rms / (x.iter().map(|x| x.norm_sqr()).sum::<f64>() / 512.0).sqrt();
    let lsb = f64::from(1 << (16 - bits));
    let round = |x: f64| ((x * scale / lsb + 0.5).floor() * lsb).clamp(-32_768.0, 32_768.0 - lsb) as i16;
    std::array::from_fn(|n| Iq::new(round(x[n].re), round(x[n].im)))
}

/// Signal to error, dB.
pub(crate) fn sqnr_db(reference: &[C64], error: impl Iterator<Item = C64>) -> f64 {
    let signal: f64 = reference.iter().map(|x| x.norm_sqr()).sum();
    10.0 * (signal / error.map(|e| e.norm_sqr()).sum::<f64>()).log10()
}

/// -12 dB of full scale, where gain control holds the strongest channel.
pub(crate) const NOMINAL_RMS: f64 = 8231.0;

/// Spectrum in natural order, scaled back to the plain transform, and the clips.
pub(crate) fn spectrum(samples: &Channel) -> (Vec<C64>, u32) {
    let mut out = [Iq::ZERO; SAMPLES];
    let clips = correlator().spectrum(samples, &mut out, &mut Workspace::new());
    let mut natural = vec![C64::new(0.0, 0.0); SAMPLES];
    for (position, y) in float(&out).into_iter().enumerate() {
        natural[bin_at(position)] = y * 64.0;
    }
    (natural, clips)
}

pub(crate) fn spectrum_sqnr_db(samples: &Channel) -> f64 {
    let reference = dft(&float(samples), -1.0);
    let (bins, clips) = spectrum(samples);
    assert_eq!(clips, 0);
    sqnr_db(&reference, bins.iter().zip(&reference).map(|(a, b)| a - b))
}

pub(crate) fn at_unit_scale(samples: &mut [Channel; 32]) -> BeamBlock<'_> {
    BeamBlock {
        samples,
        beam: 0,
        exponent: 0,
    }
}

/// Correlates a block of equal channels.
pub(crate) fn correlate<'a>(block: &'a mut [Channel; 32], work: &'a mut Workspace) -> BeamTaps<'a, 32> {
    let correlator = correlator();
    correlator.correlate(correlator.scale(at_unit_scale(block)), work)
}

/// Largest distance of a component between two spectra or tap vectors.
pub(crate) fn largest_error(a: &[C64], b: &[C64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).re.abs().max((a - b).im.abs()))
        .fold(0.0, f64::max)
}
