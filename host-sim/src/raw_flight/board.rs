//! The application as a board has it, on the host.

use cslam_core::cslam::{Config, Cslam, LinkStates, Memory};
use cslam_core::localization::filter::states;
use cslam_core::lscn::{Classifier, models};
use cslam_core::ltd::EstimatorConfig;
use cslam_core::telemetry::{Decoder, Key};
use cslam_firmware::app::{AppConfig, Application, Best, Downlink, Ground, Map, VOXELS};
use cslam_firmware::front_end::{FrontEnd, SoftwareCrc};
use cslam_firmware::sensor_stream::{SESSION, UAV};

/// Our methods, with the capacities of a board.
pub type BoardReceiver<'m> = Application<'m, Best, VOXELS, { states(2) }>;

/// The link of a simulated UAV, with the published key.
#[must_use]
pub fn ground() -> Ground {
    Ground {
        downlink: Downlink::new(UAV, &Key::TEST, 0),
        uplink: Decoder::new(UAV, &Key::TEST),
    }
}

/// Our methods, as a board that was told nothing is configured.
///
/// # Errors
/// None: the models that come with the program are sound.
pub fn board_config() -> anyhow::Result<Config<'static>> {
    let classifier = Classifier::new(models::geometric()?, models::geometric_without_departure()?)?;
    Ok(Config::best(LinkStates::Geometric(classifier)))
}

/// Calls `with` with a receiver of [`board_config`] that has just been started.
///
/// # Errors
/// Whatever `with` says.
pub fn with_board_receiver<R>(
    with: impl FnOnce(&mut BoardReceiver<'_>) -> anyhow::Result<R>,
) -> anyhow::Result<R> {
    with_receiver(board_config()?, with)
}

/// Calls `with` with a receiver that is configured so and has just been started.
///
/// # Errors
/// Whatever `with` says, or that the configuration is impossible.
pub fn with_receiver<R>(
    config: Config<'_>,
    with: impl FnOnce(&mut BoardReceiver<'_>) -> anyhow::Result<R>,
) -> anyhow::Result<R> {
    let mut estimator = Box::new(Best::new(&EstimatorConfig::default()));
    let mut squint = Box::new(config.beam_squint()?);
    let mut map = Box::new(Map::new());
    let memory = Memory {
        estimator: &mut *estimator,
        squint: &mut squint,
        map: &mut map,
    };
    let front_end = FrontEnd::new(SoftwareCrc, SESSION);
    let cslam = Cslam::new(config, memory);
    with(&mut Application::new(
        AppConfig::default(),
        front_end,
        ground(),
        cslam,
    ))
}
