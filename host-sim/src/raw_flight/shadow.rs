//! The data association that is to follow, beside the one that flies: the same paths and poses, surfaces and points of its own.
//!
//! It sees what the receiver reports of each sweep, and changes nothing.

use cslam_core::association::{
    AssociationConfig, Learned, PoseEstimate, ReceivedPath, SweepPaths, associate,
};
use cslam_core::cslam::{PATHS, SweepReport};
use cslam_core::geometry::Position;
use cslam_core::map::PointCloud;
use cslam_core::reflection::ReflectionPoint;
use cslam_core::surfaces::{SurfaceConfig, Surfaces};
use cslam_firmware::app::VOXELS;

use crate::flight_log::{FlightLog, MapVoxel, PointRecord, ShadowLog};

/// Surfaces that are kept.
const SURFACES: usize = 32;
/// The transmitter's place must be known better than this, m per axis, as for the map that flies.
const MOST_TRANSMITTER_SIGMA_M: f64 = 3.0;

/// A point, the surface it lies on, and which reflection of how many it is.
struct Kept {
    surface: u16,
    sweep: u32,
    path: u8,
    order: u8,
    reflection: u8,
    point: ReflectionPoint,
}

/// An association in the making.
pub struct Shadow {
    surfaces: Box<Surfaces<SURFACES>>,
    config: AssociationConfig,
    kept: Vec<Kept>,
    withdrawn: u64,
}

impl Shadow {
    /// Knows of the ground that it is about at this height, m, world frame.
    pub fn new(ground_z_m: f64) -> Self {
        let config = SurfaceConfig::default();
        let surfaces = Position::new(0.0, 0.0, ground_z_m as f32).map_or_else(
            |_| Surfaces::new(config),
            |beneath| Surfaces::with_ground(config, beneath),
        );
        Self {
            surfaces: Box::new(surfaces),
            config: AssociationConfig::default(),
            kept: Vec::new(),
            withdrawn: 0,
        }
    }

    /// Takes in a sweep.
    pub fn sweep(&mut self, report: &SweepReport<PATHS>) {
        let pose = report.pose.as_ref().filter(|_| !report.health.lost);
        let transmitter = report
            .transmitter
            .as_ref()
            .filter(|transmitter| transmitter.sigma_m < MOST_TRANSMITTER_SIGMA_M);
        let (Some(pose), Some(transmitter)) = (pose.and_then(PoseEstimate::of), transmitter) else {
            return;
        };
        let paths: heapless::Vec<ReceivedPath, PATHS> =
            report.paths.iter().map(|path| path.received).collect();
        let association = associate(&paths, &pose, transmitter, &self.surfaces, &self.config);
        let sweep = SweepPaths {
            paths: &paths,
            pose: &pose,
            transmitter,
            sweep: report.sweep,
        };
        let learned = self.surfaces.learn(&association, &sweep, &self.config);
        self.keep(&learned);
    }

    /// Points come, go to the surface that theirs went into, and go with one that is not confirmed any more.
    fn keep(&mut self, learned: &Learned<SURFACES>) {
        // The points of a path stand together, from the transmitter on.
        for of_path in learned
            .points
            .chunk_by(|a, b| (a.sweep, a.path) == (b.sweep, b.path))
        {
            for (reflection, point) in (1..).zip(of_path) {
                self.kept.push(Kept {
                    surface: point.surface,
                    sweep: point.sweep,
                    path: point.path,
                    order: of_path.len() as u8,
                    reflection,
                    point: point.point,
                });
            }
        }
        for (gone, stays) in &learned.merged {
            for kept in self.kept.iter_mut().filter(|kept| kept.surface == *gone) {
                kept.surface = *stays;
            }
        }
        let gone = |surface: u16| {
            learned.changes.demoted.contains(&surface) || learned.changes.died.contains(&surface)
        };
        let before = self.kept.len();
        self.kept.retain(|kept| !gone(kept.surface));
        self.withdrawn += (before - self.kept.len()) as u64;
    }

    /// Its points and map, of the flight with this log.
    pub fn close(mut self, log: &FlightLog) -> ShadowLog {
        let mut map = Box::new(PointCloud::<VOXELS>::new());
        self.kept.sort_by_key(|kept| kept.sweep);
        let mut points = Vec::new();
        for kept in &self.kept {
            let _beyond = map.insert(&kept.point);
            let mut point = PointRecord {
                sweep: kept.sweep,
                path: kept.path,
                order: kept.order,
                reflection: kept.reflection,
                time_s: 0.0,
                gmt_index: 0,
                position_m: kept.point.position.to_array().map(f64::from),
                covariance_trace_m2: f64::from(kept.point.covariance.trace()),
                probability: None,
                snr_db: None,
            };
            if let Some(sweep) = log.sweep_of(&point) {
                point.time_s = sweep.time_s;
                point.gmt_index = sweep.estimate.gmt_index;
            }
            points.push(point);
        }
        ShadowLog {
            points,
            map: map.points().map(MapVoxel::from).collect(),
            withdrawn: self.withdrawn,
        }
    }
}
