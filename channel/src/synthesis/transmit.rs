//! Field of every transmit beam towards every ray, with the errors of the GMT's elements.

use cslam_core::geometry::{Direction, Gmt};

use super::antenna::gmt::{self, Face};
use super::antenna::phasor_of_turns;
use super::radio::Radio;
use super::{C64, Calibration};

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
    faces: Vec<Face>,
    carrier_hz: f64,
    /// Face and codeword of each beam.
    codewords: Vec<(usize, Vec<C64>)>,
}

impl Transmitter {
    /// The faces as a device has them; the codewords are those of faces as they were meant.
    pub(crate) fn new<const ARRAYS: usize, const ELEMENTS: usize>(
        radio: &Radio,
        device: &Calibration<ARRAYS, ELEMENTS>,
    ) -> Self {
        let codeword = |m| {
            let (face, cosines) = gmt::beam(&radio.codebook, m);
            (face, Face::new(radio, face).codeword(cosines))
        };
        let errors = device.gmt_axis_rad.iter().zip(&device.gmt_centre_m);
        let moved = |(s, (turn_rad, centre_m))| Face::new(radio, s).moved(turn_rad, centre_m);
        Self {
            faces: errors.enumerate().map(moved).collect(),
            carrier_hz: radio.waveform.carrier_hz,
            codewords: (0..radio.beams()).map(codeword).collect(),
        }
    }

    pub(crate) fn beams(&self) -> usize {
        self.codewords.len()
    }

    pub(super) fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// What a face's place does to the carrier of a wave towards `u`.
    pub(super) fn carrier(&self, face: &Face, u: &Direction<Gmt, f64>) -> C64 {
        phasor_of_turns(self.carrier_hz * face.lead_s(u))
    }

    /// Fields of all beams towards a departure.
    pub(crate) fn fields<const ARRAYS: usize, const ELEMENTS: usize>(
        &self,
        departure: &Direction<Gmt, f64>,
        device: &Calibration<ARRAYS, ELEMENTS>,
    ) -> Vec<BeamField> {
        let faces: Vec<_> = self
            .faces
            .iter()
            .zip(&device.gmt_element)
            .map(|(face, errors)| {
                let amplitude = face.amplitude(departure);
                let mut response = face.response(face.cosines(departure));
                let carrier = self.carrier(face, departure);
                for (v, error) in response.iter_mut().zip(errors) {
                    *v *= error * amplitude;
                    *v *= carrier;
                }
                (response, face.lead_s(departure))
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
                let (response, lead_s) = &faces[*s];
                for ((w, v), delay_s) in w.iter().zip(response).zip(&device.gmt_delay_s[*s]) {
                    let part = w * v;
                    sum.field += part;
                    sum.slope_s += part * (*delay_s - lead_s);
                }
                sum
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    use crate::synthesis::antenna::phasor;
    use crate::synthesis::radio::Radio;
    use crate::synthesis::{GmtArrayErrors, Impairments};

    fn drawn(impairments: &Impairments, seed: u64) -> Calibration {
        Calibration::draw(impairments, &Radio::default(), seed)
    }

    fn transmitter(device: &Calibration) -> Transmitter {
        Transmitter::new(&Radio::default(), device)
    }

    #[test]
    fn without_errors_the_fields_are_those_of_the_codebook() {
        let device = drawn(&Impairments::none(), 0);
        let transmitter = transmitter(&device);
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
        let device = drawn(&Impairments::budget(), 5);
        let transmitter = transmitter(&device);
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

    #[test]
    fn a_face_that_is_turned_and_elsewhere_sends_from_the_places_of_its_elements() {
        let impairments = Impairments {
            gmt_arrays: GmtArrayErrors {
                axis_rms_deg: 0.5,
                centre_rms_mm: 2.0,
                ..GmtArrayErrors::default()
            },
            ..Impairments::none()
        };
        let device = drawn(&impairments, 8);
        let u = Direction::from_zenith_azimuth(1.4, 0.3).expect("angles");
        let fields = transmitter(&device).fields(&u, &device);
        let known = cslam_core::array::Codebook::<f64>::default();
        let meant = known.arrays().faces()[0];
        let turned = |v: Vector3<f64>| (v + device.gmt_axis_rad[0].cross(&v)).normalize();
        let (tangent, column, normal) = (turned(meant.tangent), turned(Vector3::z()), turned(meant.normal));
        let wavelength_m = 299_792_458.0 / 30e9;
        let centre_m = device.gmt_centre_m[0];
        let amplitude = cslam_core::array::GmtElement::default().amplitude(u.vector(), &normal);
        for (m, field) in fields.iter().enumerate().take(24) {
            let aim = known.beam(m).expect("a beam").cosines;
            let sum: C64 = (0..64)
                .map(|e| {
                    let [p, q] = [f64::from(e / 8) - 3.5, f64::from(e % 8) - 3.5];
                    let place_m = centre_m + (tangent * p + column * q) * (0.5 * wavelength_m);
                    let sent = -std::f64::consts::PI * (p * aim[0] + q * aim[1]);
                    phasor(std::f64::consts::TAU / wavelength_m * place_m.dot(u.vector()) + sent) / 8.0
                })
                .sum();
            assert!((field.field - sum * amplitude).norm() < 1e-9, "beam {m}");
            let late_s = -centre_m.dot(u.vector()) / 299_792_458.0;
            assert!((field.slope_s - field.field * late_s).norm() < 1e-20, "beam {m}");
        }
    }
}
