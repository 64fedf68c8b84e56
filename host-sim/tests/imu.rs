//! `cslam imu` as a user runs it.

use std::process::{Command, Output};

fn imu(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .arg("imu")
        .args(arguments)
        .output()
        .expect("the command runs")
}

#[test]
fn the_figures_are_printed_for_both_sensors_and_repeat() {
    let run = |seed| imu(&["--hours", "0.05", "--json", "--seed", seed]);
    let output = run("2");
    assert!(output.status.success());
    assert_eq!(output.stdout, run("2").stdout);
    assert_ne!(output.stdout, run("3").stdout);
    let text = String::from_utf8(output.stdout).expect("text");
    let lines: Vec<serde_json::Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("a JSON line"))
        .collect();
    assert_eq!(
        (&lines[0]["sensor"], &lines[1]["sensor"]),
        (&"gyroscope".into(), &"accelerometer".into())
    );
    for line in &lines {
        let figure = |key: &str| line[key].as_f64().expect("a number");
        let white = figure("white_per_sqrt_hz") / figure("given_white_per_sqrt_hz");
        assert!((white - 1.0).abs() < 0.05, "{white}");
    }
}

#[test]
fn the_configuration_counts_and_bad_input_ends_with_two_and_one_line() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("noisy.toml");
    let config = file.to_str().expect("a plain name");
    std::fs::write(&file, "[world.sensors.imu]\ngyro_noise_mdps_per_sqrt_hz = 28.0\n").expect("writable");
    let output = imu(&["--hours", "0.02", "--json", "--config", config]);
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(text.contains("\"given_white_per_sqrt_hz\":28.0"), "{text}");
    std::fs::write(&file, "[world.sensors.imu]\ngyro_turn_on_bias_dps = -1.0\n").expect("writable");
    let cases: [(&[&str], &str); 3] = [
        (&["--config", config], "gyro_turn_on_bias_dps"),
        (&["--hours", "0"], "--hours"),
        (&["--config", "missing.toml"], "missing.toml"),
    ];
    for (arguments, key) in cases {
        let failed = imu(arguments);
        let error = String::from_utf8_lossy(&failed.stderr).into_owned();
        assert_eq!(failed.status.code(), Some(2), "{error}");
        assert!(error.contains(key) && error.lines().count() == 1, "{error}");
    }
}
