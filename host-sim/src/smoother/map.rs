//! The map again: the same paths, associated and mapped by the receiver's own methods from the smoothed poses.

use cslam_core::association::{PoseEstimate, ReceivedPath, SweepPaths, associate};
use cslam_core::estimator::{Model, Transmitter};
use cslam_core::profile;
use cslam_core::receiver::{
    Config, Localization, MOST_GMT_SIGMA_M, Outcome, PATHS, Radio as _, SURFACES, SweepReport, map_learned,
};
use cslam_core::surfaces::Surfaces;
use cslam_firmware::app::Map;

use super::trajectory::State;
use crate::raw_flight::Remapped;

/// A map in the making.
pub(super) struct Mapper<'a> {
    config: &'a Config<'a>,
    model: Model,
    lost_m: f64,
    surfaces: Surfaces<SURFACES>,
    map: Box<Map>,
}

impl<'a> Mapper<'a> {
    /// An empty map. `None` of a receiver that flies without the filter.
    pub(super) fn new(config: &'a Config<'a>) -> Option<Self> {
        let Localization::Filter(filter) = &config.localization else {
            return None;
        };
        Some(Self {
            config,
            model: Model::new(
                profile::Radio::<profile::FlightEstimator>::new(&config.radio)
                    .model()
                    .clone(),
                filter.radio,
            ),
            lost_m: filter.gates.lost_m,
            surfaces: config.no_surfaces(),
            map: Box::new(Map::new()),
        })
    }

    /// The map so far.
    pub(super) fn map(&self) -> &Map {
        &self.map
    }

    /// Maps a sweep from a smoothed state.
    pub(super) fn sweep(&mut self, report: &SweepReport<PATHS>, state: &State) -> Remapped {
        let pose = state.pose();
        let (Some(pose), Some(transmitter)) = (
            pose.as_ref()
                .and_then(|pose| PoseEstimate::of(pose, state.nominal.delay_period)),
            state.standing.transmitter.as_ref(),
        ) else {
            return Remapped::default();
        };
        if state.position_sigma_m() > self.lost_m || transmitter.sigma_m >= MOST_GMT_SIGMA_M {
            return Remapped::default();
        }
        self.associated(report, state, &pose, transmitter)
    }

    fn associated(
        &mut self,
        report: &SweepReport<PATHS>,
        state: &State,
        pose: &PoseEstimate,
        transmitter: &Transmitter,
    ) -> Remapped {
        let mut paths = heapless::Vec::<ReceivedPath, PATHS>::new();
        for path in &report.paths {
            let estimated = &path.estimated;
            let arrival = self.model.corrected_arrival(&estimated.path.aoa, &state.nominal);
            let received = ReceivedPath::of(estimated, arrival, path.probabilities);
            // There is room for every path of a sweep.
            let _fits = paths.push(received);
        }
        let config = &self.config.association;
        let association = associate(&paths, pose, transmitter, &self.surfaces, config);
        let sweep = SweepPaths {
            paths: &paths,
            pose,
            transmitter,
            sweep: report.sweep,
            held: &state.standing.held,
        };
        let learned = self.surfaces.learn(&association, &sweep, config);
        let (points, surfaces) = map_learned(&mut self.map, learned);
        let outcomes = association.verdicts.iter().zip(&report.paths);
        Remapped {
            outcomes: outcomes
                .map(|(verdict, path)| match path.outcome {
                    Outcome::LineOfSight => Outcome::LineOfSight,
                    _ => Outcome::Associated(verdict.clone()),
                })
                .collect(),
            points,
            surfaces,
        }
    }
}
