//! A flight from raw samples: a world or a recording plays, the receiver that flies listens.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use cslam_core::estimator::Watch;
use cslam_core::paths::{Estimator, EstimatorConfig, PaperEstimator, PathEstimator, TapDelays};
use cslam_core::profile::quad_4x8_gmt_72::{CHANNELS, Radio};
use cslam_core::radio::RadioConfig;
use cslam_core::receiver::{Config as CoreConfig, Localization, Memory, PATHS, Receiver};

use cslam_firmware::app::{AppConfig, Application, Map, VOXELS};
use cslam_firmware::front_end::{FrontEnd, SoftwareCrc};
use cslam_firmware::sensor_stream::SESSION;

use super::{Args, Flown, keep, methods};
use crate::config::{Config, EarthField, ReceiverConfig};
use crate::flight_log::{FlightLog, Header};
use crate::input::InputError;
use crate::raw_flight::{self, BOARD_STATES, Source, Swept};
use crate::recording::Keeper;
use crate::scene::Scene;
use crate::smoother::{Flier, fly_smoothed};
use crate::world::{GivenLinks, World};
use crate::{estimate, progress};

/// Flies through a scene until `interrupted`. `sent` gets what goes to the ground as it goes, with the UAV's time, ns.
pub(super) fn run(
    args: &Args,
    config: &Config,
    name: &str,
    interrupted: &AtomicBool,
    sent: impl FnMut(u64, &[u8]),
) -> anyhow::Result<Flown> {
    let scene = config.scene(name)?;
    args.refuse_no_steps()?;
    let out = super::result_directory(args)?;
    let world = config.world_in(&scene, args.seed)?;
    let kept = args
        .keep_paths
        .as_deref()
        .map(|kept| keep::open(kept, &world))
        .transpose()?;
    let planned = args.planned(world.sweeps())?;
    let bar = progress::bar(planned as u64, "flying");
    let keeper = Keeper::new(&world);
    let swept = |swept: &Swept<'_>| {
        keeper.swept(swept);
        bar.inc(1);
    };
    let (header, site) = described(&config.receiver, name, &world, args.seed, planned)?;
    let hooks = Hooks {
        interrupted,
        swept,
        sent,
    };
    let logs = fly(&config.receiver, header, &site, &keeper, args.smooth, hooks)?;
    bar.finish_and_clear();
    if let Some(kept) = kept {
        if logs.log.interrupted() {
            progress::note("interrupted: no paths were kept");
        } else {
            let paths = keeper.write(kept.path())?;
            keep::write(kept, paths, config, name, &world)?;
        }
    }
    let imu = args.imu(&world, &logs.log);
    Ok(Flown {
        logs,
        scene: Some(scene),
        imu,
        out,
    })
}

/// Flies along given links until `interrupted`. `sent` gets what goes to the ground as it goes, with the UAV's time, ns.
pub(super) fn along(
    args: &Args,
    config: &Config,
    file: &Path,
    interrupted: &AtomicBool,
    sent: impl FnMut(u64, &[u8]),
) -> anyhow::Result<Flown> {
    args.refuse_no_steps()?;
    // The scene is there to compare with; the world has none.
    let scene = args.scene.as_deref().map(Scene::load).transpose()?;
    let links = GivenLinks::read(file)?;
    let out = super::result_directory(args)?;
    let world = config.world_along(links, args.seed)?;
    let planned = args.planned(world.sweeps())?;
    let bar = progress::bar(planned as u64, "flying");
    let name = file.display().to_string();
    let (header, site) = described(&config.receiver, &name, &world, args.seed, planned)?;
    let hooks = Hooks {
        interrupted,
        swept: |_: &Swept<'_>| bar.inc(1),
        sent,
    };
    let logs = fly(&config.receiver, header, &site, &world, args.smooth, hooks)?;
    bar.finish_and_clear();
    let imu = args.imu(&world, &logs.log);
    Ok(Flown {
        logs,
        scene,
        imu,
        out,
    })
}

/// What whoever prepares a flight knows of the place and of the radio. What the receiver's configuration says of the place comes first.
pub(crate) struct Site {
    /// The radio that is heard.
    pub(crate) radio: RadioConfig,
    /// The earth's field; without it the magnetometer is not used.
    pub(crate) magnetic_field: Option<EarthField>,
    /// Where the GMT's antenna was set up, m, world frame; without it nobody asks.
    pub(crate) gmt_m: Option<[f64; 3]>,
    /// Height of the ground, m, world frame.
    pub(crate) ground_z_m: f64,
}

/// Who is asked and told while a flight goes on.
pub(crate) struct Hooks<'i, W, S> {
    /// Ends the flight when it is set.
    pub(crate) interrupted: &'i AtomicBool,
    /// Sees each sweep that has ended.
    pub(crate) swept: W,
    /// Gets what goes to the ground as it goes, with the UAV's time, ns.
    pub(crate) sent: S,
}

/// Flies a receiver through a world for `planned` sweeps at most: the log and every byte that went to the ground.
pub(crate) fn fly_world(
    told: &ReceiverConfig,
    scene: &str,
    world: &World<'_>,
    seed: u64,
    planned: usize,
    hooks: Hooks<'_, impl FnMut(&Swept<'_>), impl FnMut(u64, &[u8])>,
) -> anyhow::Result<(FlightLog, Vec<u8>)> {
    let (header, site) = described(told, scene, world, seed, planned)?;
    let logs = fly(told, header, &site, world, false, hooks)?;
    Ok((logs.log, logs.packets))
}

/// The head of the log of a flight through a world, and what is known of the place.
///
/// # Errors
/// [`InputError`] for a world whose radio has other counts than the receiver's type.
pub(crate) fn described(
    told: &ReceiverConfig,
    scene: &str,
    world: &World<'_>,
    seed: u64,
    planned: usize,
) -> Result<(Header, Site), InputError> {
    let radio = world.radio().description().ok_or_else(|| {
        InputError::new(
            "the world's radio has other beams or squint symbols than the receiver: expected the same",
        )
    })?;
    let header = Header {
        mode: told.mode.name().into(),
        scene: scene.to_owned(),
        world: Some(world.profile().name().to_owned()),
        seed,
        planned_sweeps: planned,
        sweep_period_s: world.flight().plan().schedule().sweep_period_s,
        delay_cycle_m: Some(world.radio().waveform().delay_period().length_m()),
    };
    let site = Site {
        radio,
        magnetic_field: Some(EarthField::from(&world.flight().config().magnetometer)),
        // Whoever sets up a simulated GMT knows where.
        gmt_m: Some(world.flight().sweep_truth(0).gmt_position_m.into()),
        ground_z_m: world.ground_z_m(),
    };
    Ok((header, site))
}

/// A flight as it was on board, and what was made of it afterwards.
pub(crate) struct Logs {
    pub(crate) log: FlightLog,
    /// Every byte that went to the ground.
    pub(crate) packets: Vec<u8>,
    /// The same flight smoothed, where that was asked for.
    pub(crate) smoothed: Option<FlightLog>,
}

/// Flies a receiver through what `source` gives, and smooths the flight when `smooth` says so.
pub(crate) fn fly(
    told: &ReceiverConfig,
    header: Header,
    site: &Site,
    source: &impl Source,
    smooth: bool,
    hooks: Hooks<'_, impl FnMut(&Swept<'_>), impl FnMut(u64, &[u8])>,
) -> anyhow::Result<Logs> {
    let field = told.magnetic_field.or(site.magnetic_field);
    let ground_z_m = told.ground_z_m.unwrap_or(site.ground_z_m);
    let mut receiver = CoreConfig {
        radio: site.radio,
        magnetic_field: field.map(|field| field.config()),
        residuals: told.residuals.config(),
        association: told.association.config(),
        surfaces: told.surfaces.config(),
        ..methods::methods(told, told.gmt_setup.or_at(site.gmt_m))?
    };
    if let Some(height_m) = &mut receiver.accept.point.ground_z_m {
        *height_m = ground_z_m as f32;
    }
    if smooth && !matches!(receiver.localization, Localization::Filter(_)) {
        return Err(
            InputError::new("--smooth: expected a receiver with the filter (--localization filter)").into(),
        );
    }
    let estimation = EstimatorConfig::of(&receiver.radio);
    let paper = |delays| PaperEstimator::<4, 8, 32, 72, 9>::new(&estimation).with_delays(delays);
    let estimator = match methods::estimator(told) {
        estimate::Mode::Best => None,
        estimate::Mode::Paper => Some(paper(TapDelays::Whole)),
        estimate::Mode::PaperInterpolated => Some(paper(TapDelays::Interpolated)),
    };
    match estimator {
        Some(estimator) => fly_with(receiver, estimator, source, header, smooth, hooks),
        None => {
            let estimator = Estimator::<4, 8, 32, 72, 3, 8, 8, 360, 9>::new(&estimation);
            fly_with(receiver, estimator, source, header, smooth, hooks)
        }
    }
}

fn fly_with<E: PathEstimator<CHANNELS, PATHS>>(
    config: CoreConfig<'_>,
    estimator: E,
    source: &impl Source,
    header: Header,
    smooth: bool,
    hooks: Hooks<'_, impl FnMut(&Swept<'_>), impl FnMut(u64, &[u8])>,
) -> anyhow::Result<Logs> {
    let mut estimator = Box::new(estimator);
    if !smooth {
        let (log, packets) = once(&config, &mut *estimator, None, source, header, hooks)?;
        return Ok(Logs {
            log,
            packets,
            smoothed: None,
        });
    }
    let mut on_board = OnBoard {
        config: &config,
        estimator: &mut *estimator,
        header,
        interrupted: hooks.interrupted,
        hooks: Some(hooks),
        packets: Vec::new(),
    };
    let [log, smoothed] = fly_smoothed(source, &config, &mut on_board)?;
    Ok(Logs {
        log,
        packets: on_board.packets,
        smoothed: Some(smoothed),
    })
}

/// Flies for a smoother. Whoever looks on sees the first flight alone.
struct OnBoard<'a, 'c, E, W, S> {
    config: &'a CoreConfig<'c>,
    estimator: &'a mut E,
    header: Header,
    interrupted: &'a AtomicBool,
    /// Of the first flight, until it has begun.
    hooks: Option<Hooks<'a, W, S>>,
    /// What went to the ground in the first flight.
    packets: Vec<u8>,
}

impl<E: PathEstimator<CHANNELS, PATHS>, W: FnMut(&Swept<'_>), S: FnMut(u64, &[u8])> Flier<BOARD_STATES>
    for OnBoard<'_, '_, E, W, S>
{
    fn fly(
        &mut self,
        source: &impl Source,
        listener: Arc<dyn Watch<f32, BOARD_STATES>>,
        mut swept: impl FnMut(&Swept<'_>),
    ) -> anyhow::Result<FlightLog> {
        let (listener, header) = (Some(listener), self.header.clone());
        let Some(mut first) = self.hooks.take() else {
            let hooks = Hooks {
                interrupted: self.interrupted,
                swept,
                sent: |_: u64, _: &[u8]| (),
            };
            let (log, _) = once(self.config, self.estimator, listener, source, header, hooks)?;
            return Ok(log);
        };
        let hooks = Hooks {
            interrupted: self.interrupted,
            swept: |ended: &Swept<'_>| {
                swept(ended);
                (first.swept)(ended);
            },
            sent: first.sent,
        };
        let (log, packets) = once(self.config, self.estimator, listener, source, header, hooks)?;
        self.packets = packets;
        Ok(log)
    }
}

/// One flight of a receiver that begins anew, and every byte that went to the ground; `listener` hears each step of its filter.
fn once<E: PathEstimator<CHANNELS, PATHS>>(
    config: &CoreConfig<'_>,
    estimator: &mut E,
    listener: Option<Arc<dyn Watch<f32, BOARD_STATES>>>,
    source: &impl Source,
    header: Header,
    hooks: Hooks<'_, impl FnMut(&Swept<'_>), impl FnMut(u64, &[u8])>,
) -> anyhow::Result<(FlightLog, Vec<u8>)> {
    let mut squint = Box::new(config.beam_squint::<Radio<E>>()?);
    let mut map = Box::new(Map::new());
    let memory = Memory {
        estimator,
        squint: &mut *squint,
        map: &mut map,
    };
    let cslam: Receiver<'_, Radio<E>, VOXELS> = Receiver::new(config.clone(), memory);
    let mut receiver = Application::new(
        AppConfig::default(),
        FrontEnd::new(SoftwareCrc, SESSION),
        raw_flight::ground(),
        cslam,
    );
    if let Some(listener) = listener {
        receiver.watch(listener);
    }
    Ok(raw_flight::fly(
        source,
        &mut receiver,
        header,
        hooks.interrupted,
        hooks.swept,
        hooks.sent,
    )?)
}
