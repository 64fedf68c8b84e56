//! Field of every transmit beam towards every ray, with the errors of the GMT's elements.

use cslam_core::array::{Codebook, GmtArrays, centred, phasor};
use cslam_core::geometry::{Direction, Gmt};

use super::{C64, Calibration, FACE_ELEMENTS};

/// Field of a beam towards a ray over frequency: `field - j 2 pi f slope_s`, f off the carrier. Element delays of tens of
/// picoseconds turn the phase by hundredths of a radian at the band edge, so the second order is under -80 dB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BeamField {
    /// Relative to an isotropic antenna.
    pub(crate) field: C64,
    /// Mean of the element delays, weighted by what each adds to the field, s.
    pub(crate) slope_s: C64,
}

/// Codewords of a codebook, element by element.
#[derive(Clone, Debug)]
pub(crate) struct Transmitter {
    codebook: Codebook<f64>,
    /// Face and codeword of each beam, `conj(v)/|v|`.
    codewords: Vec<(usize, [C64; FACE_ELEMENTS])>,
}

/// Element response of a face for direction cosines, column-major: element 8 p + q has phase `n_p s_x + n_q s_z` times
/// pi.
pub(crate) fn face_response(cosines: [f64; 2], phase_per_element_rad: f64) -> [C64; FACE_ELEMENTS] {
    let line = |cosine: f64| -> [C64; 8] {
        std::array::from_fn(|n| phasor(phase_per_element_rad * cosine * centred::<f64>(n, 8)))
    };
    let (columns, rows) = (line(cosines[0]), line(cosines[1]));
    std::array::from_fn(|e| columns[e / 8] * rows[e % 8])
}

impl Transmitter {
    pub(crate) fn new(codebook: Codebook<f64>) -> Self {
        let phase = codebook.arrays().phase_per_element_rad();
        let codewords = (0..codebook.len())
            .filter_map(|m| codebook.beam(m))
            .map(|beam| {
                (
                    beam.face,
                    face_response(beam.cosines, phase).map(|v| v.conj() / 8.0),
                )
            })
            .collect();
        Self { codebook, codewords }
    }

    pub(crate) fn beams(&self) -> usize {
        self.codewords.len()
    }

    pub(crate) fn arrays(&self) -> &GmtArrays<f64> {
        self.codebook.arrays()
    }

    /// Fields of all beams towards a departure.
    pub(crate) fn fields(&self, departure: &Direction<Gmt, f64>, device: &Calibration) -> Vec<BeamField> {
        let arrays = self.codebook.arrays();
        let faces: Vec<_> = arrays
            .faces()
            .iter()
            .enumerate()
            .map(|(s, face)| {
                let cosines = GmtArrays::<f64>::cosines(face, departure);
                let amplitude = arrays.amplitude(face, departure);
                let mut response = face_response(cosines, arrays.phase_per_element_rad());
                for (v, error) in response.iter_mut().zip(&device.gmt_element[s]) {
                    *v *= error * amplitude;
                }
                response
            })
            .collect();
        self.codewords
            .iter()
            .map(|(s, w)| {
                let zero = C64::new(0.0, 0.0);
                let mut sum = BeamField {
                    field: zero,
                    slope_s: zero,
                };
                for ((w, v), delay_s) in w.iter().zip(&faces[*s]).zip(&device.gmt_delay_s[*s]) {
                    let part = w * v;
                    sum.field += part;
                    sum.slope_s += part * *delay_s;
                }
                sum
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::Impairments;

    #[test]
    fn without_errors_the_fields_are_those_of_the_codebook() {
        let transmitter = Transmitter::new(Codebook::default());
        let device = Calibration::draw(&Impairments::none(), 0);
        let u = Direction::from_zenith_azimuth(1.3, 2.9).expect("angles");
        let fields = transmitter.fields(&u, &device);
        assert_eq!(fields.len(), 72);
        for (m, f) in fields.iter().enumerate() {
            assert!(
                (f.field - transmitter.codebook.field(m, &u)).norm() < 1e-12,
                "beam {m}"
            );
            assert_eq!(f.slope_s, C64::new(0.0, 0.0));
        }
    }

    #[test]
    fn slope_is_the_derivative_of_the_field_over_frequency() {
        let transmitter = Transmitter::new(Codebook::default());
        let device = Calibration::draw(&Impairments::budget(), 5);
        let u = Direction::from_zenith_azimuth(1.4, 0.3).expect("angles");
        let f_hz = 100e6;
        let mut turned = device.clone();
        for (w, d) in turned
            .gmt_element
            .iter_mut()
            .flatten()
            .zip(device.gmt_delay_s.iter().flatten())
        {
            *w *= phasor(-std::f64::consts::TAU * f_hz * d);
        }
        let at_edge = transmitter.fields(&u, &turned);
        for (a, b) in transmitter.fields(&u, &device).iter().zip(&at_edge) {
            let linear = a.field - C64::new(0.0, std::f64::consts::TAU * f_hz) * a.slope_s;
            assert!((linear - b.field).norm() < 2e-3, "{linear} {}", b.field);
        }
    }
}
