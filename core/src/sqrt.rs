//! Square root in `f32`, correctly rounded everywhere: the instruction where this crate knows of one, `libm` elsewhere,
//! the same bits. (A `no_std` crate has no square root of its own, and `libm` works it out in integers on this chip.)

/// Square root; NaN for what is under 0.
#[cfg(not(all(target_arch = "arm", feature = "armv7em")))]
pub(crate) fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// Square root; NaN for what is under 0.
#[cfg(all(target_arch = "arm", feature = "armv7em"))]
pub(crate) use crate::simd::sqrt;
