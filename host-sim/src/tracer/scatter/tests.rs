//! Scattered power against its integrals, and the statistics of its field.

mod reference;

use core::f64::consts::PI;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

use super::lit::{half_space, power};
use super::*;
use crate::scene::{Lobe, Material, RawFace, Roughness};
use crate::tracer::field::dipole;
use crate::tracer::{Propagation, Tracer};

const WAVELENGTH_M: f64 = SPEED_OF_LIGHT_M_PER_S / 30e9;

fn diffuse(options: Diffuse) -> Propagation {
    Propagation {
        diffuse: Some(options),
        ..Propagation::default()
    }
}

#[test]
fn the_lobe_is_normalised() {
    for exponent in [1, 2, 3, 4, 8, 20] {
        for degrees in [0.0_f64, 20.0, 45.0, 70.0, 88.0] {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            let mirrored = Vec3::new(sin, 0.0, cos);
            let (steps, mut sum) = (400, 0.0);
            for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
                // Equal solid angles: height and azimuth uniform.
                let height = (f64::from(i) + 0.5) / f64::from(steps);
                let (y, x) = libm::sincos(TAU * (f64::from(j) + 0.5) / f64::from(steps));
                let across = (1.0 - height * height).sqrt();
                let cos_psi = mirrored.dot(&Vec3::new(across * x, across * y, height));
                sum += power(0.5 * (1.0 + cos_psi), exponent);
            }
            let integral = sum * TAU / f64::from(steps * steps);
            let ratio = half_space(exponent, cos) / integral;
            assert!((ratio - 1.0).abs() < 1e-4, "{exponent} {degrees}: {ratio}");
        }
    }
}

/// One upright wall of 1 m, looking along +y, of a rough material.
fn wall(material: Material) -> Scene {
    let raw = RawFace {
        vertices: vec![
            [0.5, 0.0, -0.5],
            [-0.5, 0.0, -0.5],
            [-0.5, 0.0, 0.5],
            [0.5, 0.0, 0.5],
        ],
        ..RawFace::default()
    };
    Scene::new("wall", material, 30e9, None, vec![raw]).unwrap()
}

#[test]
fn what_is_scattered_and_reflected_is_what_came_less_what_went_in() {
    let mut worst: f64 = 0.0;
    for (name, degrees) in [
        ("brick", 10.0_f64),
        ("concrete", 55.0),
        ("glass", 40.0),
        ("medium_dry_ground", 30.0),
    ] {
        let scene = wall(Material::named(name).unwrap());
        let propagation = Propagation {
            roughness: true,
            ..diffuse(Diffuse::default())
        };
        let surfaces = Surfaces::of_scene(&scene, &propagation);
        let (sin, cos) = libm::sincos(degrees.to_radians());
        let tx = Vec3::new(100.0 * sin, 100.0 * cos, 0.0);
        let tiles = Tiles::of(&scene, 1.0);
        let lit = light(&scene, &tx, 0, &tiles.tiles[0].whole, &surfaces).unwrap();
        // All of the half-space, seen isotropically.
        let (steps, mut scattered) = (300, 0.0);
        for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
            let height = (f64::from(i) + 0.5) / f64::from(steps);
            let (z, x) = libm::sincos(TAU * (f64::from(j) + 0.5) / f64::from(steps));
            let across = (1.0 - height * height).sqrt();
            let direction = Vec3::new(across * x, height, across * z);
            let heard = hear(&scene, &lit, &(direction * 1e3)).unwrap();
            scattered += heard / dipole(&direction).powi(2) * 1e6;
        }
        scattered *= TAU / f64::from(steps * steps);
        let incident = (WAVELENGTH_M / (4.0 * PI) * dipole(&(-tx).normalize())).powi(2) * cos / 1e4;
        let surface = surfaces.of(0);
        // Upright field on an upright wall: across the plane of incidence.
        let [reflected, all] = [surface.reflection(cos)[0], surface.smooth(cos)[0]].map(|r| r.norm_sqr());
        let sum = scattered / incident + reflected + (1.0 - all);
        println!(
            "{name} at {degrees} degrees: scattered {:.4}, reflected {reflected:.4}, into the wall {:.4}, sum {sum:.5}",
            scattered / incident,
            1.0 - all
        );
        worst = worst.max((sum - 1.0).abs());
    }
    assert!(worst < 0.01, "{worst}");
}

fn db(power: f64) -> f64 {
    10.0 * libm::log10(power)
}

/// A street canyon link with many tiles.
fn heard(options: Diffuse) -> Vec<TracedPath> {
    let scene = Scene::load("outdoor_a").unwrap();
    let tracer = Tracer::with(&scene, 0, diffuse(options)).unwrap();
    let mut paths = tracer
        .transmitter([93.847903, 108.226018, 2.0])
        .trace([93.237798, 80.558383, 10.0208]);
    paths.retain(|path| path.kind() == Kind::of(&[Interaction::Scattering]).unwrap());
    paths
}

#[test]
fn fading_is_rayleigh_and_its_mean_the_integral() {
    // Every tile for itself.
    let paths = heard(Diffuse {
        most_paths: usize::MAX,
        range_db: 300.0,
        ..Diffuse::default()
    });
    // A cell of the receiver: 1.2 m of length about the strongest, 12 degrees about it.
    let centre = paths[0].clone();
    let direction = |path: &TracedPath| {
        let [(sin, cos), (y, x)] = path.arrival_rad().map(libm::sincos);
        Vec3::new(sin * x, sin * y, cos)
    };
    let cell: Vec<&TracedPath> = paths
        .iter()
        .filter(|path| (path.length_m() - centre.length_m()).abs() < 0.6)
        .filter(|path| direction(path).dot(&direction(&centre)) > libm::cos(6.0_f64.to_radians()))
        .collect();
    let mean: f64 = cell.iter().map(|path| path.gain.norm_sqr()).sum();
    let draws = 600;
    let mut powers: Vec<f64> = (0..draws)
        .map(|seed| {
            let field: Complex<f64> = cell
                .iter()
                .map(|path| {
                    // A path does not say its number: any distinct ones draw the same way.
                    let [x, _, z] = path.vertices()[0];
                    let number = (x * 1e4) as u32 ^ ((z * 1e7) as u32);
                    let phase = TAU * stream(seed, path.faces()[0], number).uniform();
                    let (sin, cos) = libm::sincos(phase);
                    Complex::new(cos, sin) * path.gain.norm()
                })
                .sum();
            field.norm_sqr() / mean
        })
        .collect();
    let average = powers.iter().sum::<f64>() / f64::from(draws as u32);
    powers.sort_by(f64::total_cmp);
    // Kolmogorov and Smirnov against the exponential distribution of a Rayleigh field's power.
    let distance = powers
        .iter()
        .enumerate()
        .map(|(i, power)| {
            let expected = 1.0 - libm::exp(-power);
            let [low, high] = [i, i + 1].map(|k| k as f64 / draws as f64);
            (expected - low).abs().max((high - expected).abs())
        })
        .fold(0.0, f64::max);
    let bound = 1.63 / (draws as f64).sqrt();
    println!(
        "a cell of {} tiles over {draws} seeds: mean power {average:.3} of the integral, distance from Rayleigh {distance:.3} (1 %: {bound:.3})",
        cell.len()
    );
    assert!(cell.len() >= 8, "{}", cell.len());
    assert!((average - 1.0).abs() < 4.0 / (draws as f64).sqrt() && distance < bound);
}

#[test]
fn seeds_change_phases_alone_and_the_same_seed_nothing() {
    let [one, again, other] = [1, 1, 2].map(|seed| {
        heard(Diffuse {
            seed,
            ..Diffuse::default()
        })
    });
    assert_eq!(one, again);
    let power = |paths: &[TracedPath]| paths.iter().map(|p| p.gain.norm_sqr()).sum::<f64>();
    assert!((power(&one) / power(&other) - 1.0).abs() < 1e-12);
    let phase = |path: &TracedPath| libm::atan2(path.gain.im, path.gain.re);
    assert!((phase(&one[0]) - phase(&other[0])).abs() > 1e-3);
    assert!(
        one.len() <= Diffuse::default().most_paths && one.len() > 100,
        "{}",
        one.len()
    );
    let mean: Complex<f64> =
        one.iter().map(|p| p.gain / p.gain.norm()).sum::<Complex<f64>>() / one.len() as f64;
    assert!(mean.norm() < 0.25, "phases are not spread: {mean}");
}

#[test]
fn few_paths_have_the_power_of_all() {
    let scene = Scene::load("outdoor_a").unwrap();
    let power = |most_paths: usize, range_db: f64| {
        let options = Diffuse {
            most_paths,
            range_db,
            ..Diffuse::default()
        };
        let tracer = Tracer::with(&scene, 0, diffuse(options)).unwrap();
        let paths = tracer
            .transmitter([93.847903, 108.226018, 2.0])
            .trace([93.237798, 80.558383, 10.0208]);
        let scattered: Vec<&TracedPath> = paths.iter().filter(|path| !path.kind().is_specular()).collect();
        (
            scattered.iter().map(|path| path.gain.norm_sqr()).sum::<f64>(),
            scattered.len(),
        )
    };
    let (all, many) = power(usize::MAX, 200.0);
    for (most, range_db) in [(300, 45.0), (40, 45.0), (usize::MAX, 20.0)] {
        let (some, count) = power(most, range_db);
        assert!(
            (some / all - 1.0).abs() < 1e-12 && count < many && count <= most,
            "{most}: {some} {all} {count}"
        );
    }
}

#[test]
fn a_reflection_loses_what_is_scattered() {
    let scene = wall(Material::PAPER);
    let lobe = Lobe {
        coefficient: 0.5,
        exponent: 4,
    };
    let gain = |propagation: Propagation| {
        let tracer = Tracer::with(&scene, 1, propagation).unwrap();
        let paths = tracer.transmitter([1.0, 5.0, 0.0]).trace([-1.0, 5.0, 0.0]);
        paths
            .iter()
            .find(|path| path.kind().to_string() == "R")
            .unwrap()
            .gain
            .norm()
    };
    let options = Diffuse {
        lobe,
        ..Diffuse::default()
    };
    let ratio = gain(diffuse(options)) / gain(Propagation::default());
    assert!((ratio - 0.75_f64.sqrt()).abs() < 1e-12, "{ratio}");
    // A material's own lobe counts before that of the options.
    let own = Material::PAPER.with_roughness(Roughness {
        rms_height_m: 0.0,
        lobe: Some(Lobe {
            coefficient: 0.0,
            exponent: 1,
        }),
    });
    let scene = wall(own.unwrap());
    let tracer = Tracer::with(&scene, 1, diffuse(options)).unwrap();
    let paths = tracer.transmitter([1.0, 5.0, 0.0]).trace([-1.0, 5.0, 0.0]);
    let scattered: f64 = paths
        .iter()
        .filter(|p| !p.kind().is_specular())
        .map(|p| p.gain.norm_sqr())
        .sum();
    assert_eq!(scattered, 0.0);
}
