//! Taps around a candidate, as floats.

use nalgebra::Complex;

use super::model::{ArrayModel, steering};
use super::place::Place;
use super::template::Template;
use crate::kernels::stages::Channel;
use crate::signal::{SAMPLES, phasor};

/// Taps of a window around one path.
/// Derived: [`super::fit::REACH`] on both sides.
pub(super) const SINGLE: usize = 13;
/// Taps of a window around a group at most.
/// Derived: four metres (3.3 taps) wide.
pub(super) const JOINT: usize = 18;

/// Taps of a snapshot.
/// Capacity: memory of a snapshot.
const SNAPSHOT: usize = 5;
/// Half of it.
const HALF_SNAPSHOT: f32 = SNAPSHOT as f32 / 2.0;

/// Consecutive taps of all channels, turned so that the band is centred: a path is then a real kernel times a constant.
#[derive(Clone, Debug)]
pub(super) struct Window<const C: usize, const W: usize> {
    /// [channel][tap]; zeros beyond `len`.
    taps: [[Complex<f32>; W]; C],
    /// Coordinate of the first tap.
    first: i32,
    len: usize,
}

/// What a window holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Content {
    /// Of all samples, squared LSB.
    pub(super) energy: f32,
    /// Of all channels.
    pub(super) samples: usize,
}

impl<const C: usize, const W: usize> Window<C, W> {
    /// No taps.
    pub(super) fn new() -> Self {
        Self {
            taps: [[Complex::new(0.0, 0.0); W]; C],
            first: 0,
            len: 0,
        }
    }

    /// Takes taps `origin + first ..= origin + last` (cyclic), cut to `W`, into an empty window.
    pub(super) fn load(
        &mut self,
        taps: &[Channel; C],
        origin: usize,
        first: i32,
        last: i32,
        centre_turns: f32,
    ) {
        let len = usize::try_from(last - first + 1).unwrap_or(0).min(W);
        // The same twist for all channels; it stays under an eighth of a turn, so it is made anew for every tap.
        let twist: [Complex<f32>; W] =
            core::array::from_fn(|i| phasor(-centre_turns * (first + i as i32) as f32));
        let start = origin.wrapping_add_signed(first as isize);
        (self.first, self.len) = (first, len);
        for (row, channel) in self.taps.iter_mut().zip(taps) {
            for (i, (tap, twist)) in row.iter_mut().zip(&twist).take(len).enumerate() {
                let sample = channel[start.wrapping_add(i) & (SAMPLES - 1)];
                *tap = Complex::new(f32::from(sample.re()), f32::from(sample.im())) * twist;
            }
        }
    }

    /// Adds a path: a source of gains `gains` at the arrays, seen from the window's origin.
    pub(super) fn add<const A: usize, const E: usize>(
        &mut self,
        model: &ArrayModel<A, E>,
        template: &Template,
        place: &Place,
        gains: &[Complex<f32>; A],
    ) {
        let (first, len) = (self.first(), self.len);
        let arrays = model.arrays().zip(gains);
        for (rows, ((step, lead), gain)) in self.taps.as_chunks_mut::<E>().0.iter_mut().zip(arrays) {
            let delay = place.delay_taps - lead.dot(&place.u);
            let mut kernel = [[0.0; 2]; W];
            template.row(first - delay, kernel.get_mut(..len).unwrap_or_default());
            for (row, s) in rows.iter_mut().zip(steering::<E>(step.dot(&place.u))) {
                let gain = s * gain;
                // Beyond `len` taps and kernel are zero.
                for (tap, [value, _]) in row.iter_mut().zip(&kernel) {
                    *tap += gain * *value;
                }
            }
        }
    }

    /// The channels' rows.
    pub(super) fn rows(&self) -> &[[Complex<f32>; W]; C] {
        &self.taps
    }

    /// Coordinate of the first tap.
    pub(super) fn first(&self) -> f32 {
        self.first as f32
    }

    /// Taps that were loaded.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// What the window holds, counted anew with every call.
    pub(super) fn content(&self) -> Content {
        Content {
            energy: self.taps.iter().flatten().map(|y| y.norm_sqr()).sum(),
            samples: C * self.len,
        }
    }

    /// Amplitude of each channel at a delay: least squares over the taps nearest to it, the kernel's two taps on either
    /// side.
    pub(super) fn snapshot(&self, template: &Template, delay_taps: f32) -> [Complex<f32>; C] {
        let mut weights = [0.0; SNAPSHOT];
        let first = delay_taps - self.first as f32 - HALF_SNAPSHOT;
        let start = (first.max(0.0) as usize + usize::from(first >= 0.0)).min(W.saturating_sub(SNAPSHOT));
        let mut power = 0.0;
        for (weight, x) in weights.iter_mut().zip(self.coordinates().skip(start)) {
            let away = x - delay_taps;
            if away.abs() < HALF_SNAPSHOT {
                *weight = template.at(away)[0];
                power += *weight * *weight;
            }
        }
        let inverse = 1.0 / power.max(f32::MIN_POSITIVE);
        let mut out = [Complex::new(0.0, 0.0); C];
        for (sum, row) in out.iter_mut().zip(&self.taps) {
            for (y, weight) in row.iter().skip(start).zip(&weights) {
                *sum += y * *weight;
            }
            *sum *= inverse;
        }
        out
    }

    /// Coordinates of the loaded taps.
    pub(super) fn coordinates(&self) -> impl Iterator<Item = f32> + Clone {
        (self.first..).take(self.len).map(|x| x as f32)
    }
}
