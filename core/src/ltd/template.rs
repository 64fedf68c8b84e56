//! What one path looks like over the taps: the Dirichlet kernel of the active subcarriers, as a table.
//!
//! The waveform's active subcarriers all have unit magnitude, so after the correlation a path at delay `d` (taps) is
//! `D(n - d) = 1/Na sum_k exp(j 2 pi k (n - d) / N)`, whatever the sequence. Taking the band's centre `k_c` out leaves a
//! real, even function: `D(x) = exp(j 2 pi k_c x / N) sin(pi Na x / N) / (Na sin(pi x / N))`. Taps are turned by the
//! first factor when they are loaded ([`super::window`]), and everything after works with the real kernel.
//!
//! Near the peak, value and slope come from a table by cubic Hermite interpolation; far away (cancellation), from the
//! closed form. Source: signal.md section 3.1.

use libm::{cos, sin};

use super::phase::phasor;
use crate::waveform::{SAMPLES, Waveform};

/// Table entries per tap.
const STEPS: usize = 16;
/// Largest |x| of the table, taps.
pub(super) const SPAN: usize = 16;
const ENTRIES: usize = STEPS * SPAN + 2;

/// The kernel of one waveform: value, first and second derivative at each sixteenth of a tap. 3 KiB.
#[derive(Clone, Debug)]
pub(super) struct Template {
    table: [[f32; 3]; ENTRIES],
    /// Active subcarriers / N: taps are oversampled by its inverse, 1.23.
    occupancy: f32,
    /// Active subcarriers.
    active: f32,
    /// Band centre, turns per tap: -1/1024.
    centre_turns: f32,
    /// Taps after which the kernel repeats, N.
    period: f32,
}

impl Template {
    /// The kernel of a waveform with a full block of active subcarriers.
    pub(super) fn new(waveform: &Waveform) -> Self {
        let active = waveform.active.clamp(2, SAMPLES);
        Self::of_band(f64::from(waveform.offset(0)), active, SAMPLES)
    }

    /// The kernel of a waveform's even subcarriers, over half the taps.
    pub(super) fn folded(waveform: &Waveform) -> Self {
        let first = waveform.offset(0);
        // Even offsets, halved.
        let lowest = (first + (first & 1)) / 2;
        let active = (waveform.active - (first & 1) as usize).div_ceil(2);
        Self::of_band(f64::from(lowest), active.clamp(2, SAMPLES / 2), SAMPLES / 2)
    }

    /// The kernel of `active` subcarriers from `lowest` on, out of `samples`.
    fn of_band(lowest: f64, active: usize, samples: usize) -> Self {
        let (active, samples) = (active as f64, samples as f64);
        let (a, b) = (
            core::f64::consts::PI * active / samples,
            core::f64::consts::PI / samples,
        );
        // Mean square of the centred angular subcarrier frequency, rad^2 per tap^2. Centred frequencies step by 2 b from -(active-1) b on: variance of a uniform grid.
        let bandwidth2 = (active * active - 1.0) / 3.0 * b * b;
        let table = core::array::from_fn(|i| {
            let x = i as f64 / STEPS as f64;
            if i == 0 {
                return [1.0, 0.0, -bandwidth2 as f32];
            }
            // With D = S / (Na s): D' = (S' - Na s' D) / (Na s), D'' = (S'' - 2 Na s' D' + Na b^2 s D) / (Na s).
            let (s, ds) = (sin(b * x), b * cos(b * x));
            let (big, dbig) = (sin(a * x), a * cos(a * x));
            let d = big / (active * s);
            let dd = (dbig - active * ds * d) / (active * s);
            let ddd = (-a * a * big - 2.0 * active * ds * dd + active * b * b * s * d) / (active * s);
            [d as f32, dd as f32, ddd as f32]
        });
        Self {
            table,
            occupancy: (active / samples) as f32,
            active: active as f32,
            centre_turns: ((lowest + (active - 1.0) / 2.0) / samples) as f32,
            period: samples as f32,
        }
    }

    /// Kernel and slope at `x` taps from the peak. Beyond the table, the value at its end.
    pub(super) fn at(&self, x: f32) -> [f32; 2] {
        let place = (x.abs() * STEPS as f32).min((STEPS * SPAN) as f32);
        let cell = place as usize;
        let t = place - cell as f32;
        let (Some(&[d0, s0, c0]), Some(&[d1, s1, c1])) = (self.table.get(cell), self.table.get(cell + 1))
        else {
            return [0.0; 2];
        };
        const H: f32 = 1.0 / STEPS as f32;
        let (t2, u) = (t * t, 1.0 - t);
        // Hermite basis: h00 = (1 + 2t) u^2, h10 = t u^2, h01 = t^2 (3 - 2t), h11 = -t^2 u.
        let (h00, h01) = ((1.0 + 2.0 * t) * u * u, t2 * (3.0 - 2.0 * t));
        let (h10, h11) = (H * t * u * u, -H * t2 * u);
        let value = h00 * d0 + h10 * s0 + h01 * d1 + h11 * s1;
        let slope = h00 * s0 + h10 * c0 + h01 * s1 + h11 * c1;
        [value, if x < 0.0 { -slope } else { slope }]
    }

    /// Kernel at any `x`, within one period of the peak: beyond the table by the closed form.
    pub(super) fn anywhere(&self, x: f32) -> f32 {
        if x.abs() < SPAN as f32 {
            return self.at(x)[0];
        }
        let [band, period] = [0.5 * self.occupancy, 0.5 / self.period].map(|step| phasor(step * x).im);
        band / (self.active * period)
    }

    /// Taps after which the kernel repeats.
    pub(super) fn period(&self) -> f32 {
        self.period
    }

    /// Active subcarriers / N.
    pub(super) fn occupancy(&self) -> f32 {
        self.occupancy
    }

    /// Active subcarriers.
    pub(super) fn active(&self) -> f32 {
        self.active
    }

    /// Band centre, turns per tap.
    pub(super) fn centre_turns(&self) -> f32 {
        self.centre_turns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kernel and slope by their definition.
    fn exact(waveform: &Waveform, x: f64) -> [f64; 2] {
        let centre = -0.5;
        let (mut value, mut slope) = (0.0, 0.0);
        for i in 0..waveform.active {
            let w = core::f64::consts::TAU * (f64::from(waveform.offset(i)) - centre) / SAMPLES as f64;
            value += cos(w * x) / waveform.active as f64;
            slope -= w * sin(w * x) / waveform.active as f64;
        }
        [value, slope]
    }

    #[test]
    fn table_follows_the_waveform() {
        let waveform = Waveform::default();
        let template = Template::new(&waveform);
        let mut worst = [0.0_f64; 2];
        for i in -2310..2310 {
            let x = f64::from(i) / 150.0;
            let (got, expected) = (template.at(x as f32), exact(&waveform, f64::from(x as f32)));
            for (worst, (g, e)) in worst.iter_mut().zip(got.iter().zip(expected)) {
                *worst = worst.max((f64::from(*g) - e).abs());
            }
        }
        assert!(worst[0] < 5e-7 && worst[1] < 2e-6, "{worst:?}");
        assert_eq!(template.centre_turns(), -0.5 / 512.0);
        // Mean square of the centred subcarrier frequency: 57.64 MHz rms.
        let rms_hz = libm::sqrtf(-template.table[0][2]) / core::f32::consts::TAU * 245.76e6;
        assert!((rms_hz - 57.64e6).abs() < 1e4, "{rms_hz}");
    }

    #[test]
    fn hostile_arguments_stay_inside() {
        let template = Template::new(&Waveform::default());
        for x in [1e9, -1e9, f32::NAN, f32::INFINITY] {
            assert!(template.at(x).iter().all(|v| v.is_finite() || x.is_nan()));
        }
    }
}
