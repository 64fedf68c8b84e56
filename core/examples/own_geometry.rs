//! Arrays and beams of one's own: two faces of 4 x 4 elements at the transmitter, three arrays of six on the UAV.

use std::error::Error;

use cslam_core::array::{CodebookConfig, UavArrayConfig};
use cslam_core::paths::{Estimator, EstimatorConfig, PathEstimator};
use cslam_core::radio::RadioConfig;
use cslam_core::signal::{BeamBlock, Iq};

/// Arrays, elements, channels, beams, faces, columns, rows, detections, paths.
type Own = Estimator<3, 6, 18, 24, 2, 4, 4, 120, 5>;

fn main() -> Result<(), Box<dyn Error>> {
    let default = RadioConfig::default();
    let mut radio = RadioConfig {
        uav_arrays: UavArrayConfig {
            radius_m: 0.12,
            ..default.uav_arrays
        },
        codebook: CodebookConfig {
            azimuths: 6,
            sector_rad: 70_f64.to_radians(),
            elevations_rad: [0.0, 0.3],
        },
        waveform: default.waveform,
        gmt_arrays: default.gmt_arrays,
        squint_scheme: default.squint_scheme,
        squint: default.squint,
    };
    radio.check()?;
    let mut estimator = Box::new(Own::checked(&EstimatorConfig::of(&radio))?);
    let mut samples = Box::new([[Iq::ZERO; 512]; 18]);
    estimator.push_beam(BeamBlock {
        samples: &mut samples,
        beam: 0,
        exponent: -30,
    });
    println!("paths in silence: {}", estimator.finish().len());
    // What cannot work is refused by the name of the field.
    radio.waveform.active = 415;
    if let Err(error) = radio.check() {
        println!("{error}");
    }
    Ok(())
}
