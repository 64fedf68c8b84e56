//! The samples are right: delay, spatial phase, link budget, noise, antennas.

use cslam_core::geometry::{Rotation, Vector3};

use super::antenna::element::half_wave_dipole;
use super::probe::{block, fits, one_path, response};
use super::*;

/// No error, no noise, the widest converter.
fn clean() -> ChannelConfig {
    ChannelConfig {
        front_end: FrontEndConfig {
            noise: false,
            adc_bits: 16,
            ..FrontEndConfig::default()
        },
        impairments: Impairments::none(),
        motion: MotionConfig::default(),
    }
}

fn strongest(sweep: &Sweep) -> &Block {
    // Same level everywhere: the highest exponent has the strongest signal.
    sweep.blocks.iter().max_by_key(|b| b.exponent).expect("blocks")
}

fn wrap(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}

#[test]
fn matched_filter_returns_delay_to_a_millimetre_and_spatial_phase_to_a_milliradian() {
    let simulator = Simulator::new(clean(), 0);
    for (length_m, arrival, departure) in [
        (10.0, [1.5, 0.3], [1.6, 0.2]),
        (77.123_4, [0.7, -2.0], [1.4, 2.2]),
        (123.456_7, [2.2, 1.5], [1.2, -1.9]),
        (311.0, [1.9, 3.0], [1.5, -0.6]),
    ] {
        let link = one_path(length_m, arrival, departure);
        let sweep = simulator
            .sweep(&link, &Instant::at_rest(), 0)
            .expect("complete path");
        let fits = fits(strongest(&sweep));
        let (st, ct) = arrival[0].sin_cos();
        let (sp, cp) = arrival[1].sin_cos();
        let u = Vector3::new(st * cp, st * sp, ct);
        for j in 0..4 {
            // Geometry written out from the design page, not taken from the code under test.
            let face = std::f64::consts::FRAC_PI_2 * j as f64;
            let (sa, ca) = face.sin_cos();
            let tilt = 35.264_389_682_754_66_f64.to_radians();
            let axis = Vector3::new(-sa * tilt.cos(), ca * tilt.cos(), tilt.sin());
            let centre = Vector3::new(0.2 * ca, 0.2 * sa, 0.0);
            for i in 0..8 {
                let fit = fits[8 * j + i];
                let error_m = fit.delay_s * 299_792_458.0 - (length_m - centre.dot(&u));
                assert!(error_m.abs() < 1e-3, "array {j} element {i}: {error_m} m");
                let phase = (fit.amplitude / fits[8 * j].amplitude).arg();
                let error_rad = wrap(phase - std::f64::consts::PI * i as f64 * axis.dot(&u));
                assert!(error_rad.abs() < 1e-3, "array {j} element {i}: {error_rad} rad");
            }
        }
    }
}

#[test]
fn measured_snr_is_the_link_budget() {
    let mut config = clean();
    config.front_end.noise = true;
    let simulator = Simulator::new(config, 4);
    // Along beam 9 (face 0, k = 3, horizontal), arriving on the nose.
    let azimuth = -(60_f64.to_radians().sin() / 8.0).asin();
    let link = one_path(
        60.0,
        [std::f64::consts::FRAC_PI_2, 0.0],
        [std::f64::consts::FRAC_PI_2, azimuth],
    );
    let (mut signal, mut noise) = (0.0, 0.0);
    let sweeps = 12;
    for index in 0..sweeps {
        let sweep = simulator
            .sweep(&link, &Instant::at_rest(), index)
            .expect("complete path");
        // The elements of the array that looks ahead.
        for c in 0..8 {
            let h = response(block(&sweep, 9), c);
            let fit = probe::fit(&h);
            signal += fit.amplitude.norm_sqr();
            let total: f64 = h.iter().map(|h| h.norm_sqr()).sum();
            // Two real parameters fitted: amplitude; the delay takes a third of a degree.
            noise += (total - 416.0 * fit.amplitude.norm_sqr()) / 415.0;
        }
    }
    let measured_db = 10.0 * (signal / noise).log10();
    // 30 dBm, array 8 x 8, dipole and aperture of the GMT, 3 dB loss, free space, dipole and front of the UAV's element,
    // thermal noise of 416 x 480 kHz at noise figure 7 dB.
    let dipole_db = 10.0 * 1.643_f64.log10();
    let free_space_db = 20.0 * (4.0 * std::f64::consts::PI * 60.0 * 30e9 / 299_792_458.0_f64).log10();
    let noise_dbm = 30.0 + 10.0 * (1.380_649e-23 * 290.0 * 416.0 * 480e3_f64).log10() + 7.0;
    let budget_db = 30.0 - 3.0 + 10.0 * 64_f64.log10() + dipole_db + 10.0 * azimuth.cos().log10()
        - free_space_db
        + dipole_db
        + 10.0 * 2_f64.log10()
        - noise_dbm;
    assert!(
        (budget_db - 38.8).abs() < 0.05,
        "docs/signal-model.md says 38.8 dB with 2.15 dBi: {budget_db}"
    );
    assert!(
        (measured_db - budget_db).abs() < 0.1,
        "{measured_db} dB, budget {budget_db} dB"
    );
}

#[test]
fn noise_is_white_and_circular() {
    let mut config = clean();
    config.front_end.noise = true;
    let simulator = Simulator::new(config, 9);
    let sweep = simulator.sweep_rays(&[], &Instant::at_rest(), 0);
    let blocks = sweep.blocks.len() as f64;
    let samples: Vec<Vec<C64>> = sweep
        .blocks
        .iter()
        .flat_map(|b| {
            let scale = libm::ldexp(1.0, b.exponent) / simulator.noise_power_w().sqrt();
            b.samples.iter().map(move |c| {
                c.iter()
                    .map(|x| C64::new(f64::from(x.re()), f64::from(x.im())) * scale)
                    .collect()
            })
        })
        .collect();
    let n = samples.iter().map(Vec::len).sum::<usize>() as f64;
    let sum = |f: &dyn Fn(&[C64]) -> C64| samples.iter().map(|c| f(c)).sum::<C64>() / n;
    let five = 5.0 / n.sqrt();
    let power = sum(&|c| c.iter().map(|x| x * x.conj()).sum()).re;
    assert!((power - 1.0).abs() < five, "power {power}");
    let mean = sum(&|c| c.iter().sum());
    assert!(mean.norm() < five, "mean {mean}");
    // Circular: no pseudo-variance, so equal and uncorrelated parts.
    let pseudo = sum(&|c| c.iter().map(|x| x * x).sum());
    assert!(pseudo.norm() < 2.0 * five, "pseudo-variance {pseudo}");
    for lag in [1, 2, 3, 17, 256] {
        let white = sum(&|c| c.iter().zip(&c[lag..]).map(|(a, b)| a * b.conj()).sum());
        assert!(white.norm() < five, "lag {lag}: {white}");
    }
    // Channels, and beams, are independent.
    for step in [1, 8, 32] {
        let cross: C64 = samples
            .iter()
            .zip(&samples[step..])
            .flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b.conj()))
            .sum::<C64>()
            / n;
        assert!(cross.norm() < five, "channels {step} apart: {cross}");
    }
    // Flat: each bin's mean power, over all channels and beams.
    let transform = spectrum::Transform::new();
    let mut bins = [0.0; 512];
    for c in &samples {
        let mut x: spectrum::Samples = c.as_slice().try_into().expect("512 samples");
        transform.forward(&mut x);
        for (bin, x) in bins.iter_mut().zip(&x) {
            *bin += x.norm_sqr() / 512.0 / (32.0 * blocks);
        }
    }
    let worst = bins.iter().map(|b| (b - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst < 5.0 / (32.0 * blocks).sqrt(), "{worst}");
}

#[test]
fn a_tilted_body_hears_with_its_own_dipoles() {
    let simulator = Simulator::new(clean(), 0);
    let roll = 0.4;
    let tilted = Instant {
        attitude: Rotation::from_yaw_pitch_roll(0.0, 0.0, roll).expect("finite"),
        ..Instant::at_rest()
    };
    // From the left: rolling about x turns the wave's elevation by the roll, polarisation stays in the same plane.
    let link = one_path(
        50.0,
        [std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2],
        [1.5, 0.1],
    );
    let level = simulator.sweep(&link, &Instant::at_rest(), 0).expect("path");
    let rolled = simulator.sweep(&link, &tilted, 0).expect("path");
    let beam = strongest(&level).beam;
    let ratio = |c: usize| {
        let [a, b] = [&rolled, &level].map(|s| probe::fit(&response(block(s, beam), c)).amplitude.norm());
        a / b
    };
    // Off the left face's normal (and out of the dipoles' horizontal plane) by the roll.
    let dipole = half_wave_dipole(&Vector3::new(0.0, roll.cos(), -roll.sin())) / libm::sqrt(1.643);
    let face = libm::exp10(-6.0 * (roll.to_degrees() / 90.0).powi(2) / 20.0);
    assert!(
        (ratio(8) / (dipole * face) - 1.0).abs() < 1e-3,
        "{} {}",
        ratio(8),
        dipole * face
    );

    // From ahead: the same roll leaves the direction and turns the polarisation: cos(roll).
    let link = one_path(50.0, [std::f64::consts::FRAC_PI_2, 0.0], [1.5, 0.1]);
    let [level, rolled] = [Instant::at_rest(), tilted].map(|i| simulator.sweep(&link, &i, 0).expect("path"));
    let [a, b] = [&rolled, &level].map(|s| probe::fit(&response(block(s, beam), 0)).amplitude.norm());
    assert!((a / b - roll.cos()).abs() < 1e-3, "{}", a / b);
}

#[test]
fn beams_compare_through_their_exponents() {
    let simulator = Simulator::new(clean(), 0);
    let link = one_path(40.0, [1.4, 0.5], [1.45, 0.15]);
    let sweep = simulator.sweep(&link, &Instant::at_rest(), 0).expect("path");
    let codebook = cslam_core::array::Codebook::<f64>::default();
    let u = cslam_core::geometry::Direction::from_zenith_azimuth(1.45, 0.15).expect("angles");
    let amplitude = |m: u16| probe::fit(&response(block(&sweep, m), 0)).amplitude.norm();
    let reference = strongest(&sweep).beam;
    for m in 0..72 {
        let expected = codebook.field(m.into(), &u).norm() / codebook.field(reference.into(), &u).norm();
        let ratio = amplitude(m) / amplitude(reference);
        assert!(
            (ratio / expected - 1.0).abs() < 1e-3,
            "beam {m}: {ratio} {expected}"
        );
    }
}

#[test]
fn a_sweep_depends_on_its_seed_and_index_only() {
    let link = one_path(40.0, [1.4, 0.5], [1.45, 0.15]);
    let make = |seed, index| {
        let simulator = Simulator::new(ChannelConfig::default(), seed);
        simulator.sweep(&link, &Instant::at_rest(), index).expect("path")
    };
    let simulator = Simulator::new(ChannelConfig::default(), 1);
    let _other = simulator.sweep(&link, &Instant::at_rest(), 5);
    assert_eq!(
        simulator.sweep(&link, &Instant::at_rest(), 2).expect("path"),
        make(1, 2)
    );
    assert_ne!(make(1, 2), make(1, 3));
    assert_ne!(make(1, 2), make(2, 2));
}

#[test]
fn with_every_effect_a_block_still_depends_on_seed_index_and_slot_only() {
    let link = one_path(40.0, [1.4, 0.5], [1.45, 0.15]);
    let simulator = Simulator::new(ChannelConfig::real(), 1);
    let late = Instant {
        time_s: 30.0,
        ..Instant::at_rest()
    };
    let make = |simulator: &Simulator| simulator.sweep(&link, &late, 2).expect("path");
    let first = make(&simulator);
    assert_eq!(first, make(&Simulator::new(ChannelConfig::real(), 1)));
    assert_ne!(first, make(&Simulator::new(ChannelConfig::real(), 2)));
    let rays = rays::rays(&link, &late, 30e9).expect("complete");
    let all = simulator.squint_rays(&rays, &late, 2, SquintScheme::Sequential, |_| true);
    let some = simulator.squint_rays(&rays, &late, 2, SquintScheme::Sequential, |s| s.face == 2);
    assert_eq!(all.blocks[22..], some.blocks);
    // A beam that is lost changes no other.
    let mut config = ChannelConfig::real();
    config.impairments.dropped_beams = vec![0, 1, 40];
    let fewer = make(&Simulator::new(config, 1)).blocks;
    assert!(fewer.len() == 69 && fewer.iter().all(|b| first.blocks.contains(b)));
}

#[test]
fn an_incomplete_path_is_named() {
    let simulator = Simulator::new(clean(), 0);
    let mut link = one_path(40.0, [1.4, 0.5], [1.45, 0.15]);
    link.paths.push(link.paths[0].clone());
    link.paths[1].aod_azimuth_rad = None;
    let error = simulator
        .sweep(&link, &Instant::at_rest(), 0)
        .expect_err("no departure");
    assert_eq!(error.path, 1);
    assert!(error.to_string().contains("aod_azimuth_rad"), "{error}");
    link.paths[1] = link.paths[0].clone();
    link.paths[1].gain = None;
    let error = simulator
        .sweep(&link, &Instant::at_rest(), 0)
        .expect_err("no gain");
    assert!(error.to_string().contains("`gain` is missing"), "{error}");
}

#[test]
fn the_receiver_loses_no_bits_and_finds_the_path() {
    use cslam_core::signal::{Correlator, Detector, Workspace};
    let simulator = Simulator::new(ChannelConfig::default(), 2);
    let length_m = 100.0 * 299_792_458.0 / 245.76e6;
    let link = one_path(length_m, [1.4, 0.5], [1.45, 0.15]);
    let mut sweep = simulator.sweep(&link, &Instant::at_rest(), 0).expect("path");
    let correlator =
        Correlator::<cslam_core::kernels::Portable>::new(&cslam_core::signal::Waveform::default());
    let mut work = Box::new(Workspace::new());
    let detector = Detector::new(32, 1e-2, 72 * 512);
    let mut strongest = (0.0, 0);
    for block in &mut sweep.blocks {
        let exponent = block.exponent;
        let scaled = correlator.scale(block.view());
        // Never down, which would lose bits; up where a block lies near the lower end of the gain control's last step.
        assert!((exponent - 1..=exponent).contains(&scaled.exponent()));
        let taps = correlator.correlate(scaled, &mut work);
        assert_eq!(taps.clips(), 0);
        let peak = detector.peak(taps.profile());
        let scale = libm::ldexp(1.0, 2 * taps.exponent());
        let power = taps.profile()[100] as f64 * scale;
        if power > strongest.0 {
            strongest = (power, taps.beam());
            assert_eq!(peak.map(|p| p.tap), Some(100));
        }
    }
    let codebook = cslam_core::array::Codebook::<f64>::default();
    let u = cslam_core::geometry::Direction::from_zenith_azimuth(1.45, 0.15).expect("angles");
    let best = (0..72).max_by(|a, b| {
        codebook
            .field(*a, &u)
            .norm()
            .total_cmp(&codebook.field(*b, &u).norm())
    });
    assert_eq!(Some(usize::from(strongest.1)), best);
}
