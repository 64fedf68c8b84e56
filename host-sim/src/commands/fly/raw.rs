//! A flight from raw samples: the world plays, the receiver that flies listens.

use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use cslam_core::cslam::{
    CHANNELS, Config as Receiver, Cslam, Departures, HpcConfig, LinkStates, Localization, Mapped, Memory,
    PATHS, Rules,
};
use cslam_core::localization::filter::FilterConfig;
use cslam_core::localization::hpc;
use cslam_core::localization::imu::MagneticField;
use cslam_core::lscn::{Classifier, PaperClassifier, models};
use cslam_core::ltd::{Estimator, EstimatorConfig, PaperEstimator, PathEstimator, TapDelays};

use cslam_firmware::app::{AppConfig, Application, Map, VOXELS};
use cslam_firmware::front_end::{FrontEnd, SoftwareCrc};
use cslam_firmware::sensor_stream::SESSION;

use super::{Args, Config, Flown, Mode};
use crate::estimate;
use crate::flight_log::{FlightLog, Header};
use crate::input::InputError;
use crate::progress;
use crate::raw_flight;
use crate::scene::Scene;
use crate::world::World;

/// Heading of the options below in the help text.
const STAGES: &str = "One stage away from the mode (flights from raw samples)";

/// One stage at a time away from the mode: ablations.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
pub(crate) struct Stages {
    /// Path estimation, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    pub(crate) estimator: Option<estimate::Mode>,
    /// Link state, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    pub(crate) link_state: Option<LinkStateChoice>,
    /// Localization, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    pub(crate) localization: Option<LocalizationChoice>,
    /// Direction of departure of the line of sight, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    pub(crate) departures: Option<DepartureChoice>,
    /// Paths that may become points, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    pub(crate) mapped: Option<MappedChoice>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LinkStateChoice {
    /// Geometric networks, every path
    Geometric,
    /// The paper's network, the strongest path
    Paper,
    /// Rules of geometry, every path
    Rules,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LocalizationChoice {
    /// Error-state filter
    Filter,
    /// The same without the growth of paths from sweep to sweep
    FilterNoDeltaRanges,
    /// The paper's periodic calibration, velocity from the fixes, gated by the paper's network
    Hpc,
    /// The same to the letter, velocity running free
    HpcLiteral,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DepartureChoice {
    /// Beam squint, maximum likelihood
    Fit,
    /// Beam squint, parabola
    Parabola,
    /// Beam squint, strongest subcarrier
    Pick,
    /// The sweep's beams
    Beams,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MappedChoice {
    /// Every path, of several reflections where known mirrors explain it
    Every,
    /// Paths of one reflection
    FirstOrder,
    /// The strongest path
    Strongest,
}

/// Methods of a flight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setup {
    /// Whose.
    pub(crate) mode: Mode,
    /// Stages that differ.
    pub(crate) stages: Stages,
}

/// Flies through a scene until `interrupted`. `sent` gets what goes to the ground as it goes, with the UAV's time, ns.
pub(super) fn run(
    args: &Args,
    config: &Config,
    name: &str,
    interrupted: &AtomicBool,
    sent: impl FnMut(u64, &[u8]),
) -> anyhow::Result<Flown> {
    let scene = Scene::load(name)?;
    if args.steps == Some(0) {
        return Err(InputError::new("nothing to fly: --steps is 0").into());
    }
    let out = super::result_directory(args)?;
    let world = World::new(&scene, config.world.clone(), args.seed)?;
    let setup = Setup {
        mode: args.mode,
        stages: args.stages,
    };
    let planned = usize::try_from(world.sweeps())?.min(args.steps.unwrap_or(usize::MAX));
    let bar = progress::bar(planned as u64, "flying");
    let swept = || bar.inc(1);
    let (log, packets) = fly(&setup, name, &world, args.seed, planned, interrupted, swept, sent)?;
    bar.finish_and_clear();
    Ok(Flown {
        log,
        scene: Some(scene),
        packets,
        out,
    })
}

/// Flies the methods of a setup through a world, for `planned` sweeps or until `interrupted`: the log and every byte that went
/// to the ground. `swept` is called after each sweep, `sent` gets what goes to the ground as it goes.
#[allow(
    clippy::too_many_arguments,
    reason = "two callers, and each argument is of another kind"
)]
pub(crate) fn fly(
    setup: &Setup,
    scene: &str,
    world: &World<'_>,
    seed: u64,
    planned: usize,
    interrupted: &AtomicBool,
    swept: impl FnMut(),
    sent: impl FnMut(u64, &[u8]),
) -> anyhow::Result<(FlightLog, Vec<u8>)> {
    let header = Header {
        mode: setup.mode.name().into(),
        scene: scene.to_owned(),
        seed,
        planned_sweeps: planned,
        sweep_period_s: world.flight().plan().schedule().sweep_period_s,
        delay_cycle_m: Some(cslam_core::localization::filter::DELAY_PERIOD_M),
    };
    let mut receiver = receiver_config(setup)?;
    let earth = &world.flight().config().magnetometer;
    receiver.magnetic_field = Some(MagneticField::new(
        earth.field_ut as f32,
        earth.inclination_deg.to_radians() as f32,
        earth.declination_deg.to_radians() as f32,
    ));
    let estimation = EstimatorConfig::default();
    let of_mode = match setup.mode {
        Mode::Best => estimate::Mode::Best,
        Mode::Paper => estimate::Mode::Paper,
    };
    let delays = match setup.stages.estimator.unwrap_or(of_mode) {
        estimate::Mode::Best => {
            let estimator = Estimator::<4, 8, 32, 72, 3, 8, 8, 360, 9>::new(&estimation);
            return fly_with(receiver, estimator, world, header, interrupted, swept, sent);
        }
        estimate::Mode::Paper => TapDelays::Whole,
        estimate::Mode::PaperInterpolated => TapDelays::Interpolated,
    };
    let estimator = PaperEstimator::<4, 8, 32, 72, 9>::new(&estimation).with_delays(delays);
    fly_with(receiver, estimator, world, header, interrupted, swept, sent)
}

fn fly_with<E: PathEstimator<CHANNELS, PATHS>>(
    config: Receiver<'_>,
    estimator: E,
    world: &World<'_>,
    header: Header,
    interrupted: &AtomicBool,
    mut swept: impl FnMut(),
    sent: impl FnMut(u64, &[u8]),
) -> anyhow::Result<(FlightLog, Vec<u8>)> {
    let mut estimator = Box::new(estimator);
    let mut squint = Box::new(config.beam_squint()?);
    let mut map = Box::new(Map::new());
    let memory = Memory {
        estimator: &mut *estimator,
        squint: &mut squint,
        map: &mut map,
    };
    let cslam: Cslam<'_, E, VOXELS> = Cslam::new(config, memory);
    let mut receiver = Application::new(
        AppConfig::default(),
        FrontEnd::new(SoftwareCrc, SESSION),
        raw_flight::ground(),
        cslam,
    );
    Ok(raw_flight::fly(
        world,
        &mut receiver,
        header,
        interrupted,
        |_| {
            swept();
        },
        sent,
    )?)
}

/// The receiver of a mode, with the stages that were asked to differ.
fn receiver_config(setup: &Setup) -> anyhow::Result<Receiver<'static>> {
    let of_mode = match setup.mode {
        Mode::Best => LinkStateChoice::Geometric,
        Mode::Paper => LinkStateChoice::Paper,
    };
    let network = PaperClassifier::new(models::paper()?)?;
    let link_states = match setup.stages.link_state.unwrap_or(of_mode) {
        LinkStateChoice::Geometric => {
            let classifier = Classifier::new(models::geometric()?, models::geometric_without_departure()?)?;
            LinkStates::Geometric(classifier)
        }
        LinkStateChoice::Paper => LinkStates::Paper(network),
        LinkStateChoice::Rules => LinkStates::Rules(Rules::default()),
    };
    let mut config = match setup.mode {
        Mode::Best => Receiver::best(link_states),
        Mode::Paper => Receiver {
            link_states,
            ..Receiver::paper(network)
        },
    };
    let stages = &setup.stages;
    if let Some(choice) = stages.localization {
        let with = |mode| {
            let config = HpcConfig {
                mode,
                ..HpcConfig::default()
            };
            Localization::Hpc(config, network)
        };
        config.localization = match choice {
            LocalizationChoice::Filter | LocalizationChoice::FilterNoDeltaRanges => {
                Localization::Filter(FilterConfig::default())
            }
            LocalizationChoice::Hpc => with(hpc::Mode::VelocityFromFixes),
            LocalizationChoice::HpcLiteral => with(hpc::Mode::Literal),
        };
        config.delta_ranges = choice != LocalizationChoice::FilterNoDeltaRanges;
    }
    if let Some(choice) = stages.departures {
        config.departures = match choice {
            DepartureChoice::Fit => Departures::SquintFit,
            DepartureChoice::Parabola => Departures::SquintParabola,
            DepartureChoice::Pick => Departures::SquintPick,
            DepartureChoice::Beams => Departures::Beams,
        };
    }
    if let Some(choice) = stages.mapped {
        config.mapped = match choice {
            MappedChoice::Every => Mapped::Every,
            MappedChoice::FirstOrder => Mapped::FirstOrder,
            MappedChoice::Strongest => Mapped::Strongest,
        };
    }
    Ok(config)
}
