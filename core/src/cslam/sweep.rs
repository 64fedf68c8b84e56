//! The end of a sweep: which path is what, what it says about the pose, and what the pose makes of it.
//!
//! Twice through the paths. With the pose that is expected, they are classified, and the line of sight and the mirrors go
//! to the localizer; with the pose that comes back, they are classified again and solved, and what passes becomes points.

use heapless::Vec;

use super::config::{Departures, LinkStates, Mapped};
use super::receive::{ends, to_world};
use super::report::{Outcome, PathReport, SweepReport};
use super::{CHANNELS, Cslam, PATHS, PLANES, count};
use crate::array::GmtArrays;
use crate::geometry::{Direction, Gmt, Rotation, World};
use crate::localization::Pose;
use crate::localization::bsm::{Bearing, Refusal};
use crate::localization::filter::{
    FaceDirection, MappedPlane, PathMeasurement, SweepMeasurement, SweepVerdict, Transmitter, wrap_delay_m,
};
use crate::lscn::{LinkGeometry, LinkState, Probabilities, Received};
use crate::ltd::{EstimatedPath, PathEstimator};
use crate::path::Path;
use crate::reflection::{Ends, Rejection, Verdict, solve};

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
    /// Whether beam squint took it.
    pub(super) squint: Result<(), Refusal>,
}

impl Open {
    pub(super) fn new(sweep: u32, time_ns: u64) -> Self {
        Self {
            sweep,
            time_ns,
            beams: 0,
            beacon_heard: false,
            paths: None,
            sighted: None,
            squint: Err(Refusal::NotBegun),
        }
    }
}

/// A path with all that is said of it before there is a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heard {
    pub(super) estimated: EstimatedPath,
    pub(super) gain_db: Option<f32>,
}

/// A path as a pose sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    pub(super) path: Path<World>,
    pub(super) probabilities: Option<Probabilities>,
}

/// The GMT's pace between its stops, m/s: how fast its last known position ages.
const GMT_PACE_M_PER_S: f64 = 0.3;

impl<E: PathEstimator<CHANNELS, PATHS>, const VOXELS: usize, const STATES: usize>
    Cslam<'_, E, VOXELS, STATES>
{
    /// Ends the beams of the sweep in hand: its paths are estimated, and one of them may be listened to by beam squint.
    pub(super) fn close_beams(&mut self) {
        if self.open.as_ref().is_none_or(|open| open.paths.is_some()) {
            return;
        }
        let paths = self.estimator.finish();
        let time_ns = self.open.as_ref().map_or(0, |open| open.time_ns);
        let heard = self.heard(&paths);
        let judged = match (self.localizer.expected(), self.transmitter(time_ns)) {
            (Some(pose), Some((gmt, _))) => Some(self.judge(&heard, &pose, &gmt)),
            _ => None,
        };
        let sighted = self.line_of_sight(&heard, judged.as_deref(), time_ns);
        let squint = match sighted.map(|index| self.sighting(&heard, index, time_ns)) {
            Some(Some(sighting)) if self.config.departures != Departures::Beams => {
                self.squint.begin(&sighting)
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
        count(&mut self.counters.sweeps);
        if !open.beacon_heard {
            count(&mut self.counters.beacons_missing);
        }
        let heard = self.heard(open.paths.as_deref().unwrap_or(&[]));
        let bearing = open.squint.and_then(|()| self.bearing());
        let gmt = self.transmitter(open.time_ns);

        let (line, verdict) = match &gmt {
            Some((gmt, stop)) => self.localize(&open, &heard, gmt, *stop, bearing.ok().as_ref()),
            None => (None, SweepVerdict::NoSight),
        };
        let pose = self.localizer.pose();
        let judged = match (&pose, &gmt) {
            (Some(pose), Some((gmt, _))) => self.judge(&heard, pose, gmt),
            _ => Vec::new(),
        };
        let ends = match (&pose, &gmt) {
            (Some(pose), Some((gmt, _))) => ends(pose, &gmt.position_m).ok(),
            _ => None,
        };
        let mut paths = Vec::new();
        for (index, path) in heard.iter().enumerate() {
            let judged = judged.get(index);
            let outcome = match (&ends, judged) {
                (Some(ends), Some(judged)) => self.outcome(index, line, ends, judged),
                _ => Outcome::NoPose,
            };
            let _fits = paths.push(PathReport {
                estimated: path.estimated,
                gain_db: path.gain_db,
                probabilities: judged.and_then(|j| j.probabilities),
                outcome,
            });
        }
        if let Some(ends) = ends.filter(|_| self.config.map_aided) {
            self.planes.update(&self.map, &ends.uav);
        }
        let link = match paths.first() {
            None => LinkState::Outage,
            Some(strongest) => match (&strongest.probabilities, line) {
                (Some(probabilities), _) => probabilities.state(),
                (None, Some(0)) => LinkState::LineOfSight,
                (None, _) => LinkState::HigherOrder,
            },
        };
        Some(SweepReport {
            sweep: open.sweep,
            time_ns: open.time_ns,
            beams: open.beams,
            paths,
            link,
            verdict,
            bearing,
            clock_offset_m: pose.as_ref().and_then(|pose| {
                let offset_m = pose.clock.offset_m;
                Some(offset_m + whole_periods_m(self.clock.offset_m(open.time_ns)? - offset_m))
            }),
            pose,
            health: self.localizer.health(),
        })
    }

    /// The estimated paths with their gains. The estimator knows departures in the axes of the GMT's arrays; the beacon says
    /// how these stand in the world.
    fn heard(&self, paths: &[EstimatedPath]) -> Vec<Heard, PATHS> {
        let mast = self
            .last_beacon
            .map_or_else(Rotation::identity, |(_, beacon)| beacon.attitude);
        let to_world = |estimated: &EstimatedPath| {
            let mut estimated = *estimated;
            if let Some(departure) = &mut estimated.path.aod
                && let Ok(left) = Direction::<Gmt>::from_vector(*departure.direction.vector())
            {
                departure.direction = mast.apply(left);
            }
            estimated
        };
        paths
            .iter()
            .map(to_world)
            .map(|estimated| Heard {
                estimated,
                gain_db: self.config.budget.path_gain_db(
                    &estimated,
                    &self.config.arrays,
                    &self.config.codebook,
                    &mast,
                ),
            })
            .collect()
    }

    /// Where the GMT is, and at which of its stops: as the last beacon says, less sure the older it is.
    pub(super) fn transmitter(&self, time_ns: u64) -> Option<(Transmitter, u32)> {
        let (heard_ns, beacon) = self.last_beacon?;
        let age_s = time_ns.saturating_sub(heard_ns) as f64 * 1e-9;
        let moved_m = age_s * GMT_PACE_M_PER_S;
        let attitude = Rotation::from_matrix(beacon.attitude.matrix().map(f64::from)).ok()?;
        let transmitter = Transmitter {
            position_m: beacon.position_m,
            sigma_m: libm::sqrt(beacon.sigma_m * beacon.sigma_m + moved_m * moved_m),
            attitude,
        };
        Some((transmitter, beacon.sweep / beacon.sweeps_per_stop.max(1)))
    }

    fn face(&self, beam: u16) -> usize {
        self.config
            .codebook
            .beam(usize::from(beam))
            .map_or(0, |beam| beam.face)
    }

    fn bearing(&self) -> Result<Bearing, Refusal> {
        match self.config.departures {
            Departures::SquintFit => self.squint.fit(),
            Departures::SquintParabola => self.squint.parabola(),
            Departures::SquintPick => self.squint.pick(),
            Departures::Beams => Err(Refusal::NotBegun),
        }
    }

    /// The paths as a pose sees them, and what they are.
    fn judge(&self, heard: &[Heard], pose: &Pose, gmt: &Transmitter) -> Vec<Judged, PATHS> {
        let received: Vec<Received, PATHS> = heard
            .iter()
            .map(|heard| Received {
                path: to_world(
                    &heard.estimated,
                    self.localizer.corrected(&heard.estimated.path.aoa),
                    pose,
                    &self.config.residuals,
                ),
                gain_db: heard.gain_db,
            })
            .collect();
        let Ok(ends) = ends(pose, &gmt.position_m) else {
            return Vec::new();
        };
        match &self.config.link_states {
            LinkStates::Geometric(classifier) => {
                let link = LinkGeometry::new(&ends, &received).ok();
                received
                    .iter()
                    .map(|path| Judged {
                        path: path.path,
                        probabilities: link.as_ref().and_then(|link| classifier.path(link, path).ok()),
                    })
                    .collect()
            }
            LinkStates::Rules(rules) => received
                .iter()
                .map(|path| Judged {
                    path: path.path,
                    probabilities: Some(rules.path(&ends, &path.path)),
                })
                .collect(),
            LinkStates::Paper(classifier) => {
                let link = classifier.link(&received).ok().flatten();
                received
                    .iter()
                    .enumerate()
                    .map(|(index, path)| Judged {
                        path: path.path,
                        probabilities: link.filter(|_| index == 0),
                    })
                    .collect()
            }
        }
    }

    /// Hands the sweep to the localizer: which path was the line of sight, and what became of it.
    fn localize(
        &mut self,
        open: &Open,
        heard: &[Heard],
        gmt: &Transmitter,
        stop: u32,
        bearing: Option<&Bearing>,
    ) -> (Option<usize>, SweepVerdict) {
        let judged = self
            .localizer
            .expected()
            .map(|pose| self.judge(heard, &pose, gmt));
        let line = self.line_of_sight(heard, judged.as_deref(), open.time_ns);
        let line_of_sight = line.and_then(|index| heard.get(index)).and_then(|path| {
            let squint = bearing.filter(|_| line == open.sighted).map(face_direction);
            self.measurement(path, squint, gmt)
        });
        let (mut reflections, mut double_reflections) = (Vec::<_, PATHS>::new(), Vec::<_, PATHS>::new());
        if self.config.map_aided {
            let least = self.config.accept.min_probability;
            for (path, heard) in judged.iter().flatten().zip(heard) {
                let (Some(p), Some(measured)) = (path.probabilities, self.measurement(heard, None, gmt))
                else {
                    continue;
                };
                // There is room for every path.
                let _fits = if p.first_order >= least {
                    reflections.push(measured).is_ok()
                } else if p.higher_order >= least {
                    double_reflections.push(measured).is_ok()
                } else {
                    true
                };
            }
        }
        let planes: Vec<MappedPlane, PLANES> = self
            .planes
            .surfaces()
            .iter()
            .map(|surface| MappedPlane {
                id: surface.id,
                plane: surface.plane,
            })
            .collect();
        let verdict = self.localizer.sweep(
            open.sweep,
            &SweepMeasurement {
                time_ns: open.time_ns,
                gmt: *gmt,
                stop,
                line_of_sight,
                reflections: &reflections,
                double_reflections: &double_reflections,
                planes: &planes,
            },
        );
        self.imu.set_errors(self.localizer.imu_errors());
        let taken = matches!(
            verdict,
            SweepVerdict::Accepted | SweepVerdict::Inflated | SweepVerdict::Refixed | SweepVerdict::Started
        );
        if taken {
            self.last_sight_ns = Some(open.time_ns);
        }
        (line, verdict)
    }

    /// A path as the localizer takes it. Departure: beam squint where it listened to this path, else the sweep's beams.
    fn measurement(
        &self,
        heard: &Heard,
        squint: Option<FaceDirection>,
        gmt: &Transmitter,
    ) -> Option<PathMeasurement> {
        let path = &heard.estimated.path;
        let covariance = &path.covariance;
        Some(PathMeasurement {
            c_tau_m: f64::from(path.c_tau_m),
            c_tau_sigma_m: libm::sqrt(f64::from(covariance.m11.max(0.0))),
            aoa: Direction::from_vector(path.aoa.vector().map(f64::from)).ok()?,
            aoa_sigma_rad: libm::sqrt(f64::from(0.5 * (covariance.m22 + covariance.m33).max(0.0))),
            departure: squint.or_else(|| self.beam_departure(heard, gmt)),
        })
    }

    /// The direction of departure by the sweep's beams, as its face has it.
    fn beam_departure(&self, heard: &Heard, gmt: &Transmitter) -> Option<FaceDirection> {
        let departure = heard.estimated.path.aod?;
        let left = Direction::<World, f64>::from_vector(departure.direction.vector().map(f64::from)).ok()?;
        let left: Direction<Gmt, f64> = gmt.attitude.inverse().apply(left);
        let face = self.face(heard.estimated.beam);
        let arrays = GmtArrays::<f64>::default();
        let cosines = GmtArrays::<f64>::cosines(arrays.faces().get(face)?, &left);
        Some(FaceDirection {
            face,
            cosines,
            sigma: [f64::from(departure.sigma_rad); 2],
        })
    }

    /// What becomes of a path with the final pose.
    fn outcome(&mut self, index: usize, line: Option<usize>, ends: &Ends, judged: &Judged) -> Outcome {
        if line == Some(index) {
            return Outcome::LineOfSight;
        }
        if self.config.mapped == Mapped::Strongest && index > 0 {
            return Outcome::Unused;
        }
        let Some(probabilities) = judged.probabilities else {
            return Outcome::Unused;
        };
        let accept = self.config.accept;
        if probabilities.state() != LinkState::FirstOrder
            || probabilities.first_order < accept.min_probability
        {
            return Outcome::NotFirstOrder;
        }
        let excess_m = judged.path.c_tau_m - ends.uav.distance_m(&ends.gmt);
        match solve(ends, &judged.path, self.config.form, &accept.point) {
            Ok(Verdict::Accepted(_)) if excess_m < accept.min_excess_m => {
                Outcome::Rejected(Rejection::ExcessDelayTooSmall)
            }
            Err(error) => Outcome::Input(error),
            Ok(Verdict::Rejected(rejection)) => Outcome::Rejected(rejection),
            Ok(Verdict::Accepted(point)) => {
                // What lies beyond the map's range is counted there.
                let insertion = self.map.insert(&point).ok();
                Outcome::Point(point, insertion)
            }
        }
    }
}

/// The multiple of a delay period that is nearest to a length, m.
fn whole_periods_m(length_m: f64) -> f64 {
    length_m - wrap_delay_m(length_m)
}

/// A bearing as the localizer takes it.
fn face_direction(bearing: &Bearing) -> FaceDirection {
    let sigma = |variance: f32| libm::sqrt(f64::from(variance.max(0.0)));
    FaceDirection {
        face: bearing.face,
        cosines: bearing.cosines.map(f64::from),
        sigma: [sigma(bearing.covariance.m11), sigma(bearing.covariance.m22)],
    }
}
