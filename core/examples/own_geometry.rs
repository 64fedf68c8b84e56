//! Arrays and beams of one's own: two faces of 4 x 4 elements at the transmitter, three arrays of six on the UAV.

use std::error::Error;

use cslam_core::array::{Codebook, CodebookConfig, GmtArrays, UavArrayConfig, UavArrays};
use cslam_core::paths::{Estimator, EstimatorConfig, PathEstimator};
use cslam_core::signal::{BeamBlock, Iq};

/// Arrays, elements, channels, beams, faces, columns, rows, detections, paths.
type Own = Estimator<3, 6, 18, 24, 2, 4, 4, 120, 5>;

fn main() -> Result<(), Box<dyn Error>> {
    let defaults = EstimatorConfig::default();
    let mut config = EstimatorConfig {
        arrays: UavArrays::<f32, 3, 6>::new(&UavArrayConfig {
            radius_m: 0.12,
            ..UavArrayConfig::default()
        }),
        codebook: Codebook::<f32, 2, 4, 4, 2>::new(
            GmtArrays::default(),
            CodebookConfig {
                azimuths: 6,
                sector_rad: 70_f64.to_radians(),
                elevations_rad: [0.0, 0.3],
            },
        ),
        waveform: defaults.waveform,
        gmt_attitude: defaults.gmt_attitude,
        false_alarms_per_sweep: defaults.false_alarms_per_sweep,
        dynamic_range_db: defaults.dynamic_range_db,
        screening: defaults.screening,
        gating: defaults.gating,
        element_errors: defaults.element_errors,
        beam_gain_sigma_db: defaults.beam_gain_sigma_db,
        work_limit: defaults.work_limit,
    };
    let mut estimator = Box::new(Own::checked(&config)?);
    let mut samples = Box::new([[Iq::ZERO; 512]; 18]);
    estimator.push_beam(BeamBlock {
        samples: &mut samples,
        beam: 0,
        exponent: -30,
    });
    println!("paths in silence: {}", estimator.finish().len());
    // What cannot work is refused by the name of the field.
    config.waveform.active = 415;
    if let Err(error) = Own::checked(&config) {
        println!("{error}");
    }
    Ok(())
}
