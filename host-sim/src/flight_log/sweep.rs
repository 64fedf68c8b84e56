//! Sweeps: what the receiver made of one sweep of the transmit beams, and the link that it heard.

use cslam_core::geometry::Frame;
use cslam_core::paths::EstimatedPath;
use serde::{Deserialize, Serialize};

use super::{PoseEstimate, PoseRecord, PoseTruth};
use crate::paths::{Link, LinkPath};

/// A path as the receiver measured it. Angles of arrival are in body axes and delays hold the clock offset: nothing of
/// the pose is in them, so the error of the path and that of the pose can be told apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredPath {
    /// Speed of light times the delay as measured, clock offset included, m.
    pub c_tau_m: f64,
    /// Zenith angle of arrival in body axes, rad.
    pub aoa_zenith_rad: f64,
    /// Azimuth of arrival in body axes, rad.
    pub aoa_azimuth_rad: f64,
    /// SNR per element and active subcarrier, dB.
    pub snr_db: Option<f64>,
    /// Probabilities of line of sight, of one reflection and of more, together less than 1 by what an artefact has; `None` when no
    /// classifier judged it.
    pub probabilities: Option<[f64; 3]>,
    /// What became of it: `ok` for an accepted reflection point, else the reason in words.
    pub verdict: String,
}

impl MeasuredPath {
    /// Probability that it was reflected once; `None` when no classifier judged it.
    #[must_use]
    pub fn first_order_probability(&self) -> Option<f64> {
        self.probabilities.map(|[_, one, _]| one)
    }

    /// Verdict of an accepted reflection point.
    pub const OK: &'static str = "ok";
    /// Verdict of a path whose several reflections off confirmed surfaces were accepted.
    pub const OK_HIGHER_ORDER: &'static str = "ok, of higher order";
    /// Whether a verdict is that of a path that became points.
    pub fn is_accepted(verdict: &str) -> bool {
        verdict == Self::OK || verdict == Self::OK_HIGHER_ORDER
    }

    /// Verdict of a path that was measured while there was no pose.
    pub const NO_POSE: &'static str = "no pose yet";
    /// Verdict of a path that is probably no first-order reflection.
    pub const NOT_FIRST_ORDER: &'static str = "not one reflection";
    /// Verdict of a path off a surface that was never confirmed.
    pub const NOT_CONFIRMED: &'static str = "off a surface that was not confirmed";
    /// Verdict of a path with several explanations.
    pub const AMBIGUOUS: &'static str = "ambiguous";
    /// Verdict of a path that no chain of surfaces explains.
    pub const UNEXPLAINED: &'static str = "unexplained";
    /// Verdict of a path that confirmed surfaces explain, whose point is not known well enough or whose departure is another's.
    pub const WITHOUT_POINT: &'static str = "explained, without a point";
    /// Verdict of a path whose points left the map with their surface.
    pub const WITHDRAWN: &'static str = "withdrawn with its surface";
}

impl<D: Frame> From<&EstimatedPath<D>> for MeasuredPath {
    /// Of a path that nobody has judged.
    fn from(estimated: &EstimatedPath<D>) -> Self {
        let path = &estimated.path;
        Self {
            c_tau_m: f64::from(path.c_tau_m),
            aoa_zenith_rad: f64::from(path.aoa.zenith_rad()),
            aoa_azimuth_rad: f64::from(path.aoa.azimuth_rad()),
            snr_db: Some(f64::from(estimated.snr_db)),
            probabilities: None,
            verdict: String::new(),
        }
    }
}

/// Kinds of measurement that correct the pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measurement {
    /// Delay of the line of sight.
    LosDelay,
    /// Angle of arrival of the line of sight.
    LosAngle,
    /// Direction of departure by beam squint.
    Squint,
    /// All of the line of sight, gated together.
    Los,
    /// Two-way timing.
    Timing,
    /// A reflection off a mapped plane.
    Reflection,
    /// Heading by the magnetometer.
    Magnetometer,
}

impl Measurement {
    /// Every kind.
    pub const ALL: [Self; 7] = [
        Self::LosDelay,
        Self::LosAngle,
        Self::Squint,
        Self::Los,
        Self::Timing,
        Self::Reflection,
        Self::Magnetometer,
    ];

    /// Name in files.
    pub fn key(self) -> &'static str {
        match self {
            Self::LosDelay => "los_delay",
            Self::LosAngle => "los_angle",
            Self::Squint => "squint",
            Self::Los => "los",
            Self::Timing => "timing",
            Self::Reflection => "reflection",
            Self::Magnetometer => "magnetometer",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::LosDelay => "LOS delay",
            Self::LosAngle => "LOS angle",
            Self::Squint => "beam squint",
            Self::Los => "LOS, joint",
            Self::Timing => "two-way timing",
            Self::Reflection => "reflection",
            Self::Magnetometer => "magnetometer",
        }
    }
}

/// How far a measurement was from what the filter expected.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Innovation {
    /// Kind.
    pub measurement: Measurement,
    /// Degrees of freedom.
    pub dof: u32,
    /// Normalised innovation squared: r^T S^-1 r.
    pub nis: f64,
    /// NIS over the gate: above 1 it is refused.
    pub test_ratio: f64,
    /// Whether the filter took it.
    pub accepted: bool,
}

/// What the receiver holds of the link as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkEstimate {
    /// 0 = outage, 1 = LOS, 2 = first-order, 3 = higher-order.
    pub state: u8,
    /// Probabilities of LOS, first-order, higher-order; `None` without a classifier.
    pub probabilities: Option<[f64; 3]>,
}

/// The receiver's side of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepEstimate {
    /// Pose with which the reflection points of the sweep were solved; `None` before the first one.
    pub pose: Option<PoseEstimate>,
    /// Position of the GMT as its last beacon says, m; `None` before the first one.
    pub gmt_position_m: Option<[f64; 3]>,
    /// Index of the GMT position: counts its stops as the receiver sees them.
    pub gmt_index: u32,
    /// Measured paths, strongest first.
    pub paths: Vec<MeasuredPath>,
    /// State of the link; `None` when the receiver does not classify.
    pub link: Option<LinkEstimate>,
    /// Whether a path was used as line of sight by the filter.
    pub los_used: bool,
    /// Measurements that the filter was offered since the sweep before.
    pub innovations: Vec<Innovation>,
}

/// The world's side of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepTruth {
    /// Pose and clock at the first beam; `None` when nobody knows.
    pub pose: Option<PoseTruth>,
    /// Traced paths; `None` when the truth is not known. World frame, no clock offset.
    pub link: Option<Link>,
    /// For each measured path the index of the true path behind it, or `None`: filled by
    /// [`match_paths`](crate::evaluation::matching::match_paths), or at once by whoever knows.
    pub matches: Vec<Option<usize>>,
}

impl SweepTruth {
    /// Whether there was line of sight.
    pub fn los_visible(&self) -> bool {
        self.link
            .as_ref()
            .is_some_and(|link| link.paths.iter().any(LinkPath::is_line_of_sight))
    }

    /// True state of the link: `None` when the truth is not known.
    pub fn link_state(&self) -> Option<u8> {
        link_state_of(self.link.as_ref()?)
    }
}

/// State of a link: that of its strongest path by |gain|, 0 without a path; `None` when a path does not say its order.
/// Without gains the list's own order counts, strongest first.
pub fn link_state_of(link: &Link) -> Option<u8> {
    let power = |gain: Option<[f64; 2]>| gain.map_or(f64::NEG_INFINITY, |[re, im]| re * re + im * im);
    let Some(first) = link.paths.first() else {
        return Some(0);
    };
    let strongest = link.paths.iter().skip(1).fold(first, |best, path| {
        if power(path.gain) > power(best.gain) {
            path
        } else {
            best
        }
    });
    strongest.order.map(|order| order.min(2) + 1)
}

/// One sweep of the transmit beams.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepRecord {
    /// Number of the sweep, from 0.
    pub sweep: u32,
    /// Time of the first beam by the UAV's clock, s.
    pub time_s: f64,
    /// What the receiver made of it.
    pub estimate: SweepEstimate,
    /// What was so.
    pub truth: SweepTruth,
}

impl SweepRecord {
    /// Estimate and truth of the pose at this sweep.
    pub fn pose(&self) -> PoseRecord {
        PoseRecord {
            time_s: self.time_s,
            estimate: self.estimate.pose,
            truth: self.truth.pose,
        }
    }
}
