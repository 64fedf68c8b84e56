//! The fit against its definition, on two sources in noise.

use super::super::place::{LONGEST_ANGLE_RAD, LONGEST_DELAY_TAPS};
use nalgebra::Vector3;

use super::*;
use crate::array::UavArrays;
use crate::kernels::Iq;
use crate::paths::cancel::{Change, Source, change};
use crate::paths::window::JOINT;
use crate::signal::{SAMPLES, Waveform, phasor};

const NOISE: f32 = 1600.0;

fn tools() -> (ArrayModel<4, 8>, Template) {
    let waveform = Waveform::default();
    (
        ArrayModel::new(&UavArrays::default(), &waveform),
        Template::new(&waveform),
    )
}

fn source(delay_taps: f32, u: Vector3<f32>, phase_turns: f32) -> Source<4> {
    Source {
        origin: 100,
        delay_taps,
        u: u / u.norm(),
        gains: core::array::from_fn(|j| phasor(phase_turns + 0.3 * j as f32) * (7000.0 - 1800.0 * j as f32)),
    }
}

/// A window over the sum of two sources and noise of variance [`NOISE`].
fn window(model: &ArrayModel<4, 8>, template: &Template, sources: &[Source<4>; 2]) -> Window<32, JOINT> {
    let mut taps = [[Iq::ZERO; SAMPLES]; 32];
    let mut seed = 7_u32;
    let mut normal = || {
        // Sum of twelve uniforms, less six: variance one.
        let mut sum = -6.0;
        for _ in 0..12 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += (seed >> 8) as f32 / 16_777_216.0;
        }
        (sum * (0.5 * NOISE).sqrt()) as i16
    };
    for x in taps.iter_mut().flatten() {
        *x = Iq::new(normal(), normal());
    }
    change(
        model,
        template,
        &mut taps,
        &mut [0; SAMPLES],
        sources,
        SAMPLES / 2,
        Change::Add,
    );
    let mut window = Window::new();
    window.load(&taps, 100, -REACH, REACH + 2, template.centre_turns());
    window
}

#[test]
fn gradient_is_that_of_the_energy() {
    let (model, template) = tools();
    let u = Vector3::new(0.6, 0.48, 0.64);
    let window = window(
        &model,
        &template,
        &[source(0.1, u, 0.0), source(0.8, Vector3::new(0.5, 0.5, 0.7), 0.4)],
    );
    // Away from the optimum, so that the gradient is large.
    let places = [
        Place {
            delay_taps: 0.2,
            u: Vector3::new(0.62, 0.45, 0.64).normalize(),
        },
        Place {
            delay_taps: 0.6,
            u: Vector3::new(0.5, 0.52, 0.69).normalize(),
        },
    ];
    let at =
        |places: &[Place; 2]| normal_equations::<2, 6, 4, 8, 32, JOINT>(&model, &template, &window, places);
    let here = at(&places);
    for i in 0..6 {
        let side = |sign: f32| {
            let mut moved = places;
            let mut step = [0.0; 3];
            step[i % 3] = sign * 2e-3;
            moved[i / 3] = places[i / 3].moved(step);
            at(&moved).energy
        };
        // The gradient is that of half the squared error, which falls as the energy grows.
        let slope = 0.5 * (side(1.0) - side(-1.0)) / 4e-3;
        let largest = here.gradient.iter().fold(0.0_f32, |m, g| m.max(g.abs()));
        assert!(
            (slope - here.gradient[i]).abs() < 0.01 * largest,
            "{i}: {slope} {}",
            here.gradient[i]
        );
    }
}

#[test]
fn opposite_phases_a_quarter_tap_apart_are_told_apart() {
    let (model, template) = tools();
    let u = Vector3::new(0.6, 0.48, 0.64);
    let truth = [source(0.1, u, 0.0), source(0.345, u, 0.47)];
    let window = window(&model, &template, &truth);
    let start = [-0.3, 0.7].map(|delay_taps| Place {
        delay_taps,
        u: Vector3::new(0.61, 0.47, 0.64).normalize(),
    });
    let fit: Fit<2, 6, 4> = fit::<2, 6, 4, 8, 32, JOINT>(&model, &template, &window, start, NOISE, 24);
    let mut delays = fit.places.map(|p| p.delay_taps);
    delays.sort_by(f32::total_cmp);
    assert!(
        (delays[0] - 0.1).abs() < 0.03 && (delays[1] - 0.345).abs() < 0.03,
        "{delays:?}"
    );
    let Content { energy, samples } = window.content();
    let left = (energy - fit.energy) / NOISE / samples as f32;
    assert!((left - 1.0).abs() < 0.15, "the residual is noise: {left}");
}

#[test]
fn coinciding_paths_do_no_harm() {
    let (model, template) = tools();
    let u = Vector3::new(0.6, 0.48, 0.64);
    let window = window(&model, &template, &[source(0.1, u, 0.0), source(0.1, u, 0.1)]);
    let start = [Place { delay_taps: 0.1, u }; 2];
    let fit: Fit<2, 6, 4> = fit::<2, 6, 4, 8, 32, JOINT>(&model, &template, &window, start, NOISE, 24);
    assert!(
        fit.energy.is_finite()
            && fit
                .places
                .iter()
                .all(|p| p.delay_taps.is_finite() && p.u.norm().is_finite())
    );
}

/// At the optimum of clean data the Gauss-Newton Hessian is the curvature of the energy: the covariance comes from it.
#[test]
fn hessian_is_the_curvature_of_the_energy() {
    let (model, template) = tools();
    let truth = [
        source(0.1, Vector3::new(0.6, 0.48, 0.64), 0.0),
        source(0.8, Vector3::new(0.3, 0.7, 0.6), 0.4),
    ];
    let window = window(&model, &template, &truth);
    let places = truth.map(|s| Place {
        delay_taps: s.delay_taps,
        u: s.u,
    });
    let at = |steps: [[f32; 3]; 2]| {
        let moved: [Place; 2] = core::array::from_fn(|p| places[p].moved(steps[p]));
        normal_equations::<2, 6, 4, 8, 32, JOINT>(&model, &template, &window, &moved)
    };
    let hessian = at([[0.0; 3]; 2]).hessian;
    for (i, row) in hessian.iter().enumerate() {
        // The slope of the gradient; its step small against the beam and the tap.
        let side = |sign: f32| {
            let mut steps = [[0.0; 3]; 2];
            steps[i / 3][i % 3] = sign * 4e-3;
            at(steps).gradient
        };
        let (ahead, behind) = (side(1.0), side(-1.0));
        for (j, h) in row.iter().enumerate() {
            let slope = (behind[j] - ahead[j]) / 8e-3;
            let size = libm::sqrtf(hessian[i][i] * hessian[j][j]);
            assert!((slope - h).abs() < 0.03 * size, "({i}, {j}): {slope} {h}");
            assert!((h - hessian[j][i]).abs() < 1e-4 * size, "symmetric");
        }
    }
}

#[test]
fn one_path_is_found_from_afar_with_its_gains() {
    let (model, template) = tools();
    let truth = source(0.1, Vector3::new(0.6, 0.48, 0.64), 0.0);
    let silent = Source {
        gains: [Complex::new(0.0, 0.0); 4],
        ..truth
    };
    let window = window(&model, &template, &[truth, silent]);
    // Half a tap and four degrees off: more than one limited step.
    let (e1, e2) = Place {
        delay_taps: 0.0,
        u: truth.u,
    }
    .tangents();
    let start = Place {
        delay_taps: 0.6,
        u: (truth.u + e1 * 0.05 - e2 * 0.05).normalize(),
    };
    let run = |most| fit::<1, 3, 4, 8, 32, JOINT>(&model, &template, &window, [start], NOISE, most);
    let first = run(1).places[0];
    assert!((first.delay_taps - start.delay_taps).abs() < LONGEST_DELAY_TAPS + 1e-6);
    let turned = first.u.cross(&start.u).norm();
    assert!(turned < LONGEST_ANGLE_RAD * 1.001 && turned > 0.0, "{turned}");
    let fit: Fit<1, 3, 4> = run(6);
    let place = fit.places[0];
    assert!((place.delay_taps - 0.1).abs() < 2e-3, "{place:?}");
    assert!(place.u.cross(&truth.u).norm() < 1e-3, "{place:?}");
    for (gain, expected) in fit.gains[0].iter().zip(&truth.gains) {
        assert!((gain - expected).norm_sqr() < 1600.0, "{gain} {expected}");
    }
    let Content { energy, samples } = window.content();
    assert!(((energy - fit.energy) / NOISE / samples as f32 - 1.0).abs() < 0.15);
}
