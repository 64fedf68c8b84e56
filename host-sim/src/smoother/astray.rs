//! Outages in which the filter was led astray, as the line of sight after them tells.
//!
//! Without line of sight the filter lives on reflections, bent waves and the growth of paths. One that is taken for what it is not leads it
//! off for certain, and the smoother would believe it as the filter did. But the sight that ends the outage moves such a pose by more than
//! it claimed to err. Nothing that was heard in the outage is believed then: inertial data and timing carry the pose from one end to the
//! other, which both are known.

use std::collections::BTreeSet;

use cslam_core::estimator::POSITION;
use cslam_core::receiver::{PATHS, SweepReport};
use nalgebra::Matrix3;

use super::tape::Chain;

/// Chi-square, of three axes, up to which a sight that ends an outage agrees with the pose.
/// Derived: one honest sight in 5900 is beyond, as in the filter's gate of three rows.
const AGREES: f64 = 20.0;
/// Lines of sight in a row between which and the next one there is an outage: a single one may be none.
/// Derived: two may be of the same error, the third tells.
const STEADY: u32 = 3;
/// Outages up to this length are bridged, ns.
/// Derived: inertial data alone lead off by 6 mm per square second (docs/localization.md), in the middle of 12 s between two known ends by a
/// decimetre or two; longer ones are better off with what was heard.
const BRIDGED_NS: u64 = 12_000_000_000;

/// By how much a sweep has moved the position, as a chi-square of what the filter claimed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moved {
    /// UAV clock, ns.
    pub(super) time_ns: u64,
    /// Chi-square of three axes.
    pub(super) chi_square: f64,
}

/// What every update has moved the position by.
pub(super) fn moves(chains: &[Chain]) -> Vec<Moved> {
    let stages = chains
        .iter()
        .flat_map(|chain| chain.stages.iter().zip(&chain.standing));
    stages
        .filter_map(|(stage, standing)| {
            let moved = stage.correction.fixed_rows::<3>(POSITION);
            let claimed: Matrix3<f64> = stage.predicted.fixed_view::<3, 3>(POSITION, POSITION).into();
            let chi_square = moved.dot(&(claimed.try_inverse()? * moved));
            Some(Moved {
                time_ns: standing.nominal.time_ns,
                chi_square,
            })
        })
        .collect()
}

/// The sweeps of all outages in which the filter was led astray.
pub(super) fn led_astray(sweeps: &[Swept], moves: &[Moved]) -> BTreeSet<u32> {
    let contradicts = |swept: &Swept| {
        let mut at_once = moves.iter().filter(|moved| moved.time_ns == swept.time_ns);
        at_once.any(|moved| moved.chi_square > AGREES)
    };
    let mut astray = BTreeSet::new();
    let (mut in_a_row, mut steady) = (0, None::<usize>);
    for (at, swept) in sweeps.iter().enumerate() {
        if !swept.sighted {
            in_a_row = 0;
            continue;
        }
        in_a_row += 1;
        if let Some(begin) = steady
            && swept.time_ns.saturating_sub(sweeps[begin].time_ns) <= BRIDGED_NS
            && contradicts(swept)
        {
            astray.extend(sweeps[begin + 1..at].iter().map(|swept| swept.sweep));
        }
        if in_a_row >= STEADY {
            steady = Some(at);
        }
    }
    astray
}

/// What counts of a sweep here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Swept {
    /// Its number.
    pub(super) sweep: u32,
    /// UAV clock, ns.
    pub(super) time_ns: u64,
    /// Whether a line of sight corrected the pose, or set it.
    pub(super) sighted: bool,
}

impl From<&SweepReport<PATHS>> for Swept {
    fn from(report: &SweepReport<PATHS>) -> Self {
        Self {
            sweep: report.sweep,
            time_ns: report.time_ns,
            sighted: report.verdict.is_taken(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sweeps twice a second; `L` is a line of sight, `X` one that contradicts, anything else none.
    fn astray(sights: &str) -> Vec<u32> {
        let time_ns = |sweep: u32| u64::from(sweep) * 500_000_000;
        let (mut sweeps, mut moves) = (Vec::new(), Vec::new());
        for (sweep, kind) in (0..).zip(sights.chars()) {
            sweeps.push(Swept {
                sweep,
                time_ns: time_ns(sweep),
                sighted: "LX".contains(kind),
            });
            moves.push(Moved {
                time_ns: time_ns(sweep),
                chi_square: if kind == 'X' { 21.0 } else { 3.0 },
            });
        }
        led_astray(&sweeps, &moves).into_iter().collect()
    }

    #[test]
    fn an_outage_is_doubted_when_the_sight_after_it_contradicts() {
        assert_eq!(astray("LLL...XLL"), [3, 4, 5]);
        assert!(astray("LLL...LLL").is_empty());
        // In sight nothing is doubted, and what comes before the first steady sight has no begin.
        assert!(astray("LLLXLLL").is_empty() && astray("LL...XLL").is_empty());
    }

    #[test]
    fn single_sights_within_an_outage_are_doubted_with_it() {
        assert_eq!(astray("LLL..L..LL.X"), [3, 4, 5, 6, 7, 8, 9, 10]);
        assert_eq!(astray("LLL..LLL..X"), [8, 9]);
    }

    #[test]
    fn a_long_outage_is_not_bridged() {
        let outage = |sweeps: usize| format!("LLL{}X", ".".repeat(sweeps));
        assert_eq!(astray(&outage(23)).len(), 23);
        assert!(astray(&outage(24)).is_empty());
    }
}
