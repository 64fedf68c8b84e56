//! What lies between both ends of a link.

use super::given::Between;
use super::surroundings::Surroundings;
use crate::paths::Link;
use crate::sensors::Truth;
use crate::tracer::Tracer;

/// Where the paths of a world come from.
#[derive(Debug)]
pub(super) enum Medium<'s> {
    /// A scene, traced as the flight goes.
    Traced(Box<Tracer<'s>>, Surroundings),
    /// Links that somebody else traced.
    Given(Between),
}

impl Medium<'_> {
    /// The paths between both ends.
    pub(super) fn link(&self, truth: &Truth) -> Link {
        match self {
            Self::Traced(tracer, surroundings) => surroundings.link(tracer, truth),
            Self::Given(between) => between.link(truth),
        }
    }
}
