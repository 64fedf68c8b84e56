use super::*;
use crate::array::{SquintConfig, SquintScheme};
use crate::geometry::{Complex, Vector3};
use crate::geometry::{Direction, Gmt};
use crate::signal::Waveform;

const SEQUENTIAL: SquintScheme = SquintScheme::Sequential;

fn sighting() -> Sighting {
    Sighting {
        line_of_sight: true,
        face: 0,
        aoa: Direction::from_vector(Vector3::new(1.0, 0.2, -0.3)).expect("not zero"),
        c_tau_m: 50.0,
        interferers: Vec::new(),
        expected: None,
        ground: None,
    }
}

fn listener() -> BeamSquint<11> {
    BeamSquint::new(BeamSquintConfig::ideal(), &RadioConfig::default(), 3).expect("11 symbols")
}

/// A receiver that has heard the exact pattern of face 0 at `cosines`, `amplitude` over noise of variance one, with
/// gains of any phase; `late_m` beyond the reference delay.
fn received(cosines: [f64; 2], late_m: f64, amplitude: f64) -> BeamSquint<11> {
    let mut squint = listener();
    squint.begin(&sighting()).expect("line of sight");
    let band_hz = [-208.0 * 480e3, 207.0 * 480e3];
    for (index, slot) in squint.spectra.iter_mut().enumerate() {
        let symbol: SquintSymbol<f64> = SquintConfig::default()
            .symbol(SEQUENTIAL, index, 1, band_hz, 30e9)
            .expect("symbol");
        let gain = crate::array::phasor(0.7 * index as f64) * amplitude;
        let bins = core::array::from_fn(|k| {
            let f_hz = (k as f64 - 208.0) * 480e3;
            let turns = f_hz * late_m / 299_792_458.0;
            let y: Complex<f64> = symbol.response::<8, 8>(cosines, f_hz * 1e-9, 30.0)
                * gain
                * crate::array::phasor(-core::f64::consts::TAU * turns);
            Complex::new(y.re as f32, y.im as f32)
        });
        *slot = Some(Spectrum { bins, noise: 1.0 });
    }
    squint
}

#[test]
fn exact_patterns_give_the_exact_place() {
    for k in 0..200 {
        let cosines = [
            -0.85 + 1.7 * (0.618_034 * f64::from(k)).fract(),
            -0.05 + 0.55 * (0.414_214 * f64::from(k)).fract(),
        ];
        let late_m = -0.5 + f64::from(k % 11) * 0.1;
        let squint = received(cosines, late_m, 100.0);
        let bearing = squint.fit().unwrap_or_else(|e| panic!("{e} at {cosines:?}"));
        let off = [0, 1].map(|i| f64::from(bearing.cosines[i]) - cosines[i]);
        assert!(
            off[0].abs() < 2e-6 && off[1].abs() < 2e-6,
            "{off:?} at {cosines:?}"
        );
        let delay = bearing.delay.expect("fitted");
        assert!((f64::from(delay.c_tau_m) - 50.0 - late_m).abs() < 2e-5);
    }
}

/// Every place of a spread over the sector.
fn places() -> impl Iterator<Item = [f64; 2]> {
    (0..100).map(|k| {
        [
            -0.85 + 1.7 * (0.618_034 * f64::from(k)).fract(),
            -0.05 + 0.55 * (0.414_214 * f64::from(k)).fract(),
        ]
    })
}

#[test]
fn peaks_are_as_good_as_their_covariance_says() {
    let (mut picked, mut fitted, mut count) = (0.0, 0.0, 0.0);
    for cosines in places() {
        let squint = received(cosines, 0.0, 100.0);
        for (sum, bearing) in [(&mut picked, squint.pick()), (&mut fitted, squint.parabola())] {
            let bearing = bearing.expect("strong");
            assert!(bearing.delay.is_none());
            for i in 0..2 {
                let off = f64::from(bearing.cosines[i]) - cosines[i];
                let variance = f64::from(bearing.covariance[(i, i)]);
                // Half a subcarrier of a sweep is 2.1 mrad.
                assert!(off.abs() < 4e-3, "{off} at {cosines:?}");
                *sum += off * off / variance;
            }
        }
        count += 2.0;
    }
    for mean in [picked / count, fitted / count] {
        assert!((0.02..1.5).contains(&mean), "{mean}");
    }
}

#[test]
fn a_null_of_one_symbol_does_not_hold_the_fit() {
    // From the grid's 0.30, on which the null of the first symbol lies, and close to it.
    for z in [0.2767, 0.2942, 0.2999, 0.3001, 0.3175] {
        let bearing = received([-0.277, z], 0.0, 100.0).fit().expect("strong");
        assert!(
            (f64::from(bearing.cosines[1]) - z).abs() < 5e-6,
            "{z}: {}",
            bearing.cosines[1]
        );
    }
}

#[test]
fn what_cannot_be_heard_is_refused_with_its_reason() {
    let mut squint = listener();
    assert_eq!(squint.fit(), Err(Refusal::NotBegun));
    let behind_a_house = Sighting {
        line_of_sight: false,
        ..sighting()
    };
    assert_eq!(squint.begin(&behind_a_house), Err(Refusal::NotLineOfSight));
    assert_eq!(squint.fit(), Err(Refusal::NotBegun));
    let broken = Sighting {
        c_tau_m: f32::NAN,
        ..sighting()
    };
    assert_eq!(squint.begin(&broken), Err(Refusal::NotFinite));
    let mut masked = sighting();
    masked.interferers.push(masked.aoa).expect("room");
    assert_eq!(squint.begin(&masked), Err(Refusal::Masked));
    assert_eq!(squint.begin(&sighting()), Ok(()));
    for result in [squint.pick(), squint.parabola(), squint.fit()] {
        assert_eq!(result, Err(Refusal::SymbolsMissing));
    }
    // Azimuth sweeps alone do not tell the elevation.
    let mut azimuth = received([0.2, 0.2], 0.0, 100.0);
    azimuth.spectra.iter_mut().skip(3).for_each(|s| *s = None);
    for result in [azimuth.pick(), azimuth.parabola(), azimuth.fit()] {
        assert_eq!(result, Err(Refusal::SymbolsMissing));
    }
    let silent = received([0.2, 0.2], 0.0, 0.0);
    assert_eq!(silent.pick(), Err(Refusal::TooWeak));
    assert_eq!(silent.fit(), Err(Refusal::TooWeak));
    let faint = received([0.2, 0.2], 0.0, 0.05);
    assert_eq!(faint.fit(), Err(Refusal::TooWeak));
}

#[test]
fn a_zero_block_is_not_heard_and_other_faces_are_passed_over() {
    extern crate std;
    let (correlator, mut work) = (Correlator::new(&Waveform::default()), Workspace::new());
    let mut samples = std::boxed::Box::new([[crate::signal::Iq::ZERO; 512]; 32]);
    let mut squint = listener();
    squint
        .begin(&Sighting {
            face: 1,
            ..sighting()
        })
        .expect("line of sight");
    assert_eq!(
        [10, 11, 21, 22].map(|symbol| squint.wants(symbol)),
        [false, true, true, false]
    );
    for (beam, value) in [(10, 1000), (11, 0), (12, 1000)] {
        samples.iter_mut().flatten().enumerate().for_each(|(n, x)| {
            *x = crate::signal::Iq::new(value * (n % 7) as i16, -value);
        });
        let block = BeamBlock {
            samples: &mut samples,
            beam,
            exponent: -30,
        };
        squint.push(block, &correlator, &mut work);
    }
    // Symbol 10 is another face's, 11 nothing but zeros.
    let received = [0, 1, 10].map(|index| squint.spectra[index].is_some());
    assert_eq!(received, [false, true, false]);
}

#[test]
fn a_bearing_is_a_direction_of_its_face() {
    let arrays = crate::array::GmtArrays::<f32>::default();
    let truth = Direction::<Gmt>::from_zenith_azimuth(1.3, 2.4).expect("angles");
    let face = &arrays.faces()[1];
    let mut bearing = received([0.0, 0.1], 0.0, 100.0).fit().expect("strong");
    bearing.cosines = crate::array::GmtArrays::<f32>::cosines(face, &truth);
    assert!(
        bearing
            .direction(face)
            .expect("before the face")
            .angle_to_rad(&truth)
            < 1e-6
    );
    bearing.cosines = [0.9, 0.9];
    assert!(bearing.direction(face).is_none());
}

#[test]
fn the_ground_bounce_comes_from_under_the_line_of_sight() {
    let down = Direction::<crate::geometry::Body>::from_vector(-Vector3::z()).expect("unit");
    let far = Direction::from_vector(Vector3::new(0.0, -1.0, 0.5)).expect("not zero");
    let mut near = sighting();
    let bounce = near.aoa.vector() * 50.0 - Vector3::z() * 3.5;
    near.interferers
        .push(Direction::from_vector(bounce).expect("not zero"))
        .expect("room");
    near.interferers.push(far).expect("room");
    let with = near.with_ground(50.0, 1.5, &down, &level());
    // 3 m under the GMT, 50 m away; the path that lay there before is gone, the far one stays.
    assert_eq!(with.interferers.as_slice(), [far]);
    let expected = with.aoa.vector() * 50.0 - Vector3::z() * 3.0;
    let ground = with.ground.expect("given");
    assert!(ground.arrival.vector().cross(&expected).norm() < 1e-4);
}

/// The vertical of a mast that stands upright.
fn level() -> Direction<Gmt> {
    Direction::from_vector(Vector3::z()).expect("unit")
}

/// A receiver that has heard face 0 from `range_m` away at `cosines`, and off the ground 1.5 m under the GMT half as strong.
fn bounced(cosines: [f64; 2], range_m: f64, knows_of_it: bool) -> BeamSquint<11> {
    let [x, z] = cosines;
    let down = Direction::<crate::geometry::Body>::from_vector(-Vector3::z()).expect("unit");
    let mut squint = received(cosines, 0.1, 60.0);
    let begun = if knows_of_it {
        sighting().with_ground(range_m as f32, 1.5, &down, &level())
    } else {
        sighting()
    };
    let direct = squint.spectra;
    squint.begin(&begun).expect("line of sight");
    // The UAV's image is as far under the ground as the UAV is over it.
    let image = range_m * range_m * (1.0 - z * z) + (range_m * z + 3.0) * (range_m * z + 3.0);
    let length_m = image.sqrt();
    let mirrored = [x * range_m / length_m, -(range_m * z + 3.0) / length_m];
    let bounce = received(mirrored, 0.1 + length_m - range_m, 30.0).spectra;
    let turn = crate::array::phasor(2.1_f32);
    for ((slot, direct), bounce) in squint.spectra.iter_mut().zip(direct).zip(bounce) {
        *slot = direct.zip(bounce).map(|(direct, bounce)| Spectrum {
            bins: core::array::from_fn(|k| direct.bins[k] + bounce.bins[k] * turn),
            noise: 1.0,
        });
    }
    squint
}

#[test]
fn the_ground_bounce_is_fitted_with_the_line_of_sight() {
    for (cosines, range_m) in [([0.2, 0.04], 80.0), ([-0.5, 0.1], 60.0), ([0.6, 0.2], 40.0)] {
        let off = |knows_of_it: bool| {
            let bearing = bounced(cosines, range_m, knows_of_it).fit().expect("strong");
            let error = [0, 1].map(|i| f64::from(bearing.cosines[i]) - cosines[i]);
            let late_m = f64::from(bearing.delay.expect("fitted").c_tau_m) - 50.1;
            (libm::hypot(error[0], error[1]), late_m.abs())
        };
        let (ignored, _) = off(false);
        let (error, late_m) = off(true);
        assert!(ignored > 3e-3, "{cosines:?}: {ignored}");
        assert!(error < 3e-4 && late_m < 0.01, "{cosines:?}: {error} {late_m}");
    }
}

#[test]
fn a_bounce_that_leaves_within_a_beam_widens_the_covariance() {
    let sigma = |z: f64| {
        let bearing = bounced([0.2, z], 80.0, true).fit().expect("strong");
        bearing.covariance.m22.sqrt()
    };
    // 1.6 m and 8 m over the GMT: the two ways leave 0.08 and 0.24 apart, where a beam is 0.25 wide.
    assert!(sigma(0.02) > 2.0 * sigma(0.1), "{} {}", sigma(0.02), sigma(0.1));
}
