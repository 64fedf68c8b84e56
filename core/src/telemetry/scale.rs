//! Quantities as whole numbers: how far a decoded one may be off.
//!
//! | quantity | unit | greatest error |
//! |---|---|---|
//! | linear, `per_unit` steps a unit | 1 / `per_unit` | half a step |
//! | [`Sigma`]: standard deviation | 2^(1/8), from 0.0001 | 4.5 % up to 390 km, m, rad or m/s; what is less counts as 0.0001 |
//! | [`Quaternion`] | 2^-16.5 | 4e-5 rad of rotation |

use libm::{exp2f, floor, log2f};

use super::bits::{BitReader, BitWriter};

impl BitWriter<'_> {
    /// Appends a quantity in steps of 1 / `per_unit`, rounded half up, as a signed number of `bits`. What is no number or
    /// does not fit makes the string void.
    #[inline(never)] // called from every field of every message: inlined it costs 15 KB of flash
    pub(super) fn put_linear(&mut self, value: f64, per_unit: f64, bits: u32) {
        let steps = floor(value * per_unit + 0.5);
        if steps.is_finite() && steps.abs() < MOST_STEPS {
            self.put_signed(steps as i64, bits);
        } else {
            self.spoil();
        }
    }

    /// Appends a standard deviation: a step is an eighth of an octave, 0 is 0.0001 or less, 255 is 390 000 or more.
    #[inline(never)] // called from every field of every message: inlined it costs 15 KB of flash
    pub(super) fn put_sigma(&mut self, sigma: f32) {
        if sigma.is_nan() {
            self.spoil();
        } else {
            self.put(u64::from(log_code(sigma, SMALLEST, STEPS, 255)), 8);
        }
    }

    /// Appends a unit quaternion w, x, y, z: which component is the largest, and the other three, their sign such that it
    /// is positive.
    pub(super) fn put_quaternion(&mut self, q: [f32; 4]) {
        if !q.iter().all(|c| c.is_finite()) {
            self.spoil();
        }
        let mut largest = 0_usize;
        for (index, component) in q.iter().enumerate() {
            if component.abs() > q.get(largest).map_or(0.0, |c| c.abs()) {
                largest = index;
            }
        }
        let negative = q.get(largest).is_some_and(|c| *c < 0.0);
        self.put(largest as u64, 2);
        for (_, component) in q.iter().enumerate().filter(|(index, _)| *index != largest) {
            let component = if negative { -component } else { *component };
            // A quaternion that is not quite of length one must not lose its place.
            self.put_linear(f64::from(component.clamp(-HALF_SQRT, HALF_SQRT)), QUATERNION, 17);
        }
    }
}

impl BitReader<'_> {
    /// What [`BitWriter::put_linear`] wrote; `None` when it could not have.
    #[inline(never)] // called from every field of every message: inlined it costs 15 KB of flash
    pub(super) fn take_linear(&mut self, per_unit: f64, bits: u32) -> Option<f64> {
        let steps = self.take_signed(bits)? as f64;
        (steps.abs() < MOST_STEPS).then_some(steps / per_unit)
    }

    /// What [`BitWriter::put_sigma`] wrote.
    #[inline(never)] // called from every field of every message: inlined it costs 15 KB of flash
    pub(super) fn take_sigma(&mut self) -> Option<f32> {
        Some(from_log_code(self.take_u8(8)?, SMALLEST, STEPS))
    }

    /// What [`BitWriter::put_quaternion`] wrote; `None` when it is none.
    pub(super) fn take_quaternion(&mut self) -> Option<[f32; 4]> {
        let largest = self.take(2)? as usize;
        let mut q = [0.0; 4];
        let mut rest = 1.0;
        for (_, component) in q.iter_mut().enumerate().filter(|(index, _)| *index != largest) {
            *component = self.take_linear(QUATERNION, 17)? as f32;
            rest -= *component * *component;
        }
        // The three others of a unit quaternion leave a quarter at least, less what rounding takes.
        if rest < 0.2499 {
            return None;
        }
        *q.get_mut(largest)? = libm::sqrtf(rest);
        Some(q)
    }
}

/// An f64 tells whole numbers apart up to 2^53, a little more than this.
const MOST_STEPS: f64 = 9e15;
/// Steps a second and bits of a clock offset.
pub(super) const CLOCK_OFFSET: (f64, u32) = (1e11, 54);

/// Steps of a component that is at most 0.7072: 17 bits with sign.
const QUATERNION: f64 = 92_680.0;
/// Half of the square root of two.
const HALF_SQRT: f32 = core::f32::consts::FRAC_1_SQRT_2;
/// The standard deviation that code 0 stands for.
const SMALLEST: f32 = 1e-4;
/// Steps an octave.
const STEPS: f32 = 8.0;

/// A positive number on a scale of `steps` an octave from `smallest` = 0 to `last`; what lies beyond is at its ends.
pub(super) fn log_code(value: f32, smallest: f32, steps: f32, last: u8) -> u8 {
    if value <= smallest {
        return 0;
    }
    let code = libm::floorf(log2f(value / smallest) * steps + 0.5);
    // Casts of floats saturate.
    (code as u8).min(last)
}

/// The middle of what has a code.
pub(super) fn from_log_code(code: u8, smallest: f32, steps: f32) -> f32 {
    smallest * exp2f(f32::from(code) / steps)
}
