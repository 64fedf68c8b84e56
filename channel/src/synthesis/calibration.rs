//! The errors a device is built with: drawn once from a seed, the same in every sweep.

use nalgebra::Vector3;

use super::C64;
use super::antenna::phasor;
use super::effects::Draw;
use super::impairments::Impairments;
use super::radio::Radio;

/// Errors of one UAV and one GMT.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration<const ARRAYS: usize = 4, const ELEMENTS: usize = 8> {
    /// UAV: gain and `exp(j error)` of each element.
    pub uav_element: [[C64; ELEMENTS]; ARRAYS],
    /// UAV: tilt of each axis along two tangents, rad.
    pub uav_axis_rad: [[f64; 2]; ARRAYS],
    /// UAV: tilt of the columns of a planar array out of its face, rad.
    pub uav_column_rad: f64,
    /// UAV: delay of each array, s.
    pub uav_delay_s: [f64; ARRAYS],
    /// UAV: error of each array's centre, m, body frame.
    pub uav_centre_m: [Vector3<f64>; ARRAYS],
    /// GMT: turn of each face about the axes of the GMT's frame, rad.
    pub gmt_axis_rad: Vec<Vector3<f64>>,
    /// GMT: error of each face's centre, m, GMT frame.
    pub gmt_centre_m: Vec<Vector3<f64>>,
    /// GMT: gain and `exp(j error)` of each element of each face, column-major `rows p + q`.
    pub gmt_element: Vec<Vec<C64>>,
    /// GMT: delay of each element of each face, s.
    pub gmt_delay_s: Vec<Vec<f64>>,
}

impl<const ARRAYS: usize, const ELEMENTS: usize> Calibration<ARRAYS, ELEMENTS> {
    /// Draws a device. Each kind of error has its own stream, so setting one to zero leaves the others as they were. The rows of one
    /// board turn, move and are late together.
    pub fn draw(impairments: &Impairments, radio: &Radio, seed: u64) -> Self {
        let counts = &radio.gmt;
        let one_board = radio.is_one_board();
        let normal = |draw: Draw, rms: f64| {
            let mut stream = draw.stream(seed);
            move || rms * stream.normal()
        };
        let mut uav_axis = normal(Draw::UavAxis, impairments.uav_axis_rms_deg.to_radians());
        let uav_delay = normal(Draw::UavDelay, impairments.uav_array_delay_rms_ps * 1e-12);
        let mut gmt_delay = normal(Draw::GmtDelay, impairments.gmt_element_delay_rms_ps * 1e-12);
        let mut uav_centre = normal(Draw::UavCentre, impairments.uav_arrays.centre_rms_mm * 1e-3);
        let gmt = &impairments.gmt_arrays;
        let mut gmt_axis = normal(Draw::GmtAxis, gmt.axis_rms_deg.to_radians());
        let mut gmt_centre = normal(Draw::GmtCentre, gmt.centre_rms_mm * 1e-3);
        let element = |gain: (Draw, f64), phase: (Draw, f64)| {
            let (mut gain_db, mut phase_rad) =
                (normal(gain.0, gain.1), normal(phase.0, phase.1.to_radians()));
            move || phasor(phase_rad()) * libm::exp10(gain_db() / 20.0)
        };
        let mut uav_element = element(
            (Draw::UavGain, impairments.uav_arrays.gain_rms_db),
            (Draw::UavPhase, impairments.uav_element_phase_rms_deg),
        );
        let mut gmt_element = element(
            (Draw::GmtGain, gmt.gain_rms_db),
            (Draw::GmtPhase, impairments.gmt_element_phase_rms_deg),
        );
        let uav_axis_rad = of_arrays(one_board, || std::array::from_fn(|_| uav_axis()));
        let faces = |draw: &mut dyn FnMut() -> Vector3<f64>| each(counts.faces, draw);
        Self {
            uav_element: std::array::from_fn(|_| std::array::from_fn(|_| uav_element())),
            uav_axis_rad,
            uav_column_rad: if one_board { uav_axis() } else { 0.0 },
            uav_delay_s: of_arrays(one_board, uav_delay),
            uav_centre_m: of_arrays(one_board, || Vector3::from_fn(|_, _| uav_centre())),
            gmt_axis_rad: faces(&mut || Vector3::from_fn(|_, _| gmt_axis())),
            gmt_centre_m: faces(&mut || Vector3::from_fn(|_, _| gmt_centre())),
            gmt_element: each(counts.faces, || each(counts.elements(), &mut gmt_element)),
            gmt_delay_s: each(counts.faces, || each(counts.elements(), &mut gmt_delay)),
        }
    }
}

/// Drawn for each array one after the other, or once for all that are one board.
fn of_arrays<T: Copy, const ARRAYS: usize>(one_board: bool, mut draw: impl FnMut() -> T) -> [T; ARRAYS] {
    if one_board {
        [draw(); ARRAYS]
    } else {
        std::array::from_fn(|_| draw())
    }
}

/// So many of what is drawn one after the other.
fn each<T>(count: usize, mut draw: impl FnMut() -> T) -> Vec<T> {
    (0..count).map(|_| draw()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthesis::{GmtArrayErrors, UavArrayErrors};

    fn draw(impairments: &Impairments, seed: u64) -> Calibration {
        Calibration::draw(impairments, &Radio::default(), seed)
    }

    #[test]
    fn gains_and_centres_have_their_rms_and_move_no_phase() {
        let (mut square, draws) = ([0.0; 5], 200);
        let budget = Impairments::budget();
        for seed in 0..draws {
            let with = Impairments {
                uav_arrays: UavArrayErrors {
                    gain_rms_db: 0.5,
                    centre_rms_mm: 1.0,
                    ..UavArrayErrors::default()
                },
                gmt_arrays: GmtArrayErrors {
                    gain_rms_db: 0.5,
                    axis_rms_deg: 0.1,
                    centre_rms_mm: 1.0,
                },
                ..budget.clone()
            };
            let (with, without) = (draw(&with, seed), draw(&budget, seed));
            let db = |c: &C64| 20.0 * libm::log10(c.norm());
            square[0] += with
                .uav_element
                .iter()
                .flatten()
                .map(|c| db(c).powi(2))
                .sum::<f64>()
                / 32.0;
            square[1] += with
                .gmt_element
                .iter()
                .flatten()
                .map(|c| db(c).powi(2))
                .sum::<f64>()
                / 192.0;
            square[2] += with.uav_centre_m.iter().map(|m| m.norm_squared()).sum::<f64>() * 1e6 / 12.0;
            square[3] += with.gmt_centre_m.iter().map(|m| m.norm_squared()).sum::<f64>() * 1e6 / 9.0;
            let degrees = with.gmt_axis_rad.iter().map(|turn| turn.map(f64::to_degrees));
            square[4] += degrees.map(|turn| turn.norm_squared()).sum::<f64>() / 9.0;
            let pairs = |a: &Calibration, b: &Calibration| {
                let [a, b] = [a, b].map(|c| [c.uav_element.as_flattened(), &c.gmt_element.concat()].concat());
                a.iter()
                    .zip(&b)
                    .map(|(a, b)| (a / b).arg().abs())
                    .fold(0.0, f64::max)
            };
            assert!(pairs(&with, &without) < 1e-12);
            assert_eq!(
                (with.uav_axis_rad, with.uav_delay_s, with.gmt_delay_s),
                (without.uav_axis_rad, without.uav_delay_s, without.gmt_delay_s)
            );
        }
        let [uav, gmt, centre, face, turn] = square.map(|s| (s / draws as f64).sqrt());
        assert!(
            (uav - 0.5).abs() < 0.02 && (gmt - 0.5).abs() < 0.01,
            "{uav} {gmt}"
        );
        assert!((centre - 1.0).abs() < 0.06, "{centre}");
        assert!(
            (face - 1.0).abs() < 0.08 && (turn - 0.1).abs() < 0.008,
            "{face} {turn}"
        );
    }

    #[test]
    fn rows_of_one_board_turn_move_and_are_late_together() {
        let radio = Radio::planar();
        let impairments = Impairments {
            uav_arrays: UavArrayErrors {
                centre_rms_mm: 1.0,
                ..UavArrayErrors::default()
            },
            ..Impairments::budget()
        };
        let board = Calibration::<8, 8>::draw(&impairments, &radio, 3);
        let of_rows = (board.uav_axis_rad, board.uav_delay_s, board.uav_centre_m);
        let of_first = (of_rows.0[0], of_rows.1[0], of_rows.2[0]);
        assert_eq!(of_rows, ([of_first.0; 8], [of_first.1; 8], [of_first.2; 8]));
        assert!(of_first.1 != 0.0 && of_first.2.norm() > 0.0);
        assert!(board.uav_column_rad != 0.0 && !of_first.0.contains(&board.uav_column_rad));
        // Elements differ from row to row, and arrays around the body in all.
        assert_ne!(board.uav_element[0], board.uav_element[1]);
        let around = draw(&impairments, 3);
        assert_eq!(around.uav_column_rad, 0.0);
        assert!(around.uav_delay_s[0] != around.uav_delay_s[1]);
    }

    #[test]
    fn errors_have_their_rms_and_one_does_not_move_another() {
        let (mut square, draws) = (0.0, 200);
        for seed in 0..draws {
            let device = draw(&Impairments::budget(), seed);
            square += device
                .gmt_element
                .iter()
                .flatten()
                .map(|c| c.arg().powi(2))
                .sum::<f64>();
        }
        let rms_deg = (square / (draws as f64 * 192.0)).sqrt().to_degrees();
        assert!((rms_deg - 5.0).abs() < 0.1, "{rms_deg}");

        let all = draw(&Impairments::budget(), 1);
        let some = Impairments {
            uav_element_phase_rms_deg: 0.0,
            ..Impairments::budget()
        };
        let some = draw(&some, 1);
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
