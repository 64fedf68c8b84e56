//! The end of a sweep: which path is what, what it says about the pose, and what the pose makes of it.
//!
//! Twice through the paths. With the pose that is expected, the line of sight goes to the localizer, or without one the reflections that known
//! surfaces explain; with the pose that comes back, the paths are classified and associated, and what passes becomes points.

use heapless::Vec;
use nalgebra::Vector3;

use super::bend::Bend;
use super::departure::face_direction;
use super::mapping::{Mapping, Station};
use super::paths::{ClassifiedPath, MeasuredPath};
use super::receive::ends;
use super::report::{Innovation, Measured, Outcome, PathReport, SweepReport};
use super::sight::Sight;
use super::{LinkStates, PATHS, count};
use crate::association::Verdict;
use crate::beam_squint::{Bearing, Refusal};
use crate::estimator::{Counters, SweepMeasurement, SweepVerdict, Transmitter};
use crate::link_state::LinkState;
use crate::numeric::gather;
use crate::paths::EstimatedPath;
use crate::receiver::{Radio, Receiver};

/// What the localizer made of a sweep.
#[derive(Clone, Debug)]
struct Localized {
    /// Path that was taken for the line of sight.
    line: Option<usize>,
    verdict: SweepVerdict,
    innovations: Vec<Innovation, 3>,
}

impl Default for Localized {
    fn default() -> Self {
        Self {
            line: None,
            verdict: SweepVerdict::NoSight,
            innovations: Vec::new(),
        }
    }
}

/// A sweep in hand.
#[derive(Clone, Debug)]
pub(super) struct Open {
    pub(super) sweep: u32,
    pub(super) time_ns: u64,
    pub(super) beams: u16,
    pub(super) beacon_heard: bool,
    /// Set when its beams are over.
    pub(super) paths: Option<Vec<EstimatedPath, PATHS>>,
    /// Path that is listened to in the squint symbols.
    pub(super) sighted: Option<usize>,
    /// Whether beam squint took it, with the bearing where somebody else has read one.
    pub(super) squint: Result<Option<Bearing>, Refusal>,
    /// How fast the body turned when it began, body axes.
    pub(super) turn_rad_per_s: Vector3<f32>,
}

impl Open {
    pub(super) fn new(sweep: u32, time_ns: u64, turn_rad_per_s: Vector3<f32>) -> Self {
        Self {
            sweep,
            time_ns,
            beams: 0,
            beacon_heard: false,
            paths: None,
            sighted: None,
            squint: Err(Refusal::NotBegun),
            turn_rad_per_s,
        }
    }
}

impl<R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'_, R, VOXELS, STATES> {
    /// Ends the beams of the sweep in hand: its paths are estimated, and one of them may be listened to by beam squint. The first squint
    /// symbol, or the end of the sweep, does so too.
    pub fn close_beams(&mut self) {
        if self.open.as_ref().is_none_or(|open| open.paths.is_some()) {
            return;
        }
        let paths = R::finish(self.memory.estimator);
        self.close_with(paths);
    }

    /// The same with these paths.
    pub(super) fn close_with(&mut self, paths: Vec<EstimatedPath, PATHS>) {
        let time_ns = self.open.as_ref().map_or(0, |open| open.time_ns);
        let measured = self.with_gain(&paths);
        // Beam squint listens where the pose puts the line of sight: not when it is elsewhere.
        let sighted = self
            .line_of_sight(&measured, time_ns)
            .filter(|sight| sight.expected)
            .map(|sight| sight.index);
        let squint = match sighted.map(|index| self.sighting(&measured, index, time_ns)) {
            Some(Some(sighting))
                if sighted
                    .and_then(|index| measured.get(index))
                    .is_some_and(|path| self.listens(path)) =>
            {
                R::listen(self.memory.squint, &sighting).map(|()| None)
            }
            Some(_) => Err(Refusal::NotBegun),
            None => Err(Refusal::NotLineOfSight),
        };
        if let Some(open) = &mut self.open {
            open.paths = Some(paths);
            open.sighted = sighted;
            open.squint = squint;
        }
    }

    /// Ends the sweep in hand. `None` when there is none.
    pub fn end_sweep(&mut self) -> Option<SweepReport<PATHS>> {
        self.close_beams();
        let open = self.open.take()?;
        self.count_sweep(&open);

        let measured = self.with_gain(open.paths.as_deref().unwrap_or(&[]));
        let bearing = open.squint.and_then(|given| {
            given.map_or_else(|| R::bearing(self.memory.squint, self.config.departures), Ok)
        });
        let beacon = self.transmitter(open.time_ns);
        let localized = match &beacon {
            Some((gmt, stop)) => self.localize(&open, &measured, gmt, *stop, bearing.ok().as_ref()),
            None => Localized::default(),
        };

        let pose = self.localizer.pose();
        let gmt = beacon.map(|(claimed, _)| self.localizer.transmitter().copied().unwrap_or(claimed));
        let ends_known = pose.as_ref().zip(gmt.as_ref());
        let classified = ends_known.map_or_else(Vec::new, |(pose, gmt)| self.classify(&measured, pose, gmt));
        let received = self.to_associate(&measured, &classified);
        let mapping = match ends_known {
            Some((pose, transmitter)) => {
                let station = Station {
                    pose,
                    transmitter,
                    sweep: open.sweep,
                    line: localized.line,
                };
                self.map_sweep(&station, &received, &classified)
            }
            None => Mapping::default(),
        };

        let paths = path_reports(&measured, &classified, &mapping.outcomes);
        Some(SweepReport {
            sweep: open.sweep,
            time_ns: open.time_ns,
            beams: open.beams,
            link: link_state(&paths, localized.line),
            paths,
            points: mapping.points,
            surfaces: mapping.surfaces,
            verdict: localized.verdict,
            innovations: localized.innovations,
            bearing,
            clock_offset_m: pose.as_ref().and_then(|pose| self.clock_offset_m(pose)),
            ends: ends_known.and_then(|(pose, gmt)| ends(pose, &gmt.position_m).ok()),
            pose,
            health: self.localizer.health(),
        })
    }

    fn count_sweep(&mut self, open: &Open) {
        count(&mut self.counters.sweeps);
        if !open.beacon_heard {
            count(&mut self.counters.beacons_missing);
        }
    }

    /// Hands the sweep to the localizer: which path was the line of sight, and what became of it.
    fn localize(
        &mut self,
        open: &Open,
        measured: &[MeasuredPath],
        gmt: &Transmitter,
        stop: u32,
        bearing: Option<&Bearing>,
    ) -> Localized {
        let sight = self.line_of_sight(measured, open.time_ns);
        let association = match self.localizer.expected() {
            Some(pose) if sight.map_or(self.config.map_aided, |sight| !sight.proves_itself()) => {
                let classified = self.classify(measured, &pose, &self.localizer.plausible(open.time_ns, gmt));
                self.associated(measured, &classified, gmt, open.time_ns)
            }
            _ => None,
        };
        // What comes straight, against the pose, may be the wave that two parallel walls have turned back into its direction; what comes from where
        // the GMT is, but weaker than straight, the ground's bounce.
        let is_reflected = |sight: &Sight| {
            let verdict = association
                .as_ref()
                .and_then(|association| association.verdicts.get(sight.index));
            !sight.proves_itself() && verdict.is_some_and(Verdict::may_be_reflected)
        };
        let sight = sight.filter(|sight| !is_reflected(sight));
        let line = sight.map(|sight| sight.index);
        let line_of_sight = sight.and_then(|sight| {
            let squint = bearing.filter(|_| line == open.sighted).map(face_direction);
            let path = measured.get(sight.index)?;
            self.line_measurement(path, &sight.bend, squint, gmt, open.time_ns)
        });
        let contrary = match (line, &self.config.link_states) {
            (Some(_), _) | (_, LinkStates::Paper(_)) => None,
            _ => self.contrary(measured, open.time_ns),
        };
        let contrary = contrary
            .and_then(|index| measured.get(index))
            .and_then(|path| self.line_measurement(path, &Bend::default(), None, gmt, open.time_ns));
        let departure = line_of_sight.and_then(|path| path.departure);
        let self_consistent = line
            .and_then(|index| measured.get(index))
            .zip(departure)
            .is_some_and(|(path, left)| self.is_self_consistent(path, &left, gmt, open.time_ns));
        // There is room for every path.
        let measurements: Vec<_, PATHS> = gather(
            measured
                .iter()
                .filter_map(|path| self.measurement(path, None, gmt)),
        );
        let reflections = association
            .filter(|_| line.is_none() && self.config.map_aided)
            .map_or(Vec::new(), |association| {
                self.reflections(measured, &association, gmt)
            });
        let before = self.localizer.counters();
        let (confirmed, had_pose) = (self.localizer.is_confirmed(), self.localizer.pose().is_some());
        let verdict = self.localizer.sweep(
            open.sweep,
            &SweepMeasurement {
                time_ns: open.time_ns,
                gmt: *gmt,
                stop,
                line_of_sight,
                self_consistent,
                contrary,
                reflections: &reflections,
                paths: &measurements,
                delta_ranges: self.config.delta_ranges,
            },
        );
        self.take_surfaces_back(verdict);
        self.imu.set_errors(self.localizer.imu_errors());
        let after = self.localizer.counters();
        if after.clock_steps != before.clock_steps {
            self.clock.confirm();
        } else if after.timing_refuted != before.timing_refuted {
            self.clock.refute();
        }
        let given_up = had_pose && self.localizer.pose().is_none();
        if (verdict == SweepVerdict::Refixed && line.is_none() || given_up) && !confirmed {
            // Whatever that pose has put into the map lies elsewhere.
            self.clear_map();
        }
        let joint = line_of_sight.map(|path| if path.departure.is_some() { 5 } else { 3 });
        Localized {
            line,
            verdict,
            innovations: self.innovations(verdict, joint, &before),
        }
    }

    /// How well the sweep's measurements, and the timing since the last one, met the filter's expectation.
    fn innovations(
        &self,
        verdict: SweepVerdict,
        line_of_sight: Option<u8>,
        before: &Counters,
    ) -> Vec<Innovation, 3> {
        let (Some(ratios), Some(gates)) = (self.localizer.test_ratios(), self.config.localization.gates())
        else {
            return Vec::new();
        };
        let after = self.localizer.counters();
        let classified = !matches!(
            verdict,
            SweepVerdict::NoSight | SweepVerdict::Waiting | SweepVerdict::Started | SweepVerdict::TooLate
        );
        let line = line_of_sight.filter(|_| classified).map(|dof| Innovation {
            measured: Measured::LineOfSight,
            dof,
            test_ratio: ratios.line_of_sight,
            gate: if dof == 5 { gates.five } else { gates.three } as f32,
            accepted: matches!(verdict, SweepVerdict::Accepted | SweepVerdict::Refixed),
        });
        let timing = Some(Innovation {
            measured: Measured::TwoWayTiming,
            dof: 1,
            test_ratio: ratios.two_way,
            gate: gates.one as f32,
            accepted: after.timing_rejected == before.timing_rejected,
        });
        let reflection = (after.reflections != before.reflections).then_some(Innovation {
            measured: Measured::Reflection,
            dof: 5,
            test_ratio: ratios.reflection,
            gate: gates.five as f32,
            accepted: true,
        });
        gather([line, timing, reflection].into_iter().flatten())
    }
}

/// What is told of each path.
fn path_reports(
    measured: &[MeasuredPath],
    classified: &[ClassifiedPath],
    outcomes: &[Outcome],
) -> Vec<PathReport, PATHS> {
    gather(measured.iter().enumerate().map(|(index, path)| {
        PathReport {
            estimated: path.estimated,
            gain_db: path.gain_db,
            in_world: classified.get(index).map(|classified| classified.path),
            probabilities: classified
                .get(index)
                .and_then(|classified| classified.probabilities),
            outcome: outcomes.get(index).cloned().unwrap_or(Outcome::NoPose),
        }
    }))
}

/// The link state of a sweep: what the network says of the strongest path, or else whether it was taken for the line of sight.
fn link_state(paths: &[PathReport], line: Option<usize>) -> LinkState {
    match paths.first() {
        None => LinkState::Outage,
        Some(strongest) => match (&strongest.probabilities, line) {
            (Some(probabilities), _) => probabilities.state(),
            (None, Some(0)) => LinkState::LineOfSight,
            (None, _) => LinkState::HigherOrder,
        },
    }
}
