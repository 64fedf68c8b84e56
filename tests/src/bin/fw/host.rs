//! The same application on the host.

use std::fmt::Write as _;

use cslam_core::cslam::{Config, Cslam, LinkStates, Memory, PATHS, SweepReport};
use cslam_core::localization::filter::states;
use cslam_core::lscn::{Classifier, models};
use cslam_core::ltd::EstimatorConfig;
use cslam_core::telemetry::{Decoder, Key};
use cslam_firmware::app::{
    AppConfig, Application, Best, Downlink, Ground, Map, Observer, PointLine, SweepLine, VOXELS,
};
use cslam_firmware::front_end::{FrontEnd, SoftwareCrc};
use cslam_firmware::sensor_stream::{SESSION, UAV};

/// The application as the emulated board has it.
pub(crate) type Receiver<'m> = Application<'m, Best, VOXELS, { states(2) }>;

/// Calls `with` with a receiver that has just been started.
pub(crate) fn with_receiver<R>(
    with: impl FnOnce(&mut Receiver<'_>) -> anyhow::Result<R>,
) -> anyhow::Result<R> {
    let classifier = Classifier::new(models::geometric()?, models::geometric_without_departure()?)?;
    let config = Config::best(LinkStates::Geometric(classifier));
    let mut estimator = Box::new(Best::new(&EstimatorConfig::default()));
    let mut squint = Box::new(config.beam_squint()?);
    let mut map = Box::new(Map::new());
    let memory = Memory {
        estimator: &mut *estimator,
        squint: &mut squint,
        map: &mut map,
    };
    let ground = Ground {
        downlink: Downlink::new(UAV, &Key::TEST, 0),
        uplink: Decoder::new(UAV, &Key::TEST),
    };
    let front_end = FrontEnd::new(SoftwareCrc, SESSION);
    let mut receiver = Application::new(
        AppConfig::default(),
        front_end,
        ground,
        Cslam::new(config, memory),
    );
    with(&mut receiver)
}

/// What the board writes to its file.
#[derive(Default)]
pub(crate) struct Lines {
    pub(crate) text: String,
    pub(crate) sweeps: u32,
}

impl Lines {
    /// The map, at the end.
    pub(crate) fn map(&mut self, map: &Map) {
        for point in map.points() {
            let _infallible = writeln!(self.text, "{}", PointLine(point));
        }
    }
}

impl Observer for Lines {
    fn swept(&mut self, report: &SweepReport<PATHS>) {
        let _infallible = writeln!(self.text, "{}", SweepLine(report));
        self.sweeps += 1;
    }
}

/// Takes what waits for the radio.
pub(crate) fn drain(receiver: &mut Receiver<'_>, packets: &mut Vec<u8>) {
    let downlink = receiver.downlink();
    let before = packets.len();
    packets.resize(before + downlink.waiting(), 0);
    downlink.take(&mut packets[before..]);
}
