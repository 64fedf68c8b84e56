//! Without errors the true antennas are those that the receiver assumes.

use cslam_core::array::{self, Codebook, GmtArrays, SquintConfig};
use cslam_core::geometry::{Body, Direction, Gmt};

use super::squint::SquintScheme;
use super::uav::UavArrays;
use super::{gmt, phasor};
use crate::channel::C64;

/// Zenith and azimuth of directions all over the sphere, poles included.
fn directions() -> impl Iterator<Item = (f64, f64)> {
    let zeniths = (0..=36).map(|i| f64::from(i) * std::f64::consts::PI / 36.0);
    zeniths.flat_map(|zenith| (0..24).map(move |i| (zenith, -3.1 + 0.263 * f64::from(i))))
}

#[test]
fn the_arrays_of_the_uav_are_those_of_the_receiver() {
    let (ours, theirs) = (UavArrays::nominal(), array::UavArrays::<f64>::default());
    for (zenith, azimuth) in directions() {
        let u = Direction::<Body, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
        let step = ours.phase_step_rad(&u);
        assert_eq!(step, theirs.phase_step_rad(&u));
        for (a, b) in step.iter().zip(theirs.phase_step_rad(&u)) {
            assert_eq!(UavArrays::steering(*a), array::UavArrays::<f64>::steering(b));
        }
        assert_eq!(ours.amplitude(&u), theirs.amplitude(&u));
        assert_eq!(ours.lead_m(&u), theirs.lead_m(&u));
    }
}

#[test]
fn the_beams_of_the_gmt_are_those_of_the_receiver() {
    let codebook = Codebook::<f64>::default();
    assert_eq!(gmt::BEAMS, codebook.len());
    let beams: Vec<_> = (0..gmt::BEAMS).map(gmt::beam).collect();
    for (m, (face, cosines)) in beams.iter().enumerate() {
        let theirs = codebook.beam(m).expect("beam");
        assert_eq!((*face, *cosines), (theirs.face, theirs.cosines));
    }
    let codewords: Vec<_> = beams
        .iter()
        .map(|(_, cosines)| gmt::response(*cosines).map(|v| v.conj() / 8.0))
        .collect();
    for (zenith, azimuth) in directions() {
        let u = Direction::<Gmt, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
        for ((m, (face, _)), w) in beams.iter().enumerate().zip(&codewords) {
            let face = gmt::Face::new(*face);
            let sum: C64 = gmt::response(face.cosines(&u))
                .iter()
                .zip(w)
                .map(|(v, w)| v * w)
                .sum();
            let error = sum * face.amplitude(&u) - codebook.field(m, &u);
            assert!(error.norm() < 1e-13, "beam {m} at {zenith}, {azimuth}: {error}");
        }
    }
    let arrays = GmtArrays::<f64>::default();
    for (s, theirs) in arrays.faces().iter().enumerate() {
        for (zenith, azimuth) in directions() {
            let u = Direction::<Gmt, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
            assert_eq!(gmt::Face::new(s).amplitude(&u), arrays.amplitude(theirs, &u));
            assert_eq!(
                gmt::Face::new(s).cosines(&u),
                GmtArrays::<f64>::cosines(theirs, &u)
            );
        }
    }
}

#[test]
fn the_squint_symbols_are_those_of_the_receiver() {
    let band_hz = [-208.0 * 480e3, 207.0 * 480e3];
    for (ours, theirs, count) in [
        (SquintScheme::Sequential, array::SquintScheme::Sequential, 33),
        (SquintScheme::Raster, array::SquintScheme::Raster, 3),
    ] {
        let symbols = ours.symbols(band_hz, 30e9);
        assert_eq!(symbols.len(), count);
        for (index, symbol) in symbols.iter().enumerate() {
            let config = SquintConfig::default();
            let theirs = config.symbol::<f64>(theirs, index, 3, band_hz, 30e9);
            let theirs = theirs.expect("as many symbols");
            let of_ours = (symbol.face, symbol.psi, symbol.delay_ns);
            assert_eq!(of_ours, (theirs.face, theirs.psi, theirs.delay_ns));
        }
    }
}

#[test]
fn phasors_are_those_of_the_receiver() {
    for i in -50..50 {
        let angle = 0.37 * f64::from(i);
        assert_eq!(phasor(angle), array::phasor(angle));
    }
}
