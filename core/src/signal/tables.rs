//! Twiddle factors and the known waveform, laid out as the stages read them.
//!
//! Every table is made from the definition `W = exp(-j 2 pi / 512)`; nothing is typed in. In the transform of
//! [`super::stages`] the twiddles are constant inside a block, so one entry serves a whole block.

use libm::{cos, floor, sin};

use crate::kernels::Iq;
use crate::kernels::stages::{Tail, Twiddles};
use crate::signal::{SAMPLES, Waveform};

/// The radix plan, 8 x 4 x 4 x 4, is that of this length.
const _: () = assert!(SAMPLES == 512);

/// Residue modulo 8 of the bins in each eighth of the digit-reversed order. Even ones first: the transform of the even
/// bins alone is then the first half of every stage.
/// Given: the order of the transform.
pub(crate) const RESIDUES: [usize; 8] = [0, 2, 4, 6, 1, 3, 5, 7];

/// All factors of the 512-point transform and of one waveform. 4 KiB.
#[derive(Clone, Debug)]
pub(crate) struct Tables {
    /// Second stage, blocks of 64.
    pub(crate) second: [Twiddles; 8],
    /// Third stage, blocks of 16.
    pub(crate) third: [Twiddles; 32],
    /// Last stage, blocks of 4.
    pub(crate) last: [Tail; 128],
}

impl Tables {
    /// Tables of no waveform, to be filled where they lie.
    pub(crate) const fn blank() -> Self {
        Self {
            second: [[Iq::ZERO; 3]; 8],
            third: [[Iq::ZERO; 3]; 32],
            last: [Tail::blank(); 128],
        }
    }

    /// Computes the tables of a waveform.
    pub(crate) fn fill(&mut self, waveform: &Waveform) {
        let mut spectrum = [Iq::ZERO; SAMPLES];
        for index in 0..waveform.active.min(SAMPLES) {
            let symbol = waveform.symbol::<f64>(index);
            spectrum[waveform.bin(index) % SAMPLES] = q15(symbol.re, symbol.im);
        }
        for (block, factors) in self.second.iter_mut().enumerate() {
            *factors = twiddles(16 * residue(block, 0));
        }
        for (block, factors) in self.third.iter_mut().enumerate() {
            *factors = twiddles(4 * residue(block, 1));
        }
        for (block, tail) in self.last.iter_mut().enumerate() {
            let first = residue(block, 2);
            *tail = Tail {
                waveform: core::array::from_fn(|leg| {
                    spectrum.get(first + 128 * leg).copied().unwrap_or(Iq::ZERO)
                }),
                twiddles: twiddles(first),
            };
        }
    }
}

/// Residue of the bins in a block after the first stage and `radix4` further ones: p1 + 8 p2 + 32 p3.
fn residue(block: usize, radix4: u32) -> usize {
    let p1 = RESIDUES.get(block >> (2 * radix4)).copied().unwrap_or(0);
    match radix4 {
        0 => p1,
        1 => p1 + 8 * (block & 3),
        _ => p1 + 8 * ((block >> 2) & 3) + 32 * (block & 3),
    }
}

/// Bin that stands at a position of the digit-reversed spectrum.
#[must_use]
pub const fn bin_at(position: usize) -> usize {
    let p1 = RESIDUES[(position >> 6) & 7];
    p1 + 8 * ((position >> 4) & 3) + 32 * ((position >> 2) & 3) + 128 * (position & 3)
}

/// W^step, W^(2 step), W^(3 step).
fn twiddles(step: usize) -> Twiddles {
    core::array::from_fn(|i| root(step * (i + 1)))
}

/// `exp(-j 2 pi k / 512)` in Q15.
fn root(k: usize) -> Iq {
    let angle = -2.0 * core::f64::consts::PI * (k % SAMPLES) as f64 / SAMPLES as f64;
    q15(cos(angle), sin(angle))
}

/// Q15 of a complex number of magnitude at most one, round half up; +1 becomes 1 - 2^-15.
fn q15(re: f64, im: f64) -> Iq {
    let round = |x: f64| floor(x * 32_768.0 + 0.5).clamp(-32_768.0, 32_767.0) as i16;
    Iq::new(round(re), round(im))
}
