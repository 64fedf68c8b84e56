//! Every tuned number of the surfaces.

use crate::field::{FieldError, MOST_SHARE, Range, all_in, wide};

/// What makes, confirms and ends a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceConfig {
    /// Existence from which a tentative surface is confirmed.
    /// Given: the precision that is wanted of the map. From its log-odds follow, by symmetry, those at which a surface dies, and the most
    /// that are kept (twice them).
    pub confirmed_probability: f32,
    /// Standard deviation of the lean of a wall and of the slope of a floor, rad.
    /// Given: builders' plumb lines.
    pub lean_rad: f32,
    /// Log-odds that a surface starts below even with when a path shows it less directly: as the other one of a pair, or
    /// neither upright nor level.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub doubtful_log_odds: f32,
    /// A new surface is not born this near to a parallel one, m: that one was merely off. Within half of it two are merged. Nor is the shift
    /// of a confirmed surface, or of a new one, known worse (standard deviation): of two surfaces it could be either.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub same_m: f32,
    /// Two pieces of a plane are one surface when no more than this lies between what was seen of them, m.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub reach_m: f32,
    /// Motion of the transmitter, or of the point of reflection, that makes what the network says of a path independent, m.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub independent_m: f32,
    /// Share of the other chains whose image moves with the transmitter just as the surface's own does: three parallel walls are one plane to
    /// a single reflection, and to each of a pair.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub indistinct_share: f32,
    /// Probability that a reflection that should be seen is among the paths. The confirmed walls of flights would allow more, but
    /// windows and strips between them reflect elsewhere.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub detection: f32,
    /// Log-odds that a contradiction takes: a line of sight through the surface, or its path through a confirmed one.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub contradiction_log_odds: f32,
    /// Sightings in a row of which the pose's error makes as much as one, at two sweeps per second: of a plane they tell no more.
    /// Measured: over 24 tuning flights the errors of position and attitude are correlated over 31 sweeps (`1 + 2` sums of their
    /// autocorrelation), and their squares are a third of what the pose claims.
    pub alike_sightings: f32,
    /// Least standard deviations, shift in m.
    /// Derived: what errors of calibration, shared by all sightings, leave.
    pub least_shift_m: f32,
    /// The same of tilts, rad.
    /// Derived: what errors of calibration leave.
    pub least_tilt_rad: f32,
    /// Standard deviation of the ground's height at the start, m.
    /// Given: where the UAV stood.
    pub ground_shift_m: f32,
    /// The same of its slope, rad.
    /// Given: where the UAV stood.
    pub ground_tilt_rad: f32,
    /// A point that is known worse than this (norm of the standard deviations) does not reach the map, m.
    /// Given: what is wanted of the map.
    pub most_point_m: f32,
}

impl Default for SurfaceConfig {
    fn default() -> Self {
        Self {
            confirmed_probability: 0.98,
            lean_rad: 0.005,
            doubtful_log_odds: 1.5,
            same_m: 0.4,
            reach_m: 6.0,
            independent_m: 1.0,
            indistinct_share: 0.1,
            detection: 0.1,
            contradiction_log_odds: 1.0,
            alike_sightings: 10.0,
            least_shift_m: 0.015,
            least_tilt_rad: 0.7e-3,
            ground_shift_m: 0.5,
            ground_tilt_rad: 0.02,
            most_point_m: 0.5,
        }
    }
}

impl SurfaceConfig {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot.
    pub fn check(&self) -> Result<(), FieldError> {
        let above = [
            ("lean_rad", self.lean_rad),
            ("doubtful_log_odds", self.doubtful_log_odds),
            ("same_m", self.same_m),
            ("reach_m", self.reach_m),
            ("independent_m", self.independent_m),
            ("detection", self.detection),
            ("indistinct_share", self.indistinct_share),
            ("contradiction_log_odds", self.contradiction_log_odds),
            ("alike_sightings", self.alike_sightings),
            ("least_shift_m", self.least_shift_m),
            ("least_tilt_rad", self.least_tilt_rad),
            ("ground_shift_m", self.ground_shift_m),
            ("ground_tilt_rad", self.ground_tilt_rad),
            ("most_point_m", self.most_point_m),
        ];
        all_in(Range::AboveZero, &above.map(wide))?;
        let shares = [
            ("detection", self.detection),
            ("indistinct_share", self.indistinct_share),
        ];
        all_in(Range::Within(0.0, MOST_SHARE), &shares.map(wide))?;
        let confirmed = f64::from(self.confirmed_probability);
        all_in(
            Range::Within(0.5, MOST_SHARE),
            &[("confirmed_probability", confirmed)],
        )
    }

    /// Angle between normals of parallel surfaces, rad: they are no further apart at the end of their reach than where they count as one.
    #[must_use]
    pub fn same_rad(&self) -> f32 {
        self.same_m / self.reach_m
    }

    /// Log-odds from which a surface is confirmed.
    #[must_use]
    pub fn confirmed_log_odds(&self) -> f32 {
        let p = self.confirmed_probability;
        libm::logf(p / (1.0 - p))
    }

    /// Log-odds below which it dies: as sure that it is not as a confirmed one is that it is.
    #[must_use]
    pub fn dead_log_odds(&self) -> f32 {
        -self.confirmed_log_odds()
    }

    /// Most log-odds that are kept, so that a surface can still be refuted.
    #[must_use]
    pub fn most_log_odds(&self) -> f32 {
        2.0 * self.confirmed_log_odds()
    }

    /// Log-odds of a sweep that should have shown the surface and did not.
    #[must_use]
    pub fn missed_log_odds(&self) -> f32 {
        libm::logf(1.0 - self.detection)
    }

    /// Lean up to which a normal is that of a wall or floor, rad: eight standard deviations, the plumb prior and what one path
    /// errs by.
    #[must_use]
    pub fn upright_rad(&self) -> f32 {
        8.0 * self.lean_rad
    }
}
