//! How an estimator is built: its tables are computed where they lie.

use core::mem::MaybeUninit;

use heapless::Vec;

use super::super::calibration::Calibration;
use super::super::config::EstimatorConfig;
use super::super::departure::Departures;
use super::super::early_termination::Screen;
use super::super::effort::Effort;
use super::super::gate::Gate;
use super::super::grid::AngleGrid;
use super::super::merge::Detections;
use super::super::meter::Meter;
use super::super::model::ArrayModel;
use super::super::pilot::Pilots;
use super::super::template::Template;
use super::super::warm_start::KnownPaths;
use super::Estimator;
use crate::signal::{Correlator, Detector, SAMPLES, Workspace, fit_threshold};

impl<
    const A: usize,
    const E: usize,
    const C: usize,
    const BEAMS: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const MOST: usize,
    const K: usize,
> Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, K>
{
    /// An estimator with empty state. All tables are computed here. It is returned by value: where the stack is short, see
    /// [`Estimator::init`].
    pub fn new<const ELEVATIONS: usize>(config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>) -> Self {
        Self::with_meter(config, ())
    }
}

impl<
    const A: usize,
    const E: usize,
    const C: usize,
    const BEAMS: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const MOST: usize,
    const K: usize,
    M: Meter,
> Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, K, M>
{
    /// [`Estimator::new`] with a meter of where the time goes.
    pub fn with_meter<const ELEVATIONS: usize>(
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
        meter: M,
    ) -> Self {
        let mut estimator = Self::blank(config, meter);
        estimator.fill(config);
        estimator
    }

    /// Builds an estimator where it shall lie, static memory for example: its tables are computed there, not on the stack
    /// (docs/bindings.md, "C"). `config` as for [`Estimator::new`].
    pub fn init<'p, const ELEVATIONS: usize>(
        place: &'p mut MaybeUninit<Self>,
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
        meter: M,
    ) -> &'p mut Self {
        let estimator = place.write(Self::blank(config, meter));
        estimator.fill(config);
        estimator
    }

    /// Computes the tables, where they lie.
    fn fill<const ELEVATIONS: usize>(&mut self, config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>) {
        self.template.fill(&config.waveform);
        self.folded_template.fill_folded(&config.waveform);
        self.grid.fill(&self.model);
        self.correlator.fill(&config.waveform);
        self.departures.fill(&config.codebook);
    }

    /// An estimator without its tables: what is large in it is a constant of zeros, which the compiler writes
    /// straight to its place.
    #[inline(always)]
    fn blank<const ELEVATIONS: usize>(
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
        meter: M,
    ) -> Self {
        const { assert!(C == A * E && K <= 255) };
        let calibration = Calibration::new(config.element_errors);
        let mut model = ArrayModel::new(&config.arrays, &config.waveform);
        model.set_calibration_share(calibration.share());
        let share = libm::powf(10.0, -0.1 * config.dynamic_range_db);
        let gain_sigma = libm::powf(10.0, 0.05 * config.beam_gain_sigma_db) - 1.0;
        Self {
            template: const { Template::blank() },
            folded_template: const { Template::blank() },
            grid: const { AngleGrid::blank() },
            model,
            calibration,
            detector: Detector::new(C, config.false_alarms_per_sweep, BEAMS * config.waveform.active),
            threshold: fit_threshold(config.false_alarms_per_sweep, BEAMS),
            gate: config
                .gating
                .then(|| Gate::new(C * SAMPLES, C * config.waveform.active)),
            screen: config.screening.then(Screen::new::<E>),
            correlator: const { Correlator::blank() },
            departures: Departures::blank(&config.codebook, gain_sigma),
            share,
            work: const { Workspace::new() },
            profile: [0; SAMPLES],
            found: Vec::new(),
            detections: Detections::new(),
            known: KnownPaths::default(),
            effort: Effort::new(config.work_limit),
            strongest: 0.0,
            left: None,
            loudest: 0.0,
            noise: 0.0,
            pilots: Pilots::new(&config.waveform),
            meter,
        }
    }
}
