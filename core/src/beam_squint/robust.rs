//! Covariance of a fit from what it leaves over.
//!
//! The inverse of the information is the covariance when noise is all there is. A path that the nulls do not catch, or the
//! elements' errors, leave a residual that is far above noise and alike over many subcarriers; the information knows
//! nothing of it. So the gradient is added up in blocks of neighbouring subcarriers: at the optimum the blocks cancel, and
//! how far each is from nothing says how much the optimum would move without it (the sandwich H^-1 G H^-1 with
//! G = sum g g^T over the blocks, White 1980; in blocks against correlation, as Newey and West 1987).

use nalgebra::{Matrix2, Vector2};

use super::fit::{Fit, Place, ReceivedSymbols, invert};
use super::reception::Spectrum;
use crate::array::SquintSymbol;

/// Blocks that the subcarriers of a symbol are cut into.
/// Derived: each spans a quarter of the band, over which a path that comes 5 m later turns once.
pub(super) const BLOCKS: usize = 4;

/// Variances that a fit has shown, never less than those of noise alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    /// Of the cosines.
    pub(super) cosines: Matrix2<f32>,
    /// Of the delay, m^2.
    pub(super) delay_m2: f32,
}

/// What a block of subcarriers pulls at the parameters.
#[derive(Clone, Copy, Debug)]
struct Pull {
    cosines: Vector2<f32>,
    delay: f32,
}

impl<const SYMBOLS: usize, const ACTIVE: usize> ReceivedSymbols<'_, SYMBOLS, ACTIVE> {
    /// Covariance of a fit: that of noise, widened by what the fit leaves over. `None` when the information is singular.
    pub(super) fn shown<const X: usize, const Z: usize>(&self, fit: &Fit<SYMBOLS>) -> Option<Shown> {
        let noise = invert(&fit.information)?;
        let (mut meat, mut delay_meat) = (Matrix2::zeros(), 0.0);
        let slots = self.schedule.iter().zip(self.spectra).zip(&fit.heeded);
        for ((symbol, spectrum), heeded) in slots {
            let Some(spectrum) = spectrum.as_ref().filter(|_| *heeded) else {
                continue;
            };
            for pull in self.pulls::<X, Z>(symbol, spectrum, &fit.place) {
                meat += pull.cosines * pull.cosines.transpose();
                delay_meat += pull.delay * pull.delay;
            }
        }
        let wide = noise * meat * noise;
        // Few blocks scatter: less than noise is chance.
        let factor = (wide.m11 / noise.m11).max(wide.m22 / noise.m22);
        Some(Shown {
            cosines: if factor > 1.0 { noise * factor } else { noise },
            delay_m2: (delay_meat / (fit.delay_information * fit.delay_information))
                .max(1.0 / fit.delay_information),
        })
    }

    /// The gradient of a symbol, block by block, its gain eliminated.
    fn pulls<const X: usize, const Z: usize>(
        &self,
        symbol: &SquintSymbol,
        spectrum: &Spectrum<ACTIVE>,
        place: &Place,
    ) -> [Pull; BLOCKS] {
        let sums = self.sums::<X, Z, 1>(symbol, spectrum, place);
        let weight = 2.0 / spectrum.noise;
        let gain = sums.ry / sums.rr;
        let (mx, mz, mw) = (sums.rx / sums.rr, sums.rz / sums.rr, sums.wrr / sums.rr);
        let mut pulls = [Pull {
            cosines: Vector2::zeros(),
            delay: 0.0,
        }; BLOCKS];
        let length = ACTIVE.div_ceil(BLOCKS).max(1);
        self.walk::<X, Z, 1>(symbol, spectrum, place, |index, [r, x, z], omega, y| {
            let along = gain.conj() * (y - gain * r) * weight;
            if let Some(pull) = pulls.get_mut(index / length) {
                pull.cosines += Vector2::new(x - mx * r, z - mz * r) * along.re;
                pull.delay -= along.im * (omega - mw) * r;
            }
        });
        pulls
    }
}
