//! `cslam record`: a flight's sensors on disk.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::flight::{FlightConfig, FlightPlan};
use crate::input::{InputError, read_text};
use crate::recording;
use crate::scene::Scene;
use crate::sensors::{SensedFlight, SensorsConfig};

/// Arguments of `cslam record`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Scene: outdoor, indoor, street, outdoor_a, city:SEED, or a file (.json, .obj, .ply)
    #[arg(long, value_name = "NAME|FILE", default_value = "outdoor")]
    scene: String,
    /// Seed of the route and of the sensors' errors
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Length of the flight, s; overrides the configuration
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Flight and sensors, TOML with tables [flight] and [sensors]; defaults when absent
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Directory to write to; created, and must not hold a recording yet
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Config {
    flight: FlightConfig,
    sensors: SensorsConfig,
}

#[derive(Serialize)]
struct Summary<'a> {
    scene: &'a str,
    seed: u64,
    flight_s: f64,
    sweeps: u32,
    imu_samples: u64,
    visible_share: f64,
    longest_outage_s: f64,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let mut config = args
        .config
        .as_deref()
        .map_or_else(|| Ok(Config::default()), read)?;
    if let Some(duration_s) = args.duration {
        config.flight.duration_s = duration_s;
    }
    if args.out.join("flight.json").exists() {
        return Err(
            InputError::in_file(&args.out, "already holds a recording, expected a new directory").into(),
        );
    }
    let scene = Scene::load(&args.scene)?;
    let plan = FlightPlan::plan(&scene, &config.flight, args.seed)?;
    let contact = plan.contact();
    let flight = SensedFlight::new(plan, config.sensors, args.seed)?;
    let manifest = recording::write(&args.out, &args.scene, &flight, |_, _| Ok(false))?;
    let summary = Summary {
        scene: &args.scene,
        seed: args.seed,
        flight_s: flight.plan().duration_s(),
        sweeps: flight.plan().sweeps(),
        imu_samples: manifest.files.first().map_or(0, |entry| entry.records),
        visible_share: contact.visible_share,
        longest_outage_s: contact.longest_outage_s,
    };
    if args.json {
        println!("{}", serde_json::to_string(&summary)?);
    } else {
        println!(
            "{:.1} s, {} sweeps ({:.0} % in line of sight, longest outage {:.1} s), {} IMU samples in {}",
            summary.flight_s,
            summary.sweeps,
            100.0 * summary.visible_share,
            summary.longest_outage_s,
            summary.imu_samples,
            args.out.display()
        );
    }
    Ok(())
}

fn read(file: &Path) -> Result<Config, InputError> {
    toml::from_str(&read_text(file)?).map_err(|e| InputError::in_file(file, e.to_string()))
}
