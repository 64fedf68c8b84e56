//! Taps around a candidate, as floats.

use nalgebra::Complex;

use super::phase::phasor;
use super::stages::Channel;
use super::tables::SAMPLES;

/// Taps of a window around one path: [`super::fit::REACH`] on both sides.
pub(super) const SINGLE: usize = 13;
/// Taps of a window around a pair at most three metres (2.5 taps) apart.
pub(super) const PAIR: usize = 17;

/// Consecutive taps of all channels, turned so that the band is centred: a path is then a real kernel times a constant.
#[derive(Clone, Debug)]
pub(super) struct Window<const C: usize, const W: usize> {
    /// [channel][tap]; zeros beyond `len`.
    taps: [[Complex<f32>; W]; C],
    /// Tap that has coordinate 0.
    origin: usize,
    /// Coordinate of the first tap.
    first: i32,
    len: usize,
}

impl<const C: usize, const W: usize> Window<C, W> {
    /// Taps `origin + first ..= origin + last` (cyclic), cut to `W`.
    pub(super) fn load(taps: &[Channel; C], origin: usize, first: i32, last: i32, centre_turns: f32) -> Self {
        let len = usize::try_from(last - first + 1).unwrap_or(0).min(W);
        // The same twist for all channels; it stays under an eighth of a turn, so it is made anew for every tap.
        let twist: [Complex<f32>; W] =
            core::array::from_fn(|i| phasor(-centre_turns * (first + i as i32) as f32));
        let start = origin.wrapping_add_signed(first as isize);
        let mut window = Self {
            taps: [[Complex::new(0.0, 0.0); W]; C],
            origin,
            first,
            len,
        };
        for (row, channel) in window.taps.iter_mut().zip(taps) {
            for (i, (tap, twist)) in row.iter_mut().zip(&twist).take(len).enumerate() {
                let sample = channel[start.wrapping_add(i) & (SAMPLES - 1)];
                *tap = Complex::new(f32::from(sample.re()), f32::from(sample.im())) * twist;
            }
        }
        window
    }

    /// The channels' rows.
    pub(super) fn rows(&self) -> &[[Complex<f32>; W]; C] {
        &self.taps
    }

    /// Tap of coordinate 0.
    pub(super) fn origin(&self) -> usize {
        self.origin
    }

    /// Coordinates of the loaded taps.
    pub(super) fn coordinates(&self) -> impl Iterator<Item = f32> + Clone {
        (self.first..).take(self.len).map(|x| x as f32)
    }
}
