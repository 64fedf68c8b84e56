//! The signal model of a path at the arrays: steering phases and array delays, in the units of the scoring loops.
//!
//! Element i of array j sees `g_j exp(+j n_i w_j) D(n - d_j)` with `n_i = i - (E - 1)/2`, `w_j` the phase step of the
//! array's axis towards the path and `d_j = (c tau - p_j . u) / metres per tap`. `g_j` is free: arrays share no
//! oscillator, and elements have patterns (docs/signal-model.md, "Arrays"). Angles here are turns, delays taps.

use nalgebra::{Complex, Vector3};

use crate::array::{MOST_ARRAYS, UavArrays};
use crate::signal::{SAMPLES, Waveform, phasor};

/// Rows of a planar array: one oscillator, and so one free gain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planar {
    /// Turns from a row to the next = step . u.
    pub(super) row_turns: Vector3<f32>,
    /// Outward normal: what is behind is not heard.
    pub(super) normal: Vector3<f32>,
}

/// Steering and lever arms of `A` linear arrays of `E` elements.
#[derive(Clone, Debug)]
pub(super) struct ArrayModel<const A: usize, const E: usize> {
    /// Turns from an element to the next = step . u.
    step_turns: [Vector3<f32>; A],
    /// Taps by which a wave from u leads at the array = lead . u.
    lead_taps: [Vector3<f32>; A],
    planar: Option<Planar>,
    metres_per_tap: f64,
    /// Share of a path's energy that errors of the arrays' calibration leave beside it.
    calibration_share: f32,
}

impl<const A: usize, const E: usize> ArrayModel<A, E> {
    pub(super) fn new(arrays: &UavArrays<f32, A, E>, waveform: &Waveform) -> Self {
        let metres_per_tap = waveform.metres_per_sample();
        let turns = arrays.phase_per_element_rad() / core::f32::consts::TAU;
        Self {
            step_turns: arrays.arrays().map(|array| array.axis * turns),
            lead_taps: arrays
                .arrays()
                .map(|array| array.centre_m / metres_per_tap as f32),
            planar: arrays
                .column()
                .zip(arrays.arrays().first())
                .map(|(column, row)| Planar {
                    row_turns: column * turns,
                    normal: row.normal,
                }),
            metres_per_tap,
            calibration_share: 0.0,
        }
    }

    /// From now on errors of the arrays' calibration leave this share of a path's energy beside it.
    pub(super) fn set_calibration_share(&mut self, share: f32) {
        self.calibration_share = share;
    }

    /// Share of a path's energy that errors of the arrays' calibration leave beside it.
    pub(super) fn calibration_share(&self) -> f32 {
        self.calibration_share
    }

    pub(super) fn metres_per_tap(&self) -> f32 {
        self.metres_per_tap as f32
    }

    /// Length of a delay given as taps from a tap, m, within one period from 0. In double precision: a single-precision sum
    /// and product of taps would round to 0.04 mm, half the bound at 40 dB.
    pub(super) fn metres(&self, origin: usize, delay_taps: f32) -> f32 {
        let (taps, period) = (
            (origin & (SAMPLES - 1)) as f64 + f64::from(delay_taps),
            SAMPLES as f64,
        );
        let within = if taps < 0.0 {
            taps + period
        } else if taps >= period {
            taps - period
        } else {
            taps
        };
        (within * self.metres_per_tap) as f32
    }

    /// Per array: turns per element along its axis, and the lead in taps, both as vectors to be multiplied by `u`.
    pub(super) fn arrays(&self) -> impl Iterator<Item = (&Vector3<f32>, &Vector3<f32>)> {
        self.step_turns.iter().zip(&self.lead_taps)
    }

    /// Where the arrays are the rows of a planar one. What it takes is no part of a receiver whose arrays stand around the body.
    pub(super) fn planar(&self) -> Option<&Planar> {
        self.planar.as_ref().filter(|_| A > MOST_ARRAYS)
    }

    /// Energy of `snapshot`, one amplitude per channel, that a path from `u` explains.
    pub(super) fn explained<const C: usize>(&self, snapshot: &[Complex<f32>; C], u: &Vector3<f32>) -> f32 {
        let (mut energy, mut whole) = (0.0, Complex::new(0.0, 0.0));
        let columns = self.planar().map(|planar| steering::<A>(planar.row_turns.dot(u)));
        for (j, (step, elements)) in self
            .step_turns
            .iter()
            .zip(snapshot.as_chunks::<E>().0)
            .enumerate()
        {
            let mut sum = Complex::new(0.0, 0.0);
            for (z, s) in elements.iter().zip(steering::<E>(step.dot(u))) {
                sum += s.conj() * z;
            }
            energy += sum.norm_sqr() / E as f32;
            if let Some(columns) = &columns {
                whole += columns[j].conj() * sum;
            }
        }
        if columns.is_some() {
            whole.norm_sqr() / (A * E) as f32
        } else {
            energy
        }
    }

    /// Turns per element of each array, as vectors to be multiplied by `u`.
    pub(super) fn steps(&self) -> &[Vector3<f32>; A] {
        &self.step_turns
    }
}

/// Place of element `i` of a row of `E`, in spacings from its centre.
pub(super) fn place<const E: usize>(i: usize) -> f32 {
    i as f32 - (E as f32 - 1.0) / 2.0
}

/// `exp(+j n_i w)` of all elements for a step of `w` turns: one sine and cosine, then products. The error grows to 4e-7.
pub(super) fn steering<const E: usize>(step_turns: f32) -> [Complex<f32>; E] {
    let half = phasor(0.5 * step_turns);
    let step = half * half;
    // From the centre outwards; the other half is conjugate.
    let mut out = [Complex::new(1.0, 0.0); E];
    let mut current = if E.is_multiple_of(2) {
        half
    } else {
        Complex::new(1.0, 0.0)
    };
    for i in E / 2..E {
        if let Some(s) = out.get_mut(i) {
            *s = current;
        }
        if let Some(s) = out.get_mut(E - 1 - i) {
            *s = current.conj();
        }
        current *= step;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::UavArrays;

    #[test]
    fn a_path_explains_itself() {
        let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &Waveform::default());
        let (u, v) = (Vector3::new(0.6, 0.0, 0.8), Vector3::new(-0.48, 0.64, 0.6));
        let mut snapshot = [Complex::new(0.0, 0.0); 32];
        for (j, (step, rows)) in model
            .steps()
            .iter()
            .zip(snapshot.as_chunks_mut::<8>().0)
            .enumerate()
        {
            for (x, s) in rows.iter_mut().zip(steering::<8>(step.dot(&u))) {
                *x = s * phasor(0.3 * j as f32) * 2.0;
            }
        }
        assert!((model.explained::<32>(&snapshot, &u) / 128.0 - 1.0).abs() < 1e-5);
        assert!(model.explained::<32>(&snapshot, &v) < 0.3 * 128.0);
    }

    #[test]
    fn steering_is_the_definition() {
        for k in -50..=50 {
            let turns = k as f32 / 100.0;
            for (i, s) in steering::<8>(turns).iter().enumerate() {
                let angle = core::f64::consts::TAU * f64::from(turns) * (i as f64 - 3.5);
                assert!((f64::from(s.re) - libm::cos(angle)).abs() < 1e-6);
                assert!((f64::from(s.im) - libm::sin(angle)).abs() < 1e-6);
            }
            for (i, s) in steering::<5>(turns).iter().enumerate() {
                let angle = core::f64::consts::TAU * f64::from(turns) * f64::from(place::<5>(i));
                assert!((f64::from(s.re) - libm::cos(angle)).abs() < 1e-6);
                assert!((f64::from(s.im) - libm::sin(angle)).abs() < 1e-6);
            }
        }
    }
}
