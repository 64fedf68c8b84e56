//! Every tuned number of the association.

use crate::field::{FieldError, MOST_SHARE, Range, all_in, wide};
use crate::paths::PathErrors;

/// Least logarithm of a probability.
/// Numerical: single precision ends long before.
const LEAST_LOG: f64 = -1000.0;

/// Settings of the association.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AssociationConfig {
    /// Errors of paths.
    pub errors: PathErrors,
    /// Share that each state has at least, whatever the classifier says: what it errs about in one sweep it errs about in the next.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub classifier_doubt: f32,
    /// Chains of one reflection that a place offers, a prior over which it is.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub singles_offered: f32,
    /// By how many times more chains each further reflection offers.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub offered_growth: f32,
    /// Log prior that a surface goes on for another metre beyond what was seen of it, negative, 1/m.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub reach_per_m: f32,
    /// Log prior of a way through a confirmed surface, negative. It weighs up the departure's density, which a chain of unknown surfaces can
    /// have exactly (three parallel walls are one phantom), and the network's best word for it.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub blocked: f32,
    /// A surface within this of an end of a leg does not block it, m: at a corner two walls meet.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub clear_m: f32,
    /// Share of single reflections that are off surfaces that are not in the store.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub unknown_share: f32,
    /// Spread of the lengths of unexplained paths, m.
    /// Given: the scale of a street.
    pub clutter_length_m: f32,
    /// Density of artefacts, in units of that of unexplained paths: they lie beside stronger ones.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub artefact_density: f32,
    /// Posterior of a path that is explained.
    /// Given: the precision that is wanted.
    pub explained: f32,
    /// Posterior of a path that is explained tentatively.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub tentative: f32,
    /// Standard deviations within which an explanation is weighed.
    /// Derived: one honest explanation in a million is beyond.
    pub gate_sigmas: f32,
    /// Explanations weighed in a sweep at most.
    /// Capacity: a bound of work, not of the model. Pairs of tentative surfaces take what is left.
    pub weighings: u16,
}

impl Default for AssociationConfig {
    fn default() -> Self {
        Self {
            errors: PathErrors::default(),
            classifier_doubt: 0.06,
            singles_offered: 2.0,
            offered_growth: 9.0,
            reach_per_m: -0.25,
            blocked: -12.0,
            clear_m: 0.6,
            unknown_share: 0.3,
            clutter_length_m: 60.0,
            artefact_density: 1000.0,
            explained: 0.95,
            tentative: 0.9,
            gate_sigmas: 5.0,
            weighings: 160,
        }
    }
}

impl AssociationConfig {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot.
    pub fn check(&self) -> Result<(), FieldError> {
        let errors = &self.errors;
        let above = [
            ("classifier_doubt", self.classifier_doubt),
            ("singles_offered", self.singles_offered),
            ("offered_growth", self.offered_growth),
            ("clear_m", self.clear_m),
            ("unknown_share", self.unknown_share),
            ("clutter_length_m", self.clutter_length_m),
            ("artefact_density", self.artefact_density),
            ("gate_sigmas", self.gate_sigmas),
            ("errors.neighbour_m", errors.neighbour_m),
            ("errors.neighbour_rad", errors.neighbour_rad),
            ("errors.comparable_db", errors.comparable_db),
        ];
        all_in(Range::AboveZero, &above.map(wide))?;
        all_in(
            Range::AboveZero,
            &errors.delay_m.map(|value| wide(("errors.delay_m", value))),
        )?;
        all_in(
            Range::AboveZero,
            &errors
                .arrival_rad
                .map(|value| wide(("errors.arrival_rad", value))),
        )?;
        let outliers = errors
            .departure_outliers
            .map(|value| wide(("errors.departure_outliers", value)));
        all_in(Range::AboveZero, &outliers)?;
        all_in(Range::Within(0.0, MOST_SHARE), &outliers)?;
        all_in(
            Range::Within(0.0, 0.3),
            &[wide(("classifier_doubt", self.classifier_doubt))],
        )?;
        let logs = [("reach_per_m", self.reach_per_m), ("blocked", self.blocked)];
        all_in(Range::Within(LEAST_LOG, 0.0), &logs.map(wide))?;
        all_in(
            Range::Within(0.0, MOST_SHARE),
            &[wide(("unknown_share", self.unknown_share))],
        )?;
        all_in(
            Range::Within(0.5, MOST_SHARE),
            &[("explained", self.explained), ("tentative", self.tentative)].map(wide),
        )
    }
}
