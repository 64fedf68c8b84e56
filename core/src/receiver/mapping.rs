//! What becomes of the paths with the final pose: points on the surfaces that data association names, or of each path alone.

use heapless::Vec;

use super::config::Mapped;
use super::paths::{ClassifiedPath, MeasuredPath};
use super::receive::ends;
use super::report::{MappedPoint, Outcome, SurfaceChanges};
use super::{PATHS, SURFACES};
use crate::association::{
    self, Association, Decision, Learned, POINTS, PoseEstimate, ReceivedPath, SweepPaths, associate,
};
use crate::estimator::{Bounces, MappedPlane, Pose, ReflectedPath, SweepVerdict, Transmitter};
use crate::map::PointCloud;
use crate::numeric::gather;
use crate::receiver::{Radio, Receiver};
use crate::reflection::{Ends, Verdict, solve};

/// A point is mapped when the GMT's place is known better than this, m per axis.
/// Derived: where a pose counts as lost, so does the GMT.
pub const MOST_GMT_SIGMA_M: f64 = 3.0;

/// Where a sweep was measured from.
#[derive(Clone, Copy)]
pub(super) struct Station<'a> {
    pub(super) pose: &'a Pose,
    pub(super) transmitter: &'a Transmitter,
    pub(super) sweep: u32,
    /// Path that was taken for the line of sight.
    pub(super) line: Option<usize>,
}

/// What a sweep put into the map.
#[derive(Default)]
pub(super) struct Mapping {
    /// One for each path; none when the place was not known well enough.
    pub(super) outcomes: Vec<Outcome, PATHS>,
    pub(super) points: Vec<MappedPoint, POINTS>,
    pub(super) surfaces: SurfaceChanges,
}

/// Maps what association has learnt of a sweep: its points go in, those of surfaces that are one go over to it, those of a demoted one leave.
pub fn map_learned<const VOXELS: usize>(
    map: &mut PointCloud<VOXELS>,
    learned: Learned<SURFACES>,
) -> (Vec<MappedPoint, POINTS>, SurfaceChanges) {
    let points = gather(learned.points.iter().map(|point| MappedPoint {
        surface: Some(point.surface),
        sweep: point.sweep,
        path: point.path,
        reflection: point.reflection,
        probability: point.existence,
        point: point.point,
        // What lies beyond the map's range is counted there.
        insertion: map.insert_on(Some(point.surface), &point.point).ok(),
    }));
    for (gone, stays) in &learned.merged {
        map.rename(*gone, *stays);
    }
    for surface in &learned.changes.demoted {
        let _freed = map.withdraw(*surface);
    }
    let surfaces = SurfaceChanges {
        merged: learned.merged,
        withdrawn: learned.changes.demoted,
    };
    (points, surfaces)
}

impl<R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'_, R, VOXELS, STATES> {
    /// The paths as data association takes them.
    #[inline(never)]
    pub(super) fn to_associate(
        &self,
        measured: &[MeasuredPath],
        classified: &[ClassifiedPath],
    ) -> Vec<ReceivedPath, PATHS> {
        gather(measured.iter().enumerate().map(|(index, path)| {
            let estimated = &path.estimated;
            ReceivedPath::of(
                estimated,
                self.localizer.corrected(&estimated.path.aoa),
                classified
                    .get(index)
                    .and_then(|classified| classified.probabilities),
            )
        }))
    }

    /// A pose as data association takes it.
    fn pose_estimate(&self, pose: &Pose) -> Option<PoseEstimate> {
        PoseEstimate::of(pose, self.delay_period())
    }

    /// Which surfaces made the paths of a sweep, seen from the pose that is predicted for it.
    pub(super) fn associated(
        &mut self,
        measured: &[MeasuredPath],
        classified: &[ClassifiedPath],
        gmt: &Transmitter,
        time_ns: u64,
    ) -> Option<Association<PATHS>> {
        let pose = self.localizer.predict_to(time_ns)?;
        let pose = self.pose_estimate(&pose)?;
        let paths = self.to_associate(measured, classified);
        Some(associate(
            &paths,
            &pose,
            gmt,
            &self.surfaces,
            &self.config.association,
        ))
    }

    /// The paths that confirmed surfaces explain, for the filter.
    pub(super) fn reflections(
        &self,
        measured: &[MeasuredPath],
        association: &Association<PATHS>,
        gmt: &Transmitter,
    ) -> Vec<ReflectedPath, PATHS> {
        let explained = measured
            .iter()
            .zip(&association.verdicts)
            .filter_map(|(path, verdict)| {
                let planes = self.lent(verdict)?;
                let path = self.measurement(path, None, gmt)?;
                Some(ReflectedPath { path, planes })
            });
        gather(explained)
    }

    /// The surfaces of an explained path, for the filter. `None` of the line of sight, and of more than it follows.
    fn lent(&self, verdict: &association::Verdict) -> Option<Bounces> {
        let is_reflection = verdict.decision == Decision::Explained && !verdict.chain.is_empty();
        let mut planes = Bounces::new();
        for id in verdict.chain.iter().filter(|_| is_reflection) {
            let plane = self.surfaces.get(*id)?.plane;
            planes
                .push(MappedPlane {
                    id: u32::from(*id),
                    plane,
                })
                .ok()?;
        }
        is_reflection.then_some(planes)
    }

    /// What the filter has learnt of surfaces goes back to them. In sight it keeps none: the surfaces learn from the pose then.
    pub(super) fn take_surfaces_back(&mut self, verdict: SweepVerdict) {
        for held in self.localizer.planes() {
            if let Ok(id) = u16::try_from(held.id) {
                self.surfaces.give_back(id, &held.plane);
            }
        }
        if verdict.is_taken() {
            self.localizer.release_planes();
        }
    }

    /// Maps a sweep. A pose that is lost would only put points where there is nothing, and so would a GMT of which nobody knows
    /// where it is.
    pub(super) fn map_sweep(
        &mut self,
        station: &Station<'_>,
        paths: &Vec<ReceivedPath, PATHS>,
        classified: &[ClassifiedPath],
    ) -> Mapping {
        if self.localizer.health().lost || station.transmitter.sigma_m >= MOST_GMT_SIGMA_M {
            return Mapping::default();
        }
        match self.config.mapped {
            Mapped::Every => self.map_associated(station, paths),
            Mapped::FirstOrder | Mapped::Strongest => self.map_alone(station, classified),
        }
    }

    fn map_associated(&mut self, station: &Station<'_>, paths: &Vec<ReceivedPath, PATHS>) -> Mapping {
        let Some(pose) = self.pose_estimate(station.pose) else {
            return Mapping::default();
        };
        let config = self.config.association;
        let association = associate(paths, &pose, station.transmitter, &self.surfaces, &config);
        let left_out = &mut self.counters.chains_left_out;
        *left_out = left_out.saturating_add(association.left_out.unweighed);
        let sweep = SweepPaths {
            paths,
            pose: &pose,
            transmitter: station.transmitter,
            sweep: station.sweep,
            held: &gather(
                self.localizer
                    .planes()
                    .filter_map(|held| u16::try_from(held.id).ok()),
            ),
        };
        let learned = self.surfaces.learn(&association, &sweep, &config);
        let (points, surfaces) = map_learned(self.memory.map, learned);
        let outcomes = association.verdicts.iter().enumerate();
        Mapping {
            outcomes: gather(outcomes.map(|(index, verdict)| {
                if station.line == Some(index) {
                    Outcome::LineOfSight
                } else {
                    Outcome::Associated(verdict.clone())
                }
            })),
            points,
            surfaces,
        }
    }

    /// Every path by itself: the network says of which order it is, the closed form where it was reflected.
    fn map_alone(&mut self, station: &Station<'_>, classified: &[ClassifiedPath]) -> Mapping {
        let mut mapping = Mapping::default();
        let Ok(ends) = ends(station.pose, &station.transmitter.position_m) else {
            return mapping;
        };
        for (index, classified) in classified.iter().enumerate() {
            let outcome = if station.line == Some(index) {
                Outcome::LineOfSight
            } else {
                self.alone(&ends, station.sweep, index, classified, &mut mapping.points)
            };
            let _fits = mapping.outcomes.push(outcome);
        }
        mapping
    }

    fn alone(
        &mut self,
        ends: &Ends,
        sweep: u32,
        index: usize,
        classified: &ClassifiedPath,
        points: &mut Vec<MappedPoint, POINTS>,
    ) -> Outcome {
        let is_used = self.config.mapped == Mapped::FirstOrder || index == 0;
        let Some(probabilities) = classified.probabilities.filter(|_| is_used) else {
            return Outcome::Unused;
        };
        let accept = &self.config.accept;
        if !probabilities.is_first_order(accept.min_probability) {
            return Outcome::NotFirstOrder;
        }
        match solve(ends, &classified.path, self.config.form, &accept.point) {
            Err(error) => Outcome::Input(error),
            Ok(Verdict::Rejected(rejection)) => Outcome::Rejected(rejection),
            Ok(Verdict::Accepted(point)) => {
                // There is room for one a path.
                let _fits = points.push(MappedPoint {
                    surface: None,
                    sweep,
                    path: u8::try_from(index).unwrap_or(u8::MAX),
                    reflection: [1, 1],
                    probability: probabilities.first_order,
                    point,
                    insertion: self.memory.map.insert(&point).ok(),
                });
                Outcome::Point
            }
        }
    }
}
