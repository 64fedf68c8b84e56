//! Estimated paths of which some are left out: planned outages of the line of sight, and fewer paths than there were.

use std::collections::BTreeMap;
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};

use cslam_core::paths::EstimatedPath;
use cslam_core::signal::Waveform;
use cslam_firmware::app::Estimated;

use crate::evaluation::matching::{MatchGates, matches};
use crate::flight_log::{MeasuredPath, PoseTruth};
use crate::input::InputError;
use crate::paths::Link;
use crate::random::Stream;
use crate::raw_flight::{Given, Source};
use crate::sensors::{Event, Stamped};

/// Times by the UAV's clock, s: the first belongs to it, the last does not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Begin.
    pub from_s: f64,
    /// End.
    pub to_s: f64,
}

impl Span {
    /// Whether a time is in it.
    #[must_use]
    pub fn contains(&self, time_s: f64) -> bool {
        (self.from_s..self.to_s).contains(&time_s)
    }
}

impl FromStr for Span {
    type Err = String;

    /// `20..35.5`.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.parse().ok().filter(|s: &f64| s.is_finite());
        text.split_once("..")
            .and_then(|(from, to)| Some((number(from)?, number(to)?)))
            .filter(|(from_s, to_s)| from_s < to_s)
            .map(|(from_s, to_s)| Self { from_s, to_s })
            .ok_or_else(|| "expected FROM..TO in seconds, such as 20..35.5".to_owned())
    }
}

/// What is left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Thinning {
    /// Sweeps that begin in these spans lose every path that is within the gates of matching of the line of sight in truth.
    pub without_sight: Vec<Span>,
    /// Probability with which each path is kept, 0 to 1.
    pub share: f64,
    /// Seed of which paths are kept: of a sweep, the same whatever else is left out.
    pub seed: u64,
}

impl Default for Thinning {
    /// Nothing.
    fn default() -> Self {
        Self {
            without_sight: Vec::new(),
            share: 1.0,
            seed: 1,
        }
    }
}

/// A source of estimated paths of which some are left out.
#[derive(Debug)]
pub struct Thinned<'s, S> {
    source: &'s S,
    thinning: Thinning,
    /// When each sweep begins, UAV clock, s.
    starts_s: BTreeMap<u32, f64>,
    lines_of_sight: AtomicU64,
    others: AtomicU64,
}

impl<'s, S: Source> Thinned<'s, S> {
    /// Leaves paths of a source out.
    pub fn new(source: &'s S, thinning: Thinning) -> Self {
        let starts = source.events().filter_map(|stamped| match stamped.event {
            Event::Sweep { sweep } => Some((sweep, stamped.uav_time_ns as f64 * 1e-9)),
            _ => None,
        });
        Self {
            starts_s: starts.collect(),
            source,
            thinning,
            lines_of_sight: AtomicU64::new(0),
            others: AtomicU64::new(0),
        }
    }

    /// Number of paths that were left out so far: lines of sight, and by their share.
    pub fn left_out(&self) -> [u64; 2] {
        [&self.lines_of_sight, &self.others].map(|count| count.load(Ordering::Relaxed))
    }

    fn is_without_sight(&self, sweep: u32) -> bool {
        let start_s = self.starts_s.get(&sweep);
        let spans = &self.thinning.without_sight;
        start_s.is_some_and(|s| spans.iter().any(|span| span.contains(*s)))
    }

    fn thin(
        &self,
        sweep: u32,
        estimated: &mut Estimated,
        truth: Option<&(PoseTruth, Link)>,
    ) -> Result<(), InputError> {
        let mut draws = Stream::new(self.thinning.seed, u64::from(sweep));
        let mut keeps: Vec<bool> = estimated
            .paths
            .iter()
            .map(|_| draws.uniform() < self.thinning.share)
            .collect();
        let thinned = keeps.iter().filter(|kept| !**kept).count();
        self.others.fetch_add(thinned as u64, Ordering::Relaxed);
        if self.is_without_sight(sweep) {
            let Some(truth) = truth else {
                let message = format!(
                    "the line of sight of sweep {sweep} is not known: expected truth.csv and truth_paths.jsonl beside the paths"
                );
                return Err(InputError::new(message));
            };
            for (kept, is_one) in keeps.iter_mut().zip(lines_of_sight(estimated, truth)) {
                if is_one && std::mem::replace(kept, false) {
                    self.lines_of_sight.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
        keep(estimated, &keeps);
        Ok(())
    }
}

/// Which paths are the line of sight in truth, each by itself: its images, by errors of the arrays, and a ground bounce that is one path with
/// it would show the GMT as well.
fn lines_of_sight(estimated: &Estimated, (pose, link): &(PoseTruth, Link)) -> Vec<bool> {
    let mut alone = link.clone();
    alone.paths.retain(|path| path.is_line_of_sight());
    let is_one = |path: &EstimatedPath| {
        let gates = MatchGates::default();
        let found = matches(
            &[MeasuredPath::from(path)],
            &alone,
            pose,
            &gates,
            Some(Waveform::default().delay_period().length_m()),
        );
        found.iter().any(Option::is_some)
    };
    estimated.paths.iter().map(is_one).collect()
}

/// Leaves out the paths that are not kept. The bearing stays with its path.
pub(crate) fn keep(estimated: &mut Estimated, keeps: &[bool]) {
    let is_kept = |index: &usize| keeps.get(*index).copied().unwrap_or(true);
    let paths = std::mem::take(&mut estimated.paths);
    let kept = paths.iter().enumerate().filter(|(index, _)| is_kept(index));
    estimated.paths = kept.map(|(_, path)| *path).collect();
    estimated.sighted = estimated
        .sighted
        .take()
        .filter(|(path, _)| is_kept(path))
        .map(|(path, bearing)| ((0..path).filter(is_kept).count(), bearing));
}

impl<S: Source> Source for Thinned<'_, S> {
    fn sweeps(&self) -> u32 {
        self.source.sweeps()
    }

    fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
        self.source.events()
    }

    fn makers(&self) -> usize {
        self.source.makers()
    }

    fn sweep(&self, sweep: u32) -> Result<Given, InputError> {
        let mut given = self.source.sweep(sweep)?;
        if let Some(estimated) = &mut given.estimated {
            self.thin(sweep, estimated, given.truth.as_ref())?;
        }
        Ok(given)
    }

    fn truth(&self, uav_time_ns: u64) -> Option<PoseTruth> {
        self.source.truth(uav_time_ns)
    }
}

#[cfg(test)]
mod tests {
    use cslam_core::beam_squint::Refusal;
    use cslam_core::geometry::{Direction, Matrix3};
    use cslam_core::path::Path;
    use cslam_core::paths::EstimatedPath;

    use super::*;
    use crate::test_flight::true_path;

    const LENGTHS_M: [f32; 4] = [62.0, 50.0, 55.0, 70.0];

    /// Eight sweeps, half a second each, of four paths; the second is the line of sight, and the last one listened to.
    #[derive(Debug)]
    struct Fixed {
        knows: bool,
    }

    impl Source for Fixed {
        fn sweeps(&self) -> u32 {
            8
        }

        fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
            Box::new((0..8).map(|sweep| Stamped {
                uav_time_ns: u64::from(sweep + 1) * 500_000_000,
                event: Event::Sweep { sweep },
            }))
        }

        fn sweep(&self, _: u32) -> Result<Given, InputError> {
            let aoa = |k: usize| Direction::from_zenith_azimuth(1.5, k as f32).expect("angles");
            let paths = LENGTHS_M
                .into_iter()
                .enumerate()
                .map(|(k, c_tau_m)| EstimatedPath {
                    path: Path {
                        c_tau_m,
                        aoa: aoa(k),
                        aod: None,
                        covariance: Matrix3::identity(),
                    },
                    beam: 0,
                    snr_db: 20.0,
                    energy: 1.0,
                    range_rate: None,
                });
            let order = |k: usize| u8::from(k != 1);
            let link = Link {
                paths: (0..4)
                    .map(|k| true_path(order(k), f64::from(LENGTHS_M[k]), [1.5, k as f64]))
                    .collect(),
                ..Link::default()
            };
            let pose = PoseTruth {
                position_m: [0.0; 3],
                quaternion_wb: [1.0, 0.0, 0.0, 0.0],
                velocity_m_per_s: [0.0; 3],
                clock_offset_s: 0.0,
            };
            Ok(Given {
                estimated: Some(Estimated {
                    paths: paths.collect(),
                    sighted: Some((3, Err(Refusal::NoPeak))),
                    ..Estimated::default()
                }),
                truth: self.knows.then_some((pose, link)),
                ..Given::default()
            })
        }

        fn truth(&self, _: u64) -> Option<PoseTruth> {
            None
        }
    }

    fn lengths_m(source: &impl Source, sweep: u32) -> Vec<f32> {
        let estimated = source.sweep(sweep).expect("known").estimated.expect("there");
        estimated.paths.iter().map(|path| path.path.c_tau_m).collect()
    }

    #[test]
    fn the_line_of_sight_alone_is_cut_out_of_the_spans_alone() {
        let fixed = Fixed { knows: true };
        let thinning = Thinning {
            without_sight: vec![
                "1.5..2.5".parse().expect("a span"),
                "4..9".parse().expect("a span"),
            ],
            ..Thinning::default()
        };
        let thinned = Thinned::new(&fixed, thinning);
        for sweep in 0..8 {
            let expected: &[f32] = if [2, 3, 7].contains(&sweep) {
                &[62.0, 55.0, 70.0]
            } else {
                &LENGTHS_M
            };
            assert_eq!(lengths_m(&thinned, sweep), expected, "{sweep}");
        }
        assert_eq!(thinned.left_out(), [3, 0]);
        // The bearing stays with its path, which is now the third.
        let estimated = thinned.sweep(2).expect("known").estimated.expect("there");
        assert_eq!(estimated.sighted, Some((2, Err(Refusal::NoPeak))));
        let blind = Fixed { knows: false };
        let thinned = Thinned::new(&blind, thinned.thinning.clone());
        assert!(thinned.sweep(1).is_ok());
        let said = thinned.sweep(2).expect_err("unknown").to_string();
        assert!(
            said.contains("sweep 2") && said.contains("truth_paths.jsonl"),
            "{said}"
        );
    }

    #[test]
    fn a_share_of_one_changes_nothing_and_a_seed_draws_the_same_again() {
        let fixed = Fixed { knows: false };
        let thinned = |share, seed| {
            let thinning = Thinning {
                share,
                seed,
                ..Thinning::default()
            };
            let thinned = Thinned::new(&fixed, thinning);
            let sweeps: Vec<_> = (0..8)
                .map(|sweep| thinned.sweep(sweep).expect("known").estimated.expect("there"))
                .collect();
            (sweeps, thinned.left_out())
        };
        let whole: Vec<_> = (0..8)
            .map(|sweep| fixed.sweep(sweep).expect("known").estimated.expect("there"))
            .collect();
        assert_eq!(thinned(1.0, 5), (whole, [0, 0]));
        let (half, left_out) = thinned(0.5, 5);
        assert_eq!((half.clone(), left_out), thinned(0.5, 5));
        assert_ne!(half, thinned(0.5, 6).0);
        assert!((8..24).contains(&left_out[1]), "{left_out:?}");
        for sweep in &half {
            // The bearing goes with its path, the last.
            let last = sweep.paths.last().is_some_and(|path| path.path.c_tau_m == 70.0);
            let expected = last.then(|| (sweep.paths.len() - 1, Err(Refusal::NoPeak)));
            assert_eq!(sweep.sighted, expected);
        }
        assert_eq!(thinned(0.0, 5).1, [0, 32]);
    }

    #[test]
    fn what_is_no_span_is_refused() {
        for text in ["", "3", "3..", "5..4", "4..4", "a..b", "1..inf"] {
            assert!(text.parse::<Span>().is_err(), "{text}");
        }
    }
}
