//! The application as a board has it, on the host.

use cslam_core::beam_squint::BeamSquint;
use cslam_core::estimator::states;
use cslam_core::link_state::models;
use cslam_core::paths::EstimatorConfig;
use cslam_core::profile::Radio;
use cslam_core::receiver::{Config, LinkStates, Memory, Receiver};
use cslam_core::telemetry::{Decoder, Key};
use cslam_firmware::app::{AppConfig, Application, Best, Downlink, Ground, Map, VOXELS};
use cslam_firmware::front_end::{FrontEnd, SoftwareCrc};
use cslam_firmware::sensor_stream::{SESSION, UAV};

/// States of a board's filter.
pub const BOARD_STATES: usize = states(2);

/// Our methods, with the capacities of a board.
pub type BoardReceiver<'m> = Application<'m, Radio, VOXELS, BOARD_STATES>;

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
    Ok(Config::best(LinkStates::Trees(models::trees()?)))
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
    config: Config<'static>,
    with: impl FnOnce(&mut BoardReceiver<'_>) -> anyhow::Result<R>,
) -> anyhow::Result<R> {
    with(&mut BoardMemory::new(&config)?.receiver(config, ground()))
}

/// The large parts of a receiver.
#[derive(Debug)]
pub struct BoardMemory {
    estimator: Box<Best>,
    squint: Box<BeamSquint>,
    map: Box<Map>,
}

impl BoardMemory {
    /// Memory for a receiver that is configured so.
    ///
    /// # Errors
    /// That the configuration is impossible.
    pub fn new(config: &Config<'_>) -> anyhow::Result<Self> {
        Ok(Self {
            estimator: Box::new(Best::new(&EstimatorConfig::of(&config.radio))),
            squint: Box::new(config.beam_squint::<Radio>()?),
            map: Box::new(Map::new()),
        })
    }

    /// A receiver that has just been started.
    pub fn receiver<'m>(&'m mut self, config: Config<'m>, ground: Ground) -> BoardReceiver<'m> {
        let memory = Memory {
            estimator: &mut *self.estimator,
            squint: &mut *self.squint,
            map: &mut *self.map,
        };
        let front_end = FrontEnd::new(SoftwareCrc, SESSION);
        Application::new(
            AppConfig::default(),
            front_end,
            ground,
            Receiver::new(config, memory),
        )
    }
}
