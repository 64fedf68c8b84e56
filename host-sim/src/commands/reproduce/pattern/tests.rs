//! Lobes, gains and squint of the arrays against closed forms.

use super::*;

#[test]
fn a_lobe_has_its_width_and_its_sidelobe() {
    // Eight elements half a wavelength apart: half power at 0.886/(N/2) of direction cosine, first sidelobe at 12.8 dB.
    let factor = |s: f64| {
        let x = std::f64::consts::FRAC_PI_2 * s;
        if x == 0.0 {
            1.0
        } else {
            (8.0 * x).sin() / (8.0 * x.sin())
        }
    };
    let points: Vec<(f64, f64)> = (-1000..=1000)
        .map(|i| f64::from(i) * 1e-3)
        .map(|s| (s, db(factor(s).powi(2))))
        .collect();
    let (width, sidelobe_db) = lobe(&points);
    assert!((width - 0.222).abs() < 0.004, "{width}");
    assert!((sidelobe_db - 12.8).abs() < 0.1, "{sidelobe_db}");
}

#[test]
fn beams_have_the_gain_of_64_elements_and_cover_all_azimuths() {
    let codebook = Codebook::<f64>::new(GmtArrays::default(), Default::default());
    let beams = beams(&codebook);
    assert_eq!(beams.len(), 12);
    // 18.06 dB of 64 elements, 2.16 dB of the dipole, and the face's cosine.
    let first = beams
        .iter()
        .find(|b| b.elevation_deg == 0.0)
        .expect("a level beam");
    let expected = 10.0 * (64.0 * 1.643 * first.azimuth_deg.to_radians().cos()).log10();
    assert!((first.gain_dbi - expected).abs() < 1e-3, "{}", first.gain_dbi);
    let level = cover("best", 0.0, |az| best_beam_dbi(&codebook, az, 0.0));
    assert!(
        level.least_dbi > 10.0 && level.most_dbi < 20.3,
        "{} {}",
        level.least_dbi,
        level.most_dbi
    );
}

#[test]
fn a_squint_symbol_sweeps_the_row_over_the_band() {
    let rows = squints(&Waveform::default());
    let aims: Vec<f64> = rows.iter().map(|row| row.aim_cosine).collect();
    assert!(
        (aims[0] + 0.87).abs() < 1e-6 && (aims[4] - 0.87).abs() < 1e-6,
        "{aims:?}"
    );
    assert!(aims.windows(2).all(|pair| pair[1] > pair[0] + 0.4));
    assert!(rows.iter().all(|row| (row.width_cosine - 0.222).abs() < 0.01));
}
