//! Spectrum, taps, profiles and exponents against the definition.

use cslam_core::kernels::Channel;
use cslam_core::signal::{BeamBlock, Iq, SAMPLES, Workspace};

use crate::oracle::*;

#[test]
fn the_spectrum_keeps_60_db_at_the_level_of_the_gain_control() {
    let mut random = Random(1);
    let nine: Vec<Path> = (0..9)
        .map(|i| {
            (
                random.uniform() * 300.0,
                random.normal() * 10_f64.powf(-f64::from(i) / 6.0),
            )
        })
        .collect();
    let cases: [(&str, &[Path], f64); 3] = [
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

#[test]
fn taps_equal_the_definition_and_carry_its_scale() {
    let mut random = Random(2);
    let paths = [(100.25, C64::new(0.6, 0.8)), (117.0, C64::new(-0.2, 0.1))];
    for (rms, floor_db) in [
        (NOMINAL_RMS, 56.0),
        (4600.0, 51.0),
        (30.0, 55.0),
        (20_000.0, 52.0),
    ] {
        let samples = capture(&paths, 30.0, rms, 16, &mut random);
        let reference = taps(&samples);
        let mut block = [samples; 32];
        let mut work = Workspace::new();
        let beam = correlate(&mut block, &mut work);
        assert_eq!(beam.clips(), 0);
        let scale = 2_f64.powi(beam.exponent());
        let natural = float(&beam.into_block().samples[5]);
        let stored = sqnr_db(
            &reference,
            natural.iter().zip(&reference).map(|(a, b)| a * scale - b),
        );
        println!("rms {rms}: {stored:.1} dB");
        assert!(stored >= floor_db, "rms {rms}: {stored:.1}");
    }
}

#[test]
fn the_profile_is_the_power_of_the_taps() {
    let mut random = Random(5);
    let mut block: [Channel; 32] =
        std::array::from_fn(|_| capture(&[(40.2, random.normal())], 20.0, 5_000.0, 12, &mut random));
    let mut work = Workspace::new();
    let beam = correlate(&mut block, &mut work);
    let profile = *beam.profile();
    let natural = beam.into_block();
    for (n, &power) in profile.iter().enumerate() {
        let sum: u64 = natural
            .samples
            .iter()
            .map(|channel| u64::from(channel[n].power()))
            .sum();
        assert_eq!(power, sum, "tap {n}");
    }
    let peak = (0..SAMPLES).max_by_key(|&n| profile[n]).expect("not empty");
    assert_eq!(peak, 40);
}

#[test]
fn the_folded_profile_is_that_of_the_even_subcarriers() {
    let mut random = Random(6);
    let channels: [u8; 8] = [2, 5, 10, 13, 18, 21, 26, 29];
    let mut block: [Channel; 32] =
        std::array::from_fn(|_| capture(&[(300.4, random.normal())], 10.0, NOMINAL_RMS, 12, &mut random));
    let mut reference = vec![0.0; 256];
    for &channel in &channels {
        let product: Vec<C64> = dft(&float(&block[usize::from(channel)]), -1.0)
            .iter()
            .zip(waveform())
            .enumerate()
            .map(|(k, (r, x))| {
                if k % 2 == 0 {
                    r * x.conj() / 512.0
                } else {
                    C64::new(0.0, 0.0)
                }
            })
            .collect();
        for (sum, tap) in reference.iter_mut().zip(dft(&product, 1.0)) {
            *sum += tap.norm_sqr();
        }
    }
    let correlator = correlator();
    let beam = correlator.scale(at_unit_scale(&mut block));
    let scale = 4_f64.powi(beam.exponent() + 3);
    let mut work = Workspace::new();
    let folded = correlator.detect(&beam, &channels, &mut work);
    for (n, &power) in folded.profile.iter().enumerate() {
        let sum: u64 = folded.taps.iter().map(|taps| u64::from(taps[n].power())).sum();
        assert_eq!(power, sum, "tap {n}");
    }
    let profile = folded.profile;
    let peak = reference.iter().copied().fold(0.0, f64::max);
    for (n, (&power, exact)) in profile.iter().zip(&reference).enumerate() {
        let error = (power as f64 * scale - exact).abs() / (peak * exact).sqrt();
        assert!(error < 0.02, "tap {n}: {} for {exact}", power as f64 * scale);
    }
    // A channel that is not there adds nothing.
    let with_absent = *correlator.detect(&beam, &[2, 200], &mut Workspace::new()).profile;
    assert_eq!(
        with_absent,
        *correlator.detect(&beam, &[2], &mut Workspace::new()).profile
    );
}

/// The same wave captured at another gain gives the same taps, each with its exponent, and the same power.
#[test]
fn beams_of_different_gain_compare() {
    let mut random = Random(7);
    let samples = capture(&[(9.75, C64::new(1.0, 0.0))], 40.0, 16_000.0, 16, &mut random);
    let mut results = Vec::new();
    for bits in [0, 1, 3, 5] {
        let half = if bits == 0 { 0 } else { 1 << (bits - 1) };
        let part = |x: i16| ((i32::from(x) + half) >> bits) as i16;
        let weaker: Channel = samples.map(|x| Iq::new(part(x.re()), part(x.im())));
        let mut block = [weaker; 32];
        let correlator = correlator();
        let beam = correlator.scale(BeamBlock {
            samples: &mut block,
            beam: 3,
            exponent: bits - 20,
        });
        let power = beam.mean_power();
        let mut work = Workspace::new();
        let beam = correlator.correlate(beam, &mut work);
        assert_eq!(beam.beam(), 3);
        let peak = beam.profile().iter().copied().max().expect("not empty");
        results.push((power, peak as f64 * 4_f64.powi(beam.exponent())));
    }
    let (power, peak) = results[0];
    assert!(
        (power / (32.0 * 16_000_f64.powi(2) * 4_f64.powi(-20)) - 1.0).abs() < 1e-3,
        "{power}"
    );
    for (other_power, other_peak) in results {
        assert!(
            (other_power / power - 1.0).abs() < 1e-3,
            "{other_power} for {power}"
        );
        assert!((other_peak / peak - 1.0).abs() < 1e-3, "{other_peak} for {peak}");
    }
}

#[test]
fn a_block_without_signal_gives_no_taps() {
    let mut block = [[Iq::ZERO; SAMPLES]; 32];
    let mut work = Workspace::new();
    let beam = correlate(&mut block, &mut work);
    assert_eq!(beam.clips(), 0);
    // Roundings and floors of nothing are nothing.
    assert!(beam.profile().iter().all(|&power| power == 0));
}
