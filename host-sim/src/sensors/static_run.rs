//! A static run of the IMU on a bench, and what its Allan deviation says: the check of the noise model against the
//! figures it was given.

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
use nalgebra::Vector3;

use super::fifo::{ACCELERATION_PER_CODE_M_PER_S2, RATE_PER_CODE_RAD_PER_S};
use super::imu::{DPS_RAD_PER_S, Imu, ImuConfig, MICRO_G_M_PER_S2};
use crate::allan::{Allan, Figures};

/// One sensor's Allan deviation, pooled over its three axes (root mean square), and the figures read off it.
#[derive(Clone, Debug)]
pub struct Characterisation {
    /// (averaging time in s, deviation in `unit`), ascending.
    pub curve: Vec<(f64, f64)>,
    /// Figures fitted to the curve up to a tenth of the run: beyond, too few averages are left.
    pub measured: Figures,
    /// Figures the simulation was given.
    pub given: Figures,
    /// Unit of the deviations: "mdps" or "ug".
    pub unit: &'static str,
}

/// Runs the IMU at rest and level for `duration_s` and characterises gyroscope and accelerometer from the integer codes
/// that a receiver would see. `progress` is told the share done, 0..=1.
pub fn static_run(
    config: &ImuConfig,
    seed: u64,
    duration_s: f64,
    progress: impl Fn(f64),
) -> [Characterisation; 2] {
    let mut imu = Imu::new(config, seed);
    let samples = (duration_s * f64::from(config.rate_hz)) as usize;
    let level = Vector3::z() * STANDARD_GRAVITY_M_PER_S2;
    let (mut rates, mut forces) = (Vec::with_capacity(samples), Vec::with_capacity(samples));
    for done in 0..samples {
        if done % 100_000 == 0 {
            progress(0.5 * done as f64 / samples as f64);
        }
        let sample = imu.measure(&Vector3::zeros(), &level);
        rates.push(sample.rate);
        forces.push(sample.acceleration);
    }
    let interval_s = 1.0 / f64::from(config.rate_hz);
    let gyroscope = characterise(
        &rates,
        interval_s,
        RATE_PER_CODE_RAD_PER_S / (1e-3 * DPS_RAD_PER_S),
        Figures {
            white: config.gyro_noise_mdps_per_sqrt_hz,
            instability: config.gyro_bias_instability_deg_per_h / 3.6,
            walk: config.gyro_bias_walk_mdps_per_sqrt_s,
        },
        "mdps",
    );
    progress(0.75);
    let accelerometer = characterise(
        &forces,
        interval_s,
        ACCELERATION_PER_CODE_M_PER_S2 / MICRO_G_M_PER_S2,
        Figures {
            white: config.accel_noise_ug_per_sqrt_hz,
            instability: config.accel_bias_instability_ug,
            walk: config.accel_bias_walk_ug_per_sqrt_s,
        },
        "ug",
    );
    progress(1.0);
    [gyroscope, accelerometer]
}

fn characterise(
    codes: &[[i32; 3]],
    interval_s: f64,
    unit_per_code: f64,
    given: Figures,
    unit: &'static str,
) -> Characterisation {
    let mut curve: Vec<(f64, f64)> = Vec::new();
    for axis in 0..3 {
        let allan = Allan::new(
            codes.iter().map(|c| f64::from(c[axis]) * unit_per_code),
            interval_s,
        );
        for (place, factor) in allan.factors(5).into_iter().enumerate() {
            let variance = allan.deviation(factor).map_or(0.0, |d| d * d);
            match curve.get_mut(place) {
                Some(point) => point.1 += variance,
                None => curve.push((allan.tau_s(factor), variance)),
            }
        }
    }
    for point in &mut curve {
        point.1 = (point.1 / 3.0).sqrt();
    }
    let longest_s = codes.len() as f64 * interval_s / 10.0;
    let trusted: Vec<_> = curve
        .iter()
        .copied()
        .filter(|&(tau_s, _)| tau_s <= longest_s)
        .collect();
    Characterisation {
        measured: Figures::fit(&trusted),
        curve,
        given,
        unit,
    }
}
