//! The errors a device is built with: drawn once from a seed, the same in every sweep.

use super::antenna::phasor;
use super::config::Impairments;
use super::{ARRAYS, C64, ELEMENTS, FACE_ELEMENTS, FACES};
use crate::random::Stream;

/// Errors of one UAV and one GMT.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// UAV: `exp(j error)` of each element.
    pub uav_element: [[C64; ELEMENTS]; ARRAYS],
    /// UAV: tilt of each axis along two tangents, rad.
    pub uav_axis_rad: [[f64; 2]; ARRAYS],
    /// UAV: delay of each array, s.
    pub uav_delay_s: [f64; ARRAYS],
    /// GMT: `exp(j error)` of each element, column-major 8 p + q.
    pub gmt_element: [[C64; FACE_ELEMENTS]; FACES],
    /// GMT: delay of each element, s.
    pub gmt_delay_s: [[f64; FACE_ELEMENTS]; FACES],
}

impl Calibration {
    /// Draws a device. Each kind of error has its own stream, so setting one to zero leaves the others as they were.
    pub fn draw(impairments: &Impairments, seed: u64) -> Self {
        let kind = |index: u64, rms: f64| {
            let mut stream = Stream::new(seed, CALIBRATION_STREAMS | index);
            move || rms * stream.normal()
        };
        let phase = |index, rms_deg: f64| {
            let mut draw = kind(index, rms_deg.to_radians());
            move || phasor(draw())
        };
        let mut uav_element = phase(0, impairments.uav_element_phase_rms_deg);
        let mut uav_axis = kind(1, impairments.uav_axis_rms_deg.to_radians());
        let mut uav_delay = kind(2, impairments.uav_array_delay_rms_ps * 1e-12);
        let mut gmt_element = phase(3, impairments.gmt_element_phase_rms_deg);
        let mut gmt_delay = kind(4, impairments.gmt_element_delay_rms_ps * 1e-12);
        Self {
            uav_element: std::array::from_fn(|_| std::array::from_fn(|_| uav_element())),
            uav_axis_rad: std::array::from_fn(|_| std::array::from_fn(|_| uav_axis())),
            uav_delay_s: std::array::from_fn(|_| uav_delay()),
            gmt_element: std::array::from_fn(|_| std::array::from_fn(|_| gmt_element())),
            gmt_delay_s: std::array::from_fn(|_| std::array::from_fn(|_| gmt_delay())),
        }
    }
}

/// High bits of the stream numbers of device errors; those of sweeps have them clear.
const CALIBRATION_STREAMS: u64 = 1 << 63;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_their_rms_and_one_does_not_move_another() {
        let (mut square, draws) = (0.0, 200);
        for seed in 0..draws {
            let device = Calibration::draw(&Impairments::budget(), seed);
            square += device
                .gmt_element
                .iter()
                .flatten()
                .map(|c| c.arg().powi(2))
                .sum::<f64>();
        }
        let rms_deg = (square / (draws as f64 * 192.0)).sqrt().to_degrees();
        assert!((rms_deg - 5.0).abs() < 0.1, "{rms_deg}");

        let all = Calibration::draw(&Impairments::budget(), 1);
        let some = Impairments {
            uav_element_phase_rms_deg: 0.0,
            ..Impairments::budget()
        };
        let some = Calibration::draw(&some, 1);
        assert!(
            some.uav_element
                .iter()
                .flatten()
                .all(|c| *c == C64::new(1.0, 0.0))
        );
        assert_eq!(
            (
                some.uav_axis_rad,
                some.uav_delay_s,
                some.gmt_element,
                some.gmt_delay_s
            ),
            (
                all.uav_axis_rad,
                all.uav_delay_s,
                all.gmt_element,
                all.gmt_delay_s
            )
        );
    }
}
