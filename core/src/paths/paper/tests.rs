use super::*;
use crate::geometry::Body;
use crate::paths::model::steering;

type Paper = PaperEstimator<4, 8, 32, 72, 9>;

/// A path whose arrays all see it with this amplitude, LSB at the peak's tap.
#[derive(Clone, Copy)]
struct Made {
    zenith_deg: f32,
    azimuth_deg: f32,
    amplitude: f32,
}

impl Made {
    fn aoa(&self) -> Direction<Body> {
        Direction::from_zenith_azimuth(self.zenith_deg.to_radians(), self.azimuth_deg.to_radians())
            .expect("angles")
    }
}

/// Keeps a beam in which the path peaks at `tap`, its neighbours 12 dB down.
fn keep(paper: &mut Paper, beam: usize, tap: usize, made: Made, exponent: i32) {
    let u = *made.aoa().vector();
    let mut taps = [[Iq::ZERO; KEPT]; 32];
    for (j, step) in paper.model.steps().iter().enumerate() {
        for (i, s) in steering::<8>(step.dot(&u)).iter().enumerate() {
            // A phase of its own for each array.
            let x = s * phasor(0.37 * j as f32) * made.amplitude;
            let row = &mut taps[8 * j + i];
            row[KEPT / 2] = Iq::new(x.re as i16, x.im as i16);
            row[KEPT / 2 + 1] = Iq::new((x.re * 0.25) as i16, (x.im * 0.25) as i16);
        }
    }
    paper.beams[beam] = Some(Kept {
        taps,
        first: tap.wrapping_sub(KEPT / 2) & (SAMPLES - 1),
        exponent,
        noise: 100.0,
    });
}

fn paper() -> Paper {
    estimator(TapDelays::Whole)
}

fn estimator(delays: TapDelays) -> Paper {
    Paper::new(&EstimatorConfig::<4, 8, 3, 8, 8, 3>::default()).with_delays(delays)
}

/// Keeps a beam in which the path lies `delay_taps` behind `tap`, as the band spreads it over its neighbours.
fn keep_between(paper: &mut Paper, beam: usize, tap: usize, delay_taps: f32) {
    keep(paper, beam, tap, STRONG, -20);
    let u = *STRONG.aoa().vector();
    let steps = *paper.model.steps();
    let kernel: [f32; KEPT] =
        core::array::from_fn(|t| paper.template.at(t as f32 - (KEPT / 2) as f32 - delay_taps)[0]);
    let kept = paper.beams[beam].as_mut().expect("kept");
    for (channel, row) in kept.taps.iter_mut().enumerate() {
        let (array, element) = (channel / 8, channel % 8);
        let s = steering::<8>(steps[array].dot(&u))[element] * phasor(0.37 * array as f32);
        for (x, d) in row.iter_mut().zip(kernel) {
            let y = s * (STRONG.amplitude * d);
            *x = Iq::new(y.re as i16, y.im as i16);
        }
    }
}

const STRONG: Made = Made {
    zenith_deg: 70.0,
    azimuth_deg: 35.0,
    amplitude: 9000.0,
};

#[test]
fn path_is_its_grid_point_its_tap_and_its_beam() {
    let mut paper = paper();
    keep(&mut paper, 30, 3, STRONG, -20);
    let paths = paper.finish();
    let path = &paths[0];
    // The truth is a point of the grid; the spectra's bins are 1.4 degrees of phase apart.
    assert!(
        path.path.aoa.angle_to_rad(&STRONG.aoa()).to_degrees() < 1.5,
        "{path:?}"
    );
    assert_eq!((path.beam, path.path.c_tau_m), (30, paper.model.metres(3, 0.0)));
    let energy = 32.0 * STRONG.amplitude * STRONG.amplitude / 2_f32.powi(40);
    assert!(
        (path.energy * 416.0 * 416.0 / energy - 1.0).abs() < 0.01,
        "{path:?}"
    );
    // 9000^2 / (416 x 100): 32.9 dB.
    assert!((path.snr_db - 32.89).abs() < 0.1, "{path:?}");
    let aod = path.path.aod.expect("a beam");
    let beam = crate::array::Codebook::<f32>::default()
        .beam(30)
        .expect("beam")
        .direction();
    assert!((aod.direction.vector() - beam).norm() < 1e-5);
    // Uniform over cells of a tap, 1 degree and 2 degrees.
    let sigma = |i: usize| libm::sqrtf(path.path.covariance[(i, i)] * 12.0);
    assert!((sigma(0) - 1.2198).abs() < 1e-3 && (sigma(1).to_degrees() - 1.0).abs() < 1e-3);
    assert!((sigma(2).to_degrees() - 2.0).abs() < 1e-3);
    // What is left of one path is rounding, under the dynamic range.
    assert_eq!(paths.len(), 1);
}

#[test]
fn paths_come_strongest_first_on_one_scale_down_to_the_dynamic_range() {
    let mut paper = paper();
    let weak = Made {
        zenith_deg: 100.0,
        azimuth_deg: -120.0,
        amplitude: 6000.0,
    };
    // The larger integers are the weaker path: its block has 12 dB less exponent.
    keep(&mut paper, 5, 200, weak, -22);
    keep(
        &mut paper,
        41,
        100,
        Made {
            amplitude: 5000.0,
            ..STRONG
        },
        -20,
    );
    let faint = Made {
        zenith_deg: 60.0,
        azimuth_deg: 150.0,
        amplitude: 4000.0,
    };
    keep(&mut paper, 66, 400, faint, -28);
    let paths = paper.finish();
    let beams: Vec<u16, 9> = paths.iter().map(|p| p.beam).collect();
    assert_eq!(beams[..2], [41, 5], "{paths:?}");
    assert!(paths.iter().all(|p| p.beam != 66), "50 dB down: {paths:?}");
    // Singular vectors are orthogonal, the paths' steering nearly: angles bend by a few degrees.
    let off = paths[1].path.aoa.angle_to_rad(&weak.aoa()).to_degrees();
    assert!(off < 6.0, "{off} deg");
    let ratio = 10.0 * libm::log10f(paths[0].energy / paths[1].energy);
    assert!((ratio - 10.46).abs() < 1.0, "{ratio} dB");
    assert!(paper.finish().is_empty(), "nothing is left for the next sweep");
}

/// What counts is the energy in one tap of one beam, as for the strongest path, not the sum over beams.
#[test]
fn dynamic_range_is_that_of_single_beams() {
    let faint = |share_db: f32| Made {
        zenith_deg: 100.0,
        azimuth_deg: -120.0,
        amplitude: STRONG.amplitude * libm::powf(10.0, 0.05 * share_db),
    };
    for (share_db, expected) in [(-33.0, 2), (-35.0, 1)] {
        let mut paper = paper();
        keep(&mut paper, 41, 100, STRONG, -20);
        for beam in [5, 6, 7, 8] {
            keep(&mut paper, beam, 200, faint(share_db), -20);
        }
        let paths = paper.finish();
        assert_eq!(paths.len(), expected, "{share_db} dB: {paths:?}");
    }
}

/// As published, a delay is a whole tap however the path lies between two; interpolated it is the path's, across the period's end
/// as well.
#[test]
fn a_delay_between_taps_is_found_by_the_interpolated_variant_alone() {
    for tap in [100, 0, SAMPLES - 1] {
        for delay_taps in [-0.45, -0.2, 0.0, 0.1, 0.3, 0.49] {
            let found = |delays| {
                let mut paper = estimator(delays);
                keep_between(&mut paper, 30, tap, delay_taps);
                let paths = paper.finish();
                let path = paths.first().expect("a path").path;
                let metres = paper.model.metres_per_tap();
                let truth = paper.model.metres(tap, delay_taps);
                let period = metres * SAMPLES as f32;
                let off = libm::remainderf(path.c_tau_m - truth, period) / metres;
                (off, libm::sqrtf(path.covariance.m11) / metres)
            };
            let (literal, _) = found(TapDelays::Whole);
            assert!(
                (literal + delay_taps).abs() < 1e-3,
                "{tap} {delay_taps}: {literal}"
            );
            let (off, sigma) = found(TapDelays::Interpolated);
            assert!(off.abs() < 0.01, "{tap} {delay_taps}: {off}");
            // What the arrays' places leave, 0.103 m.
            assert!((sigma - 0.0845).abs() < 1e-3, "{sigma}");
        }
    }
}
