//! Cramer-Rao lower bounds of path estimation: the figure of merit of every estimator.
//!
//! The model of one beam: path p gives channel (j, i) on subcarrier k the mean
//! `g_pj exp(+j pi n_i axis_j . u_p) exp(-j 2 pi f_k (c tau_p - p_j . u_p) / c)` in white noise. The gain `g_pj` of every
//! path and array is free and unknown (arrays share no oscillator, and the pattern of an element is not used); rows of a planar array
//! share one. Parameters
//! of a path are (c tau in m, angle along e1, angle along e2 in rad), with the tangents of its direction.
//!
//! [`single`] is the closed form for one path (docs/signal-model.md, "Path estimation", `H` at the truth), [`joint`] the numerical Fisher
//! matrix of any number of paths, made of difference quotients of the mean; each checks the other.

use cslam_core::array::{UavArrays, phasor};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction};
use cslam_core::signal::Waveform;
use nalgebra::{Complex, DMatrix, Matrix3, Vector3};

/// Receiver whose bound is asked for: `ARRAYS` of `ELEMENTS` elements.
#[derive(Clone, Debug, Default)]
pub struct Receiver<const ARRAYS: usize = 4, const ELEMENTS: usize = 8> {
    /// Arrays.
    pub arrays: UavArrays<f64, ARRAYS, ELEMENTS>,
    /// Waveform.
    pub waveform: Waveform,
}

/// A path of the model.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Speed of light times delay, m.
    pub c_tau_m: f64,
    /// Angle of arrival.
    pub aoa: Direction<Body, f64>,
    /// SNR per active subcarrier at an element of gain one; the element pattern is applied here.
    pub snr: f64,
    /// Phase of the path, rad; matters only between paths.
    pub phase_rad: f64,
}

/// Mean square of the centred angular subcarrier frequency over c, rad^2/m^2: (2 pi 57.64 MHz / c)^2.
fn bandwidth2_per_m2(waveform: &Waveform) -> f64 {
    let active = waveform.active as f64;
    let step = std::f64::consts::TAU * waveform.spacing_hz() / SPEED_OF_LIGHT_M_PER_S;
    step * step * (active * active - 1.0) / 12.0
}

/// Bound of one path alone: covariance of (c tau in m, two tangent angles in rad). None where the geometry leaves a
/// parameter unobservable.
pub fn single<const ARRAYS: usize, const ELEMENTS: usize>(
    receiver: &Receiver<ARRAYS, ELEMENTS>,
    path: &Arrival,
) -> Option<Matrix3<f64>> {
    let (e1, e2) = path.aoa.tangents();
    let kappa2 = bandwidth2_per_m2(&receiver.waveform);
    let active = receiver.waveform.active as f64;
    let elements = ELEMENTS as f64;
    // Sum of n_i^2: 42 for eight elements.
    let places2 = elements * (elements * elements - 1.0) / 12.0;
    let mut fisher = Matrix3::zeros();
    let gains = receiver.arrays.amplitude(&path.aoa);
    for (array, gain) in receiver.arrays.arrays().iter().zip(gains) {
        let energy = 2.0 * path.snr * gain * gain * active;
        let turn = receiver.arrays.phase_per_element_rad();
        let dw = Vector3::new(0.0, turn * array.axis.dot(&e1), turn * array.axis.dot(&e2));
        let dd = Vector3::new(1.0, -array.centre_m.dot(&e1), -array.centre_m.dot(&e2));
        fisher += (dw * dw.transpose() * places2 + dd * dd.transpose() * (elements * kappa2)) * energy;
        // Rows of one oscillator tell by their phases what rows of free gains do not.
        if let Some(column) = receiver.arrays.column() {
            let dv = Vector3::new(0.0, turn * column.dot(&e1), turn * column.dot(&e2));
            let rows = ARRAYS as f64;
            fisher += dv * dv.transpose() * (elements * (rows * rows - 1.0) / 12.0) * energy;
        }
    }
    fisher.try_inverse()
}

/// Bound of several paths of one beam jointly: covariance of their parameters, three a path, from a numerical Fisher
/// matrix. None where it is singular.
pub fn joint(receiver: &Receiver, paths: &[Arrival]) -> Option<DMatrix<f64>> {
    let arrays = receiver.arrays.arrays().len();
    let shared = 3 * paths.len();
    // Parameters: three a path, then real and imaginary part of each gain.
    let parameters = shared + 2 * arrays * paths.len();
    let mut fisher = DMatrix::<f64>::zeros(parameters, parameters);
    for j in 0..arrays {
        let mean =
            |p: usize, moved: [f64; 3], gain: Complex<f64>| array_mean(receiver, j, &paths[p], moved, gain);
        let mut columns: Vec<(usize, Vec<Complex<f64>>)> = Vec::new();
        for (p, path) in paths.iter().enumerate() {
            let amplitude = receiver.arrays.amplitude(&path.aoa)[j] * path.snr.sqrt();
            let gain = phasor(path.phase_rad) * amplitude;
            for (a, step) in [1e-3, 1e-5, 1e-5].into_iter().enumerate() {
                let side = |s: f64| {
                    let mut moved = [0.0; 3];
                    moved[a] = s;
                    mean(p, moved, gain)
                };
                let slope = side(step)
                    .iter()
                    .zip(side(-step))
                    .map(|(x, y)| (x - y) / (2.0 * step))
                    .collect();
                columns.push((3 * p + a, slope));
            }
            let first = shared + 2 * (arrays * p + j);
            columns.push((first, mean(p, [0.0; 3], Complex::new(1.0, 0.0))));
            columns.push((first + 1, mean(p, [0.0; 3], Complex::new(0.0, 1.0))));
        }
        for (r, row) in &columns {
            for (c, column) in &columns {
                // Noise of variance one: snr is the path's power.
                fisher[(*r, *c)] += 2.0
                    * row
                        .iter()
                        .zip(column)
                        .map(|(x, y)| (x.conj() * y).re)
                        .sum::<f64>();
            }
        }
    }
    // Unit diagonal, for the inversion's sake: gains and metres differ by many powers of ten.
    let scale: Vec<f64> = (0..parameters).map(|i| fisher[(i, i)].sqrt().recip()).collect();
    let scaled = DMatrix::from_fn(parameters, parameters, |r, c| {
        fisher[(r, c)] * scale[r] * scale[c]
    });
    let inverse = scaled.try_inverse()?;
    Some(DMatrix::from_fn(shared, shared, |r, c| {
        inverse[(r, c)] * scale[r] * scale[c]
    }))
}

/// Mean of the elements and subcarriers of array `j` for a path moved by (m, rad, rad).
fn array_mean(
    receiver: &Receiver,
    j: usize,
    path: &Arrival,
    moved: [f64; 3],
    gain: Complex<f64>,
) -> Vec<Complex<f64>> {
    let (e1, e2) = path.aoa.tangents();
    let direction =
        Direction::from_vector(path.aoa.vector() + e1 * moved[1] + e2 * moved[2]).unwrap_or(path.aoa);
    let step = receiver.arrays.phase_step_rad(&direction)[j];
    // Delays relative to the unmoved one: the constant part only turns the gain.
    let late_m = moved[0] - (receiver.arrays.lead_m(&direction)[j] - receiver.arrays.lead_m(&path.aoa)[j]);
    let absolute_m = path.c_tau_m - receiver.arrays.lead_m(&path.aoa)[j] + late_m;
    let per_m = std::f64::consts::TAU * receiver.waveform.spacing_hz() / SPEED_OF_LIGHT_M_PER_S;
    let delays: Vec<Complex<f64>> = (0..receiver.waveform.active)
        .map(|index| phasor(-per_m * f64::from(receiver.waveform.offset(index)) * absolute_m))
        .collect();
    UavArrays::<f64>::steering(step)
        .into_iter()
        .flat_map(|steering| delays.iter().map(move |delay| gain * steering * delay))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrival(zenith_deg: f64, azimuth_deg: f64, snr_db: f64) -> Arrival {
        Arrival {
            c_tau_m: 87.3,
            aoa: Direction::from_zenith_azimuth(zenith_deg.to_radians(), azimuth_deg.to_radians())
                .expect("angles"),
            snr: libm::exp10(snr_db / 10.0),
            phase_rad: 0.7,
        }
    }

    #[test]
    fn closed_form_is_the_numerical_fisher_matrix() {
        let receiver = <Receiver>::default();
        for (zenith, azimuth, snr) in [
            (90.0, 0.0, 0.0),
            (60.0, 45.0, 20.0),
            (120.0, -100.0, -10.0),
            (30.0, 170.0, 5.0),
        ] {
            let path = arrival(zenith, azimuth, snr);
            let closed = single(&receiver, &path).expect("observable");
            let numerical = joint(&receiver, &[path]).expect("observable");
            let size = closed.map_with_location(|r, c, _| (closed[(r, r)] * closed[(c, c)]).sqrt());
            for (r, c) in (0..9).map(|i| (i / 3, i % 3)) {
                let off = (closed[(r, c)] - numerical[(r, c)]).abs() / size[(r, c)];
                assert!(off < 1e-5, "({r}, {c}) differs by {off:e}");
            }
        }
    }

    #[test]
    fn figures_are_those_of_the_design() {
        // docs/signal-model.md, "Arrays": diag/fb15, median over directions: 0.135 / 0.144 deg, 6.8 mm at 0 dB.
        let receiver = <Receiver>::default();
        let mut bounds: [Vec<f64>; 3] = Default::default();
        for azimuth in (0..360).step_by(5) {
            for elevation in (-60..=75).step_by(5) {
                let path = arrival(90.0 - f64::from(elevation), f64::from(azimuth), 0.0);
                let covariance = single(&receiver, &path).expect("observable");
                for (all, i) in bounds.iter_mut().zip(0..3) {
                    all.push(covariance[(i, i)].sqrt());
                }
            }
        }
        let [range, e1, e2] = bounds.map(|b| crate::statistics::median(&b).expect("directions"));
        assert!((range * 1e3 - 6.8).abs() < 0.7, "{range} m");
        assert!((e1.to_degrees() - 0.135).abs() < 0.015, "{} deg", e1.to_degrees());
        assert!((e2.to_degrees() - 0.144).abs() < 0.015, "{} deg", e2.to_degrees());
    }

    #[test]
    fn neighbour_widens_the_bound_and_a_distant_one_does_not() {
        let receiver = <Receiver>::default();
        let one = arrival(80.0, 20.0, 20.0);
        let alone = single(&receiver, &one).expect("observable");
        let with = |apart_m: f64, apart_deg: f64| {
            let mut other = arrival(80.0 + apart_deg, 20.0, 14.0);
            other.c_tau_m += apart_m;
            joint(&receiver, &[one, other]).expect("observable")[(0, 0)]
        };
        assert!(with(0.3, 1.7) > 4.0 * alone[(0, 0)]);
        assert!(with(60.0, 40.0) < 1.01 * alone[(0, 0)]);
    }
}
