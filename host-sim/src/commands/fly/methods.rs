//! The receiver's methods, as a configuration tells them.

use std::path::Path;

use cslam_core::estimator::{Setup, baseline};
use cslam_core::link_state::{Classifier, PaperClassifier, PathClassifier, Trees, models};
use cslam_core::receiver::{
    Config as CoreConfig, Departures, LinkStates, Localization, Mapped, Pilots, Rules,
};

use crate::config::{
    DepartureChoice, LinkStateChoice, LocalizationChoice, MappedChoice, Mode, ReceiverConfig,
};
use crate::estimate;
use crate::input::{InputError, limits, read_bytes};

/// Who estimates the paths: the mode's estimator, or the one that was asked for.
pub(crate) fn estimator(told: &ReceiverConfig) -> estimate::Mode {
    told.estimator.unwrap_or(match told.mode {
        Mode::Best => estimate::Mode::Best,
        Mode::Paper => estimate::Mode::Paper,
    })
}

/// How departures of the line of sight are read: as the mode has it, or as was asked for.
pub(crate) fn departures(told: &ReceiverConfig) -> anyhow::Result<DepartureChoice> {
    Ok(match methods(told, None)?.departures {
        Departures::SquintFit => DepartureChoice::Fit,
        Departures::SquintParabola => DepartureChoice::Parabola,
        Departures::SquintPick => DepartureChoice::Pick,
        Departures::Beams => DepartureChoice::Beams,
    })
}

/// Trees of a file (`cslam train --kind trees`). They stay in memory: receivers borrow them for as long as the program runs.
fn own_trees(file: &Path) -> Result<PathClassifier<'static>, InputError> {
    let bytes = read_bytes(file, &limits::MODEL)?.leak();
    Trees::parse(bytes)
        .and_then(PathClassifier::new)
        .map_err(|error| InputError::in_file(file, error.to_string()))
}

/// The methods of a mode, with the stages that were asked to differ, beside a GMT that was set up there, if somebody says.
pub(super) fn methods(told: &ReceiverConfig, setup: Option<Setup>) -> anyhow::Result<CoreConfig<'static>> {
    let of_mode = match (told.mode, told.mapped) {
        (Mode::Paper, _) => LinkStateChoice::Paper,
        (Mode::Best, None | Some(MappedChoice::Every)) => LinkStateChoice::Trees,
        // Of a path that is taken alone the departure must be in the probability: no association weighs it.
        (Mode::Best, Some(MappedChoice::FirstOrder | MappedChoice::Strongest)) => LinkStateChoice::Geometric,
    };
    let network = PaperClassifier::new(models::paper()?)?;
    let link_states = match told.link_state.unwrap_or(of_mode) {
        LinkStateChoice::Trees => LinkStates::Trees(match &told.link_state_model {
            Some(file) => own_trees(file)?,
            None => models::trees()?,
        }),
        LinkStateChoice::Geometric => {
            let classifier = Classifier::new(models::geometric()?, models::geometric_without_departure()?)?;
            LinkStates::Geometric(classifier)
        }
        LinkStateChoice::Paper => LinkStates::Paper(network),
        LinkStateChoice::Rules => LinkStates::Rules(Rules::default()),
    };
    let mut config = match told.mode {
        Mode::Best => CoreConfig::best(link_states),
        Mode::Paper => CoreConfig {
            link_states,
            ..CoreConfig::paper(network)
        },
    };
    let with = |mode| Localization::Baseline(told.baseline.config(mode), network);
    config.localization = match told.localization {
        None => match config.localization {
            Localization::Filter(_) => Localization::Filter(told.filter.config(setup)),
            Localization::Baseline(baseline, _) => with(baseline.mode),
        },
        Some(
            LocalizationChoice::Filter
            | LocalizationChoice::FilterNoDeltaRanges
            | LocalizationChoice::FilterNoRangeRates,
        ) => Localization::Filter(told.filter.config(setup)),
        Some(LocalizationChoice::Baseline) => with(baseline::Mode::VelocityFromFixes),
        Some(LocalizationChoice::BaselineLiteral) => with(baseline::Mode::Literal),
    };
    // On board none are read before there is a pose. Kept paths may be flown again by a receiver that has one sooner.
    config.pilots = Pilots::EverySweep;
    if let Some(choice) = told.localization {
        config.delta_ranges = choice != LocalizationChoice::FilterNoDeltaRanges;
        if choice == LocalizationChoice::FilterNoRangeRates {
            config.pilots = Pilots::Unread;
        }
    }
    if let Some(choice) = told.departures {
        config.departures = match choice {
            DepartureChoice::Fit => Departures::SquintFit,
            DepartureChoice::Parabola => Departures::SquintParabola,
            DepartureChoice::Pick => Departures::SquintPick,
            DepartureChoice::Beams => Departures::Beams,
        };
    }
    if let Some(choice) = told.mapped {
        config.mapped = match choice {
            MappedChoice::Every => Mapped::Every,
            MappedChoice::FirstOrder => Mapped::FirstOrder,
            MappedChoice::Strongest => Mapped::Strongest,
        };
    }
    Ok(config)
}
