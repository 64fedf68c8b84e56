//! The links that the words between GMT and UAV meet in a flight.

use rayon::prelude::*;

use super::instant;
use super::medium::Medium;
use crate::channel::Simulator;
use crate::input::InputError;
use crate::sensors::{OverAir, SensedFlight, Truth, WordLink, WordPath, WordRadio};

/// Looks at the links of a flight at its beacons and exchanges of two-way timing. `medium` should have no diffuse scattering: what a word is
/// stamped by and understood over are single paths.
///
/// # Errors
/// [`InputError`] naming the time of a link that cannot be had.
pub(super) fn over_air<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>(
    medium: &Medium<'_>,
    simulator: &Simulator<ARRAYS, ELEMENTS, CHANNELS>,
    flight: &SensedFlight,
) -> Result<OverAir, InputError> {
    let front_end = &simulator.config().front_end;
    let radio = WordRadio {
        transmit_dbm: front_end.transmit_power_dbm - front_end.implementation_loss_db,
        noise_figure_db: front_end.noise_figure_db,
    };
    let links = |times_s: Vec<f64>| -> Result<Vec<(f64, WordLink)>, InputError> {
        times_s
            .into_par_iter()
            .map(|time_s| Ok((time_s, link(medium, simulator, &flight.truth(time_s))?)))
            .collect()
    };
    let beacons = links(flight.beacon_times_s())?;
    let exchanges = links(flight.exchange_times_s())?;
    Ok(OverAir::new(&radio, &beacons, &exchanges, flight.seed()))
}

fn link<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>(
    medium: &Medium<'_>,
    simulator: &Simulator<ARRAYS, ELEMENTS, CHANNELS>,
    truth: &Truth,
) -> Result<WordLink, InputError> {
    let failed = |reason: String| InputError::new(format!("{} s: {reason}", truth.time_s));
    let link = medium.link(truth);
    let instant = instant(truth).map_err(|e| failed(e.to_string()))?;
    let gains = simulator
        .beam_gains(&link, &instant)
        .map_err(|e| failed(e.to_string()))?;
    let paths = link.paths.iter().zip(gains);
    Ok(paths
        .map(|(path, beam_gain)| WordPath {
            delay_s: path.delay_s,
            beam_gain,
        })
        .collect())
}
