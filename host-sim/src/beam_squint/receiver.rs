//! What hears the symbols of a trial: path estimation and beam squint as they fly, one set for each thread.

use cslam_core::array::{GmtArrays, SquintScheme};
use cslam_core::beam_squint::{BeamSquint, BeamSquintConfig, Bearing, Joined, Refusal, Sighting};
use cslam_core::paths::{ElementErrors, Estimator, EstimatorConfig, PathEstimator};
use cslam_core::radio::RadioConfig;
use cslam_core::signal::{Correlator, Waveform, Workspace};

use super::case::Case;
use crate::channel::{Instant, Ray, Simulator};

/// What a thread keeps between trials.
pub(super) struct Receiver {
    pub(super) estimator: Box<dyn PathEstimator<32, 9>>,
    sequential: Box<BeamSquint<11>>,
    raster: Box<BeamSquint<1>>,
    correlator: Correlator,
    work: Box<Workspace>,
}

impl Receiver {
    #[inline(never)]
    pub(super) fn new(case: &Case) -> Self {
        let mut config = EstimatorConfig::single_sweeps();
        if !case.uav_errors {
            config.element_errors = ElementErrors::Known(0.0);
        }
        let mut squint = if case.gmt_errors {
            BeamSquintConfig::default()
        } else {
            BeamSquintConfig::ideal()
        };
        if !case.uav_errors {
            squint.delay_sigma_m = 0.0;
        }
        let radio = |squint_scheme| RadioConfig {
            squint_scheme,
            ..RadioConfig::default()
        };
        let waveform = Waveform::default();
        Self {
            estimator: Box::new(Estimator::<4, 8, 32, 72, 3, 8, 8, 360, 9>::new(&config)),
            sequential: Box::new(
                BeamSquint::new(squint, &radio(SquintScheme::Sequential), 3).expect("11 symbols"),
            ),
            raster: Box::new(BeamSquint::new(squint, &radio(SquintScheme::Raster), 3).expect("one symbol")),
            correlator: Correlator::new(&waveform),
            work: Box::new(Workspace::new()),
        }
    }

    /// Bearings by fit, parabola and pick.
    pub(super) fn listen(
        &mut self,
        case: &Case,
        simulator: &Simulator,
        rays: &[Ray],
        sighting: &Sighting,
        face: usize,
        index: u32,
    ) -> [Result<Bearing, Refusal>; 3] {
        let mut sweep = simulator.squint_rays(rays, &Instant::at_rest(), index, case.scheme(), |s| {
            s.face == face
        });
        macro_rules! hear {
            ($squint:expr) => {{
                if let Err(refusal) = $squint.begin(sighting) {
                    return [Err(refusal); 3];
                }
                for block in &mut sweep.blocks {
                    $squint.push(block.view(), &self.correlator, &mut self.work);
                }
                [$squint.fit(), $squint.parabola(), $squint.pick()]
            }};
        }
        if case.raster {
            hear!(self.raster)
        } else {
            hear!(self.sequential)
        }
    }

    /// The fits of all faces that are heard, joined: `first` is that of the face that looks at the UAV.
    pub(super) fn join(
        &mut self,
        case: &Case,
        simulator: &Simulator,
        rays: &[Ray],
        sighting: &Sighting,
        first: &Bearing,
        index: u32,
    ) -> Option<Joined> {
        let arrays = GmtArrays::<f32>::default();
        let seen = first.direction(arrays.faces().get(first.face)?)?;
        let mut bearings = vec![*first];
        for face in (0..arrays.faces().len()).filter(|face| *face != first.face) {
            let Some(there) = sighting.on_face(face, &seen, &arrays) else {
                continue;
            };
            let [fit, _, _] = self.listen(case, simulator, rays, &there, face, index);
            bearings.extend(fit.ok());
        }
        Joined::new(&bearings, case.face_bias_sigma(), &arrays)
    }
}
