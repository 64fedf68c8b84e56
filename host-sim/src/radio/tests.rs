//! The default's figures are the receiver's; what is told is taken, and what cannot work is named as it is written.

use super::*;

#[test]
fn the_default_is_that_of_the_receiver_to_the_last_bit() {
    assert_eq!(RadioFigures::default().config(), RadioConfig::default());
    assert_eq!(RadioFigures::default().of_channel(), Ok(Radio::default()));
    assert_eq!(RadioFigures::default().unless_default(), None);
    assert_eq!(WaveformFigures::default().name(), Waveform::NAME);
}

#[test]
fn a_board_is_told_what_it_has_room_for() {
    assert_eq!(RadioFigures::default().for_board(), Ok(None));
    let told = |text: &str| toml::from_str::<RadioFigures>(text).expect("sound");
    let radio = told("waveform.carrier_hz = 28e9\nwaveform.root = 136\nuav_arrays.radius_m = 0.15");
    let settings = radio.for_board().expect("has room").expect("another radio");
    let (of_board, of_host) = (settings.config(), radio.config());
    assert_eq!(of_board.waveform, of_host.waveform);
    assert_eq!(of_board.uav_arrays.radius_m, 0.15);
    assert!((of_board.uav_arrays.tilt_rad - of_host.uav_arrays.tilt_rad).abs() < 1e-8);
    assert!((of_board.codebook.sector_rad - of_host.codebook.sector_rad).abs() < 1e-12);
    for (text, key) in [
        ("waveform.sample_rate_hz = 122.88e6", "waveform.sample_rate_hz"),
        ("uav_arrays.front_gain_db = 4.0", "uav_arrays"),
        ("squint.half_width = 0.8", "squint"),
        (
            "waveform.sequence_length = 70001\nwaveform.root = 7",
            "waveform.sequence_length",
        ),
        ("waveform.carrier_hz = 2e12", "waveform.carrier_hz"),
        ("uav_arrays.radius_m = 7.0", "uav_arrays.radius_m"),
    ] {
        let error = told(text).for_board().expect_err("no room").to_string();
        assert!(error.starts_with(key), "{error}");
    }
}

#[test]
fn what_is_told_is_taken_and_what_cannot_work_is_named_as_it_is_written() {
    let text = "waveform.carrier_hz = 28e9\nwaveform.root = 136\nuav_arrays.tilt_deg = 20.0\ncodebook.elevations_deg = [0.0, 10.0, 20.0]";
    let told: RadioFigures = toml::from_str(text).expect("sound");
    let config = told.config();
    assert_eq!((config.waveform.carrier_hz, config.waveform.root), (28e9, 136));
    assert_eq!(config.uav_arrays.tilt_rad, 20_f64.to_radians());
    assert_eq!(config.codebook.elevations_rad[1], 10_f64.to_radians());
    assert_eq!(told.unless_default(), Some(told));
    let refused = |text: &str| {
        let told: RadioFigures = toml::from_str(text).expect("well-formed");
        told.check().expect_err("must be refused").to_string()
    };
    for (text, message) in [
        (
            "waveform.root = 818",
            "waveform.root expected a number coprime to the sequence's length",
        ),
        (
            "uav_arrays.tilt_deg = 91.0",
            "uav_arrays.tilt_deg expected at most a quarter of a turn up or down",
        ),
        (
            "uav_arrays.spacing_wavelengths = 0.6",
            "uav_arrays.spacing_wavelengths expected above 0 and at most 0.5",
        ),
        (
            "uav_arrays.front_gain_db = nan",
            "uav_arrays expected finite numbers",
        ),
        (
            "squint.rise = [0.2, 0.2]",
            "squint.rise expected direction cosines, and a sweep that moves",
        ),
        (
            "codebook.sector_deg = 0.0",
            "codebook.sector_deg expected above 0 and at most a quarter of a turn",
        ),
    ] {
        assert_eq!(refused(text), message);
    }
    assert!(
        toml::from_str::<RadioFigures>("waveform.active = 416").is_err(),
        "the type says"
    );
}
