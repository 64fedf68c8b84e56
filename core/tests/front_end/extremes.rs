//! What no gain control lets through: nothing wraps, and what clips is counted.

use std::f64::consts::PI;

use cslam_core::kernels::Channel;
use cslam_core::signal::{Iq, SAMPLES, Workspace};

use crate::oracle::*;

/// Full scale in each component.
const FULL: f64 = 32_767.0;

/// The captures that no gain control would let through, by name.
fn extremes() -> Vec<(&'static str, Channel)> {
    let mut random = Random(3);
    let corner = |re: bool, im: bool| {
        let part = |high| if high { i16::MAX } else { i16::MIN };
        Iq::new(part(re), part(im))
    };
    vec![
        ("high", [corner(true, true); SAMPLES]),
        ("low", [corner(false, false); SAMPLES]),
        ("high and low", [corner(true, false); SAMPLES]),
        (
            "alternating",
            std::array::from_fn(|n| corner(n & 1 == 0, n & 1 == 0)),
        ),
        (
            "by two and one",
            std::array::from_fn(|n| corner(n & 2 == 0, n & 1 == 0)),
        ),
        (
            "impulse",
            std::array::from_fn(|n| if n == 77 { corner(false, true) } else { Iq::ZERO }),
        ),
        (
            "random corners",
            std::array::from_fn(|_| {
                let word = random.word();
                corner(word & 1 == 0, word & 2 == 0)
            }),
        ),
        (
            "random words",
            std::array::from_fn(|_| Iq::from_word((random.word() >> 32) as u32)),
        ),
        (
            "tone",
            std::array::from_fn(|n| {
                let x = polar(FULL, 2.0 * PI * (n * 123 % 512) as f64 / 512.0);
                Iq::new(x.re as i16, x.im as i16)
            }),
        ),
    ]
}

/// Where nothing clipped, the spectrum is the definition's within the rounding. Where something did, a bin that does not
/// fit stays large and on its own side; a wrapped lane would turn it over. (Clipping works on each component, so it may
/// turn a bin by up to 45 deg in a stage.)
#[test]
fn no_input_wraps_in_the_spectrum() {
    for (name, samples) in extremes() {
        let reference = dft(&float(&samples), -1.0);
        let (bins, clips) = spectrum(&samples);
        let fits = reference
            .iter()
            .all(|x| x.re.abs().max(x.im.abs()) <= 64.0 * FULL);
        println!(
            "{name}: {clips} lanes clipped, error {:.0}",
            largest_error(&bins, &reference) / 64.0
        );
        if clips == 0 {
            assert!(fits, "{name}: a bin that does not fit was not counted");
            assert!(largest_error(&bins, &reference) < 64.0 * 12.0, "{name}");
            continue;
        }
        for (k, (bin, exact)) in bins.iter().zip(&reference).enumerate() {
            let along = (bin * exact.conj()).re / exact.norm_sqr().sqrt().max(1.0) / 64.0;
            if exact.re.abs().max(exact.im.abs()) > 64.0 * FULL {
                assert!(along > 0.5 * FULL, "{name}, bin {k}: {bin} for {exact}");
            }
        }
    }
    let clips_of = |wanted: &str| {
        let (_, samples) = extremes()
            .into_iter()
            .find(|(name, _)| *name == wanted)
            .expect("listed");
        spectrum(&samples).1
    };
    assert!(
        clips_of("high") > 0 && clips_of("tone") > 0,
        "a full-scale tone does not fit"
    );
    assert_eq!(clips_of("impulse"), 0);
}

/// A tone of every bin, at full scale and eight times too strong for its bin: it stays there, on its own side.
#[test]
fn a_tone_of_every_bin_saturates_on_its_own_side() {
    for k in 0..SAMPLES {
        for phase in [0.3, 2.0, 4.1] {
            let samples: Channel = std::array::from_fn(|n| {
                let x = polar(FULL, 2.0 * PI * (n * k % 512) as f64 / 512.0 + phase);
                Iq::new(x.re as i16, x.im as i16)
            });
            let (bins, clips) = spectrum(&samples);
            assert!(clips > 0, "bin {k}");
            let along = (bins[k] * polar(1.0, -phase)).re / 64.0;
            assert!(along > 0.6 * FULL, "bin {k}, phase {phase}: {}", bins[k]);
        }
    }
}

#[test]
fn no_input_wraps_in_the_taps() {
    for (name, samples) in extremes() {
        let reference = taps(&samples);
        let mut block = [samples; 32];
        let mut work = Workspace::new();
        let beam = correlate(&mut block, &mut work);
        let scale = 2_f64.powi(beam.exponent());
        let clips = beam.clips();
        let natural: Vec<C64> = float(&beam.into_block().samples[31])
            .iter()
            .map(|x| x * scale)
            .collect();
        let rails = natural
            .iter()
            .filter(|x| x.re.abs().max(x.im.abs()) >= FULL * scale)
            .count();
        assert_eq!(rails, 0, "{name}: the level leaves room in the taps");
        let error = largest_error(&natural, &reference) / scale;
        println!("{name}: {clips} clips, error {error:.1} LSB");
        if clips == 0 {
            assert!(error < 8.0, "{name}: {error:.1} LSB");
        } else {
            // A clipped tone loses energy; it must not turn into something larger.
            let energy = |x: &[C64]| x.iter().map(|x| x.norm_sqr()).sum::<f64>();
            assert!(
                energy(&natural) < 1.1 * energy(&reference) + 1e3 * scale * scale,
                "{name}"
            );
        }
    }
}

/// A jammer in every channel is seen, but its passes are not all repeated to count lanes; nor is a single one missed.
#[test]
fn strained_passes_are_examined_up_to_a_limit() {
    let tone = |amplitude: f64| -> Channel {
        std::array::from_fn(|n| {
            let x = polar(amplitude, 2.0 * PI * (n * 100 % 512) as f64 / 512.0);
            Iq::new(x.re as i16, x.im as i16)
        })
    };
    let mut work = Workspace::new();
    let mut block = [tone(9_000.0); 32];
    let everywhere = correlate(&mut block, &mut work);
    assert!(everywhere.clips() > 0);
    assert!(everywhere.unexamined() > 32, "{}", everywhere.unexamined());
    let mut block = [[Iq::ZERO; SAMPLES]; 32];
    block[31] = tone(9_000.0);
    let in_one = correlate(&mut block, &mut work);
    assert!(in_one.clips() > 0 && in_one.unexamined() == 0);
    // Too weak to clip, strong enough to leave half the range: examined, and found whole.
    let mut block = [[Iq::ZERO; SAMPLES]; 32];
    block[0] = capture(&[(5.0, C64::new(1.0, 0.0))], 300.0, 9_000.0, 16, &mut Random(10));
    block[31] = tone(3_500.0);
    let strained = correlate(&mut block, &mut work);
    assert_eq!((strained.clips(), strained.unexamined()), (0, 0));
}

/// The waveform itself at any level: the largest tap is 2.55 times the rms, after the shift that makes it fit.
#[test]
fn the_strongest_tap_fits() {
    let mut random = Random(4);
    for (rms, exponent) in [
        (9_150.0, 3),
        (9_180.0, 4),
        (12_000.0, 4),
        (16_000.0, 4),
        (18_400.0, 5),
    ] {
        for delay in [0.0, 63.0, 200.5, 511.0] {
            let samples = capture(&[(delay, C64::new(0.6, -0.8))], 300.0, rms, 16, &mut random);
            let mut block = [samples; 32];
            let mut work = Workspace::new();
            let beam = correlate(&mut block, &mut work);
            assert_eq!(
                (beam.clips(), beam.exponent()),
                (0, exponent),
                "rms {rms}, delay {delay}"
            );
            let natural = beam.into_block();
            let scale = 2_f64.powi(exponent - 3);
            let peak = scale
                * natural.samples[0]
                    .iter()
                    .map(|x| f64::from(x.power()).sqrt())
                    .fold(0.0, f64::max);
            let expected = if delay.fract() == 0.0 { 2.55 } else { 2.55 * 0.75 };
            assert!(
                (peak / rms / expected - 1.0).abs() < 0.03,
                "rms {rms}, delay {delay}: {peak}"
            );
        }
    }
}
