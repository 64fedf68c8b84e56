//! Square root in `f32`, correctly rounded everywhere: the instruction where the target has one, `libm` elsewhere,
//! the same bits. (A `no_std` crate has no square root of its own, and `libm` works it out in integers on a chip.)

/// Square root; NaN for what is under 0.
#[cfg(not(dsp_kernels))]
pub(crate) fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// Square root; NaN for what is under 0.
#[cfg(dsp_kernels)]
pub(crate) use crate::kernels::simd::sqrt;
