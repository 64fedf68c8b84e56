//! What a row of the table of beam squint is about.

use cslam_core::array::{SquintConfig, SquintSymbol};
use cslam_core::beam_squint::FACE_BIAS_SIGMA;
use cslam_core::signal::Waveform;

use crate::channel::SquintScheme;

/// What a row is about.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Case {
    /// Distance of the UAV, m.
    pub distance_m: f64,
    /// Whether the raster scheme is sent; else the sequential one.
    pub raster: bool,
    /// Element errors of the GMT: 5 degrees and 20 ps.
    pub gmt_errors: bool,
    /// Errors of the UAV's arrays: 2 degrees, 0.1 degrees, 50 ps.
    pub uav_errors: bool,
    /// A ground bounce 6 dB under the line of sight.
    pub bounce: bool,
    /// Whether the receiver nulls a ground bounce where flat ground puts it.
    pub null: bool,
    /// Signal against noise beside the link budget, dB.
    pub snr_offset_db: f64,
}

impl Case {
    /// Line of sight alone, no errors, sequential scheme, no null.
    pub fn ideal(distance_m: f64) -> Self {
        Self {
            distance_m,
            raster: false,
            gmt_errors: false,
            uav_errors: false,
            bounce: false,
            null: false,
            snr_offset_db: 0.0,
        }
    }

    /// The scheme of its symbols.
    pub(super) fn scheme(&self) -> SquintScheme {
        if self.raster {
            SquintScheme::Raster
        } else {
            SquintScheme::Sequential
        }
    }

    /// Its symbols on the first face, as the receiver knows them.
    pub(super) fn symbols_of_a_face(&self, waveform: &Waveform) -> Vec<SquintSymbol<f64>> {
        let edge_hz = |index| f64::from(waveform.offset(index)) * waveform.spacing_hz();
        let band_hz = [edge_hz(0), edge_hz(waveform.active - 1)];
        let config = SquintConfig::default();
        (0..)
            .map_while(|index| config.symbol(self.scheme(), index, 1, band_hz, waveform.carrier_hz))
            .collect()
    }

    /// What is known of the constant error of a face: none where the GMT has no errors.
    pub(super) fn face_bias_sigma(&self) -> [f32; 2] {
        if self.gmt_errors {
            FACE_BIAS_SIGMA
        } else {
            [0.0; 2]
        }
    }
}
