//! The estimator's double-precision twin for one path: what fixed point is measured against.
//!
//! From the same samples, everything in `f64`: transform and correlation by definition, peak of the power-delay profile,
//! grid of directions with exact steering, Fisher scoring with the kernel in closed form. Grid step, window and step limits
//! are those of the flying estimator ([`cslam_core::paths`]), so that only its number formats and table look-ups are measured,
//! not a different method. Nothing of the flying estimator's code is used.

use cslam_core::array::{UavArrays, phasor};
use cslam_core::geometry::{Body, Direction, Vector3};
use cslam_core::signal::{SAMPLES, Waveform};
use nalgebra::{Complex, Matrix3};

use crate::channel::Block;
use crate::channel::spectrum::{Samples, Transform};

type C64 = Complex<f64>;

const ELEMENTS: usize = 8;
/// Taps of the fit on both sides of the peak, as in the flying estimator.
const REACH: i32 = 6;
/// Step of the coarse grid, degrees.
const STEP_DEG: usize = 4;
/// Longest step of one iteration: 0.5 m and 3 degrees.
const LONGEST_M: f64 = 0.5;
const LONGEST_RAD: f64 = 0.052;
/// Steps; convergence is quadratic near the optimum.
const STEPS: usize = 12;

/// The twin. Immutable.
pub struct Twin {
    transform: Transform,
    waveform: Waveform,
    /// Conjugate waveform by bin, zero outside the band.
    reference: Vec<C64>,
    arrays: UavArrays<f64>,
    grid: Vec<Direction<Body, f64>>,
}

/// A path as the twin sees it.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// Speed of light times delay, m.
    pub c_tau_m: f64,
    /// Angle of arrival.
    pub aoa: Direction<Body, f64>,
}

/// One array's elements by tap of the window, the band centred.
type Rows = [Vec<C64>; ELEMENTS];

impl Default for Twin {
    fn default() -> Self {
        let waveform = Waveform::default();
        let mut reference = vec![C64::new(0.0, 0.0); SAMPLES];
        for index in 0..waveform.active {
            reference[waveform.bin(index)] = waveform.symbol::<f64>(index).conj();
        }
        let ring = |zenith_deg: usize| {
            let zenith = (zenith_deg as f64).to_radians();
            let count = ((360 / STEP_DEG) as f64 * libm::sin(zenith) + 0.5).max(1.0) as usize;
            (0..count).filter_map(move |i| {
                let azimuth = std::f64::consts::TAU * i as f64 / count as f64;
                Direction::from_zenith_azimuth(zenith, azimuth).ok()
            })
        };
        Self {
            transform: Transform::new(),
            reference,
            arrays: UavArrays::default(),
            grid: (0..=180).step_by(STEP_DEG).flat_map(ring).collect(),
            waveform,
        }
    }
}

impl Twin {
    /// Strongest path of a block.
    pub fn strongest(&self, block: &Block) -> Fitted {
        let taps: Vec<Samples> = block
            .samples
            .iter()
            .map(|channel| self.correlate(channel))
            .collect();
        let profile: Vec<f64> = (0..SAMPLES)
            .map(|n| taps.iter().map(|h| h[n].norm_sqr()).sum())
            .collect();
        let peak = (0..SAMPLES)
            .max_by(|a, b| profile[*a].total_cmp(&profile[*b]))
            .unwrap_or(0);
        let at = |offset: usize| profile[(peak + offset) % SAMPLES];
        let (before, here, after) = (at(SAMPLES - 1), at(0), at(1));
        let vertex = 0.5 * (before - after) / (before - 2.0 * here + after);
        let arrays: Vec<Rows> = taps
            .chunks_exact(ELEMENTS)
            .map(|rows| self.window(rows, peak))
            .collect();
        let start = if vertex.is_finite() {
            vertex.clamp(-0.5, 0.5)
        } else {
            0.0
        };
        let (delay_taps, aoa) = self.score(&arrays, start, self.coarse(&arrays, start));
        let metres = self.waveform.metres_per_sample() * (peak as f64 + delay_taps);
        Fitted {
            c_tau_m: metres.rem_euclid(self.waveform.delay_period().length_m()),
            aoa,
        }
    }

    fn correlate(&self, channel: &[cslam_core::signal::Iq; SAMPLES]) -> Samples {
        let mut data: Samples = channel.map(|x| C64::new(f64::from(x.re()), f64::from(x.im())));
        self.transform.forward(&mut data);
        for (x, reference) in data.iter_mut().zip(&self.reference) {
            *x *= reference;
        }
        self.transform.inverse(&mut data);
        data
    }

    /// Taps around the peak, turned by the band's centre (half a subcarrier under the carrier).
    fn window(&self, taps: &[Samples], peak: usize) -> Rows {
        std::array::from_fn(|e| {
            (-REACH..=REACH)
                .map(|x| {
                    let n = (peak as i32 + x).rem_euclid(SAMPLES as i32) as usize;
                    taps[e][n] * phasor(std::f64::consts::PI * f64::from(x) / SAMPLES as f64)
                })
                .collect()
        })
    }

    /// Kernel and slope at a distance in taps: sin(pi Na x / N) / (Na sin(pi x / N)).
    fn kernel(&self, x: f64) -> [f64; 2] {
        let (active, period) = (self.waveform.active as f64, SAMPLES as f64);
        let (a, b) = (
            std::f64::consts::PI * active / period,
            std::f64::consts::PI / period,
        );
        let bottom = active * libm::sin(b * x);
        if bottom.abs() < 1e-7 {
            return [1.0, -x * (a * a - b * b) / 3.0];
        }
        let value = libm::sin(a * x) / bottom;
        let slope = (a * libm::cos(a * x) - value * active * b * libm::cos(b * x)) / bottom;
        [value, slope]
    }

    /// Direction of the grid that explains most at a delay.
    fn coarse(&self, arrays: &[Rows], delay_taps: f64) -> Direction<Body, f64> {
        let sums: Vec<[C64; ELEMENTS]> = arrays
            .iter()
            .map(|rows| {
                std::array::from_fn(|e| {
                    let taps = (-REACH..=REACH).zip(&rows[e]);
                    taps.map(|(x, y)| y * self.kernel(f64::from(x) - delay_taps)[0])
                        .sum()
                })
            })
            .collect();
        let power = |u: &Direction<Body, f64>| -> f64 {
            let steps = self.arrays.phase_step_rad(u);
            let arrays = sums.iter().zip(steps);
            arrays
                .map(|(sums, step)| {
                    let steering = UavArrays::<f64>::steering(step);
                    let product: C64 = sums.iter().zip(steering).map(|(y, s)| s.conj() * y).sum();
                    product.norm_sqr()
                })
                .sum()
        };
        let scored = self.grid.iter().map(|u| (power(u), u));
        *scored
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(&self.grid[0], |best| best.1)
    }

    /// Fisher scoring (docs/signal-model.md, "Path estimation") with each array's gain eliminated.
    fn score(
        &self,
        arrays: &[Rows],
        delay_taps: f64,
        aoa: Direction<Body, f64>,
    ) -> (f64, Direction<Body, f64>) {
        let per_m = 1.0 / self.waveform.metres_per_sample();
        let (mut delay_taps, mut aoa) = (delay_taps, aoa);
        for _ in 0..STEPS {
            let (e1, e2) = aoa.tangents();
            let (mut fisher, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
            let (steps, leads) = (self.arrays.phase_step_rad(&aoa), self.arrays.lead_m(&aoa));
            for (j, rows) in arrays.iter().enumerate() {
                let geometry = &self.arrays.arrays()[j];
                let turn = self.arrays.phase_per_element_rad();
                let dw = Vector3::new(0.0, turn * geometry.axis.dot(&e1), turn * geometry.axis.dot(&e2));
                let dd = Vector3::new(1.0, -geometry.centre_m.dot(&e1), -geometry.centre_m.dot(&e2)) * per_m;
                let kernel: Vec<[f64; 2]> = (-REACH..=REACH)
                    .map(|x| self.kernel(f64::from(x) - delay_taps + leads[j] * per_m))
                    .collect();
                let moment = |a: usize, b: usize| kernel.iter().map(|k| k[a] * k[b]).sum::<f64>();
                let (t00, t01, t11) = (moment(0, 0), moment(0, 1), moment(1, 1));
                // Correlations with the path and its slopes along steering phase and delay.
                let zero = C64::new(0.0, 0.0);
                let (mut a, mut w, mut t) = (zero, zero, zero);
                for (e, s) in UavArrays::<f64>::steering(steps[j]).iter().enumerate() {
                    let project = |which: usize| -> C64 {
                        let taps = rows[e].iter().zip(&kernel);
                        s.conj() * taps.map(|(y, k)| y * k[which]).sum::<C64>()
                    };
                    let (value, slope) = (project(0), project(1));
                    a += value;
                    w -= C64::i() * value * (e as f64 - 3.5);
                    t -= slope;
                }
                let elements = ELEMENTS as f64;
                let gain = a / (elements * t00);
                // Slopes without their part along the path itself; the steering's has none, places are centred.
                t += a * (t01 / t00);
                let (pull_w, pull_t) = ((gain.conj() * w).re, (gain.conj() * t).re);
                gradient += dw * pull_w + dd * pull_t;
                let power = gain.norm_sqr();
                let places = elements * (elements * elements - 1.0) / 12.0;
                fisher += dw * dw.transpose() * (power * places * t00)
                    + dd * dd.transpose() * (power * elements * (t11 - t01 * t01 / t00));
            }
            let Some(step) = fisher.try_inverse().map(|inverse| inverse * gradient) else {
                break;
            };
            let angle = (step.y * step.y + step.z * step.z).sqrt();
            let step = step / (angle / LONGEST_RAD).max(step.x.abs() / LONGEST_M).max(1.0);
            delay_taps += step.x * per_m;
            let Ok(next) = Direction::from_vector(aoa.vector() + e1 * step.y + e2 * step.z) else {
                break;
            };
            aoa = next;
            if step.x.abs() < 1e-9 && angle < 1e-10 {
                break;
            }
        }
        (delay_taps, aoa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{Range, Truth, direction};
    use crate::random::Stream;

    #[test]
    fn kernel_and_slope_follow_their_definition() {
        let twin = Twin::default();
        for x in [-6.4, -0.7, -1e-5, 0.0, 1e-5, 0.31, 2.5, 6.0] {
            let sum = |f: &dyn Fn(f64) -> f64| -> f64 {
                let angle = |k: i32| std::f64::consts::TAU * (f64::from(k) + 0.5) / 512.0;
                (-208..208).map(|k| f(angle(k))).sum::<f64>() / 416.0
            };
            let expected = [sum(&|w| libm::cos(w * x)), sum(&|w| -w * libm::sin(w * x))];
            let got = twin.kernel(x);
            assert!(
                (0..2).all(|i| (got[i] - expected[i]).abs() < 1e-9),
                "{x}: {got:?} {expected:?}"
            );
        }
    }

    /// At 60 dB what is left is the converter's 16 bits: the model of the twin is that of the channel.
    #[test]
    fn twin_finds_a_path_to_micrometres() {
        let (range, twin) = (Range::with_bits(&[12], 4, 16), Twin::default());
        for trial in 0..20 {
            let mut stream = Stream::new(4, trial);
            let truth = Truth {
                c_tau_m: 5.0 + 400.0 * stream.uniform(),
                aoa: direction(&mut stream, -45.0..45.0),
                aod: range.aim(12),
                snr_db: 60.0,
                phase_rad: 1.0,
            };
            let sweep = range.hear(&[truth], trial as u32);
            let found = twin.strongest(&sweep.blocks[0]);
            let error_m = (found.c_tau_m - truth.c_tau_m).abs();
            let error_rad = found.aoa.angle_to_rad(&truth.aoa);
            assert!(error_m < 5e-5 && error_rad < 2e-5, "{error_m} m, {error_rad} rad");
        }
    }
}
