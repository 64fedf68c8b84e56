//! Keeps the log of a flight: the receiver's reports beside the world's truth.

use cslam_core::association::{Decision, Verdict};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::estimator::Pose;
use cslam_core::geometry::Matrix3;
use cslam_core::map::PointCloud;
use cslam_core::receiver::{self, MappedPoint, Outcome, PATHS, PathReport, SurfaceChanges, SweepReport};
use cslam_core::telemetry::Key;
use cslam_firmware::sensor_stream::UAV;
use nalgebra::{Rotation3, UnitQuaternion};

use crate::evaluation::downlink;
use crate::flight_log::{
    FlightLog, Header, Innovation, LinkEstimate, MapVoxel, MeasuredPath, Measurement, PointRecord,
    PoseEstimate, PoseRecord, PoseTruth, SweepEstimate, SweepRecord, SweepTruth,
};
use crate::paths::Link;

/// A log in the making.
pub(super) struct Logbook {
    log: FlightLog,
    gmt_index: u32,
    /// Position of the GMT by its last beacon, m.
    gmt_m: Option<[f64; 3]>,
    /// The same when its last stop began.
    last_stop_m: Option<[f64; 3]>,
}

/// The GMT has moved on when it is this far from where it was, m.
const MOVED_M: f64 = 0.5;

impl Logbook {
    pub(super) fn new(header: Header, voxel_edge_m: f32) -> Self {
        Self::over(FlightLog::new(header, f64::from(voxel_edge_m)))
    }

    /// A log that is made already and goes on.
    pub(super) fn over(log: FlightLog) -> Self {
        Self {
            log,
            gmt_index: 0,
            gmt_m: None,
            last_stop_m: None,
        }
    }

    pub(super) fn count(&mut self, what: &str) {
        self.add(what, 1);
    }

    /// Adds to a counter that is there only when something was counted.
    pub(super) fn add(&mut self, what: &str, count: u64) {
        if count > 0 {
            *self.log.counters.entry(what.to_owned()).or_default() += count;
        }
    }

    /// Enters the pose between sweeps, at a time of the UAV's clock.
    pub(super) fn pose(
        &mut self,
        time_ns: u64,
        pose: Option<&Pose>,
        clock_offset_m: Option<f64>,
        truth: Option<PoseTruth>,
    ) {
        self.log.poses.push(PoseRecord {
            time_s: seconds(time_ns),
            estimate: pose.map(|pose| pose_estimate(pose, clock_offset_m)),
            truth,
        });
    }

    /// Hears a beacon.
    pub(super) fn beacon(&mut self, gmt_m: [f64; 3]) {
        self.gmt_m = Some(gmt_m);
        match self.last_stop_m {
            Some(last) => {
                if (0..3).map(|i| (gmt_m[i] - last[i]).powi(2)).sum::<f64>() > MOVED_M * MOVED_M {
                    self.gmt_index += 1;
                    self.last_stop_m = Some(gmt_m);
                }
            }
            None => self.last_stop_m = Some(gmt_m),
        }
    }

    /// Enters a sweep with its points.
    pub(super) fn sweep(&mut self, report: &SweepReport<PATHS>, truth: Option<(PoseTruth, Link)>) {
        let time_s = seconds(report.time_ns);
        let estimate = SweepEstimate {
            pose: report
                .pose
                .as_ref()
                .map(|pose| pose_estimate(pose, report.clock_offset_m)),
            gmt_position_m: self.gmt_m,
            gmt_index: self.gmt_index,
            paths: report.paths.iter().map(measured).collect(),
            link: Some(LinkEstimate {
                state: report.link as u8,
                probabilities: report
                    .paths
                    .first()
                    .and_then(|p| p.probabilities)
                    .map(|p| p.to_array().map(f64::from)),
            }),
            los_used: report.verdict.is_taken(),
            innovations: report.innovations.iter().map(innovation).collect(),
        };
        let (pose, link) = match truth {
            Some((pose, link)) => (Some(pose), Some(link)),
            None => (None, None),
        };
        self.log.sweeps.push(SweepRecord {
            sweep: report.sweep,
            time_s,
            estimate,
            truth: SweepTruth {
                pose,
                link,
                matches: Vec::new(),
            },
        });
        self.map(report.sweep, &report.points, &report.surfaces);
    }

    /// A sweep that has been entered.
    pub(super) fn sweep_mut(&mut self, sweep: u32) -> Option<&mut SweepRecord> {
        let found = self
            .log
            .sweeps
            .binary_search_by_key(&sweep, |record| record.sweep);
        self.log.sweeps.get_mut(found.ok()?)
    }

    /// Enters what a sweep puts into the map, points of it and of earlier ones, and what becomes of their surfaces then.
    pub(super) fn map(&mut self, sweep: u32, points: &[MappedPoint], surfaces: &SurfaceChanges) {
        for mapped in points {
            self.point(sweep, mapped);
        }
        self.follow(surfaces);
    }

    /// Enters a point of a sweep that has been entered.
    fn point(&mut self, mapped_sweep: u32, mapped: &MappedPoint) {
        let [reflection, order] = mapped.reflection;
        let mut point = PointRecord {
            sweep: mapped.sweep,
            path: mapped.path,
            order,
            reflection,
            surface: mapped.surface,
            mapped_sweep: Some(mapped_sweep),
            time_s: 0.0,
            gmt_index: 0,
            position_m: mapped.point.position.to_array().map(f64::from),
            covariance_trace_m2: f64::from(mapped.point.covariance.trace()),
            probability: Some(f64::from(mapped.probability)),
            snr_db: None,
        };
        if let Some(sweep) = self.log.sweep_of(&point) {
            point.time_s = sweep.time_s;
            point.gmt_index = sweep.estimate.gmt_index;
            let path = sweep.estimate.paths.get(usize::from(point.path));
            point.snr_db = path.and_then(|path| path.snr_db);
        }
        let verdict = if order > 1 {
            MeasuredPath::OK_HIGHER_ORDER
        } else {
            MeasuredPath::OK
        };
        self.say(&point, verdict);
        self.log.points.push(point);
    }

    /// Points follow their surface into another one, and leave with one that is not believed any more.
    fn follow(&mut self, changes: &SurfaceChanges) {
        for (gone, stays) in &changes.merged {
            for point in &mut self.log.points {
                if point.surface == Some(*gone) {
                    point.surface = Some(*stays);
                }
            }
        }
        let is_withdrawn =
            |point: &PointRecord| point.surface.is_some_and(|id| changes.withdrawn.contains(&id));
        let (withdrawn, stay) = std::mem::take(&mut self.log.points)
            .into_iter()
            .partition(is_withdrawn);
        self.log.points = stay;
        let withdrawn: Vec<PointRecord> = withdrawn;
        for point in &withdrawn {
            self.say(point, MeasuredPath::WITHDRAWN);
        }
    }

    /// What became of the path of a point.
    fn say(&mut self, point: &PointRecord, verdict: &str) {
        let Some(place) = self.log.place_of(point) else {
            return;
        };
        let path = self.log.sweeps[place]
            .estimate
            .paths
            .get_mut(usize::from(point.path));
        if let Some(path) = path {
            verdict.clone_into(&mut path.verdict);
        }
    }

    /// Closes the log with the receiver's map and the packets that it sent.
    pub(super) fn close<const N: usize>(mut self, map: &PointCloud<N>, packets: &[u8]) -> FlightLog {
        let heard = downlink::decode(packets, UAV, &Key::TEST);
        let verdicts: Vec<String> = self
            .log
            .sweeps
            .iter()
            .flat_map(|sweep| &sweep.estimate.paths)
            .map(|path| path.verdict.clone())
            .collect();
        for verdict in &verdicts {
            self.count(verdict);
        }
        self.log.health = heard.health_counters();
        self.log.downlink = heard.traffic;
        self.with_map(map)
    }

    /// The log with this map, and its points by their sweeps.
    pub(super) fn with_map<const N: usize>(mut self, map: &PointCloud<N>) -> FlightLog {
        self.log.points.sort_by_key(|point| point.sweep);
        self.log.map = map.points().map(MapVoxel::from).collect();
        self.log
    }
}

fn seconds(time_ns: u64) -> f64 {
    time_ns as f64 * 1e-9
}

fn innovation(of: &receiver::Innovation) -> Innovation {
    Innovation {
        measurement: match of.measured {
            receiver::Measured::LineOfSight => Measurement::Los,
            receiver::Measured::TwoWayTiming => Measurement::Timing,
            receiver::Measured::Reflection => Measurement::Reflection,
        },
        dof: u32::from(of.dof),
        nis: f64::from(of.test_ratio) * f64::from(of.gate),
        test_ratio: f64::from(of.test_ratio),
        accepted: of.accepted,
    }
}

/// What became of a path, in words.
pub fn verdict(path: &PathReport) -> String {
    outcome(&path.outcome)
}

/// What an outcome is called.
pub(super) fn outcome(of: &Outcome) -> String {
    match of {
        Outcome::NoPose => MeasuredPath::NO_POSE.into(),
        Outcome::Unused => "not used in this mode".into(),
        Outcome::Input(error) => error.to_string(),
        Outcome::LineOfSight => "line of sight".into(),
        Outcome::NotFirstOrder => MeasuredPath::NOT_FIRST_ORDER.into(),
        Outcome::Rejected(rejection) => rejection.to_string(),
        Outcome::Point => MeasuredPath::OK.into(),
        Outcome::Associated(verdict) => decision(verdict).into(),
    }
}

/// What data association says of a path. That it became points is said when these come.
fn decision(verdict: &Verdict) -> &'static str {
    match verdict.decision {
        Decision::Explained if verdict.chain.is_empty() => "line of sight",
        Decision::Explained => MeasuredPath::WITHOUT_POINT,
        Decision::Tentative | Decision::New => MeasuredPath::NOT_CONFIRMED,
        Decision::Ambiguous => MeasuredPath::AMBIGUOUS,
        Decision::Unexplained => MeasuredPath::UNEXPLAINED,
    }
}

fn measured(path: &PathReport) -> MeasuredPath {
    MeasuredPath {
        probabilities: path.probabilities.map(|p| p.to_array().map(f64::from)),
        verdict: verdict(path),
        ..MeasuredPath::from(&path.estimated)
    }
}

fn rows(matrix: &Matrix3<f32>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(matrix[(i, j)])))
}

/// A pose with the clock offset that the receiver makes of it, m ([`Receiver::clock_offset_m`](cslam_core::receiver::Receiver::clock_offset_m)), in SI units.
pub fn pose_estimate(pose: &Pose, clock_offset_m: Option<f64>) -> PoseEstimate {
    let matrix = Rotation3::from_matrix_unchecked(pose.attitude.matrix().map(f64::from));
    let q = UnitQuaternion::from_rotation_matrix(&matrix);
    PoseEstimate {
        position_m: (*pose.position.vector()).into(),
        quaternion_wb: [q.w, q.i, q.j, q.k],
        velocity_m_per_s: pose.velocity_m_per_s.map(f64::from).into(),
        position_covariance_m2: rows(&pose.position_covariance_m2),
        attitude_covariance_rad2: rows(&pose.attitude_covariance_rad2),
        velocity_covariance_m2_per_s2: rows(&pose.velocity_covariance_m2_per_s2),
        clock_offset_s: clock_offset_m.map(|offset_m| offset_m / SPEED_OF_LIGHT_M_PER_S),
        clock_sigma_s: Some(f64::from(pose.clock.offset_sigma_m) / SPEED_OF_LIGHT_M_PER_S),
    }
}
