//! What became of a sweep, path by path.

use super::bits::{BitReader, BitWriter};
use super::pose::{put_health, put_time, take_health, take_time};
use crate::association::Decision;
use crate::estimator::{Health, SweepVerdict};
use crate::link_state::LinkState;
use crate::receiver::{Outcome, SweepReport};
use crate::reflection::{InputError, Rejection};

/// Most paths of a report; the rest go into another one of the same sweep.
pub const MAX_OUTCOMES: usize = 15;

/// What became of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PathOutcome {
    /// Nothing is known: the measurement was damaged or lost on its way to the receiver.
    Missing,
    /// The receiver had no pose, or did not know where the GMT is.
    NoPose,
    /// It is not one of the paths that this mode uses.
    Unused,
    /// Taken for the line of sight.
    LineOfSight,
    /// Taken alone, not probable enough to be a first-order reflection.
    NotFirstOrder,
    /// One reflection: off a confirmed surface, or by the network's word where paths are taken alone.
    Point,
    /// Two confirmed surfaces reflected it.
    TwoPoints,
    /// Three did.
    ThreePoints,
    /// Surfaces reflected it of which one is not confirmed yet.
    Tentative,
    /// Several explanations are left.
    Ambiguous,
    /// One reflection off a surface that was not known.
    NewSurface,
    /// Nothing that is known explains it.
    Unexplained,
    /// A point, but beyond the map's range.
    PointOutOfRange,
    /// Probably a first-order reflection, but a gate of the reflection point says no.
    Rejected(Rejection),
    /// No measurement of a path.
    Input(InputError),
}

/// What data association says, after the rejections.
const TENTATIVE: u8 = 18;
const AMBIGUOUS: u8 = 19;
const NEW_SURFACE: u8 = 20;
const UNEXPLAINED: u8 = 21;
/// Points of several reflections.
const TWO_POINTS: u8 = 22;
const THREE_POINTS: u8 = 23;
/// Where the codes of rejections and of input errors begin.
const REJECTED: u8 = 8;
const INPUT: u8 = 24;

impl PathOutcome {
    /// The outcome in words.
    #[must_use]
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::Missing => "not received",
            Self::NoPose => "no pose yet",
            Self::Unused => "not used in this mode",
            Self::LineOfSight => "taken for the line of sight",
            Self::NotFirstOrder => "not one reflection",
            Self::Tentative => "off a surface that is not confirmed",
            Self::Ambiguous => "ambiguous",
            Self::NewSurface => "off a new surface",
            Self::Unexplained => "unexplained",
            Self::Point => "ok",
            Self::TwoPoints => "ok, of two reflections",
            Self::ThreePoints => "ok, of three reflections",
            Self::PointOutOfRange => "ok, but beyond the map's range",
            Self::Rejected(reason) => reason.as_str(),
            Self::Input(error) => error.as_str(),
        }
    }

    /// Whether it became a point.
    #[must_use]
    pub fn is_point(&self) -> bool {
        matches!(
            self,
            Self::Point | Self::TwoPoints | Self::ThreePoints | Self::PointOutOfRange
        )
    }

    fn code(self) -> u8 {
        match self {
            Self::Missing => 0,
            Self::NoPose => 1,
            Self::Unused => 2,
            Self::LineOfSight => 3,
            Self::NotFirstOrder => 4,
            Self::Point => 6,
            Self::PointOutOfRange => 7,
            Self::Tentative => TENTATIVE,
            Self::Ambiguous => AMBIGUOUS,
            Self::NewSurface => NEW_SURFACE,
            Self::Unexplained => UNEXPLAINED,
            Self::TwoPoints => TWO_POINTS,
            Self::ThreePoints => THREE_POINTS,
            Self::Rejected(reason) => REJECTED + index(&Rejection::ALL, &reason),
            Self::Input(error) => INPUT + index(&InputError::ALL, &error),
        }
    }

    fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0 => Self::Missing,
            1 => Self::NoPose,
            2 => Self::Unused,
            3 => Self::LineOfSight,
            4 => Self::NotFirstOrder,
            6 => Self::Point,
            7 => Self::PointOutOfRange,
            TENTATIVE => Self::Tentative,
            AMBIGUOUS => Self::Ambiguous,
            NEW_SURFACE => Self::NewSurface,
            UNEXPLAINED => Self::Unexplained,
            TWO_POINTS => Self::TwoPoints,
            THREE_POINTS => Self::ThreePoints,
            INPUT.. => Self::Input(*InputError::ALL.get(usize::from(code - INPUT))?),
            REJECTED.. => Self::Rejected(*Rejection::ALL.get(usize::from(code - REJECTED))?),
            _ => return None,
        })
    }
}

/// Place of an element in a list of few; the list holds every element.
fn index<T: PartialEq>(list: &[T], element: &T) -> u8 {
    (0..).zip(list).find(|(_, e)| *e == element).map_or(0, |(i, _)| i)
}

impl From<&Outcome> for PathOutcome {
    fn from(outcome: &Outcome) -> Self {
        match outcome {
            Outcome::NoPose => Self::NoPose,
            Outcome::Unused => Self::Unused,
            Outcome::Input(error) => Self::Input(*error),
            Outcome::LineOfSight => Self::LineOfSight,
            Outcome::NotFirstOrder => Self::NotFirstOrder,
            Outcome::Rejected(reason) => Self::Rejected(*reason),
            Outcome::Point => Self::Point,
            Outcome::Associated(verdict) => match (verdict.decision, verdict.chain.len()) {
                (Decision::Explained, 0) => Self::LineOfSight,
                (Decision::Explained, 1) => Self::Point,
                (Decision::Explained, 2) => Self::TwoPoints,
                (Decision::Explained, _) => Self::ThreePoints,
                (Decision::Tentative, _) => Self::Tentative,
                (Decision::Ambiguous, _) => Self::Ambiguous,
                (Decision::New, _) => Self::NewSurface,
                (Decision::Unexplained, _) => Self::Unexplained,
            },
        }
    }
}

/// A sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkReport {
    /// Number of the sweep.
    pub sweep: u32,
    /// UAV clock at its start, ns; sent in whole microseconds, rounded down.
    pub time_ns: u64,
    /// State of the link.
    pub state: LinkState,
    /// What the line of sight did to the pose.
    pub verdict: SweepVerdict,
    /// Transmit beams that were heard, 255 at most.
    pub beams: u8,
    /// Signal to noise of the strongest path, dB, -128 to 127.5; sent in steps of half a decibel. `None` without a path.
    pub snr_db: Option<f32>,
    /// Where the GMT was, world frame, m, up to 2147 km; sent in steps of 1 mm. `None` when no beacon told.
    pub gmt_m: Option<[f64; 3]>,
    /// Number of the place that the GMT had, counted from 0.
    pub stop: u16,
    /// Flags of the filter.
    pub health: Health,
    /// Index of the first path in `outcomes`: 0, unless there are more than fit one report.
    pub first_path: u8,
    /// What became of each path, strongest first.
    pub outcomes: heapless::Vec<PathOutcome, MAX_OUTCOMES>,
}

impl LinkReport {
    /// Of a sweep, while the GMT was at `gmt_m`, its stop number `stop`.
    #[must_use]
    pub fn new<const K: usize>(report: &SweepReport<K>, gmt_m: Option<[f64; 3]>, stop: u16) -> Self {
        const { assert!(K <= MAX_OUTCOMES, "the paths of a sweep fit one report") };
        let mut outcomes = heapless::Vec::new();
        for path in &report.paths {
            let _fits = outcomes.push(PathOutcome::from(&path.outcome));
        }
        Self {
            sweep: report.sweep,
            time_ns: report.time_ns,
            state: report.link,
            verdict: report.verdict,
            beams: u8::try_from(report.beams).unwrap_or(u8::MAX),
            snr_db: report.paths.first().map(|path| path.estimated.snr_db),
            gmt_m,
            stop,
            health: report.health,
            first_path: 0,
            outcomes,
        }
    }

    pub(super) fn write(&self, to: &mut BitWriter<'_>) {
        to.put(u64::from(self.sweep), 32);
        put_time(to, self.time_ns);
        to.put(self.state as u64, 2);
        to.put(u64::from(index(&VERDICTS, &self.verdict)), 4);
        to.put(u64::from(self.beams), 8);
        to.put_bit(self.snr_db.is_some());
        if let Some(snr_db) = self.snr_db {
            to.put_linear(f64::from(snr_db.clamp(-128.0, 127.5)), 2.0, 9);
        }
        to.put_bit(self.gmt_m.is_some());
        for coordinate in self.gmt_m.iter().flatten() {
            to.put_linear(*coordinate, 1000.0, 32);
        }
        to.put(u64::from(self.stop), 16);
        put_health(to, &self.health);
        to.put(u64::from(self.first_path), 8);
        to.put(self.outcomes.len() as u64, 4);
        for outcome in &self.outcomes {
            to.put(u64::from(outcome.code()), 5);
        }
    }

    pub(super) fn read(from: &mut BitReader<'_>) -> Option<Self> {
        let sweep = from.take_u32(32)?;
        let time_ns = take_time(from)?;
        let state = *STATES.get(from.take(2)? as usize)?;
        let verdict = *VERDICTS.get(from.take(4)? as usize)?;
        let beams = from.take_u8(8)?;
        let snr_db = if from.take_bit()? {
            Some(from.take_linear(2.0, 9)? as f32)
        } else {
            None
        };
        let gmt_m = if from.take_bit()? {
            let mut gmt_m = [0.0; 3];
            for coordinate in &mut gmt_m {
                *coordinate = from.take_linear(1000.0, 32)?;
            }
            Some(gmt_m)
        } else {
            None
        };
        let stop = from.take_u16(16)?;
        let health = take_health(from)?;
        let first_path = from.take_u8(8)?;
        let mut outcomes = heapless::Vec::new();
        for _ in 0..from.take(4)? {
            outcomes.push(PathOutcome::from_code(from.take_u8(5)?)?).ok()?;
        }
        Some(Self {
            sweep,
            time_ns,
            state,
            verdict,
            beams,
            snr_db,
            gmt_m,
            stop,
            health,
            first_path,
            outcomes,
        })
    }
}

/// In the order of the wire format.
const STATES: [LinkState; 4] = [
    LinkState::Outage,
    LinkState::LineOfSight,
    LinkState::FirstOrder,
    LinkState::HigherOrder,
];
/// In the order of the wire format. Code 2 was sent by receivers that took some sights in with a wider covariance.
const VERDICTS: [SweepVerdict; 9] = [
    SweepVerdict::NoSight,
    SweepVerdict::Accepted,
    SweepVerdict::Accepted,
    SweepVerdict::Held,
    SweepVerdict::Rejected,
    SweepVerdict::Refixed,
    SweepVerdict::Started,
    SweepVerdict::Waiting,
    SweepVerdict::TooLate,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::association::Verdict;
    use crate::paths::Neighbourhood;
    use crate::surfaces::SurfaceIds;

    /// Of earlier versions of the format: a departure that was not known.
    const RETIRED: u8 = 5;

    #[test]
    fn every_outcome_has_its_code() {
        let plain = (0..REJECTED)
            .filter(|code| *code != RETIRED)
            .chain(TENTATIVE..=THREE_POINTS)
            .map(|code| PathOutcome::from_code(code).expect("a plain outcome"));
        let rejected = Rejection::ALL.map(PathOutcome::Rejected);
        let input = InputError::ALL.map(PathOutcome::Input);
        let mut codes = heapless::Vec::<u8, 32>::new();
        for outcome in plain.chain(rejected).chain(input) {
            let code = outcome.code();
            assert!(code < 32, "{outcome:?} does not fit five bits");
            assert!(!codes.contains(&code), "{outcome:?} has another's code");
            assert_eq!(PathOutcome::from_code(code), Some(outcome));
            codes.push(code).expect("room");
        }
        assert_eq!(codes.len(), 29);
        assert_eq!(PathOutcome::from_code(RETIRED), None);
        assert_eq!(PathOutcome::from_code(31), None);
    }

    #[test]
    fn a_verdict_is_told_with_the_number_of_its_surfaces() {
        let outcome = |decision, chain: &[u16]| {
            PathOutcome::from(&Outcome::Associated(Verdict {
                decision,
                chain: SurfaceIds::from_slice(chain).expect("three at most"),
                posterior: 0.99,
                chi_square: 1.0,
                departure_held: 1.0,
                contradicts: None,
                neighbourhood: Neighbourhood::default(),
            }))
        };
        let explained = [&[][..], &[0], &[0, 4], &[4, 0, 9]].map(|chain| outcome(Decision::Explained, chain));
        assert_eq!(
            explained,
            [
                PathOutcome::LineOfSight,
                PathOutcome::Point,
                PathOutcome::TwoPoints,
                PathOutcome::ThreePoints
            ]
        );
        assert_eq!(outcome(Decision::Tentative, &[7]), PathOutcome::Tentative);
        assert_eq!(outcome(Decision::Ambiguous, &[7]), PathOutcome::Ambiguous);
        assert_eq!(outcome(Decision::New, &[]), PathOutcome::NewSurface);
        assert_eq!(outcome(Decision::Unexplained, &[]), PathOutcome::Unexplained);
    }

    #[test]
    fn states_and_verdicts_keep_their_numbers() {
        for (number, state) in STATES.into_iter().enumerate() {
            assert_eq!(state as usize, number);
        }
        let numbers = [
            (SweepVerdict::NoSight, 0),
            (SweepVerdict::Accepted, 1),
            (SweepVerdict::Held, 3),
            (SweepVerdict::Rejected, 4),
            (SweepVerdict::Refixed, 5),
            (SweepVerdict::Started, 6),
            (SweepVerdict::Waiting, 7),
            (SweepVerdict::TooLate, 8),
        ];
        for (verdict, number) in numbers {
            assert_eq!(index(&VERDICTS, &verdict), number);
            assert_eq!(VERDICTS[usize::from(number)], verdict);
        }
        // Retired, and still understood.
        assert_eq!(VERDICTS[2], SweepVerdict::Accepted);
    }
}
