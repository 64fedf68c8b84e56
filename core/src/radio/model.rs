//! A radio as the stages behind path estimation know it: its counts are no longer in the type.

use heapless::Vec;

use super::RadioConfig;
use crate::array::{BeamReach, GmtArrays, GmtFace, MOST_ARRAYS, UavArrays, UavElement, Ula};
use crate::numeric::gather;
use crate::signal::Waveform;

/// Faces of the transmitter at most: each has calibration states in the filter.
/// Capacity: states of the filter.
pub const MOST_FACES: usize = 3;

/// A radio without its counts: what filter, data association and receiver ask of it. Made from the description
/// ([`RadioConfig::model`]).
#[derive(Clone, Debug, PartialEq)]
pub struct RadioModel {
    /// Waveform.
    pub waveform: Waveform,
    /// Receive arrays whose errors are calibrated in flight: those around the body, of which more than [`MOST_ARRAYS`] are left out, or a row and a
    /// column of a planar one.
    pub arrays: Vec<Ula<f64>, MOST_ARRAYS>,
    /// Pattern of their elements.
    pub element: UavElement,
    /// Faces of the transmitter.
    pub faces: Vec<GmtFace<f64>, MOST_FACES>,
    /// Half of what lies between two beams that do not overlap, along a row and up a column of a face, direction cosine.
    pub half_beam: [f64; 2],
    /// Elevations that the beams reach.
    pub reach: BeamReach,
}

impl Default for RadioModel {
    /// Of the default radio.
    fn default() -> Self {
        RadioConfig::default().model::<4, 8, 3, 8, 8>()
    }
}

impl<const ELEVATIONS: usize, const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>
    RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>
{
    /// What the stages behind path estimation ask of it: of `ARRAYS` receive arrays of `ELEMENTS` elements and `FACES` transmit faces of
    /// `COLUMNS` x `ROWS` elements. More faces than the filter has states for do not compile.
    #[must_use]
    pub fn model<
        const ARRAYS: usize,
        const ELEMENTS: usize,
        const FACES: usize,
        const COLUMNS: usize,
        const ROWS: usize,
    >(
        &self,
    ) -> RadioModel {
        const { assert!(FACES <= MOST_FACES) };
        let arrays: UavArrays<f64, ARRAYS, ELEMENTS> = self.uav_arrays();
        let faces = GmtArrays::<f64, FACES, COLUMNS, ROWS>::new(&self.gmt_arrays);
        let spacing_wavelengths = self.gmt_arrays.spacing_wavelengths;
        RadioModel {
            waveform: self.waveform,
            arrays: match (arrays.column(), arrays.arrays().first()) {
                (Some(column), Some(row)) => gather(
                    [
                        *row,
                        Ula {
                            axis: *column,
                            ..*row
                        },
                    ]
                    .into_iter(),
                ),
                _ => gather(arrays.arrays().iter().copied()),
            },
            element: self.uav_arrays.element,
            faces: gather(faces.faces().iter().copied()),
            half_beam: [COLUMNS, ROWS].map(|count| 0.5 / (count as f64 * spacing_wavelengths)),
            reach: BeamReach::of(&self.codebook.elevations_rad, ROWS, spacing_wavelengths),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::UavLayout;

    #[test]
    fn the_default_has_four_arrays_three_faces_and_beams_a_quarter_apart() {
        let model = RadioModel::default();
        assert_eq!((model.arrays.len(), model.faces.len()), (4, 3));
        assert_eq!(model.half_beam, [0.125; 2]);
        assert_eq!(model.reach, BeamReach::default());
    }

    #[test]
    fn a_wider_face_has_narrower_beams() {
        let mut radio = RadioConfig::default();
        assert_eq!(radio.model::<3, 6, 2, 16, 4>().half_beam, [0.0625, 0.25]);
        radio.gmt_arrays.spacing_wavelengths = 0.25;
        assert_eq!(radio.model::<3, 6, 2, 16, 4>().half_beam, [0.125, 0.5]);
    }

    #[test]
    fn a_planar_array_is_calibrated_by_a_row_and_a_column() {
        let model = {
            let mut radio = RadioConfig::default();
            radio.uav_arrays.layout = UavLayout::Planar { azimuth_rad: 0.0 };
            radio.model::<8, 8, 3, 8, 8>()
        };
        let [row, column] = model.arrays.as_slice() else {
            panic!("{:?}", model.arrays);
        };
        assert!(row.axis.dot(&column.axis).abs() < 1e-15 && row.normal == column.normal);
        // More arrays around the body than there are states for are not calibrated.
        assert_eq!(RadioConfig::default().model::<6, 8, 3, 8, 8>().arrays.len(), 4);
    }
}
