//! The detector: its threshold, its false alarms, its sensitivity.

use cslam_core::kernels::Channel;
use cslam_core::signal::{Detector, Iq, SAMPLES, Workspace};
use proptest::prelude::*;

use crate::oracle::*;

/// White noise of an rms a component would have after the converter.
fn noise_block(rms: f64, random: &mut Random) -> [Channel; 32] {
    std::array::from_fn(|_| {
        std::array::from_fn(|_| {
            let x = random.normal() * rms;
            Iq::new(x.re.round() as i16, x.im.round() as i16)
        })
    })
}

/// 2 E / sigma^2 is chi-square with 64 degrees of freedom; tables give its upper quantiles 93.217 (1 %) and 104.716 (0.1 %).
#[test]
fn thresholds_are_chi_square_quantiles() {
    for (false_alarm, chi_square) in [(0.01, 93.217), (0.001, 104.716)] {
        let threshold = Detector::new(32, false_alarm, 1).threshold();
        assert!((2.0 * threshold - chi_square).abs() < 2e-3, "{threshold}");
    }
    // 16 degrees of freedom, 5 %.
    assert!((2.0 * Detector::new(8, 0.05, 1).threshold() - 26.296).abs() < 2e-3);
    // The default sweep: docs/signal-model.md, "Path estimation" has 68.8.
    let sweep = Detector::new(32, 1e-2, 72 * 512).threshold();
    assert!((sweep - 68.8).abs() < 0.05, "{sweep}");
}

/// Noise alone, at a rate high enough to count: half a false alarm a beam is asked for. The 512 taps of 416 subcarriers
/// are not independent, but their peaks nearly are: 1 - exp(-1/2) = 0.39 of the beams fire, as for 512 tests.
#[test]
fn false_alarms_come_at_their_rate() {
    let detector = Detector::new(32, 0.5, 512);
    let correlator = correlator();
    let mut work = Workspace::new();
    let mut random = Random(8);
    let beams = 400;
    let mut fired = 0;
    let mut variance = 0.0;
    for _ in 0..beams {
        let mut block = noise_block(NOMINAL_RMS, &mut random);
        let taps = correlator.correlate(correlator.scale(at_unit_scale(&mut block)), &mut work);
        fired += u32::from(detector.peak(taps.profile()).is_some());
        variance +=
            f64::from(detector.noise(taps.profile())) * 4_f64.powi(taps.exponent()) / f64::from(beams);
    }
    let rate = f64::from(fired) / f64::from(beams);
    println!("{rate} of the beams fire");
    assert!((0.32..0.46).contains(&rate), "{rate}");
    // Variance of a tap: 416 of 512 bins of noise of that mean square, divided by 512.
    let exact = NOMINAL_RMS.powi(2) * 416.0 / 512.0;
    assert!((variance / exact - 1.0).abs() < 0.02, "{variance} for {exact}");
}

/// One path at -20 dB a subcarrier in all channels, at delays between the taps, with the default sweep's threshold.
#[test]
fn a_path_at_minus_20_db_is_detected() {
    let detector = Detector::new(32, 1e-2, 72 * 512);
    let correlator = correlator();
    let mut work = Workspace::new();
    let mut random = Random(9);
    let trials = 60;
    let mut detected = 0;
    for trial in 0..trials {
        let delay = 100.0 + f64::from(trial) / f64::from(trials);
        let clean = capture(&[(delay, C64::new(1.0, 0.0))], 300.0, 20_000.0, 16, &mut random);
        // Noise of all 512 bins at 20 dB over the active ones' signal.
        let rms = NOMINAL_RMS;
        let signal = rms * 0.1 * (416.0_f64 / 512.0).sqrt() / 20_000.0;
        let mut block = noise_block(rms, &mut random);
        for channel in &mut block {
            let turn = random.normal();
            let turn = turn / turn.norm_sqr().sqrt() * signal;
            for (x, s) in channel.iter_mut().zip(float(&clean)) {
                let s = s * turn;
                *x = Iq::new(
                    (f64::from(x.re()) + s.re).round() as i16,
                    (f64::from(x.im()) + s.im).round() as i16,
                );
            }
        }
        let taps = correlator.correlate(correlator.scale(at_unit_scale(&mut block)), &mut work);
        let peak = detector.peak(taps.profile());
        detected += u32::from(peak.is_some_and(|peak| (100..=101).contains(&peak.tap)));
    }
    println!("{detected} of {trials}");
    assert!(
        f64::from(detected) >= 0.95 * f64::from(trials),
        "{detected} of {trials}"
    );
}

#[test]
fn silence_does_not_fire() {
    assert_eq!(Detector::new(32, 1e-2, 30_000).peak(&[0; SAMPLES]), None);
}

#[test]
fn of_equal_peaks_the_first_is_given() {
    let mut profile = [1_000; SAMPLES];
    profile[70] = 1_000_000;
    profile[300] = 1_000_000;
    let peak = Detector::new(32, 1e-2, 30_000)
        .peak(&profile)
        .expect("far over the threshold");
    assert_eq!((peak.tap, peak.power), (70, 1_000_000));
}

proptest! {
    /// The median against sorting, to the nine bits that it keeps; the first of equal peaks wins.
    #[test]
    fn noise_is_the_median(values in prop::collection::vec(prop_oneof![any::<u64>(), 0..1000_u64, Just(0)], 512)) {
        let profile: [u64; 512] = values.clone().try_into().expect("512 values");
        let mut sorted = values;
        sorted.sort_unstable();
        let detector = Detector::new(32, 1e-2, 1);
        // ln 2-like factor of Gamma(32): its median, 31.6676.
        let median = f64::from(detector.noise(&profile)) * 31.667_6;
        let exact = sorted[255] as f64;
        prop_assert!(median <= exact * 1.000_01 && median >= exact * (1.0 - 1.0 / 256.0) * 0.999_99, "{median} {exact}");
        if let Some(peak) = detector.peak(&profile) {
            prop_assert_eq!(peak.power, sorted[511]);
            prop_assert_eq!(profile.iter().position(|&power| power == peak.power), Some(peak.tap));
        }
    }
}
