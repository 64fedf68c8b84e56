//! What one path looks like over the taps: the Dirichlet kernel of the active subcarriers, as a table.
//!
//! The waveform's active subcarriers all have unit magnitude, so after the correlation a path at delay `d` (taps) is
//! `D(n - d) = 1/Na sum_k exp(j 2 pi k (n - d) / N)`, whatever the sequence. Taking the band's centre `k_c` out leaves a
//! real, even function: `D(x) = exp(j 2 pi k_c x / N) sin(pi Na x / N) / (Na sin(pi x / N))`. Taps are turned by the
//! first factor when they are loaded ([`super::window`]), and everything after works with the real kernel.
//!
//! Near the peak, value and slope come from a table by cubic Hermite interpolation; far away (cancellation), from the
//! closed form. Source: docs/signal-model.md, "Path estimation".

use libm::{cos, sin};

use crate::signal::{SAMPLES, Waveform, phasor};

/// Table entries per tap.
/// Numerical: entries of a table that is interpolated between them.
const STEPS: usize = 16;
/// Largest |x| that the table is asked for, taps.
/// Capacity: memory of the table.
pub(super) const SPAN: usize = 16;

/// The kernel of one waveform: value, first and second derivative at each sixteenth of a tap. 3.5 KiB.
#[derive(Clone, Debug)]
pub(super) struct Template {
    /// [sixteenth][tap]: the taps of a window, all at the same fraction, lie one after another. The last row is the first one, a
    /// tap on.
    table: [[[f32; 3]; SPAN + 1]; STEPS + 1],
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
        let mut template = Self::blank();
        template.fill(waveform);
        template
    }

    #[cfg(test)]
    pub(super) fn folded(waveform: &Waveform) -> Self {
        let mut template = Self::blank();
        template.fill_folded(waveform);
        template
    }

    /// A kernel of no waveform, to be filled where it lies.
    pub(super) const fn blank() -> Self {
        Self {
            table: [[[0.0; 3]; SPAN + 1]; STEPS + 1],
            occupancy: 0.0,
            active: 0.0,
            centre_turns: 0.0,
            period: 0.0,
        }
    }

    /// Computes the kernel of a waveform with a full block of active subcarriers.
    pub(super) fn fill(&mut self, waveform: &Waveform) {
        let active = waveform.active.clamp(2, SAMPLES);
        self.fill_band(f64::from(waveform.offset(0)), active, SAMPLES);
    }

    /// Computes the kernel of a waveform's even subcarriers, over half the taps.
    pub(super) fn fill_folded(&mut self, waveform: &Waveform) {
        let first = waveform.offset(0);
        // Even offsets, halved.
        let lowest = (first + (first & 1)) / 2;
        let active = (waveform.active - (first & 1) as usize).div_ceil(2);
        self.fill_band(f64::from(lowest), active.clamp(2, SAMPLES / 2), SAMPLES / 2);
    }

    /// Computes the kernel of `active` subcarriers from `lowest` on, out of `samples`.
    fn fill_band(&mut self, lowest: f64, active: usize, samples: usize) {
        let (active, samples) = (active as f64, samples as f64);
        let (a, b) = (
            core::f64::consts::PI * active / samples,
            core::f64::consts::PI / samples,
        );
        // Mean square of the centred angular subcarrier frequency, rad^2 per tap^2. Centred frequencies step by 2 b from -(active-1) b on: variance of a uniform grid.
        let bandwidth2 = (active * active - 1.0) / 3.0 * b * b;
        let entry = |x: f64| {
            if x == 0.0 {
                return [1.0, 0.0, -bandwidth2 as f32];
            }
            // With D = S / (Na s): D' = (S' - Na s' D) / (Na s), D'' = (S'' - 2 Na s' D' + Na b^2 s D) / (Na s).
            let (s, ds) = (sin(b * x), b * cos(b * x));
            let (big, dbig) = (sin(a * x), a * cos(a * x));
            let d = big / (active * s);
            let dd = (dbig - active * ds * d) / (active * s);
            let ddd = (-a * a * big - 2.0 * active * ds * dd + active * b * b * s * d) / (active * s);
            [d as f32, dd as f32, ddd as f32]
        };
        for (step, row) in self.table.iter_mut().enumerate() {
            for (tap, value) in row.iter_mut().enumerate() {
                *value = entry(tap as f64 + step as f64 / STEPS as f64);
            }
        }
        self.occupancy = (active / samples) as f32;
        self.active = active as f32;
        self.centre_turns = ((lowest + (active - 1.0) / 2.0) / samples) as f32;
        self.period = samples as f32;
    }

    /// Kernel and slope at `x` taps from the peak. Beyond the table, the value at its end.
    pub(super) fn at(&self, x: f32) -> [f32; 2] {
        let mut out = [0.0; 2];
        self.side(x.abs(), core::iter::once(&mut out));
        let [value, slope] = out;
        [value, if x < 0.0 { -slope } else { slope }]
    }

    /// Kernel and slope at `x`, `x + 1`, ..., as many as there is room for; what lies beyond the table stays as it was.
    pub(super) fn row(&self, x: f32, out: &mut [[f32; 2]]) {
        // The cast cuts towards zero and gives 0 below it: as many taps as lie before the peak.
        let ahead = ((1.0 - x) as usize).min(out.len());
        let (before, behind) = out.split_at_mut_checked(ahead).unwrap_or_default();
        self.side(x + ahead as f32, behind.iter_mut());
        self.side(1.0 - ahead as f32 - x, before.iter_mut().rev());
        for [_, slope] in before {
            *slope = -*slope;
        }
    }

    /// Kernel and slope at `x >= 0`, `x + 1`, ... of the table. They lie at one fraction of a tap, so what blends entries is made once.
    #[inline(always)]
    fn side<'a>(&self, x: f32, out: impl Iterator<Item = &'a mut [f32; 2]>) {
        let place = x.clamp(0.0, SPAN as f32) * STEPS as f32;
        let entry = place as usize;
        let between = Between::new(place - entry as f32);
        let row = |step| {
            self.table
                .get(step)
                .and_then(|row: &[_; SPAN + 1]| row.get(entry / STEPS..))
        };
        if let (Some(before), Some(after)) = (row(entry % STEPS), row(entry % STEPS + 1)) {
            for ((out, before), after) in out.zip(before).zip(after) {
                *out = between.blend(before, after);
            }
        }
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

/// A place between two entries of the table: the cubic Hermite polynomials there.
struct Between {
    values: [f32; 2],
    slopes: [f32; 2],
}

impl Between {
    /// The place at a share of the step, 0..1.
    #[inline(always)]
    fn new(t: f32) -> Self {
        const H: f32 = 1.0 / STEPS as f32;
        let (t2, u) = (t * t, 1.0 - t);
        Self {
            values: [(1.0 + 2.0 * t) * u * u, t2 * (3.0 - 2.0 * t)],
            slopes: [H * t * u * u, -H * t2 * u],
        }
    }

    /// Value and slope between two entries of value, slope and bend.
    #[inline(always)]
    fn blend(&self, before: &[f32; 3], after: &[f32; 3]) -> [f32; 2] {
        let ([d0, s0, c0], [d1, s1, c1]) = (before, after);
        let ([v0, v1], [w0, w1]) = (self.values, self.slopes);
        [
            v0 * d0 + w0 * s0 + v1 * d1 + w1 * s1,
            v0 * s0 + w0 * c0 + v1 * s1 + w1 * c1,
        ]
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
        let rms_hz = libm::sqrtf(-template.table[0][0][2]) / core::f32::consts::TAU * 245.76e6;
        assert!((rms_hz - 57.64e6).abs() < 1e4, "{rms_hz}");
    }

    #[test]
    fn a_row_is_its_taps() {
        let template = Template::new(&Waveform::default());
        for step in -2000..300 {
            let x = step as f32 / 100.0;
            let mut row = [[0.0; 2]; 18];
            template.row(x, &mut row[..15]);
            for (i, got) in row.iter().enumerate() {
                let here = x + i as f32;
                let filled = i < 15 && here.abs() < SPAN as f32;
                let expected = if filled { template.at(here) } else { [0.0; 2] };
                let near = got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-6);
                // A row may use the last tap of the table as well.
                let last = (SPAN as f32..SPAN as f32 + 1.1).contains(&here.abs());
                assert!(near || last, "{x} {i}: {got:?} {expected:?}");
            }
        }
    }

    #[test]
    fn hostile_arguments_stay_inside() {
        let template = Template::new(&Waveform::default());
        for x in [1e9, -1e9, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut row = [[0.0; 2]; 18];
            template.row(x, &mut row);
            let at = template.at(x);
            assert!(
                row.iter()
                    .chain([&at])
                    .flatten()
                    .all(|v| v.is_finite() || x.is_nan()),
                "{x}: {at:?} {row:?}"
            );
        }
    }
}
