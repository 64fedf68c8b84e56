//! How the receiver is configured in the rows of each table.

use cslam_core::estimator::baseline::Mode;
use cslam_core::link_state::{PaperClassifier, models};
use cslam_core::receiver::{BaselineConfig, Config as Receiver, Localization, Pilots};

use crate::raw_flight::board_config;

/// A row: its name, and what it changes of the receiver that flies on a board.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub(super) name: &'static str,
    change: fn(&mut Receiver<'static>) -> anyhow::Result<()>,
}

impl Row {
    const fn new(name: &'static str, change: fn(&mut Receiver<'static>) -> anyhow::Result<()>) -> Self {
        Self { name, change }
    }

    /// The receiver of this row.
    pub(super) fn receiver(&self) -> anyhow::Result<Receiver<'static>> {
        let mut receiver = board_config()?;
        (self.change)(&mut receiver)?;
        Ok(receiver)
    }
}

/// The receiver as it flies.
pub(super) const ALL_AIDS: Row = Row::new("all aids", |_| Ok(()));

/// All aids, without each, without both; the paper's calibration.
pub(super) const ROWS: [Row; 8] = [
    ALL_AIDS,
    Row::new("without reflections", |receiver| {
        receiver.map_aided = false;
        Ok(())
    }),
    Row::new("without delta ranges", |receiver| {
        receiver.delta_ranges = false;
        Ok(())
    }),
    Row::new("without range rates", |receiver| {
        receiver.pilots = Pilots::Unread;
        Ok(())
    }),
    Row::new("range rates alone", |receiver| {
        (receiver.map_aided, receiver.delta_ranges) = (false, false);
        Ok(())
    }),
    Row::new("without any", |receiver| {
        (receiver.map_aided, receiver.delta_ranges) = (false, false);
        receiver.pilots = Pilots::Unread;
        Ok(())
    }),
    Row::new("HPC, velocity from fixes", |receiver| {
        baseline(receiver, Mode::VelocityFromFixes)
    }),
    Row::new("HPC, literal", |receiver| baseline(receiver, Mode::Literal)),
];

/// The paper's calibration.
fn baseline(receiver: &mut Receiver<'static>, mode: Mode) -> anyhow::Result<()> {
    let network = PaperClassifier::new(models::paper()?)?;
    let config = BaselineConfig {
        mode,
        ..BaselineConfig::default()
    };
    receiver.localization = Localization::Baseline(config, network);
    Ok(())
}
