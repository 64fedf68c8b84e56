//! The kernels as the rest of the crate calls them: assembly where the feature `armv7em` is on and the target is an
//! ARM core, the portable form elsewhere. Both give the same bits and the same counts.

#[cfg(not(all(target_arch = "arm", feature = "armv7em")))]
pub(super) use super::stages::{
    correlate, energy, first, first_folded, inverse_second, inverse_third, last, natural, power,
    power_folded, second, third,
};

#[cfg(all(target_arch = "arm", feature = "armv7em"))]
pub(super) use super::simd::{
    correlate, energy, first, first_folded, inverse_second, inverse_third, last, natural, power,
    power_folded, second, third,
};
