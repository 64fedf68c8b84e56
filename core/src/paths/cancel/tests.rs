//! What is cancelled is gone from the taps up to rounding, as far as it reaches, and the profile keeps step.

use super::*;
use crate::array::UavArrays;
use crate::signal::Waveform;

fn source() -> Source<4> {
    Source {
        origin: 100,
        delay_taps: 0.37,
        u: Vector3::new(0.36, -0.48, 0.8),
        gains: core::array::from_fn(|j| phasor(0.21 * j as f32) * (6000.0 - 1500.0 * j as f32)),
    }
}

/// The taps of the source by the definition of the signal, in double precision, rounded.
fn exact(model: &ArrayModel<4, 8>, waveform: &Waveform, source: &Source<4>) -> [Channel; 32] {
    let mut taps = [[Iq::ZERO; SAMPLES]; 32];
    let mut kernel = [[Complex::new(0.0_f64, 0.0); SAMPLES]; 4];
    for (row, (_, lead)) in kernel.iter_mut().zip(model.arrays()) {
        let delay = f64::from(source.delay_taps - lead.dot(&source.u));
        for (n, value) in row.iter_mut().enumerate() {
            let x = n as f64 - source.origin as f64;
            for i in 0..waveform.active {
                let k = f64::from(waveform.offset(i));
                // The gain's phase refers to the band centre at the delay, to the origin tap elsewhere.
                let turns = (k * (x - delay) - 0.5 * delay) / SAMPLES as f64;
                let (sine, cosine) = (
                    libm::sin(core::f64::consts::TAU * turns),
                    libm::cos(core::f64::consts::TAU * turns),
                );
                *value += Complex::new(cosine, sine) / waveform.active as f64;
            }
        }
    }
    for (c, row) in taps.iter_mut().enumerate() {
        let (j, i) = (c / 8, c % 8);
        let (step, _) = model.arrays().nth(j).expect("array");
        let angle = core::f64::consts::TAU * f64::from(step.dot(&source.u)) * (i as f64 - 3.5);
        let g = source.gains[j];
        let gain =
            Complex::new(f64::from(g.re), f64::from(g.im)) * Complex::new(libm::cos(angle), libm::sin(angle));
        for (sample, d) in row.iter_mut().zip(&kernel[j]) {
            let value = gain * d;
            *sample = Iq::new(libm::round(value.re) as i16, libm::round(value.im) as i16);
        }
    }
    taps
}

fn profile_of(taps: &[Channel; 32]) -> [u64; SAMPLES] {
    core::array::from_fn(|n| taps.iter().map(|row| u64::from(row[n].power())).sum())
}

#[test]
fn path_leaves_only_rounding_and_the_profile_keeps_step() {
    let waveform = Waveform::default();
    let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &waveform);
    let template = Template::new(&waveform);
    let source = source();
    let mut taps = exact(&model, &waveform, &source);
    let before = taps;
    let mut profile = profile_of(&taps);
    // Noise so weak that the whole period is cancelled.
    change(
        &model,
        &template,
        &mut taps,
        &mut profile,
        &[source],
        SAMPLES / 2,
        Change::Subtract,
    );
    let left: u64 = profile.iter().sum();
    assert_eq!(profile, profile_of(&taps));
    let rms = libm::sqrt(left as f64 / (2.0 * 32.0 * SAMPLES as f64));
    assert!(rms < 0.45, "{rms} LSB per component");
    let largest = taps.iter().flatten().map(|x| x.power()).max().expect("taps");
    assert!(largest <= 8, "{largest}");
    change(
        &model,
        &template,
        &mut taps,
        &mut profile,
        &[source],
        SAMPLES / 2,
        Change::Add,
    );
    assert_eq!(profile, profile_of(&taps));
    let back = taps.iter().flatten().zip(before.iter().flatten());
    assert!(
        back.clone().all(|(a, b)| a == b),
        "{:?}",
        back.clone().find(|(a, b)| a != b)
    );
}

#[test]
fn a_column_is_the_kernel_wherever_it_begins() {
    let template = Template::new(&Waveform::default());
    let gain = phasor(0.1) * 1e6;
    for (first, count) in [
        (-256, 512),
        (-60, 30),
        (-20, 3),
        (-5, 8),
        (-14, 200),
        (15, 4),
        (40, 100),
    ] {
        for delay in [-0.5, -0.25, 0.0, 0.3] {
            let mut column = [[0; 2]; SAMPLES];
            fill(&template, first, count, delay, gain, (&mut column, 1));
            for (n, value) in (first..).zip(column).take(count) {
                let exact =
                    gain * phasor(template.centre_turns() * n as f32) * template.anywhere(n as f32 - delay);
                let away = (exact.re - value[0] as f32)
                    .abs()
                    .max((exact.im - value[1] as f32).abs());
                assert!(
                    away < 3.0,
                    "tap {n} of {first}, {count} at {delay}: {value:?} {exact}"
                );
            }
        }
    }
}

#[test]
fn reach_follows_the_strength() {
    let waveform = Waveform::default();
    let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &waveform);
    let template = Template::new(&waveform);
    let weak = Source {
        gains: [Complex::new(40.0, 0.0); 4],
        ..source()
    };
    let mut taps = [[Iq::ZERO; SAMPLES]; 32];
    let mut profile = [0; SAMPLES];
    change(
        &model,
        &template,
        &mut taps,
        &mut profile,
        &[weak],
        reach(weak.amplitude(), 16.0, template.occupancy()),
        Change::Add,
    );
    let touched = |n: usize| profile.get(n).is_some_and(|&e| e > 0);
    // Amplitude ten times the noise: 3 x 10 / 2.55 = 11 taps.
    assert!(touched(100 - 10) && touched(100 + 10));
    assert!((112..600).all(|n| !touched(n % SAMPLES)) && !touched(88));
}

/// What the bound on a difference leaves out is under a third of the noise's amplitude, wherever and however a path is moved.
#[test]
fn beyond_its_reach_a_difference_is_under_the_noise() {
    let waveform = Waveform::default();
    let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &waveform);
    let template = Template::new(&waveform);
    let noise = 16.0_f32;
    for (by_taps, by_rad, by_gain) in [
        (0.02, 0.0, 1.0),
        (0.0, 0.002, 1.0),
        (0.0, 0.0, 0.98),
        (-0.02, 0.002, 1.02),
    ] {
        let old = source();
        let u = old.u + Vector3::new(0.0, by_rad, 0.0);
        let new = Source {
            delay_taps: old.delay_taps + by_taps,
            u: u / u.norm(),
            gains: old.gains.map(|g| g * by_gain),
            ..old
        };
        let taps = [&new, &old].map(|source| exact(&model, &waveform, source));
        let amplitude = new.difference(&old, &model, &template);
        let far = reach(amplitude, noise, template.occupancy()) as i32;
        assert!(far < 200, "{far}: a small change must not reach everywhere");
        let left = (far + 1..256)
            .flat_map(|n| [n, -n])
            .map(|n| (100 + n) as usize & (SAMPLES - 1));
        let most = left
            .flat_map(|n| (0..32).map(move |c| (c, n)))
            .map(|(c, n)| {
                let [a, b] = taps.each_ref().map(|taps| taps[c][n]);
                let part = |x: i16, y: i16| f32::from(x) - f32::from(y);
                libm::hypotf(part(a.re(), b.re()), part(a.im(), b.im()))
            })
            .fold(0.0, f32::max);
        // Both are rounded: up to 1.4 LSB, and beyond a quarter of the period the kernel is up to twice the bound.
        assert!(
            most < 2.0 * libm::sqrtf(noise) / 3.0 + 1.5,
            "{by_taps} {by_rad}: {most} beyond {far}"
        );
    }
}
