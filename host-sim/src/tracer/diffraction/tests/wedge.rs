//! The field behind a wedge against exact solutions.

use core::f64::consts::FRAC_PI_2;

use super::*;
use crate::tracer::diffraction::dyad::{frame_before, frame_behind};
use crate::tracer::diffraction::exact::{conducting_wedge, impedance_wedge, knife_edge, phasor};
use crate::tracer::field::along;

/// A wedge about the vertical axis of so much free space (over pi), its first face along +x, free space at +y.
fn wedge_scene(material: Material, n: f64) -> Scene {
    let reach = 1e3;
    let (y, x) = libm::sincos(n * PI);
    scene_of(
        material,
        vec![
            vec![
                [0.0, 0.0, -reach],
                [0.0, 0.0, reach],
                [reach, 0.0, reach],
                [reach, 0.0, -reach],
            ],
            vec![
                [0.0, 0.0, reach],
                [0.0, 0.0, -reach],
                [x * reach, y * reach, -reach],
                [x * reach, y * reach, reach],
            ],
        ],
    )
}

/// Diffracted over incoming field, along the edge and across it, of a plane wave at level incidence, times sqrt(r) e^{jkr},
/// behind the first edge of a scene. For the second, magnetic fields are compared.
fn coefficients(scene: &Scene, behind_m: f64, phi_in: f64, phi_out: f64) -> [C64; 2] {
    let edges = Edges::of(scene, false);
    let wedge = &edges.wedges[0];
    let incidence = Incidence {
        n: wedge.exterior_rad / PI,
        k_rad_per_m: K,
        sin_beta: 1.0,
        before_m: 1e12,
        behind_m,
        phi_in_rad: phi_in,
        phi_out_rad: phi_out,
    };
    let ray = |angle: f64| Vec3::from(about_axis(1.0, angle, 0.0));
    let (incoming, outgoing) = (-ray(phi_in), ray(phi_out));
    let (before, behind) = (
        frame_before(&wedge.along, &incoming),
        frame_behind(&wedge.along, &outgoing),
    );
    [0, 1].map(|i| {
        let field = before[i].map(|c| Complex::new(c, 0.0));
        let surfaces = Surfaces::of_scene(scene, &Propagation::default());
        // b' and b, and what goes with phi' and phi, point against each other.
        -along(
            &diffract(&field, wedge, &incidence, &incoming, &outgoing, &surfaces),
            &behind[i],
        )
    })
}

#[test]
fn a_conducting_wedge_has_its_exact_field() {
    let kr = 60.0;
    let behind_m = kr / K;
    let mut worst: f64 = 0.0;
    for n in [1.5, 2.0] {
        // A screen has two faces: one of 0.001 degrees more than none.
        let scene = wedge_scene(conductor(), if n == 2.0 { n - 1e-5 } else { n });
        for (i, j) in (1..12).flat_map(|i| (1..24).map(move |j| (i, j))) {
            let phi_in = 0.5 * n * PI * (f64::from(i) + 0.13) / 12.0;
            let phi_out = n * PI * (f64::from(j) + 0.29) / 24.0;
            let [soft, hard] = coefficients(&scene, behind_m, phi_in, phi_out);
            let (difference, sum) = (phi_out - phi_in, phi_out + phi_in);
            let direct = if difference.abs() < PI {
                phasor(kr * difference.cos())
            } else {
                0.0.into()
            };
            // Off either face, where it lights.
            let mirrored =
                [sum, 2.0 * n * PI - sum].map(|x| if x < PI { phasor(kr * x.cos()) } else { 0.0.into() });
            for (coefficient, sign, is_soft) in [(soft, -1.0, true), (hard, 1.0, false)] {
                let ours =
                    direct + (mirrored[0] + mirrored[1]) * sign + coefficient * phasor(-kr) / behind_m.sqrt();
                let exact = conducting_wedge(n, kr, phi_in, phi_out, is_soft);
                worst = worst.max((ours - exact).norm());
            }
        }
    }
    println!("conducting wedge, kr = {kr}: field within {worst:.1e} of the incident one");
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn a_right_angle_has_the_field_of_the_impedance_wedge_in_shadow() {
    let scene = wedge_scene(Material::PAPER, 1.5);
    let [re, im] = Material::PAPER.complex_permittivity(FREQUENCY_HZ);
    let index = crate::tracer::surface::sqrt(Complex::new(re, im));
    // From the shadow boundary, and from the faces: closer to grazing on both, a constant impedance is no half-space.
    let [clear, off_faces] = [6.0_f64, 10.0].map(f64::to_radians);
    let (mut worst, mut compared) = ([0.0_f64; 2], 0);
    for (i, j) in (0..30).flat_map(|i| (0..45).map(move |j| (i, j))) {
        let phi_in = off_faces + 1.5 * f64::from(i).to_radians();
        let phi_out = 1.5 * PI - off_faces - 2.0 * f64::from(j).to_radians();
        if phi_out - phi_in < PI + clear {
            continue;
        }
        // Far behind, where the transition functions are 1.
        let ours = coefficients(&scene, 1e9, phi_in, phi_out);
        for (which, sine) in [index, index.inv()].into_iter().enumerate() {
            let ratio = ours[which] / impedance_wedge(K, sine, phi_in, phi_out);
            worst[which] = worst[which].max((20.0 * libm::log10(ratio.norm())).abs());
            assert!(
                ratio.re > 0.9 && ratio.im.abs() < 0.1,
                "{phi_in} {phi_out}: {ratio}"
            );
        }
        compared += 1;
    }
    println!(
        "impedance wedge, {compared} pairs of angles in shadow: within {:.3} dB along the edge, {:.3} dB across",
        worst[0], worst[1]
    );
    assert!(
        compared > 500 && worst.iter().all(|&db| db < 0.15),
        "{compared} {worst:?}"
    );
}

#[test]
fn a_thin_wedge_is_a_knife_edge() {
    let scene = wedge_scene(Material::PAPER, 2.0 - 0.02 / 180.0);
    let tracer = Tracer::with(&scene, 0, all()).unwrap();
    let off_m = 30.0;
    let mut report = Vec::new();
    for (depth_rad, within_db) in [(1e-6, 0.03), (0.01, 0.1), (0.05, 0.25), (0.13, 0.5)] {
        // The screen stands along +x; both ends beside it, symmetric, the receiver in shadow.
        let angle = FRAC_PI_2 + 0.5 * depth_rad;
        let angle = PI - angle;
        let [tx, rx] = [angle, TAU - angle].map(|at| about_axis(off_m, at, 0.0));
        let paths = tracer.transmitter(tx).trace(rx);
        assert_eq!(paths.len(), 1, "{paths:?}");
        let straight_m = (Vec3::from(tx) - Vec3::from(rx)).norm();
        let free = WAVELENGTH_M / (4.0 * PI * straight_m) * DIPOLES;
        // Fresnel number of the detour.
        let nu = 2.0 * ((2.0 * off_m - straight_m) / WAVELENGTH_M).sqrt();
        let loss_db = 20.0 * libm::log10(paths[0].gain.norm() / free);
        let exact_db = 20.0 * libm::log10(knife_edge(nu).norm());
        report.push(format!("{:.3} dB at {exact_db:.1} dB", loss_db - exact_db));
        assert!(
            (loss_db - exact_db).abs() < within_db,
            "{depth_rad}: {loss_db} {exact_db}"
        );
    }
    println!("thin wedge against the knife edge: {}", report.join(", "));
}
