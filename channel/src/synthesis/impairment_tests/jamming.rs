//! Jammers add what they send, from where they are, and nothing else.

use super::*;

#[test]
fn a_jammer_adds_a_tone_of_its_power_from_its_direction() {
    let offset_hz = 24.0 * 480e3;
    let (_, jammed) = sweep(Impairments {
        jammer: Some(Jammer {
            offset_hz,
            ..Jammer::tone(-60.0)
        }),
        ..Impairments::none()
    });
    let ideal = ideal();
    let waveform = cslam_core::signal::Waveform::default();
    let [a, b] = [&jammed, &ideal].map(|s| (0..8).map(|c| response(block(s, BEAM), c)).collect::<Vec<_>>());
    let at = 208 + 24;
    let difference = |c: usize, k: usize| a[c][k] - b[c][k];
    // Amplitude sqrt(power) times dipole and front gain; the whole tone in one bin, where the waveform has 1/sqrt(416).
    let expected = libm::sqrt(1e-9) * libm::sqrt(1.643 * 2.0) * 416_f64.sqrt();
    for c in 0..8 {
        let tone = difference(c, at);
        assert!(
            (tone.norm() / expected - 1.0).abs() < 1e-3,
            "{} {expected}",
            tone.norm()
        );
        // Array 0's axis is square to the nose: the tone arrives in phase.
        assert!(wrap((tone / difference(0, at)).arg()).abs() < 2e-3);
        let elsewhere = (0..waveform.active)
            .filter(|k| *k != at)
            .map(|k| difference(c, k).norm());
        assert!(elsewhere.fold(0.0, f64::max) < 2e-3 * expected);
    }
}

/// What a jammer of -60 dBm adds to channel 0 of a beam, sample by sample, and the amplitude that its power means there.
fn added(jammer: Jammer, beam: u16) -> (Vec<[f64; 2]>, f64) {
    let (_, jammed) = sweep(Impairments {
        jammer: Some(jammer),
        ..Impairments::none()
    });
    let ideal = ideal();
    let [a, b] = [&jammed, &ideal].map(|sweep| {
        let block = block(sweep, beam);
        let scale = libm::ldexp(1.0, block.exponent);
        block.samples[0].map(|x| [f64::from(x.re()) * scale, f64::from(x.im()) * scale])
    });
    let difference = a.iter().zip(&b).map(|(a, b)| [a[0] - b[0], a[1] - b[1]]);
    (difference.collect(), libm::sqrt(1e-9) * libm::sqrt(1.643 * 2.0))
}

fn of_kind(kind: JammerKind) -> Jammer {
    Jammer {
        kind,
        ..Jammer::tone(-60.0)
    }
}

#[test]
fn a_noise_jammer_adds_its_power_and_other_noise_to_each_beam() {
    let (first, amplitude) = added(of_kind(JammerKind::Noise), BEAM);
    // 512 complex samples: 4.4 % rms of the power.
    let ratio = power(&first) / (amplitude * amplitude);
    assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
    let (other, _) = added(of_kind(JammerKind::Noise), BEAM + 1);
    let together: f64 = first
        .iter()
        .zip(&other)
        .map(|(a, b)| a[0] * b[0] + a[1] * b[1])
        .sum();
    assert!(together.abs() / 512.0 < 0.25 * amplitude * amplitude);
    assert_eq!(added(of_kind(JammerKind::Noise), BEAM).0, first);
}

#[test]
fn a_pulsed_jammer_is_silent_between_its_pulses() {
    let jammer = Jammer {
        pulse_interval_s: 0.5e-6,
        duty: 0.25,
        ..of_kind(JammerKind::Pulsed)
    };
    let (samples, amplitude) = added(jammer, 0);
    let on = samples
        .iter()
        .filter(|[re, im]| re.hypot(*im) > 0.05 * amplitude)
        .count();
    // 512 samples are four intervals and a sixth.
    assert!((120..=165).contains(&on), "{on} samples");
    let ratio = power(&samples) / (0.27 * amplitude * amplitude);
    assert!((ratio - 1.0).abs() < 0.35, "{ratio}");
}

#[test]
fn a_replay_is_the_symbol_with_the_delay_of_the_jammers_choice_in_every_beam() {
    let delay_s = 200e-9;
    for beam in [0, BEAM] {
        let jammer = Jammer {
            delay_s,
            ..of_kind(JammerKind::Replay)
        };
        let (_, jammed) = sweep(Impairments {
            jammer: Some(jammer),
            ..Impairments::none()
        });
        let [a, b] = [&jammed, &ideal()].map(|sweep| response(block(sweep, beam), 0));
        let difference: Vec<C64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        let amplitude = libm::sqrt(1e-9) * libm::sqrt(1.643 * 2.0);
        // The array lies 0.2 m nearer to the jammer than the body's origin.
        let heard_s = delay_s - 0.2 / cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
        let step = cslam_core::array::phasor(-TAU * 480e3 * heard_s);
        for pair in difference.windows(2) {
            assert!(
                (pair[0].norm() / amplitude - 1.0).abs() < 5e-3,
                "{}",
                pair[0].norm()
            );
            assert!((pair[1] / pair[0] - step).norm() < 1e-2);
        }
    }
}
