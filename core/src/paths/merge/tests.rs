//! Looks of one path become one, what a beam told apart stays apart, and the weakest give way.

use super::*;

fn detection(beam: u16, energy: f32, c_tau_m: f32, azimuth_deg: f32) -> Detection {
    let sigma = (0.01, 0.001);
    Detection {
        c_tau_m,
        aoa: Direction::from_zenith_azimuth(1.2, azimuth_deg.to_radians()).expect("angles"),
        covariance: Matrix3::from_diagonal(&Vector3::new(
            sigma.0 * sigma.0,
            sigma.1 * sigma.1,
            sigma.1 * sigma.1,
        )),
        energy,
        noise: 1.0,
        errors: 0.0,
        beam,
        members: 1,
        glance: false,
        path: None,
    }
}

fn merged<const MOST: usize>(all: &[Detection]) -> (Detections<MOST>, Vec<Merged, 9>) {
    let mut detections = Detections::new();
    for d in all {
        detections.insert(*d);
    }
    let paths = detections.merge(4e-4);
    (detections, paths)
}

#[test]
fn looks_of_one_path_are_averaged_and_counted() {
    let (detections, paths) = merged::<16>(&[
        detection(3, 100.0, 50.004, 10.0),
        detection(4, 900.0, 50.0, 10.02),
        detection(5, 300.0, 49.99, 10.0),
        // Far away in angle, and in range.
        detection(6, 200.0, 50.0, 30.0),
        detection(7, 150.0, 51.0, 10.0),
    ]);
    assert_eq!(paths.len(), 3);
    let beams: Vec<u16, 16> = detections.looks(0).map(|d| d.beam).collect();
    assert_eq!(beams, [4, 5, 3], "strongest first");
    let (c_tau_m, aoa, covariance) = paths[0].mean();
    assert!((c_tau_m - 49.998).abs() < 1e-4, "{c_tau_m}");
    assert!((aoa.azimuth_rad().to_degrees() - 10.006_67).abs() < 1e-3);
    assert!(
        (covariance.m11 - 1e-4 / 3.0).abs() < 1e-8,
        "three equal looks: a third of the variance"
    );
}

/// The strongest beam tells a pair apart, to a centimetre each; a weaker one shows it as one path between them, to a
/// millimetre.
#[test]
fn a_blend_does_not_pull_what_was_told_apart() {
    let pair = |c_tau_m, energy| Detection {
        members: 2,
        ..detection(4, energy, c_tau_m, 10.0)
    };
    let blend = Detection {
        covariance: detection(5, 0.0, 50.0, 10.0).covariance / 100.0,
        ..detection(5, 500.0, 50.02, 10.0)
    };
    let (detections, paths) = merged::<16>(&[pair(50.0, 900.0), pair(50.05, 800.0), blend]);
    assert_eq!(paths.len(), 2);
    assert!((paths[0].mean().0 - 50.0).abs() < 1e-4, "{}", paths[0].mean().0);
    assert_eq!(detections.looks(0).count(), 2, "it was seen there");
}

#[test]
fn blend_counts_as_a_look_but_does_not_pull() {
    let (detections, paths) =
        merged::<16>(&[detection(1, 900.0, 50.0, 10.0), detection(2, 300.0, 50.3, 12.0)]);
    assert_eq!((paths.len(), detections.looks(0).count()), (1, 2));
    assert_eq!(paths[0].mean().0, 50.0);
}

#[test]
fn what_one_beam_resolved_stays_apart() {
    let (detections, paths) = merged::<16>(&[
        detection(1, 900.0, 50.0, 10.0),
        detection(1, 300.0, 50.3, 12.0),
        detection(2, 500.0, 50.001, 10.0),
        detection(2, 100.0, 50.301, 12.0),
    ]);
    assert_eq!(paths.len(), 2);
    assert_eq!(detections.looks(0).count(), 2);
    assert!((paths[1].mean().0 - 50.3005).abs() < 1e-4);
}

/// A glance, however strong it seems, makes no path and moves none; it is a look at the one where it was taken.
#[test]
fn glances_count_and_do_not_pull() {
    let glance = |beam, energy, c_tau_m| Detection {
        glance: true,
        ..detection(beam, energy, c_tau_m, 10.0)
    };
    let (detections, paths) = merged::<16>(&[
        detection(1, 500.0, 50.0, 10.0),
        glance(2, 900.0, 50.01),
        glance(3, 100.0, 50.01),
        glance(4, 400.0, 80.0),
        detection(5, 300.0, 60.0, 10.0),
    ]);
    assert_eq!(paths.len(), 2);
    assert_eq!((paths[0].mean().0, paths[0].strongest.beam), (50.0, 1));
    let beams: Vec<u16, 16> = detections.looks(0).map(|d| d.beam).collect();
    assert_eq!(beams, [2, 1, 3]);
    assert_eq!(detections.looks(1).count(), 1);
}

#[test]
fn weak_ones_give_way() {
    let mut detections = Detections::<2>::new();
    for (beam, energy) in [(1, 5.0), (2, 9.0), (3, 7.0), (4, 1.0)] {
        detections.insert(detection(beam, energy, 50.0 + 3.0 * f32::from(beam), 0.0));
    }
    let paths: Vec<Merged, 9> = detections.merge(1e-4);
    assert_eq!(
        paths.iter().map(|p| p.strongest.beam).collect::<Vec<_, 9>>(),
        [2, 3]
    );
    assert_eq!(detections.dropped(), 2);
    let paths: Vec<Merged, 9> = detections.merge(0.8);
    assert_eq!(paths.len(), 1, "7 is less than 0.8 of 9");
}

#[test]
fn gates_are_half_a_metre_and_six_degrees() {
    for (metres, degrees, paths_expected) in [
        (0.49, 0.0, 1),
        (0.51, 0.0, 2),
        (-0.49, 0.0, 1),
        (-0.51, 0.0, 2),
        // Azimuths at a zenith of 1.2 rad: an angle of 0.932 times as much.
        (0.0, 6.4, 1),
        (0.0, 6.5, 2),
    ] {
        let first = detection(1, 900.0, 50.0, 10.0);
        let second = detection(2, 300.0, 50.0 + metres, 10.0 + degrees);
        let (_, paths) = merged::<16>(&[first, second]);
        assert_eq!(paths.len(), paths_expected, "{metres} m, {degrees} deg");
    }
}

#[test]
fn look_belongs_to_the_nearest_path() {
    let (detections, paths) = merged::<16>(&[
        detection(1, 900.0, 50.0, 10.0),
        detection(1, 800.0, 50.4, 10.0),
        // Within the gates of both.
        detection(2, 500.0, 50.3, 10.0),
        detection(3, 400.0, 50.1, 10.0),
        // 4 degrees count for more than 0.2 m.
        detection(4, 300.0, 50.15, 14.0),
        detection(4, 299.0, 50.2, 10.0),
    ]);
    let beams = |path| -> Vec<u16, 16> { detections.looks(path).map(|d| d.beam).collect() };
    assert_eq!(paths.len(), 2);
    assert_eq!(
        (beams(0).as_slice(), beams(1).as_slice()),
        (&[1, 3, 4][..], &[1, 2, 4][..])
    );
}

#[test]
fn looks_average_up_to_their_agreement() {
    // Two looks of 1 cm: the difference has 1.414 cm, and 4.8 of those (23 squared) are 6.8 cm.
    for (apart_m, averaged) in [(0.066, true), (0.070, false)] {
        let (_, paths) = merged::<16>(&[
            detection(1, 900.0, 50.0, 10.0),
            detection(2, 300.0, 50.0 + apart_m, 10.0),
        ]);
        let expected = if averaged { 50.0 + 0.5 * apart_m } else { 50.0 };
        assert!(
            (paths[0].mean().0 - expected).abs() < 1e-4,
            "{apart_m}: {}",
            paths[0].mean().0
        );
    }
}

/// Near the zenith the tangents of two close directions are turned by tens of degrees: long axes must meet all the same.
#[test]
fn uneven_covariances_are_added_in_common_axes() {
    let near_zenith = |azimuth_deg: f32, beam: u16, energy: f32| {
        let aoa = Direction::<Body>::from_zenith_azimuth(0.02, azimuth_deg.to_radians()).expect("angles");
        let (e1, e2) = aoa.tangents();
        // Sure along x of the body (1e-4 rad), unsure along y (1e-2 rad).
        let along = |a: &Vector3<f32>, b: &Vector3<f32>| 1e-8 * a.x * b.x + 1e-4 * a.y * b.y;
        let mut covariance = Matrix3::from_diagonal(&Vector3::new(1e-4, along(&e1, &e1), along(&e2, &e2)));
        covariance.m23 = along(&e1, &e2);
        covariance.m32 = covariance.m23;
        Detection {
            aoa,
            covariance,
            ..detection(beam, energy, 50.0, 0.0)
        }
    };
    // The same x, so that the looks agree: 60 and -60 degrees of azimuth.
    let (_, paths) = merged::<16>(&[near_zenith(60.0, 1, 900.0), near_zenith(-60.0, 2, 800.0)]);
    assert_eq!(paths.len(), 1);
    let (_, aoa, covariance) = paths[0].mean();
    let u = aoa.vector();
    assert!((u.x - 0.01).abs() < 1e-4 && u.y.abs() < 1e-3, "{u}");
    // The mean's covariance refers to the tangents of the strongest look.
    let (e1, e2) = paths[0].strongest.aoa.tangents();
    let across = |e1: f32, e2: f32| {
        e1 * e1 * covariance.m22 + 2.0 * e1 * e2 * covariance.m23 + e2 * e2 * covariance.m33
    };
    let (x, y) = (across(e1.x, e2.x), across(e1.y, e2.y));
    assert!((y / 5e-5 - 1.0).abs() < 0.05 && x < 2e-8, "{x} {y}");
}
