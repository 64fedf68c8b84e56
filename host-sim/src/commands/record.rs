//! `cslam record`: a flight on disk, everything the receiver is given and the truth beside it.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use clap::ValueEnum;
use rayon::prelude::*;

use super::DEFAULT_SCENE;
use crate::config::{Config, RadioFigures};
use crate::input::InputError;
use crate::interrupt;
use crate::paths::Link;
use crate::progress;
use crate::recording::{self, Manifest};
use crate::result_directory::ResultDirectory;
use crate::scene::Scene;
use crate::sigmf::{self, Codebook, Recording};
use crate::world::{GivenLinks, HeardSweep, Profile, SceneConfig, World};

/// Arguments of `cslam record`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Scene: outdoor (the default), indoor, street, outdoor_a, city:SEED, indoor:SEED, or a file (.json, .obj, .ply). With --channel: the
    /// scene that the recording names, to compare a map with
    #[arg(long, value_name = "NAME|FILE")]
    scene: Option<String>,
    /// Record a flight along links that a ray tracer of yours found, as `cslam fly --channel` flies it: a path list (.jsonl or .jsonl.gz), line by
    /// line the links of consecutive sweeps
    #[arg(long, value_name = "FILE", conflicts_with = "duration")]
    channel: Option<PathBuf>,
    /// Configuration file (TOML), of which [world], and what [receiver] says of the place, count; `cslam config` shows what it may
    /// hold
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The simulated world [default: the configuration's, real]
    #[arg(long, value_enum)]
    world: Option<Profile>,
    /// Print the configuration with what the options changed as TOML and end
    #[arg(long)]
    print_config: bool,
    /// Seed of the flight and of every error
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Record at most this many sweeps
    #[arg(long, value_name = "N")]
    steps: Option<u32>,
    /// Length of the flight, s; instead of the configuration's
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Leave out the sample blocks: 8.5 MB for each sweep
    #[arg(long)]
    no_samples: bool,
    /// Directory for the recording, made when missing. It holds one recording: an older one in it is replaced whole when the
    /// new one is there; a directory with anything else in it is refused, and nothing in it is touched
    #[arg(long, value_name = "DIR", default_value = "recording")]
    out: PathBuf,
    /// Print the description of the recording as one JSON object on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let mut config = Config::read(args.config.as_deref(), args.world)?;
    if let Some(duration_s) = args.duration {
        config.world.flight.duration_s = duration_s;
    }
    if args.print_config {
        print!("{}", toml::to_string(&config)?);
        return Ok(());
    }
    let manifest = record(args, &config, &interrupt::flag())?;
    if args.json {
        println!("{}", serde_json::to_string(&manifest)?);
    }
    Ok(())
}

/// Records a flight with nothing but these said, until `interrupted`.
pub(crate) fn flight(
    scene: Option<&str>,
    channel: Option<&Path>,
    world: Option<&str>,
    seed: u64,
    sweeps: Option<u32>,
    out: &Path,
    interrupted: &AtomicBool,
) -> anyhow::Result<Manifest> {
    let profile = world.map_or(Ok(Profile::default()), |world| {
        Profile::from_str(world, false).map_err(|_| {
            let names = Profile::value_variants().iter().map(|known| known.name());
            let names = names.collect::<Vec<_>>().join(", ");
            InputError::new(format!("world: got \"{world}\", expected one of {names}"))
        })
    })?;
    let args = Args {
        scene: scene.map(str::to_owned),
        channel: channel.map(Path::to_owned),
        config: None,
        world: Some(profile),
        print_config: false,
        seed,
        steps: sweeps,
        duration: None,
        no_samples: false,
        out: out.to_owned(),
        json: false,
    };
    record(&args, &Config::of(profile), interrupted)
}

fn record(args: &Args, config: &Config, interrupted: &AtomicBool) -> anyhow::Result<Manifest> {
    if args.steps == Some(0) {
        return Err(InputError::new("nothing to record: --steps is 0").into());
    }
    if let Some(file) = &args.channel {
        // The scene is there to compare with; the world has none.
        args.scene.as_deref().map(Scene::load).transpose()?;
        let world = config.world_along(GivenLinks::read(file)?, args.seed)?;
        let name = args.scene.as_deref();
        return record_world(args, config, (name, SceneConfig::default()), &world, interrupted);
    }
    let name = args.scene.as_deref().unwrap_or(DEFAULT_SCENE);
    let scene = config.scene(name)?;
    let world = config.world_in(&scene, args.seed)?;
    record_world(
        args,
        config,
        (Some(name), config.world.scene),
        &world,
        interrupted,
    )
}

/// Records a flight through a world, and names the scene to compare with and what became of it.
fn record_world(
    args: &Args,
    config: &Config,
    scene: (Option<&str>, SceneConfig),
    world: &World<'_>,
    interrupted: &AtomicBool,
) -> anyhow::Result<Manifest> {
    let sweeps = world.sweeps().min(args.steps.unwrap_or(u32::MAX));
    let manifest = Manifest {
        samples: !args.no_samples,
        pilots: !args.no_samples,
        ..manifest(config, scene, world, sweeps)
    };
    let manifest = write(world, sweeps, manifest, &args.out, interrupted)?;
    let of = args.channel.as_deref().map(|file| file.display().to_string());
    progress::note(format_args!(
        "recorded {sweeps} sweeps of {} to {}",
        of.as_deref().or(scene.0).unwrap_or_default(),
        args.out.display()
    ));
    Ok(manifest)
}

/// What a recording of the first `sweeps` sweeps of a world says about itself, without samples. The scene is that to compare with, and what
/// became of it first.
pub(crate) fn manifest(
    config: &Config,
    (scene, scene_as): (Option<&str>, SceneConfig),
    world: &World<'_>,
    sweeps: u32,
) -> Manifest {
    let profile = Some(world.profile().name().to_owned());
    let manifest = Manifest::of(scene, profile, world.flight(), sweeps);
    let setup = &config.receiver;
    Manifest {
        radio: config.radio.unless_default(),
        scene_as: Some(scene_as).filter(|told| *told != SceneConfig::default()),
        gmt_setup_position_m: setup.gmt_setup.position_m.or(manifest.gmt_setup_position_m),
        magnetic_field: setup.magnetic_field.or(manifest.magnetic_field),
        ground_z_m: Some(setup.ground_z_m.unwrap_or(world.ground_z_m())).filter(|z_m| *z_m != 0.0),
        ..manifest
    }
}

fn write(
    world: &World<'_>,
    sweeps: u32,
    manifest: Manifest,
    out: &Path,
    interrupted: &AtomicBool,
) -> anyhow::Result<Manifest> {
    let out = ResultDirectory::open(out, recording::KIND)?;
    if manifest.samples {
        let bar = progress::bar(u64::from(sweeps), "recording");
        // Sweeps do not depend on each other. Their links come back in order whatever the threads do.
        let links: Vec<Link> = (0..sweeps)
            .into_par_iter()
            .map(|sweep| {
                if interrupted.load(Ordering::Relaxed) {
                    anyhow::bail!("interrupted, nothing was recorded");
                }
                let heard = world.sweep(sweep)?;
                write_samples(out.path(), sweep, &heard, manifest.radio)?;
                bar.inc(1);
                Ok(heard.link)
            })
            .collect::<anyhow::Result<_>>()?;
        bar.finish_and_clear();
        recording::write_links(out.path(), &links)?;
    }
    let manifest = recording::write(out.path(), manifest, world.flight(), sweeps)?;
    out.commit()?;
    Ok(manifest)
}

/// The blocks of a sweep, of its pilots and of the beam squint symbols after it. Where the UAV was is the truth's to say, and where the
/// GMT was the beacon's: neither belongs to the samples.
fn write_samples(
    directory: &Path,
    sweep: u32,
    heard: &HeardSweep,
    radio: Option<RadioFigures>,
) -> Result<(), InputError> {
    let recording = |codebook, sweep: &crate::channel::Sweep| Recording {
        codebook,
        radio,
        gmt_position_m: None,
        uav_position_m: None,
        uav_quaternion_wb: None,
        blocks: sweep.blocks.clone(),
    };
    let beams = recording(Codebook::Beams, &heard.beams);
    sigmf::write(&recording::sweep_base(directory, sweep), &beams)?;
    let pilots = recording(Codebook::Pilots, &heard.pilots);
    sigmf::write(&recording::pilots_base(directory, sweep), &pilots)?;
    let squint = recording(Codebook::SquintSequential, &heard.squint);
    sigmf::write(&recording::squint_base(directory, sweep), &squint)
}
