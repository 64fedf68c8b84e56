//! `cslam reproduce attacks jamming`: the first poses of flights beside a jammer, and whether they are as right as they claim.

use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use crate::channel::{Jammer, JammerKind};
use crate::commands::fly::raw::{Hooks, fly_world};
use crate::commands::seeds::AnySeed;
use crate::commands::threads::Threads;
use crate::config::{Mode, ReceiverConfig};
use crate::flight_log::SweepRecord;
use crate::input::InputError;
use crate::progress;
use crate::raw_flight::Swept;
use crate::scene::Scene;
use crate::seeded::{Seeded, Source};
use crate::statistics;
use crate::table::Table;
use crate::world::{Profile, World, WorldConfig};

/// Arguments of `cslam reproduce attacks jamming`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Scene: outdoor, indoor, street, outdoor_a, city:SEED, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "outdoor")]
    scene: String,
    /// Starts of each kind at each power, with one seed after the other
    #[arg(long, value_name = "N", default_value_t = 5)]
    starts: u64,
    /// Seed of the first start
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    first_seed: u64,
    #[command(flatten)]
    any_seed: AnySeed,
    /// Sweeps flown of each, two per second
    #[arg(long, value_name = "N", default_value_t = 30)]
    sweeps: usize,
    /// Weakest and strongest jammer and the step between, dBm
    #[arg(long, value_name = "DBM", num_args = 3, default_values_t = [-90, -30, 10], allow_hyphen_values = true)]
    powers: Vec<i32>,
    #[command(flatten)]
    threads: Threads,
}

const KINDS: [(&str, JammerKind); 4] = [
    ("tone", JammerKind::Tone),
    ("noise", JammerKind::Noise),
    ("pulsed", JammerKind::Pulsed),
    ("replayed preamble", JammerKind::Replay),
];

/// Frequencies of tones off the carrier, Hz: within the active subcarriers.
const TONE_HZ: f64 = 90e6;
/// Longest delay of a replay, as a length, m: shorter and longer than any way of the scene.
const REPLAY_M: f64 = 150.0;

/// The jammer that a seed places somewhere around the UAV.
fn jammer(kind: JammerKind, power_dbm: f64, seed: u64) -> Jammer {
    let mut random = Seeded::new(seed, Source::Jammer);
    let (azimuth_deg, zenith_deg) = (random.between(-180.0, 180.0), random.between(60.0, 110.0));
    let (tone_hz, replay_m) = (random.between(-TONE_HZ, TONE_HZ), random.between(1.0, REPLAY_M));
    let offset_hz = if kind == JammerKind::Tone { tone_hz } else { 0.0 };
    Jammer {
        kind,
        offset_hz,
        delay_s: replay_m / cslam_core::constants::SPEED_OF_LIGHT_M_PER_S,
        zenith_deg,
        azimuth_deg,
        ..Jammer::tone(power_dbm)
    }
}

/// A pose against the truth: its error, m, and the standard deviation that it claims, norm, m.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Claimed {
    error_m: f64,
    sigma_m: f64,
}

impl Claimed {
    fn of(sweep: &SweepRecord) -> Option<Self> {
        let pose = sweep.estimate.pose.as_ref()?;
        let (told, truth) = (pose.position_m, sweep.truth.pose?.position_m);
        let square: f64 = told.iter().zip(truth).map(|(a, b)| (a - b) * (a - b)).sum();
        let trace: f64 = (0..3).map(|i| pose.position_covariance_m2[i][i]).sum();
        Some(Self {
            error_m: square.sqrt(),
            sigma_m: trace.max(0.0).sqrt(),
        })
    }

    /// Whether a claim is false; one that is no number is.
    fn is_false(&self) -> bool {
        let holds = self.error_m <= 3.0 * self.sigma_m;
        !holds
    }
}

/// Starts of one kind at one power, sweep by sweep.
#[derive(Clone, Debug, Default)]
struct Cell(Vec<Vec<Option<Claimed>>>);

impl Cell {
    fn row(&self) -> Vec<String> {
        let given: Vec<Claimed> = self.0.iter().flatten().copied().flatten().collect();
        let started = self.0.iter().filter(|start| start.iter().any(Option::is_some));
        let false_starts = self
            .0
            .iter()
            .filter(|start| start.iter().flatten().any(Claimed::is_false));
        let sweeps = self.0.iter().flatten().count();
        let honest = sweeps - given.iter().filter(|claimed| claimed.is_false()).count();
        let errors: Vec<f64> = given.iter().map(|claimed| claimed.error_m).collect();
        let worst = given.iter().max_by(|a, b| a.error_m.total_cmp(&b.error_m));
        let text = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
        vec![
            format!("{}/{}", started.count(), self.0.len()),
            format!("{:.0}", 100.0 * given.len() as f64 / sweeps.max(1) as f64),
            text(statistics::median(&errors)),
            text(worst.map(|worst| worst.error_m)),
            text(worst.map(|worst| worst.sigma_m)),
            format!("{:.1}", 100.0 * honest as f64 / sweeps.max(1) as f64),
            false_starts.count().to_string(),
        ]
    }
}

const COLUMNS: [&str; 8] = [
    "jammer",
    "starts with a pose",
    "sweeps with one, %",
    "error, median, m",
    "error, most, m",
    "sigma there, m",
    "within 3 sigma or none, %",
    "false starts",
];

fn start(
    scene: &Scene,
    args: &Args,
    jammer: Option<Jammer>,
    seed: u64,
) -> anyhow::Result<Vec<Option<Claimed>>> {
    let mut config = WorldConfig::of(Profile::Budget);
    config.channel.impairments.jammer = jammer;
    let world = World::new(scene, config, seed)?;
    let planned = usize::try_from(world.sweeps())?.min(args.sweeps);
    let never = AtomicBool::new(false);
    let hooks = Hooks {
        interrupted: &never,
        swept: |_: &Swept<'_>| {},
        sent: |_: u64, _: &[u8]| {},
    };
    let (log, _) = fly_world(
        &ReceiverConfig::of(Mode::Best),
        &args.scene,
        &world,
        seed,
        planned,
        hooks,
    )?;
    Ok(log.sweeps.iter().map(Claimed::of).collect())
}

pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let [first, last, step] = args.powers[..] else {
        return Err(InputError::new("--powers: expected weakest, strongest and step").into());
    };
    if args.starts == 0 || args.sweeps == 0 || step <= 0 || last < first {
        return Err(InputError::new("nothing to fly: --starts, --sweeps or --powers leave no start").into());
    }
    args.any_seed
        .check_seeds(&args.scene, args.first_seed, args.starts)?;
    let scene = Scene::load(&args.scene)?;
    let powers: Vec<i32> = (first..=last).step_by(step.unsigned_abs() as usize).collect();
    let mut cells = vec![("none".to_owned(), None)];
    for (name, kind) in KINDS {
        cells.extend(
            powers
                .iter()
                .map(|dbm| (format!("{name}, {dbm} dBm"), Some((kind, *dbm)))),
        );
    }
    let seeds = args.first_seed..args.first_seed.saturating_add(args.starts);
    let bar = progress::bar(cells.len() as u64 * args.starts, "starting");
    let flown = args.threads.install(|| {
        cells
            .par_iter()
            .map(|(_, what)| {
                let starts = seeds.clone().map(|seed| {
                    let jammer = what.map(|(kind, dbm)| jammer(kind, f64::from(dbm), seed));
                    let start = start(&scene, args, jammer, seed);
                    bar.inc(1);
                    start
                });
                Ok(Cell(starts.collect::<anyhow::Result<_>>()?))
            })
            .collect::<anyhow::Result<Vec<Cell>>>()
    })?;
    bar.finish_and_clear();
    let mut table = Table::new(COLUMNS);
    for ((name, _), cell) in cells.iter().zip(&flown) {
        table.row(core::iter::once(name.clone()).chain(cell.row()));
    }
    let all = Cell(flown.iter().skip(1).flat_map(|cell| cell.0.clone()).collect());
    table.row(core::iter::once("all with a jammer".to_owned()).chain(all.row()));
    println!("{table}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_counts_as_false_beyond_three_sigma_and_none_never_does() {
        let pose = |error_m, sigma_m| Some(Claimed { error_m, sigma_m });
        let cell = Cell(vec![
            vec![None, pose(0.3, 0.1), pose(0.31, 0.1)],
            vec![None, None, None],
            vec![None, pose(48.0, 20.0), pose(0.0, f64::NAN)],
        ]);
        assert_eq!(cell.row(), ["2/3", "44", "0.30", "48.00", "20.00", "77.8", "2"]);
    }

    #[test]
    fn a_seed_places_the_same_jammer_at_every_power() {
        let [weak, strong] = [-90.0, -30.0].map(|dbm| jammer(JammerKind::Replay, dbm, 3));
        assert_eq!(
            Jammer {
                power_dbm: -30.0,
                ..weak
            },
            strong
        );
        assert_ne!(jammer(JammerKind::Replay, -30.0, 4), strong);
    }
}
