//! `cslam reproduce maps`: the paper's outdoor and indoor maps and their errors.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use cslam_core::map::PointCloud;
use cslam_core::reflection::ReflectionPoint;
use rayon::prelude::*;
use serde::Serialize;

use super::known_pose::{Arrays, KnownPose, Perceived};
use super::map_plot;
use crate::commands::threads::Threads;
use crate::estimate::Mode;
use crate::evaluation::{Fate, MapFigures, evaluate, true_vertices_m};
use crate::flight_files::ply::{self, Column, Encoding};
use crate::flight_log::{
    FlightLog, Header, MapVoxel, MeasuredPath, PointRecord, PoseTruth, SweepEstimate, SweepRecord, SweepTruth,
};
use crate::input::InputError;
use crate::progress;
use crate::scene::Scene;
use crate::table::Table;
use crate::world::{HeardSweep, Profile, World, WorldConfig, instant};
use cslam_firmware::app::VOXELS;

/// Arguments of `cslam reproduce maps`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Scenes to fly through
    #[arg(long, value_name = "NAME", num_args = 1.., default_values_t = ["outdoor".to_owned(), "indoor".to_owned()])]
    scene: Vec<String>,
    /// Whose methods; both beside each other when absent
    #[arg(long, value_enum)]
    mode: Option<Mode>,
    /// Length of each flight, s; two sweeps per second
    #[arg(long, value_name = "S", default_value_t = 120.0)]
    duration: f64,
    /// Seed of the flights and of all errors
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    threads: Threads,
    /// Directory for the maps (.ply) and their plots (.svg), made when missing
    #[arg(long, value_name = "DIR", default_value = "out/maps")]
    out: PathBuf,
    /// Print one JSON object a map on standard output instead of the table
    #[arg(long)]
    json: bool,
}

/// The paper's "MSE of the mapping result", m, outdoors; for the indoor map none is printed.
const PRINTED_M: (&str, f64) = ("outdoor", 0.3211);
/// Sweeps in memory: 7 MB each.
const CHUNK: usize = 16;

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    args.threads.install(|| all(args))
}

#[derive(Serialize)]
struct Row<'a> {
    scene: &'a str,
    mode: &'static str,
    sweeps: usize,
    true_points: usize,
    printed_m: Option<f64>,
    #[serde(flatten)]
    map: &'a MapFigures,
    /// What became of every estimated path.
    fates: &'a [Fate],
}

fn all(args: &Args) -> anyhow::Result<()> {
    std::fs::create_dir_all(&args.out)
        .map_err(|e| InputError::unwritable(&args.out, "cannot be made", &e))?;
    let modes = args.mode.map_or_else(|| Mode::ALL.to_vec(), |mode| vec![mode]);
    let mut table = Table::new([
        "map",
        "sweeps",
        "points",
        "correct, first order",
        "point median m",
        "RMSE m",
        "surface median m",
        "RMSE m",
        "walls lit, mapped",
        "printed m",
    ]);
    for scene_name in &args.scene {
        let scene = Scene::load(scene_name)?;
        let receivers: Vec<KnownPose> = modes
            .iter()
            .map(|mode| KnownPose::new(*mode))
            .collect::<Result<_, _>>()?;
        let mut logs = fly(args, scene_name, &scene, &receivers)?;
        for (log, receiver) in logs.iter_mut().zip(&receivers) {
            let evaluation = evaluate(log, Some(&scene));
            let mode = receiver.mode.name();
            write(args, &scene, log, &format!("{scene_name}-{mode}"))?;
            let row = Row {
                scene: scene_name,
                mode,
                sweeps: log.sweeps.len(),
                true_points: true_vertices_m(log).len(),
                printed_m: (scene_name == PRINTED_M.0).then_some(PRINTED_M.1),
                map: &evaluation.map,
                fates: &evaluation.fates,
            };
            if args.json {
                writeln!(std::io::stdout(), "{}", serde_json::to_string(&row)?)?;
            } else {
                table.row(cells(&row));
            }
        }
        if let Some(log) = logs.first() {
            write_truth(args, &scene, log, scene_name)?;
        }
    }
    if !args.json {
        writeln!(
            std::io::stdout(),
            "{table}\nmaps and plots: {}",
            args.out.display()
        )?;
    }
    Ok(())
}

fn cells(row: &Row<'_>) -> Vec<String> {
    let metres = |m: Option<f64>| m.map_or_else(|| "-".into(), |m| format!("{m:.3}"));
    let map = row.map;
    vec![
        format!("{}, {}", row.scene, row.mode),
        row.sweeps.to_string(),
        map.points.to_string(),
        metres(map.precision_first_order),
        metres(map.point_median_m),
        metres(map.point_rmse_m),
        metres(map.surface_median_m),
        metres(map.surface_rmse_m),
        metres(map.completeness_0p5m),
        row.printed_m.map_or_else(|| "-".into(), |m| format!("{m:.4}")),
    ]
}

/// The flight as each receiver sees it: the same samples for all of them.
fn fly(args: &Args, name: &str, scene: &Scene, receivers: &[KnownPose]) -> anyhow::Result<Vec<FlightLog>> {
    let mut config = WorldConfig::of(Profile::Budget);
    config.flight.duration_s = args.duration;
    let world = World::new(scene, config, args.seed)?;
    let mut flights: Vec<Flight> = receivers
        .iter()
        .map(|receiver| Flight::new(args, name, &world, receiver))
        .collect();
    let numbers: Vec<u32> = (0..world.sweeps()).collect();
    let bar = progress::bar(u64::from(world.sweeps()), "sweeps");
    for some in numbers.chunks(CHUNK) {
        let heard: Vec<anyhow::Result<(HeardSweep, Vec<Perceived>)>> = some
            .par_iter()
            .map(|number| hear(&world, *number, receivers))
            .collect();
        for result in heard {
            let (heard, perceived) = result?;
            for ((flight, perceived), receiver) in flights.iter_mut().zip(&perceived).zip(receivers) {
                flight.add(&heard, perceived, receiver);
            }
        }
        bar.inc(some.len() as u64);
    }
    bar.finish_and_clear();
    Ok(flights.into_iter().map(Flight::close).collect())
}

fn hear(
    world: &World<'_>,
    number: u32,
    receivers: &[KnownPose],
) -> anyhow::Result<(HeardSweep, Vec<Perceived>)> {
    let mut heard = world.sweep(number)?;
    let at = instant(&heard.truth)?;
    let mut all = Vec::with_capacity(receivers.len());
    for receiver in receivers {
        let mut beams = heard.beams.clone();
        let mut estimator = receiver.estimator(Arrays::Budget);
        all.push(receiver.perceive(estimator.as_mut(), &mut beams, &heard.link, &at)?);
    }
    // The samples have been heard; the truth is needed on.
    heard.beams.blocks.clear();
    heard.squint.blocks.clear();
    Ok((heard, all))
}

/// Log and map of one receiver.
struct Flight {
    log: FlightLog,
    map: Box<PointCloud<VOXELS>>,
    gmt_m: Option<[f64; 3]>,
    gmt_index: u32,
}

impl Flight {
    fn new(args: &Args, scene: &str, world: &World<'_>, receiver: &KnownPose) -> Self {
        let header = Header {
            mode: receiver.mode.name().into(),
            scene: scene.into(),
            world: None,
            seed: args.seed,
            planned_sweeps: world.sweeps() as usize,
            sweep_period_s: world.flight().plan().schedule().sweep_period_s,
            delay_cycle_m: None,
        };
        let map = Box::new(PointCloud::new());
        Self {
            log: FlightLog::new(header, f64::from(map.edge_m())),
            map,
            gmt_m: None,
            gmt_index: 0,
        }
    }

    fn add(&mut self, heard: &HeardSweep, perceived: &Perceived, receiver: &KnownPose) {
        if self
            .gmt_m
            .replace(heard.link.tx)
            .is_some_and(|before| before != heard.link.tx)
        {
            self.gmt_index += 1;
        }
        let time_s = heard.truth.time_s;
        let mut paths = Vec::with_capacity(perceived.paths.len());
        for (index, received) in perceived.paths.iter().enumerate() {
            let probability = perceived.probabilities[index].map(|p| f64::from(p.first_order));
            let outcome = receiver.outcome(perceived, index);
            if let Ok(point) = &outcome {
                self.take(heard.number, index as u8, time_s, point, probability);
            }
            paths.push(MeasuredPath {
                c_tau_m: f64::from(received.path.c_tau_m),
                aoa_zenith_rad: f64::from(received.path.aoa.zenith_rad()),
                aoa_azimuth_rad: f64::from(received.path.aoa.azimuth_rad()),
                snr_db: None,
                probabilities: perceived.probabilities[index].map(|p| p.to_array().map(f64::from)),
                verdict: outcome.err().unwrap_or("ok").into(),
            });
        }
        self.log.sweeps.push(SweepRecord {
            sweep: heard.number,
            time_s,
            estimate: SweepEstimate {
                pose: None,
                gmt_position_m: Some(heard.link.tx),
                gmt_index: self.gmt_index,
                paths,
                link: None,
                los_used: false,
                innovations: Vec::new(),
            },
            // The clock is taken out and the paths are turned into world axes: nothing of the pose is left to be wrong.
            truth: SweepTruth {
                pose: Some(PoseTruth {
                    position_m: heard.link.rx,
                    quaternion_wb: [1.0, 0.0, 0.0, 0.0],
                    velocity_m_per_s: heard.truth.uav.velocity_m_per_s.into(),
                    clock_offset_s: 0.0,
                }),
                link: Some(heard.link.clone()),
                matches: Vec::new(),
            },
        });
    }

    fn take(&mut self, sweep: u32, path: u8, time_s: f64, point: &ReflectionPoint, probability: Option<f64>) {
        // What lies beyond the map's range is counted there.
        let _counted = self.map.insert(point).ok();
        self.log.points.push(PointRecord {
            sweep,
            path,
            order: 1,
            reflection: 1,
            surface: None,
            mapped_sweep: None,
            time_s,
            gmt_index: self.gmt_index,
            position_m: point.position.to_array().map(f64::from),
            covariance_trace_m2: f64::from(point.covariance.trace()),
            probability,
            snr_db: None,
        });
    }

    fn close(mut self) -> FlightLog {
        self.log.map = self.map.points().map(MapVoxel::from).collect();
        self.log
    }
}

/// The map as a point cloud and as a picture beside the true surfaces.
fn write(args: &Args, scene: &Scene, log: &FlightLog, name: &str) -> anyhow::Result<()> {
    let points: Vec<[f64; 3]> = log.map.iter().map(|voxel| voxel.position_m).collect();
    let traces = log
        .map
        .iter()
        .map(|voxel| voxel.covariance_trace_m2 as f32)
        .collect();
    let hits = log.map.iter().map(|voxel| voxel.hits as i32).collect();
    let more = [
        ("covariance_trace", Column::F32(traces)),
        ("hits", Column::I32(hits)),
    ];
    cloud(&args.out, name, &points, more)?;
    plot(&args.out, name, scene, &points)
}

/// The map that the true reflection points make.
fn write_truth(args: &Args, scene: &Scene, log: &FlightLog, scene_name: &str) -> anyhow::Result<()> {
    let name = format!("{scene_name}-truth");
    let points = true_vertices_m(log);
    cloud(&args.out, &name, &points, [])?;
    plot(&args.out, &name, scene, &points)
}

fn cloud<const N: usize>(
    out: &Path,
    name: &str,
    points: &[[f64; 3]],
    more: [(&str, Column); N],
) -> anyhow::Result<()> {
    let axis = |k: usize| Column::F32(points.iter().map(|p| p[k] as f32).collect());
    let mut columns = vec![("x", axis(0)), ("y", axis(1)), ("z", axis(2))];
    columns.extend(more);
    let file = out.join(format!("{name}.ply"));
    let written = File::create(&file).and_then(|f| {
        let mut f = BufWriter::new(f);
        ply::write(&mut f, Encoding::Ascii, name, &columns)?;
        f.flush()
    });
    written.with_context(|| format!("{} cannot be written", file.display()))
}

fn plot(out: &Path, name: &str, scene: &Scene, points: &[[f64; 3]]) -> anyhow::Result<()> {
    let file = out.join(format!("{name}.svg"));
    std::fs::write(&file, map_plot::svg(name, scene, points)?)
        .with_context(|| format!("{} cannot be written", file.display()))
}
