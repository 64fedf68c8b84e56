//! Gains of a path in a pilot: each array listens where the path comes from, and not where others of like delay do.
//!
//! Of an array's channels one is made before the transform, so a path costs as many transforms as there are arrays. In the taps around its
//! delay the path is a kernel times a gain, by least squares; what that leaves is noise, and whatever else comes from there.

use heapless::Vec;
use nalgebra::Complex;

use super::Gains;
use crate::array::{Null, ReceiveBeam};
use crate::kernels::{Channel, Iq};
use crate::paths::estimated::EstimatedPath;
use crate::paths::fit::REACH;
use crate::paths::model::{ArrayModel, steering};
use crate::paths::template::Template;
use crate::paths::window::SINGLE;
use crate::signal::{Correlator, SAMPLES, Workspace, phasor};

/// Other paths that an array does not listen to, those that would leave most.
/// Capacity: half of what eight elements can tell apart, so that the path keeps its gain.
const NULLS: usize = 3;
/// Share of a path's power that another may leave in its gain.
/// Derived: -30 dB errs a phase by 0.03 rad, as oscillators do.
const HARMLESS: f32 = 1e-3;
/// Share of its power that the path must keep beside a null: what is nearer cannot be told apart by one array.
/// Derived: -6 dB of signal to noise; a path of like strength leaves more.
const LEAST_KEPT: f32 = 0.25;
/// Energy of a kernel in the window, its peak being one, under which it is not fitted.
/// Derived: six taps beyond the window its sidelobes have as much.
const LEAST_NORM: f32 = 0.01;
/// Share of an energy under which the difference of two energies is rounding.
/// Numerical: sums of 13 numbers in single precision; a phase is then known a hundred times better than oscillators allow.
const ROUNDING: f32 = 1e-5;

/// The samples of a pilot, and what they are read with.
pub(in crate::paths) struct Reading<'a, const A: usize, const E: usize, const C: usize> {
    pub(in crate::paths) model: &'a ArrayModel<A, E>,
    pub(in crate::paths) template: &'a Template,
    pub(in crate::paths) correlator: &'a Correlator,
    pub(in crate::paths) samples: &'a [Channel; C],
}

impl<const A: usize, const E: usize, const C: usize> Reading<'_, A, E, C> {
    /// Gains of the path with this index beside the others, LSB of a tap. `work`: scratch.
    pub(in crate::paths) fn gains(
        &self,
        index: usize,
        paths: &[EstimatedPath],
        work: &mut Workspace,
    ) -> Gains<A> {
        let Some(path) = paths.get(index) else {
            return Gains::NONE;
        };
        let others = self.disturbing(index, path, paths);
        let nearest = libm::roundf(path.path.c_tau_m / self.model.metres_per_tap());
        let first = (nearest as usize).wrapping_add_signed(-REACH as isize);
        let centre_turns = self.template.centre_turns();
        let mut gains = [Complex::new(0.0, 0.0); A];
        let mut channel = [Iq::ZERO; SAMPLES];
        let (mut energy, mut left, mut fitted, mut louder) = (0.0, 0.0, 0, 0.0);
        let arrays = self.model.arrays().zip(self.samples.as_chunks::<E>().0);
        for (gain, ((step, lead), channels)) in gains.iter_mut().zip(arrays) {
            let towards = |path: &EstimatedPath| steering::<E>(step.dot(path.path.aoa.vector()));
            let nulls = others.iter().map(|(_, other)| Null {
                steering: towards(other),
                least_kept: LEAST_KEPT,
            });
            ReceiveBeam::new::<NULLS>(&towards(path), nulls).hear(channels, &mut channel);
            self.correlator.correlate_channel(&mut channel, work);
            let kernel = |path: &EstimatedPath| {
                let delay = self.taps_from(path, nearest) - lead.dot(path.path.aoa.vector());
                let mut kernel = [[0.0; 2]; SINGLE];
                self.template.row(-(REACH as f32) - delay, &mut kernel);
                kernel.map(|[value, _]| value)
            };
            let taps = core::array::from_fn(|i| {
                let tap = channel[first.wrapping_add(i) & (SAMPLES - 1)];
                let twist = phasor(-centre_turns * (i as f32 - REACH as f32));
                Complex::new(f32::from(tap.re()), f32::from(tap.im())) * twist
            });
            let fit = Fit::new(kernel(path), others.iter().map(|(_, other)| kernel(other)), taps);
            *gain = fit.gain;
            energy += fit.energy;
            left += fit.left;
            fitted += fit.kernels;
            louder += fit.louder / A as f32;
        }
        // Taps that are left free, oversampled as they are.
        let taps = (A * SINGLE) as f32 - fitted as f32 / self.template.occupancy();
        Gains {
            gains,
            noise: louder * left.max(ROUNDING * energy) / taps,
        }
    }

    /// A path's delay from a tap, the shorter way round the period.
    fn taps_from(&self, path: &EstimatedPath, tap: f32) -> f32 {
        let away = path.path.c_tau_m / self.model.metres_per_tap() - tap;
        let period = self.template.period();
        away - period * libm::roundf(away / period)
    }

    /// The other paths that would leave most in a path's gain, and how much of its power, most first.
    fn disturbing<'p>(
        &self,
        index: usize,
        path: &EstimatedPath,
        paths: &'p [EstimatedPath],
    ) -> Vec<(f32, &'p EstimatedPath), NULLS> {
        let own_taps = path.path.c_tau_m / self.model.metres_per_tap();
        let mut most: Vec<(f32, &EstimatedPath), NULLS> = Vec::new();
        for (_, other) in paths.iter().enumerate().filter(|(other, _)| *other != index) {
            let kernel = self.template.anywhere(self.taps_from(other, own_taps));
            let share = other.energy * kernel * kernel / path.energy;
            let least = most
                .last()
                .filter(|_| most.is_full())
                .map_or(HARMLESS, |(least, _)| *least);
            if share <= least {
                continue;
            }
            if most.is_full() {
                let _least = most.pop();
            }
            let _room = most.push((share, other));
            for last in (1..most.len()).rev() {
                if let Some([before, this]) = most.get_mut(last - 1..=last)
                    && this.0 > before.0
                {
                    core::mem::swap(before, this);
                }
            }
        }
        most
    }
}

/// Least squares of a path's kernel in the taps of an array, beside the kernels of others.
struct Fit {
    gain: Complex<f32>,
    /// Of the taps, and what is left of it.
    energy: f32,
    left: f32,
    /// Kernels that were fitted.
    kernels: usize,
    /// What telling them apart multiplies the gain's variance with.
    louder: f32,
}

impl Fit {
    /// Others whose kernel is nearly the path's are left to the nulls.
    fn new(
        mut own: [f32; SINGLE],
        others: impl Iterator<Item = [f32; SINGLE]>,
        mut taps: [Complex<f32>; SINGLE],
    ) -> Self {
        let energy = taps.iter().map(|tap| tap.norm_sqr()).sum();
        let whole = dot(&own, &own);
        let mut basis: Vec<[f32; SINGLE], NULLS> = Vec::new();
        for mut other in others.take(NULLS) {
            for one in &basis {
                let along = dot(one, &other);
                other = less(&other, one, along);
            }
            let norm = dot(&other, &other);
            let along = dot(&own, &other) / norm;
            let rest = less(&own, &other, along);
            if norm > LEAST_NORM && dot(&rest, &rest) > LEAST_KEPT * whole {
                own = rest;
                let scale = 1.0 / libm::sqrtf(norm);
                let _room = basis.push(other.map(|value| value * scale));
            }
        }
        for one in &basis {
            let along: Complex<f32> = one.iter().zip(&taps).map(|(one, tap)| tap * *one).sum();
            for (tap, one) in taps.iter_mut().zip(one) {
                *tap -= along * *one;
            }
        }
        let along: Complex<f32> = own.iter().zip(&taps).map(|(own, tap)| tap * *own).sum();
        let norm = dot(&own, &own);
        let rest: f32 = taps.iter().map(|tap| tap.norm_sqr()).sum();
        Self {
            gain: along / norm,
            energy,
            left: rest - along.norm_sqr() / norm,
            kernels: 1 + basis.len(),
            louder: whole / norm,
        }
    }
}

fn dot(one: &[f32; SINGLE], other: &[f32; SINGLE]) -> f32 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

fn less(one: &[f32; SINGLE], other: &[f32; SINGLE], share: f32) -> [f32; SINGLE] {
    core::array::from_fn(|i| {
        let [a, b] = [one, other].map(|values| values.get(i).copied().unwrap_or(0.0));
        a - share * b
    })
}

#[cfg(test)]
mod tests;
