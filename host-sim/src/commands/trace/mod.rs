//! `cslam trace`: propagation paths of every transmitter with every receiver.

mod check;
mod points;
mod route;

use std::fs::File;
use std::io::{BufWriter, IsTerminal, Write};
use std::path::PathBuf;

use serde::Serialize;

use self::check::{check, check_diffraction};
use self::points::{point, points};
use crate::commands::threads::Threads;
use crate::input::InputError;
use crate::paths::{Link, LinkPath};
use crate::progress;
use crate::scene::{Lobe, Placement, Scene, Unevenness};
use crate::tracer::{
    DEFAULT_MAX_ORDER, Diffraction, Diffuse, ImageTree, LEAST_DISTANCE_M, MAX_ORDER, Propagation, TracedPath,
    Tracer, for_each_link,
};
use crate::world::SceneConfig;

/// Least path gain that can be asked for, dB.
const LEAST_GAIN_DB: f64 = -300.0;

/// Arguments of `cslam trace`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Scene: outdoor, indoor, street, outdoor_a, city:SEED, indoor:SEED, or a file (.json, .obj, .ply)
    #[arg(long, value_name = "NAME|FILE")]
    scene: String,
    /// Transmitters: one point, or a file with x,y,z a line (m)
    #[arg(
        long,
        value_name = "FILE|X,Y,Z",
        allow_hyphen_values = true,
        required_unless_present_any = ["check", "flight"]
    )]
    tx: Option<String>,
    /// Receivers: one point, or a file with x,y,z a line (m)
    #[arg(
        long,
        value_name = "FILE|X,Y,Z",
        allow_hyphen_values = true,
        required_unless_present_any = ["check", "flight"]
    )]
    rx: Option<String>,
    /// Trace the links of a whole flight instead, one for each sweep, with time and attitude: the flight of this seed, as `cslam fly
    /// --scene` plans it. `cslam fly --channel` flies along them, or along those of another ray tracer at the same places
    #[arg(long, value_name = "SEED", conflicts_with_all = ["tx", "rx", "check", "vertices"])]
    flight: Option<u64>,
    /// Length of that flight, s [default: 120]
    #[arg(long, value_name = "S", requires = "flight")]
    duration: Option<f64>,
    /// Greatest number of reflections, 0 for line of sight alone
    #[arg(long, value_name = "N", default_value_t = DEFAULT_MAX_ORDER as u8,
          value_parser = clap::value_parser!(u8).range(0..=MAX_ORDER as i64))]
    max_order: u8,
    #[command(flatten)]
    propagation: PropagationArgs,
    #[command(flatten)]
    scene_as: SceneArgs,
    #[command(flatten)]
    threads: Threads,
    /// Write the links to a file instead of standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Give every path all its interaction points and the indices of the reflecting faces as well
    #[arg(long)]
    vertices: bool,
    /// Trace the links of a reference list and compare instead; ends with code 1 when they disagree
    #[arg(long, value_name = "PATHS", conflicts_with_all = ["tx", "rx", "out", "vertices"])]
    check: Option<PathBuf>,
    /// Print the comparison of --check as JSON. Links are JSON lines in any case
    #[arg(long)]
    json: bool,
}

/// What is followed beyond specular reflection.
#[derive(clap::Args, Debug)]
struct PropagationArgs {
    /// Diffraction at edges too: alone (D), reflected before (RD) or behind the edge (DR). Every path then says its kind
    #[arg(long)]
    diffraction: bool,
    /// Drop diffracted paths weaker than this path gain (dB)
    #[arg(long, value_name = "DB", default_value_t = Diffraction::default().least_gain_db, allow_hyphen_values = true,
          value_parser = gain_db, requires = "diffraction")]
    least_gain: f64,
    /// Keep the N strongest diffracted paths of a link
    #[arg(long, value_name = "N", default_value_t = Diffraction::default().most_paths, requires = "diffraction")]
    most_diffracted: usize,
    /// Let the rims of open faces diffract too, as screens
    #[arg(long, requires = "diffraction")]
    rims: bool,
    /// Let the grain of rough materials weaken their reflections
    #[arg(long)]
    roughness: bool,
    /// Diffuse scattering off faces too (kind S), as tiles of fixed phase; reflections lose what is scattered
    #[arg(long)]
    diffuse: bool,
    /// Seed of the tiles' phases
    #[arg(long, value_name = "N", default_value_t = Diffuse::default().seed, requires = "diffuse")]
    diffuse_seed: u64,
    /// Scattering coefficient S of materials that have none of their own, 0 to 1
    #[arg(long, value_name = "S", default_value_t = Diffuse::default().lobe.coefficient, requires = "diffuse",
          value_parser = coefficient)]
    scattering: f64,
    /// Exponent of their lobe about the mirrored direction
    #[arg(long, value_name = "N", default_value_t = Diffuse::default().lobe.exponent, requires = "diffuse",
          value_parser = clap::value_parser!(u32).range(1..=100))]
    lobe: u32,
    /// Side of the tiles, m, 0.1 to 10: shadows are followed to a quarter of it
    #[arg(long, value_name = "M", default_value_t = Diffuse::default().tile_m, requires = "diffuse", value_parser = tile)]
    tile: f64,
    /// Keep N scattered paths of a link: the strongest tiles, the rest gathered
    #[arg(long, value_name = "N", default_value_t = Diffuse::default().most_paths, requires = "diffuse")]
    most_scattered: usize,
    /// Tell the horizontal component of reflected waves too (`cross_gain`)
    #[arg(long)]
    cross_polarisation: bool,
}

impl PropagationArgs {
    fn propagation(&self) -> Propagation {
        Propagation {
            diffraction: self.diffraction.then_some(Diffraction {
                least_gain_db: self.least_gain,
                most_paths: self.most_diffracted,
                rims: self.rims,
            }),
            roughness: self.roughness,
            diffuse: self.diffuse.then_some(Diffuse {
                seed: self.diffuse_seed,
                lobe: Lobe {
                    coefficient: self.scattering,
                    exponent: self.lobe,
                },
                tile_m: self.tile,
                most_paths: self.most_scattered,
                ..Diffuse::default()
            }),
            cross_polarisation: self.cross_polarisation,
        }
    }
}

/// What becomes of the scene first.
#[derive(clap::Args, Debug)]
struct SceneArgs {
    /// Let the ground outdoors have a relief of this rms (m), with a correlation length of 12 m
    #[arg(long, value_name = "M", default_value_t = 0.0, allow_hyphen_values = true)]
    relief: f64,
    /// Let walls outdoors be panels of 3 x 3 m, each a little off the wall's plane, some of them windows
    #[arg(long)]
    panels: bool,
    /// Seed of relief and panels
    #[arg(long, value_name = "N", default_value_t = Unevenness::default().surface_seed)]
    surface_seed: u64,
    /// Move the scene as a whole (m); --tx and --rx are places in the world
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = moved, default_value = "0,0,0")]
    moved: Moved,
    /// Turn the scene about the vertical through its origin before it is moved, counter-clockwise from above (deg)
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    turned: f64,
}

/// Where a scene is moved.
type Moved = [f64; 3];

fn moved(text: &str) -> Result<Moved, String> {
    point(text).ok_or_else(|| "expected x,y,z in metres".to_owned())
}

impl SceneArgs {
    /// The scene as the options say.
    fn applied(&self, scene: Scene) -> Result<Scene, InputError> {
        let told = SceneConfig {
            placement: Placement {
                moved_m: self.moved,
                turned_deg: self.turned,
            },
            surfaces: Unevenness {
                surface_seed: self.surface_seed,
                ground_relief_rms_m: self.relief,
                panels: self.panels,
                ..Unevenness::default()
            },
        };
        told.check()?;
        told.applied(scene)
    }
}

/// A scattering coefficient.
fn coefficient(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|coefficient| (0.0..=1.0).contains(coefficient))
        .ok_or_else(|| "expected a scattering coefficient from 0 to 1".to_owned())
}

/// Side of a tile, m.
fn tile(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|tile_m| (0.1..=10.0).contains(tile_m))
        .ok_or_else(|| "expected a side from 0.1 to 10 m".to_owned())
}

/// A path gain in dB.
fn gain_db(text: &str) -> Result<f64, String> {
    let range = LEAST_GAIN_DB..=0.0;
    text.parse()
        .ok()
        .filter(|gain_db| range.contains(gain_db))
        .ok_or_else(|| format!("expected a path gain from {LEAST_GAIN_DB} to 0 dB"))
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let scene = args.scene_as.applied(Scene::load(&args.scene)?)?;
    let mut propagation = args.propagation.propagation();
    if let (Some(diffraction), Some(_)) = (&mut propagation.diffraction, &args.check) {
        diffraction.most_paths = usize::MAX;
    }
    let tracer = Tracer::with(&scene, usize::from(args.max_order), propagation)
        .ok_or_else(|| InputError::new(format!("--max-order: expected 0 to {MAX_ORDER}")))?;
    args.threads.install(|| match &args.check {
        Some(reference) if args.propagation.diffraction => check_diffraction(&tracer, reference, args.json),
        Some(reference) => check(&tracer, reference, args.json),
        None => match args.flight {
            Some(seed) => route::trace(&tracer, args, seed),
            None => trace(&tracer, args),
        },
    })
}

/// Where links go.
fn output(args: &Args) -> anyhow::Result<BufWriter<Box<dyn Write + Send>>> {
    let out: Box<dyn Write + Send> = match &args.out {
        Some(file) => {
            let created = File::create(file);
            Box::new(created.map_err(|e| InputError::unwritable(file, "cannot be written", &e))?)
        }
        None => Box::new(std::io::stdout()),
    };
    Ok(BufWriter::new(out))
}

fn trace(tracer: &Tracer<'_>, args: &Args) -> anyhow::Result<()> {
    let transmitters = points("--tx", args.tx.as_deref())?;
    let receivers = points("--rx", args.rx.as_deref())?;
    for (what, points) in [("transmitters", &transmitters), ("receivers", &receivers)] {
        let inside = points.iter().filter(|p| tracer.scene().inside_solid(**p)).count();
        if inside > 0 {
            eprintln!(
                "cslam: note: {inside} of {} {what} lie inside a solid",
                points.len()
            );
        }
    }
    let mut out = output(args)?;
    // Links that scroll by on the terminal show the progress themselves.
    let bar = if args.out.is_none() && std::io::stdout().is_terminal() {
        indicatif::ProgressBar::hidden()
    } else {
        progress::bar((transmitters.len() * receivers.len()) as u64, "trace")
    };
    let line = |tree: &ImageTree<'_>, rx_m: [f64; 3], paths: Vec<TracedPath>| -> anyhow::Result<String> {
        let tx_m = tree.transmitter_m();
        if (0..3).map(|i| (tx_m[i] - rx_m[i]).powi(2)).sum::<f64>() < LEAST_DISTANCE_M * LEAST_DISTANCE_M {
            let place = rx_m.map(|c| c.to_string()).join(",");
            return Err(InputError::new(format!(
                "transmitter and receiver both stand at {place}: expected at least {LEAST_DISTANCE_M} m between them"
            ))
            .into());
        }
        Ok(if args.vertices {
            serde_json::to_string(&Detailed::new(tree.to_link(rx_m, &paths), &paths))?
        } else {
            serde_json::to_string(&tree.to_link(rx_m, &paths))?
        })
    };
    for_each_link(
        tracer,
        &transmitters,
        &receivers,
        line,
        |line| -> anyhow::Result<()> {
            writeln!(out, "{}", line?)?;
            bar.inc(1);
            Ok(())
        },
    )?;
    out.flush()?;
    bar.finish_and_clear();
    Ok(())
}

/// A link with everything that the tracer knows. Reads back as a link of the paths format.
#[derive(Serialize)]
struct Detailed<'a> {
    tx: [f64; 3],
    rx: [f64; 3],
    paths: Vec<DetailedPath<'a>>,
}

#[derive(Serialize)]
struct DetailedPath<'a> {
    #[serde(flatten)]
    path: LinkPath,
    faces: &'a [u32],
    vertices: &'a [[f64; 3]],
}

impl<'a> Detailed<'a> {
    fn new(link: Link, paths: &'a [TracedPath]) -> Self {
        let detailed = |(path, traced): (LinkPath, &'a TracedPath)| DetailedPath {
            path,
            faces: traced.faces(),
            vertices: traced.vertices(),
        };
        Self {
            tx: link.tx,
            rx: link.rx,
            paths: link.paths.into_iter().zip(paths).map(detailed).collect(),
        }
    }
}
