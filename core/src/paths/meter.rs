//! Where the time of a sweep goes: the estimator tells a meter which stage of its work begins.

/// A stage of path estimation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Level, transforms, correlation, power, taps in natural order.
    FrontEnd,
    /// Screening, noise floor, candidates.
    Detection,
    /// Window and coarse grid of angles.
    CoarseGrid,
    /// Scoring of one path off the grid.
    Refine,
    /// Cancelling and putting back, wherever it happens.
    Cancel,
    /// Refits with everything else cancelled.
    Cyclic,
    /// Joint fits of close paths.
    JointFit,
    /// Merge over beams.
    Merge,
    /// Angles of departure.
    Departure,
    /// Between beams, and what is too small to have a name.
    Rest,
}

impl Stage {
    /// Every stage, in the order of its discriminant.
    pub const ALL: [Self; 10] = [
        Self::FrontEnd,
        Self::Detection,
        Self::CoarseGrid,
        Self::Refine,
        Self::Cancel,
        Self::Cyclic,
        Self::JointFit,
        Self::Merge,
        Self::Departure,
        Self::Rest,
    ];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FrontEnd => "front end",
            Self::Detection => "detection",
            Self::CoarseGrid => "coarse grid",
            Self::Refine => "refine",
            Self::Cancel => "cancel",
            Self::Cyclic => "cyclic",
            Self::JointFit => "joint fit",
            Self::Merge => "merge",
            Self::Departure => "departure",
            Self::Rest => "rest",
        }
    }
}

/// Told which stage begins.
pub trait Meter {
    /// A stage begins; gives the one that it interrupts, to be entered again at its end.
    fn enter(&self, stage: Stage) -> Stage;
}

/// Measures nothing and costs nothing.
impl Meter for () {
    fn enter(&self, stage: Stage) -> Stage {
        stage
    }
}

impl<M: Meter> Meter for &M {
    fn enter(&self, stage: Stage) -> Stage {
        (*self).enter(stage)
    }
}

/// Does some work as a stage.
pub(super) fn within<M: Meter, R>(meter: &M, stage: Stage, work: impl FnOnce() -> R) -> R {
    let outer = meter.enter(stage);
    let result = work();
    meter.enter(outer);
    result
}
