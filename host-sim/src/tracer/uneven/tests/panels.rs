//! What the panels of a facade do to a mirror.

use super::*;

/// A wall of 60 x 30 m at y = 5 that looks south.
pub(super) fn wall(material: Material, unevenness: Unevenness) -> Scene {
    let wall = RawFace {
        vertices: vec![
            [0.0, 5.0, 0.0],
            [60.0, 5.0, 0.0],
            [60.0, 5.0, 30.0],
            [0.0, 5.0, 30.0],
        ],
        ..RawFace::default()
    };
    let scene = Scene::new("wall", material, 30e9, None, vec![wall]).expect("a wall");
    scene.with_unevenness(unevenness)
}

pub(super) fn panels(seed: u64) -> Unevenness {
    Unevenness {
        surface_seed: seed,
        panels: true,
        ..Unevenness::default()
    }
}

/// The reflection at a place of the wall, level, at 30 degrees of incidence, from 17.3 m before it.
pub(super) fn reflection(scene: &Scene, at: [f64; 2]) -> TracedPath {
    let tracer = Tracer::new(scene, 1).expect("few reflections");
    let [x, z] = at;
    let paths = tracer.transmitter([x - 10.0, 5.0 - 300.0_f64.sqrt(), z]).trace([
        x + 10.0,
        5.0 - 300.0_f64.sqrt(),
        z,
    ]);
    paths
        .into_iter()
        .find(|path| path.order() == 1)
        .expect("a mirror")
}

#[test]
fn a_facade_spreads_delays_and_angles_as_its_panels_are_off() {
    let (cos, mut sums, mut counts) = (0.75_f64.sqrt(), [0.0; 4], [0.0; 2]);
    for seed in 0..40 {
        let scene = wall(Material::PAPER, panels(seed));
        let uneven = scene.uneven().expect("a wall");
        for k in 0..60_u32 {
            // Anywhere in the panels.
            let at = [
                1.0 + 58.0 * f64::from(k * 37 % 60) / 60.0,
                1.0 + 28.0 * f64::from(k * 23 % 60) / 60.0,
            ];
            let path = reflection(&scene, at);
            let longer_m = path.length_m() - 40.0;
            if uneven.patch(0, &Vec3::new(at[0], 5.0, at[1])).is_window() {
                sums[0] += longer_m;
                counts[0] += 1.0;
            } else {
                sums[1] += longer_m * longer_m;
                let [zenith, azimuth] = path.arrival_rad();
                let off = azimuth - libm::atan2(300.0_f64.sqrt(), -10.0);
                sums[2] += (zenith - core::f64::consts::FRAC_PI_2).powi(2);
                sums[3] += off * off;
                counts[1] += 1.0;
            }
        }
    }
    // A recess of 0.1 m; an offset of 3 cm, and what a tilt of 0.15 degrees raises within a panel.
    let recess = sums[0] / counts[0] / (2.0 * cos);
    assert!((recess / 0.1 - 1.0).abs() < 0.05, "{recess}");
    let tilt = 0.15_f64.to_radians();
    let expected = 2.0 * cos * (0.03_f64.powi(2) + 1.5 * tilt * tilt).sqrt();
    let [rms, up, aside] = [1, 2, 3].map(|i| (sums[i] / counts[1]).sqrt());
    assert!((rms / expected - 1.0).abs() < 0.06, "{rms} {expected}");
    // Ends equally far: the wave comes from where the normal points, less by the cosine upwards.
    assert!((up / (tilt * cos) - 1.0).abs() < 0.06, "{up}");
    assert!(aside / tilt > 0.94, "{aside}");
    let windows = counts[0] / (counts[0] + counts[1]);
    assert!((windows - 0.4).abs() < 0.04, "{windows}");
}

#[test]
fn windows_reflect_as_glass_and_the_rest_as_the_wall() {
    let pane = Scene::pane().expect("glass");
    let (brick, glass) = (
        wall(Material::named("brick").expect("known"), panels(3)),
        wall(pane, panels(3)),
    );
    let uneven = brick.uneven().expect("a wall");
    let mut windows = 0;
    for k in 0..100_u32 {
        let at = [
            1.0 + 58.0 * f64::from(k) / 100.0,
            2.0 + 26.0 * f64::from(k * 7 % 100) / 100.0,
        ];
        let window = uneven.patch(0, &Vec3::new(at[0], 5.0, at[1])).is_window();
        let [brick, glass] = [&brick, &glass].map(|scene| reflection(scene, at));
        assert_eq!(brick.vertices(), glass.vertices());
        assert_eq!(brick.gain() == glass.gain(), window, "{at:?}");
        windows += u32::from(window);
    }
    assert!((20..60).contains(&windows), "{windows}");
}

#[test]
fn a_point_at_a_joint_of_panels_stays_on_one_of_them() {
    // Across the joint at x = 30 m, where panels lean towards or away from each other.
    let (mut beyond, mut farthest_m, mut jumps) = (0, 0.0_f64, 0);
    for seed in 0..60 {
        let scene = wall(Material::PAPER, panels(seed));
        let uneven = scene.uneven().expect("a wall");
        let face = &scene.faces()[0];
        let mut last: Option<Vec3> = None;
        for k in 0..=120 {
            let x = 29.94 + 0.001 * f64::from(k);
            let point = Vec3::from(reflection(&scene, [x, 13.0]).vertices()[0]);
            let foot = point - face.normal() * face.height_m(&point);
            let off_m = face.height_m(&point) - uneven.height_m(0, &foot);
            if off_m.abs() > 1e-9 {
                beyond += 1;
                farthest_m = farthest_m.max((foot.x - 30.0).abs());
            }
            jumps += u32::from(last.is_some_and(|last| (last - point).norm() > 0.01));
            last = Some(point);
        }
    }
    println!("{beyond} of 7260 points beyond a rim, by {farthest_m:.3} m at most, {jumps} steps");
    // Less than half of what the wave sees of a wall there, 0.36 m about the point.
    assert!(
        (20..1800).contains(&beyond) && farthest_m < 0.15,
        "{beyond} {farthest_m}"
    );
    // Once over the joint and never back.
    assert!((30..=60).contains(&jumps), "{jumps}");
}
