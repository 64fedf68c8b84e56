//! The fixed-point front end against its definition in f64, and what it does at the extremes of its input.

#![allow(clippy::expect_used, reason = "a helper of a test fails by panicking")]

use std::f64::consts::PI;

use cslam_core::ltd::{BeamTaps, Channel, Correlator, Iq, Levelled, SAMPLES, Workspace, bin_at, q15};
use nalgebra::Complex;

type C64 = Complex<f64>;

fn polar(magnitude: f64, phase: f64) -> C64 {
    C64::new(magnitude * phase.cos(), magnitude * phase.sin())
}

/// Xorshift64*: a test needs repeatable numbers, not good ones.
struct Random(u64);

impl Random {
    fn word(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn uniform(&mut self) -> f64 {
        ((self.word() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Circular complex normal of variance one.
    fn normal(&mut self) -> C64 {
        polar((-self.uniform().ln()).sqrt(), 2.0 * PI * self.uniform())
    }
}

/// Spectrum of the default waveform: Zadoff-Chu 409, root 273, on subcarriers -208..=207.
fn waveform() -> Vec<C64> {
    let mut x = vec![C64::new(0.0, 0.0); SAMPLES];
    for k in -208..208_i32 {
        let n = f64::from((k + 208) % 409);
        x[k.rem_euclid(512) as usize] = polar(1.0, -PI * 273.0 * n * (n + 1.0) / 409.0);
    }
    x
}

fn correlator() -> Correlator {
    let x = waveform();
    Correlator::new(&std::array::from_fn(|k| q15(x[k].re, x[k].im)))
}

/// Plain discrete Fourier transform, `sign` -1 forward and +1 inverse, no scale.
fn dft(x: &[C64], sign: f64) -> Vec<C64> {
    let n = x.len();
    let roots: Vec<C64> = (0..n)
        .map(|k| polar(1.0, sign * 2.0 * PI * k as f64 / n as f64))
        .collect();
    (0..n)
        .map(|k| (0..n).map(|i| x[i] * roots[i * k % n]).sum())
        .collect()
}

fn float(samples: &[Iq]) -> Vec<C64> {
    samples
        .iter()
        .map(|x| C64::new(f64::from(x.re()), f64::from(x.im())))
        .collect()
}

/// `h[n] = 1/512 sum_k R[k] conj(X[k]) exp(+j 2 pi k n / 512)`.
fn taps(samples: &[Iq]) -> Vec<C64> {
    let product: Vec<C64> = dft(&float(samples), -1.0)
        .iter()
        .zip(waveform())
        .map(|(r, x)| r * x.conj() / 512.0)
        .collect();
    dft(&product, 1.0)
}

/// Samples of `paths` (delay in samples, amplitude) plus noise of an SNR per active subcarrier, with an rms of
/// `rms`, quantised to `bits` left-aligned in 16.
fn capture(paths: &[(f64, C64)], snr_db: f64, rms: f64, bits: u32, random: &mut Random) -> Channel {
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
fn sqnr_db(reference: &[C64], error: impl Iterator<Item = C64>) -> f64 {
    let signal: f64 = reference.iter().map(|x| x.norm_sqr()).sum();
    10.0 * (signal / error.map(|e| e.norm_sqr()).sum::<f64>()).log10()
}

/// -12 dB of full scale, where gain control holds the strongest channel.
const NOMINAL_RMS: f64 = 8231.0;

/// Spectrum in natural order, scaled back to the plain transform, and the clips.
fn spectrum(samples: &Channel) -> (Vec<C64>, u32) {
    let mut out = [Iq::ZERO; SAMPLES];
    let clips = correlator().spectrum(samples, &mut out, &mut Workspace::new());
    let mut natural = vec![C64::new(0.0, 0.0); SAMPLES];
    for (position, y) in float(&out).into_iter().enumerate() {
        natural[bin_at(position)] = y * 64.0;
    }
    (natural, clips)
}

fn spectrum_sqnr_db(samples: &Channel) -> f64 {
    let reference = dft(&float(samples), -1.0);
    let (bins, clips) = spectrum(samples);
    assert_eq!(clips, 0);
    sqnr_db(&reference, bins.iter().zip(&reference).map(|(a, b)| a - b))
}

#[test]
fn the_spectrum_keeps_60_db_at_the_level_of_the_gain_control() {
    let mut random = Random(1);
    let nine: Vec<(f64, C64)> = (0..9)
        .map(|i| {
            (
                random.uniform() * 300.0,
                random.normal() * 10_f64.powf(-f64::from(i) / 6.0),
            )
        })
        .collect();
    let cases: [(&str, &[(f64, C64)], f64); 3] = [
        ("noise", &[], 0.0),
        ("one path", &[(17.3, C64::new(1.0, 0.0))], 30.0),
        ("nine paths", &nine, 20.0),
    ];
    for (name, paths, snr_db) in cases {
        for bits in [12, 16] {
            let samples = capture(paths, snr_db, NOMINAL_RMS, bits, &mut random);
            let sqnr = spectrum_sqnr_db(&samples);
            println!("{name}, {bits} bit: {sqnr:.1} dB");
            assert!(sqnr >= 60.0, "{name}, {bits} bit: {sqnr:.1} dB");
        }
    }
}

/// Correlates a block of equal channels.
fn correlate<'a>(block: &'a mut [Channel; 32], work: &'a mut Workspace) -> BeamTaps<'a, 32> {
    correlator().correlate(Levelled::new(block, 0), work)
}

#[test]
fn taps_equal_the_definition_and_carry_its_scale() {
    let mut random = Random(2);
    let paths = [(100.25, C64::new(0.6, 0.8)), (117.0, C64::new(-0.2, 0.1))];
    for (rms, floor_db) in [
        (NOMINAL_RMS, 57.0),
        (4600.0, 52.0),
        (30.0, 50.0),
        (20_000.0, 50.0),
    ] {
        let samples = capture(&paths, 30.0, rms, 16, &mut random);
        let reference = taps(&samples);
        let mut block = [samples; 32];
        let mut work = Workspace::new();
        let beam = correlate(&mut block, &mut work);
        assert_eq!(beam.clips(), 0);
        let scale = 2_f64.powi(beam.exponent());
        let mut window = [Complex::new(0.0_f32, 0.0); SAMPLES];
        beam.window(5, 0, &mut window);
        let exact = sqnr_db(
            &reference,
            window
                .iter()
                .zip(&reference)
                .map(|(a, b)| C64::new(f64::from(a.re), f64::from(a.im)) * scale - b),
        );
        let natural = float(&beam.into_natural()[5]);
        let stored = sqnr_db(
            &reference,
            natural.iter().zip(&reference).map(|(a, b)| a * scale - b),
        );
        println!("rms {rms}: window {exact:.1} dB, int16 taps {stored:.1} dB");
        assert!(
            exact >= floor_db && stored >= floor_db - 3.0,
            "rms {rms}: {exact:.1} {stored:.1}"
        );
    }
}
