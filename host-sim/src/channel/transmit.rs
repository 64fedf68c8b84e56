//! Field of every transmit beam towards every ray, with the errors of the GMT's elements.

use cslam_core::geometry::{Direction, Gmt};

use super::antenna::gmt::{self, Face};
use super::{C64, Calibration, FACE_ELEMENTS, FACES};

/// Field of a beam towards a ray over frequency: `field - j 2 pi f slope_s`, f off the carrier. Element delays of tens of
/// picoseconds turn the phase by hundredths of a radian at the band edge, so the second order is under -80 dB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BeamField {
    /// Relative to an isotropic antenna.
    pub(crate) field: C64,
    /// Mean of the element delays, weighted by what each adds to the field, s.
    pub(crate) slope_s: C64,
}

/// Faces and codewords of the GMT, element by element.
#[derive(Clone, Debug)]
pub(crate) struct Transmitter {
    faces: [Face; FACES],
    /// Face and codeword of each beam, `conj(v)/|v|`.
    codewords: Vec<(usize, [C64; FACE_ELEMENTS])>,
}

impl Transmitter {
    pub(crate) fn new() -> Self {
        let codeword = |m| {
            let (face, cosines) = gmt::beam(m);
            (face, gmt::response(cosines).map(|v| v.conj() / 8.0))
        };
        Self {
            faces: std::array::from_fn(Face::new),
            codewords: (0..gmt::BEAMS).map(codeword).collect(),
        }
    }

    pub(crate) fn beams(&self) -> usize {
        self.codewords.len()
    }

    pub(super) fn faces(&self) -> &[Face; FACES] {
        &self.faces
    }

    /// Fields of all beams towards a departure.
    pub(crate) fn fields(&self, departure: &Direction<Gmt, f64>, device: &Calibration) -> Vec<BeamField> {
        let faces: Vec<_> = self
            .faces
            .iter()
            .zip(&device.gmt_element)
            .map(|(face, errors)| {
                let amplitude = face.amplitude(departure);
                let mut response = gmt::response(face.cosines(departure));
                for (v, error) in response.iter_mut().zip(errors) {
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
    use crate::channel::antenna::phasor;

    #[test]
    fn without_errors_the_fields_are_those_of_the_codebook() {
        let transmitter = Transmitter::new();
        let device = Calibration::draw(&Impairments::none(), 0);
        let u = Direction::from_zenith_azimuth(1.3, 2.9).expect("angles");
        let fields = transmitter.fields(&u, &device);
        assert_eq!(fields.len(), 72);
        let codebook = cslam_core::array::Codebook::<f64>::default();
        for (m, f) in fields.iter().enumerate() {
            assert!((f.field - codebook.field(m, &u)).norm() < 1e-12, "beam {m}");
            assert_eq!(f.slope_s, C64::new(0.0, 0.0));
        }
    }

    #[test]
    fn slope_is_the_derivative_of_the_field_over_frequency() {
        let transmitter = Transmitter::new();
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
