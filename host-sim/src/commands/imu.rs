//! `cslam imu`: Allan deviation of the simulated IMU.

use serde::Serialize;

use crate::config::Config;
use crate::input::InputError;
use crate::progress;
use crate::sensors::{Characterisation, static_run};
use crate::table::Table;

/// Arguments of `cslam imu`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Length of the run at rest, hours
    #[arg(long, value_name = "H", default_value_t = 1.0)]
    hours: f64,
    /// Seed of the IMU's errors
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Let the temperature drift as in flight; data sheets and benches hold it constant
    #[arg(long)]
    in_flight: bool,
    /// Configuration file (TOML), of which [world.sensors.imu] counts; `cslam config` shows what it may hold
    #[arg(long, value_name = "FILE")]
    config: Option<std::path::PathBuf>,
    /// Print one JSON object a sensor on stdout instead of the tables
    #[arg(long)]
    json: bool,
}

/// Longest run: its samples are kept in memory.
const MAX_HOURS: f64 = 12.0;

#[derive(Serialize)]
struct Line<'a> {
    sensor: &'a str,
    unit: &'a str,
    white_per_sqrt_hz: f64,
    instability: f64,
    walk_per_sqrt_s: f64,
    given_white_per_sqrt_hz: f64,
    given_instability: f64,
    given_walk_per_sqrt_s: f64,
    tau_s: Vec<f64>,
    deviation: Vec<f64>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    if !(args.hours >= 0.01 && args.hours <= MAX_HOURS) {
        return Err(
            InputError::new(format!("--hours is {}, expected 0.01 to {MAX_HOURS}", args.hours)).into(),
        );
    }
    let config = Config::read(args.config.as_deref(), None)?.world.sensors.imu;
    let config = if args.in_flight {
        config
    } else {
        config.at_constant_temperature()
    };
    let bar = progress::bar(100, "at rest");
    let sensors = static_run(&config, args.seed, args.hours * 3600.0, |share| {
        bar.set_position((share * 100.0) as u64)
    });
    bar.finish_and_clear();
    for (name, sensor) in ["gyroscope", "accelerometer"].into_iter().zip(&sensors) {
        if args.json {
            println!("{}", serde_json::to_string(&line(name, sensor))?);
        } else {
            print(name, sensor);
        }
    }
    Ok(())
}

fn line<'a>(name: &'a str, sensor: &'a Characterisation) -> Line<'a> {
    Line {
        sensor: name,
        unit: sensor.unit,
        white_per_sqrt_hz: sensor.measured.white,
        instability: sensor.measured.instability,
        walk_per_sqrt_s: sensor.measured.walk,
        given_white_per_sqrt_hz: sensor.given.white,
        given_instability: sensor.given.instability,
        given_walk_per_sqrt_s: sensor.given.walk,
        tau_s: sensor.curve.iter().map(|p| p.0).collect(),
        deviation: sensor.curve.iter().map(|p| p.1).collect(),
    }
}

fn print(name: &str, sensor: &Characterisation) {
    let unit = sensor.unit;
    println!("{name}, {unit}, three axes pooled");
    let mut curve = Table::new(["tau s", "measured", "expected"]);
    for &(tau_s, deviation) in &sensor.curve {
        curve.row([
            format!("{tau_s:.3}"),
            format!("{deviation:.4}"),
            format!("{:.4}", sensor.given.deviation(tau_s)),
        ]);
    }
    println!("{curve}");
    let mut figures = Table::new(["figure", "measured", "given"]);
    let (measured, given) = (sensor.measured, sensor.given);
    for (what, measured, given) in [
        (
            format!("white noise, {unit}/sqrt(Hz)"),
            measured.white,
            given.white,
        ),
        (
            format!("bias instability, {unit}"),
            measured.instability,
            given.instability,
        ),
        (format!("bias walk, {unit}/sqrt(s)"), measured.walk, given.walk),
    ] {
        figures.row([what, format!("{measured:.4}"), format!("{given:.4}")]);
    }
    println!("{figures}");
}
