//! Cramer-Rao bound of beam squint localization.
//!
//! Symbol m at subcarrier k gives element i of array j the mean `g_mj r_m(s_x, s_z; f_k) exp(-j 2 pi f_k (c tau -
//! p_j.u)/c)` in white noise, with the symbol's known pattern r and a free gain g for every symbol and array.
//! Parameters are (s_x, s_z, c tau in m). Arrival and lever arms count as known, so only the array's power towards the
//! UAV matters.

use cslam_core::array::{SquintSymbol, centred, phasor};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::signal::Waveform;
use nalgebra::{Complex, DMatrix, Matrix3, Vector3};

/// What is heard of a sweep.
#[derive(Clone, Debug)]
pub struct Hearing<'a> {
    /// Symbols of the face.
    pub symbols: &'a [SquintSymbol<f64>],
    /// Waveform.
    pub waveform: &'a Waveform,
    /// Direction cosines on the face.
    pub cosines: [f64; 2],
    /// SNR per active subcarrier of each array, its elements added, behind a transmit pattern of gain one.
    pub snr: [f64; 4],
}

impl Hearing<'_> {
    fn carrier_ghz(&self) -> f64 {
        self.waveform.carrier_hz * 1e-9
    }

    fn offset_hz(&self, index: usize) -> f64 {
        f64::from(self.waveform.offset(index)) * self.waveform.spacing_hz()
    }

    /// Pattern of a row and its derivative over the cosine, in closed form.
    fn row(&self, symbol: &SquintSymbol<f64>, axis: usize, f_ghz: f64) -> [f64; 2] {
        let squint = 1.0 + f_ghz / self.carrier_ghz();
        let step = std::f64::consts::PI * (self.cosines[axis] * squint - symbol.psi[axis])
            - std::f64::consts::TAU * f_ghz * symbol.delay_ns[axis];
        (0..8).fold([0.0; 2], |[sum, slope], i| {
            let n: f64 = centred(i, 8);
            let (sine, cosine) = libm::sincos(n * step);
            [sum + cosine, slope - n * sine * std::f64::consts::PI * squint]
        })
    }

    /// Covariance of (s_x, s_z, c tau), closed form: the pattern is real, a delay turns it, so directions and delay are
    /// uncorrelated. None where a parameter is unobservable.
    pub fn bound(&self) -> Option<Matrix3<f64>> {
        let mut fisher = Matrix3::zeros();
        let snr: f64 = self.snr.iter().sum();
        for symbol in self.symbols {
            // Sums of the products of (pattern, its derivatives; with delay the pattern times angular frequency).
            let (mut rr, mut ra, mut aa) = (0.0, Vector3::zeros(), Matrix3::zeros());
            for index in 0..self.waveform.active {
                let f_hz = self.offset_hz(index);
                let [x, dx] = self.row(symbol, 0, f_hz * 1e-9);
                let [z, dz] = self.row(symbol, 1, f_hz * 1e-9);
                let r = x * z;
                let directions = Vector3::new(dx * z, x * dz, 0.0);
                let delay = Vector3::z() * (std::f64::consts::TAU * f_hz / SPEED_OF_LIGHT_M_PER_S * r);
                rr += r * r;
                ra += (directions + delay) * r;
                aa += directions * directions.transpose() + delay * delay.transpose();
            }
            let mut beside = aa - ra * ra.transpose() / rr;
            // Real against imaginary: nothing.
            for i in 0..2 {
                beside[(i, 2)] = 0.0;
                beside[(2, i)] = 0.0;
            }
            // Patterns of rows have gain 64 together; weights of norm one leave 8.
            fisher += beside * (2.0 * snr / 64.0);
        }
        fisher.try_inverse()
    }

    /// The same from a numerical Fisher matrix over all parameters, the gains included: difference quotients of the
    /// mean.
    pub fn numerical_bound(&self) -> Option<Matrix3<f64>> {
        let arrays = self.snr.len();
        let parameters = 3 + 2 * arrays * self.symbols.len();
        let mut fisher = DMatrix::<f64>::zeros(parameters, parameters);
        for (m, symbol) in self.symbols.iter().enumerate() {
            for (j, snr) in self.snr.iter().enumerate() {
                // Any phase will do.
                let gain = phasor(0.3 + m as f64 + 2.0 * j as f64) * snr.sqrt();
                let slope = |parameter: usize, step: f64| -> Vec<Complex<f64>> {
                    let side = |s: f64| {
                        let mut moved = [0.0; 3];
                        moved[parameter] = s;
                        self.mean(symbol, moved, gain)
                    };
                    let (ahead, behind) = (side(step), side(-step));
                    ahead
                        .iter()
                        .zip(behind)
                        .map(|(a, b)| (a - b) / (2.0 * step))
                        .collect()
                };
                let first = 3 + 2 * (arrays * m + j);
                let columns = [
                    (0, slope(0, 1e-5)),
                    (1, slope(1, 1e-5)),
                    (2, slope(2, 1e-3)),
                    (first, self.mean(symbol, [0.0; 3], Complex::new(1.0, 0.0))),
                    (first + 1, self.mean(symbol, [0.0; 3], Complex::new(0.0, 1.0))),
                ];
                for (r, row) in &columns {
                    for (c, column) in &columns {
                        let product: f64 = row.iter().zip(column).map(|(x, y)| (x.conj() * y).re).sum();
                        fisher[(*r, *c)] += 2.0 * product;
                    }
                }
            }
        }
        // Unit diagonal, for the inversion's sake.
        let scale: Vec<f64> = (0..parameters).map(|i| fisher[(i, i)].sqrt().recip()).collect();
        let scaled = DMatrix::from_fn(parameters, parameters, |r, c| {
            fisher[(r, c)] * scale[r] * scale[c]
        });
        let inverse = scaled.try_inverse()?;
        Some(Matrix3::from_fn(|r, c| inverse[(r, c)] * scale[r] * scale[c]))
    }

    fn mean(&self, symbol: &SquintSymbol<f64>, moved: [f64; 3], gain: Complex<f64>) -> Vec<Complex<f64>> {
        let cosines = [self.cosines[0] + moved[0], self.cosines[1] + moved[1]];
        (0..self.waveform.active)
            .map(|index| {
                let f_hz = self.offset_hz(index);
                let turns = f_hz * moved[2] / SPEED_OF_LIGHT_M_PER_S;
                let pattern: Complex<f64> = symbol.response::<8, 8>(cosines, f_hz * 1e-9, self.carrier_ghz());
                gain * pattern * phasor(-std::f64::consts::TAU * turns)
            })
            .collect()
    }
}

/// Mean square 3-D position error, m^2, of a covariance of (s_x, s_z, c tau): the position is
/// `c tau (c_x normal + s_x row + s_z up)`.
pub fn position_variance_m2(covariance: &Matrix3<f64>, [x, z]: [f64; 2], c_tau_m: f64) -> f64 {
    let ahead = (1.0 - x * x - z * z).sqrt();
    // Columns over (s_x, s_z, c tau), rows along normal, row and up.
    let jacobian = Matrix3::new(
        -x / ahead * c_tau_m,
        -z / ahead * c_tau_m,
        ahead,
        c_tau_m,
        0.0,
        x,
        0.0,
        c_tau_m,
        z,
    );
    (jacobian * covariance * jacobian.transpose()).trace()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cslam_core::array::{SquintConfig, SquintScheme};

    #[test]
    fn closed_form_is_the_numerical_fisher_matrix() {
        let waveform = Waveform::default();
        let band_hz = [-208.0 * 480e3, 207.0 * 480e3];
        for (scheme, count) in [(SquintScheme::Sequential, 11), (SquintScheme::Raster, 1)] {
            let symbol = |i| SquintConfig::default().symbol(scheme, i, 1, band_hz, 30e9);
            let symbols: Vec<_> = (0..count).filter_map(symbol).collect();
            for cosines in [[0.3, 0.2], [-0.7, 0.05]] {
                let hearing = Hearing {
                    symbols: &symbols,
                    waveform: &waveform,
                    cosines,
                    snr: [2.0, 0.5, 0.1, 1.0],
                };
                let closed = hearing.bound().expect("observable");
                let numerical = hearing.numerical_bound().expect("observable");
                for (r, c) in (0..9).map(|i| (i / 3, i % 3)) {
                    let size = (closed[(r, r)] * closed[(c, c)]).sqrt();
                    let off = (closed[(r, c)] - numerical[(r, c)]).abs() / size;
                    assert!(off < 1e-5, "{scheme:?} ({r}, {c}) differs by {off:e}");
                }
            }
        }
    }

    #[test]
    fn position_error_is_what_a_moved_position_shows() {
        let (cosines, c_tau_m) = ([0.3, 0.2_f64], 50.0);
        let place = |x: f64, z: f64, r: f64| Vector3::new((1.0 - x * x - z * z).sqrt(), x, z) * r;
        let steps = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-3]];
        let covariance = Matrix3::from_diagonal(&Vector3::new(4e-6, 9e-6, 1e-4));
        let mut sum = 0.0;
        for (i, [x, z, r]) in steps.into_iter().enumerate() {
            let moved = place(0.3 + x, 0.2 + z, 50.0 + r) - place(0.3, 0.2, 50.0);
            sum += (moved / (x + z + r)).norm_squared() * covariance[(i, i)];
        }
        assert!((position_variance_m2(&covariance, cosines, c_tau_m) / sum - 1.0).abs() < 1e-4);
    }
}
