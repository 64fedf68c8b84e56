//! Whole flights with some of their measurements free of errors: what limits the pose.

use indicatif::ProgressBar;

use super::rows::ALL_AIDS;
use super::whole::{self, Line};
use crate::kept_flight::{Changes, ErrorFree, KeptFlight};

/// Columns.
pub(super) const HEADER: [&str; 10] = {
    let mut header = whole::HEADER;
    header[0] = "without errors of";
    header
};

/// Names, and what has no errors.
const ROWS: [(&str, &[ErrorFree]); 13] = [
    ("-", &[]),
    ("arrivals", &[ErrorFree::Arrivals]),
    ("departures", &[ErrorFree::Departures]),
    ("lengths", &[ErrorFree::Lengths]),
    ("range rates", &[ErrorFree::RangeRates]),
    (
        "arrivals, range rates",
        &[ErrorFree::Arrivals, ErrorFree::RangeRates],
    ),
    ("artefacts", &[ErrorFree::Artefacts]),
    ("bent lines of sight", &[ErrorFree::Bends]),
    ("paths: all of these", &ErrorFree::OF_PATHS),
    ("timing", &[ErrorFree::Timing]),
    ("the GMT's pose", &[ErrorFree::Beacon]),
    ("inertial sensor, but for noise", &[ErrorFree::Inertial]),
    ("all", &ErrorFree::ALL),
];

/// How many there are.
pub(super) const COUNT: usize = ROWS.len();

/// Flies each row over all flights, with all aids.
pub(super) fn fly(flights: &[KeptFlight<'_>], bar: &ProgressBar) -> anyhow::Result<Vec<Line>> {
    let line = |(name, error_free): &(&'static str, &[ErrorFree])| {
        let changes = Changes {
            error_free: error_free.to_vec(),
            ..Changes::default()
        };
        Line::flown(name, flights, &changes, &ALL_AIDS, bar)
    };
    ROWS.iter().map(line).collect()
}
