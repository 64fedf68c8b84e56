//! A static run of the IMU on a bench, and what its Allan deviation says: the check of the noise model against the
//! figures it was given.

use cslam_firmware::icm42688::packet::{ACCELERATION_PER_CODE_M_PER_S2, RATE_PER_CODE_RAD_PER_S};
use nalgebra::Vector3;

use super::imu::{DPS_RAD_PER_S, Imu, ImuConfig, MICRO_G_M_PER_S2};
use super::sampling::Sampling;
use crate::allan::{Allan, Figures};
use crate::flight::Trajectory;

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

/// Runs the IMU at rest and level, its rotors too, for `duration_s` and characterises gyroscope and accelerometer from the integer codes
/// that a receiver would see. `progress` is told the share done, 0..=1.
pub fn static_run(
    config: &ImuConfig,
    seed: u64,
    duration_s: f64,
    progress: impl Fn(f64),
) -> [Characterisation; 2] {
    let mut imu = Imu::new(config, seed);
    let samples = (duration_s * f64::from(config.rate_hz)) as usize;
    let mut sampling = Sampling::new(config, seed);
    let rest = Trajectory::at_rest(Vector3::zeros(), duration_s);
    let interval_s = 1.0 / f64::from(config.rate_hz);
    let (mut rates, mut forces) = (Vec::with_capacity(samples), Vec::with_capacity(samples));
    for done in 0..samples {
        if done % 100_000 == 0 {
            progress(0.5 * done as f64 / samples as f64);
        }
        let start_s = done as f64 * interval_s;
        let (rate, force) = sampling.sample(&rest, |_| 0.0, start_s, start_s + interval_s);
        let sample = imu.measure(&rate, &force);
        rates.push(sample.rate);
        forces.push(sample.acceleration);
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn hour(config: &ImuConfig, seed: u64) -> [Characterisation; 2] {
        static_run(config, seed, 3600.0, |_| ())
    }

    fn off(measured: f64, given: f64) -> f64 {
        (measured / given - 1.0).abs()
    }

    /// One hour, three axes pooled, at constant temperature as data sheets are measured. The seeds are the first
    /// four, not chosen. White noise is read at tau = 1 s off each run. The flicker floor of one run of an hour
    /// scatters by about 6 % (few independent averages at long tau), so it is judged on the four runs pooled as well
    /// as, more loosely, on each.
    #[test]
    fn an_hour_at_rest_has_the_allan_deviation_of_the_data_sheet() {
        let config = ImuConfig::default().at_constant_temperature();
        let mut floors = [0.0; 2];
        for seed in 1..=4 {
            for (sensor, floor) in hour(&config, seed).iter().zip(&mut floors) {
                let (given, measured) = (sensor.given, sensor.measured);
                let at_1_s = sensor.curve.iter().find(|p| p.0 >= 1.0).expect("a second").1;
                println!("seed {seed}: {at_1_s:.4} at 1 s, {measured:.4?} {}", sensor.unit);
                assert!(off(measured.white, given.white) < 0.02, "{measured:?}");
                // What stands at 1 s is white noise and floor together: still the data sheet's figure within 10 %.
                assert!(off(at_1_s, given.white) < 0.10, "{at_1_s}");
                assert!(
                    off(measured.instability, given.instability) < 0.20,
                    "{measured:?}"
                );
                *floor += measured.instability * measured.instability / 4.0;
            }
        }
        for (sensor, floor) in hour(&config, 1).iter().zip(floors) {
            assert!(
                off(floor.sqrt(), sensor.given.instability) < 0.10,
                "{} of {:?}",
                floor.sqrt(),
                sensor.given
            );
        }
    }

    /// Everything that is left of a real sensor on a bench, where no rotor turns: its filter, mounting and g-sensitivity move no figure of
    /// the data sheet.
    #[test]
    fn a_real_sensor_on_the_bench_has_the_deviation_of_the_data_sheet_too() {
        let config = ImuConfig::real().at_constant_temperature();
        for sensor in static_run(&config, 1, 1800.0, |_| ()) {
            let at = |tau_s: f64| sensor.curve.iter().find(|p| p.0 >= tau_s).expect("a point");
            for tau_s in [0.1, 1.0, 10.0] {
                let (tau_s, deviation) = *at(tau_s);
                let given = sensor.given.deviation(tau_s);
                assert!(
                    off(deviation, given) < 0.1,
                    "{deviation} for {given} {} at {tau_s} s",
                    sensor.unit
                );
            }
            assert!(
                off(sensor.measured.white, sensor.given.white) < 0.02,
                "{:?}",
                sensor.measured
            );
        }
    }

    #[test]
    fn in_flight_the_temperature_walk_stands_on_top() {
        let bench = static_run(&ImuConfig::default().at_constant_temperature(), 1, 600.0, |_| ());
        let flight = static_run(&ImuConfig::default(), 1, 600.0, |_| ());
        for (bench, flight) in bench.iter().zip(&flight) {
            let at = |sensor: &Characterisation, tau_s: f64| {
                sensor.curve.iter().find(|p| p.0 >= tau_s).map_or(0.0, |p| p.1)
            };
            assert!(off(at(flight, 0.1), at(bench, 0.1)) < 0.01);
            assert!(at(flight, 60.0) > 1.5 * at(bench, 60.0));
            assert!(off(at(flight, 10.0), flight.given.deviation(10.0)) < 0.2);
        }
    }
}
