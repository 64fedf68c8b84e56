//! Without errors the true antennas are those that the receiver assumes, of the default radio and of others.

use cslam_core::array::{self, Codebook, CodebookConfig, GmtArrays, SquintConfig, UavArrayConfig, UavLayout};
use cslam_core::geometry::{Body, Direction, Gmt};
use cslam_core::profile::{planar_8x8_gmt_72, quad_4x16_gmt_48};
use cslam_core::radio::RadioConfig;

use super::uav::UavArrays;
use super::{gmt, phasor, place, squint};
use crate::synthesis::radio::{GmtCounts, Radio};
use crate::synthesis::{C64, SquintScheme};

/// Zenith and azimuth of directions all over the sphere, poles included.
fn directions() -> impl Iterator<Item = (f64, f64)> {
    let zeniths = (0..=36).map(|i| f64::from(i) * std::f64::consts::PI / 36.0);
    zeniths.flat_map(|zenith| (0..24).map(move |i| (zenith, -3.1 + 0.263 * f64::from(i))))
}

/// A radio in which every figure differs from the default's, with five elevations.
fn odd() -> RadioConfig<5> {
    let default = RadioConfig::default();
    let mut odd = RadioConfig {
        waveform: default.waveform,
        uav_arrays: UavArrayConfig {
            radius_m: 0.13,
            tilt_rad: 0.4,
            spacing_wavelengths: 0.43,
            ..default.uav_arrays
        },
        gmt_arrays: default.gmt_arrays,
        codebook: CodebookConfig {
            azimuths: 7,
            sector_rad: 0.8,
            elevations_rad: [-0.1, 0.05, 0.2, 0.3, 0.5],
        },
        squint_scheme: default.squint_scheme,
        squint: default.squint,
    };
    odd.waveform.carrier_hz = 39e9;
    odd.uav_arrays.element.side_attenuation_db = 4.0;
    odd.uav_arrays.element.rear_attenuation_db = 9.0;
    odd.uav_arrays.element.front_gain_db = 2.0;
    odd.gmt_arrays.spacing_wavelengths = 0.37;
    odd.gmt_arrays.element.least_cosine = 0.08;
    odd.gmt_arrays.element.rear_amplitude = 0.02;
    odd
}

fn arrays_agree<const ARRAYS: usize, const ELEMENTS: usize>(config: &UavArrayConfig) {
    let ours = UavArrays::<ARRAYS>::nominal(config);
    let theirs = array::UavArrays::<f64, ARRAYS, ELEMENTS>::new(config);
    for (zenith, azimuth) in directions() {
        let u = Direction::<Body, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
        let row_step_rad = theirs.column().map_or(0.0, |column| {
            theirs.phase_per_element_rad() * column.dot(u.vector())
        });
        let phases_rad = ours.phase_rad::<ELEMENTS>(&u);
        for (j, (row_rad, step_rad)) in phases_rad.iter().zip(theirs.phase_step_rad(&u)).enumerate() {
            let row = phasor(place(j, ARRAYS) * row_step_rad);
            let theirs = array::UavArrays::<f64, ARRAYS, ELEMENTS>::steering(step_rad);
            for (ours, theirs) in row_rad.iter().zip(theirs) {
                let error = phasor(*ours) - theirs * row;
                assert!(error.norm() < 1e-13, "row {j}: {error}");
            }
        }
        assert_eq!(ours.amplitude(&u), theirs.amplitude(&u));
        assert_eq!(ours.lead_m(&u), theirs.lead_m(&u));
    }
}

#[test]
fn the_arrays_of_the_uav_are_those_of_the_receiver() {
    arrays_agree::<4, 8>(&UavArrayConfig::default());
    arrays_agree::<4, 16>(&quad_4x16_gmt_48::radio().uav_arrays);
    arrays_agree::<3, 5>(&odd().uav_arrays);
    arrays_agree::<8, 8>(&planar_8x8_gmt_72::radio().uav_arrays);
    arrays_agree::<6, 5>(&UavArrayConfig {
        layout: UavLayout::Planar { azimuth_rad: 2.2 },
        ..odd().uav_arrays
    });
}

fn beams_agree<const FACES: usize, const COLUMNS: usize, const ROWS: usize, const ELEVATIONS: usize>(
    config: &RadioConfig<ELEVATIONS>,
) {
    let counts = GmtCounts {
        faces: FACES,
        columns: COLUMNS,
        rows: ROWS,
    };
    let radio = Radio::new(config, counts).expect("a sound radio");
    let codebook: Codebook<f64, FACES, COLUMNS, ROWS, ELEVATIONS> = config.codebook();
    assert_eq!(radio.beams(), codebook.len());
    let beams: Vec<_> = (0..radio.beams())
        .map(|m| gmt::beam(&radio.codebook, m))
        .collect();
    for (m, (face, cosines)) in beams.iter().enumerate() {
        let theirs = codebook.beam(m).expect("beam");
        assert_eq!((*face, *cosines), (theirs.face, theirs.cosines));
    }
    let faces: Vec<_> = (0..FACES).map(|s| gmt::Face::new(&radio, s)).collect();
    let codewords: Vec<_> = beams
        .iter()
        .map(|(face, cosines)| faces[*face].codeword(*cosines))
        .collect();
    for (zenith, azimuth) in directions() {
        let u = Direction::<Gmt, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
        for ((m, (face, _)), w) in beams.iter().enumerate().zip(&codewords) {
            let face = faces[*face];
            let response = face.response(face.cosines(&u));
            let sum: C64 = response.iter().zip(w).map(|(v, w)| v * w).sum();
            let error = sum * face.amplitude(&u) - codebook.field(m, &u);
            assert!(error.norm() < 1e-13, "beam {m} at {zenith}, {azimuth}: {error}");
        }
    }
    let arrays = codebook.arrays();
    for (face, theirs) in faces.iter().zip(arrays.faces()) {
        for (zenith, azimuth) in directions() {
            let u = Direction::<Gmt, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
            assert_eq!(face.amplitude(&u), arrays.amplitude(theirs, &u));
            assert_eq!(
                face.cosines(&u),
                GmtArrays::<f64, FACES, COLUMNS, ROWS>::cosines(theirs, &u)
            );
        }
    }
}

#[test]
fn the_beams_of_the_gmt_are_those_of_the_receiver() {
    beams_agree::<3, 8, 8, 3>(&RadioConfig::default());
    beams_agree::<3, 8, 8, 2>(&quad_4x16_gmt_48::radio());
    beams_agree::<4, 6, 5, 5>(&odd());
}

fn symbols_agree<const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>(
    config: &SquintConfig<AZIMUTH_SWEEPS, ELEVATION_SWEEPS>,
    faces: usize,
    carrier_hz: f64,
    counts: [usize; 2],
) {
    let band_hz = [-208.0 * 480e3, 207.0 * 480e3];
    let schemes = [SquintScheme::Sequential, SquintScheme::Raster];
    for (scheme, count) in schemes.into_iter().zip(counts) {
        let sweeps = crate::synthesis::radio::SquintSweeps::from(config);
        let symbols: Vec<squint::SquintSymbol> = sweeps.symbols(scheme, faces, band_hz, carrier_hz);
        assert_eq!(symbols.len(), count);
        for (index, symbol) in symbols.iter().enumerate() {
            let theirs = config.symbol::<f64>(scheme, index, faces, band_hz, carrier_hz);
            let theirs = theirs.expect("as many symbols");
            let of_ours = (symbol.face, symbol.psi, symbol.delay_ns);
            assert_eq!(of_ours, (theirs.face, theirs.psi, theirs.delay_ns));
        }
    }
}

#[test]
fn the_squint_symbols_are_those_of_the_receiver() {
    symbols_agree(&SquintConfig::default(), 3, 30e9, [33, 3]);
    let other = SquintConfig::<2, 5> {
        half_width: 0.8,
        elevations: [0.1, 0.4],
        rise: [-0.2, 0.6],
        sector: 0.7,
        passes: 2,
        raster_rise: [0.1, 0.5],
    };
    symbols_agree(&other, 4, 28e9, [28, 4]);
}

#[test]
fn phasors_are_those_of_the_receiver() {
    for i in -50..50 {
        let angle = 0.37 * f64::from(i);
        assert_eq!(phasor(angle), array::phasor(angle));
    }
}
