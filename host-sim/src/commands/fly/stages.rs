//! One stage of the receiver at a time away from the mode, as options.

use std::path::PathBuf;

use crate::config::{DepartureChoice, LinkStateChoice, LocalizationChoice, MappedChoice, ReceiverConfig};
use crate::estimate;

/// Heading of the options below in the help text.
const STAGES: &str = "One stage away from the mode (flights from raw samples)";

/// One stage at a time away from the mode: ablations.
#[derive(clap::Args, Clone, Debug, Default)]
pub(super) struct Stages {
    /// Path estimation, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    estimator: Option<estimate::Mode>,
    /// Link state, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    link_state: Option<LinkStateChoice>,
    /// Trees of your own for the link state (`cslam train --kind trees`)
    #[arg(long, value_name = "FILE", help_heading = STAGES)]
    link_state_model: Option<PathBuf>,
    /// Localization, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    localization: Option<LocalizationChoice>,
    /// Direction of departure of the line of sight, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    departures: Option<DepartureChoice>,
    /// Paths that may become points, if not the mode's
    #[arg(long, value_enum, help_heading = STAGES)]
    mapped: Option<MappedChoice>,
}

impl Stages {
    /// What is asked for here counts, whatever the configuration says.
    pub(super) fn set(&self, receiver: &mut ReceiverConfig) {
        receiver.estimator = self.estimator.or(receiver.estimator);
        receiver.link_state = self.link_state.or(receiver.link_state);
        if let Some(model) = &self.link_state_model {
            receiver.link_state_model = Some(model.clone());
        }
        receiver.localization = self.localization.or(receiver.localization);
        receiver.departures = self.departures.or(receiver.departures);
        receiver.mapped = self.mapped.or(receiver.mapped);
    }
}
