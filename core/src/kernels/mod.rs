//! The integer kernels that the receiver's time goes into: the stages of the 512-point transform, cancellation, and the dense layers
//! of the networks; and the square root. Each is there portably, which defines its result, and in assembly for ARM cores with the
//! DSP instructions. Both give the same bits; on a chip both are there, so that the equality can be tested there.
//!
//! The ground floor: nothing here knows what its numbers stand for.
//!
//! # Example
//! A sample is one word, as it lies in a stream of interleaved 16-bit numbers:
//! ```
//! use cslam_core::kernels::Iq;
//!
//! let sample = Iq::new(3, -4);
//! assert_eq!(sample.word(), 0xFFFC_0003);
//! assert_eq!((sample.re(), sample.im(), sample.power()), (3, -4, 25));
//! ```

pub(crate) mod dense;
mod iq;
#[cfg(dsp_kernels)]
mod simd;
mod sqrt;
pub(crate) mod stages;

pub use iq::Iq;
pub(crate) use sqrt::sqrt;
pub use stages::{Channel, FoldedChannel, SAMPLES};

use dense::Quad;
use stages::{FoldedPowers, Powers, Tail, Twiddles};

/// The stages of the transform, each documented in `stages.rs`, and the dense layer (`dense.rs`). Sealed: [`Portable`] and, where the
/// target has the DSP instructions, `Armv7em` implement it.
pub trait Kernels: stage::Stages + layer::Dense {}

/// Kernels in plain Rust: the definition of the results.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

/// Kernels in assembly for ARMv7E-M with single-precision registers (Cortex-M4F, M7, M33, M55).
#[cfg(dsp_kernels)]
#[derive(Clone, Copy, Debug)]
pub struct Armv7em;

/// The fastest kernels of the target.
#[cfg(not(dsp_kernels))]
pub type Native = Portable;
/// The fastest kernels of the target.
#[cfg(dsp_kernels)]
pub type Native = Armv7em;

/// Keeps the trait's methods to this crate.
pub(crate) mod stage {
    #[cfg(dsp_kernels)]
    use super::Armv7em;
    #[cfg(dsp_kernels)]
    use super::simd;
    use super::{Channel, FoldedChannel, FoldedPowers, Iq, Portable, Powers, Tail, Twiddles, stages};

    /// From one list of signatures: the trait, and its implementations by the functions of the same names; `=>` names
    /// the part of the portable form's result that is the trait's.
    macro_rules! stages {
        ($($name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)? $(=> $part:ident())?;)*) => {
            /// See the functions of the same names in `stages`. Passes say whether they were strained.
            pub trait Stages {
                $(#[doc = "See `stages`."] fn $name($($argument: $type),*) $(-> $result)?;)*
            }

            impl Stages for Portable {
                $(fn $name($($argument: $type),*) $(-> $result)? { stages::$name($($argument),*)$(.$part())? })*
            }

            #[cfg(dsp_kernels)]
            impl Stages for Armv7em {
                $(fn $name($($argument: $type),*) $(-> $result)? { simd::$name($($argument),*) })*
            }
        };
    }

    stages! {
        first(input: &Channel, out: &mut Channel) -> bool => strained();
        first_folded(input: &Channel, out: &mut Channel);
        second(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> bool => strained();
        third(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> bool => strained();
        last(input: &Channel, out: &mut Channel, tails: &[Tail]) -> bool => strained();
        correlate(input: &Channel, out: &mut Channel, tails: &[Tail]) -> bool => strained();
        inverse_third(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> bool => strained();
        inverse_second(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> bool => strained();
        taps(kept: &Channel, out: &mut Channel, powers: &mut Powers);
        taps_folded(kept: &Channel, out: &mut FoldedChannel, powers: &mut FoldedPowers);
        energy(input: &Channel) -> u64;
        cancel(taps: &mut [Iq], powers: &mut [u64], columns: &[[i32; 2]], phases: &[Iq], add: bool);
    }
}

/// Keeps the trait's function to this crate.
pub(crate) mod layer {
    use super::{Portable, Quad, dense};

    /// See `dense::dense`.
    pub trait Dense {
        /// See `dense::dense`.
        fn dense(records: &[u8], input: &[Quad], output: &mut [Quad]) -> [i32; 4];
    }

    impl Dense for Portable {
        fn dense(records: &[u8], input: &[Quad], output: &mut [Quad]) -> [i32; 4] {
            dense::dense(records, input, output)
        }
    }

    #[cfg(dsp_kernels)]
    impl Dense for super::Armv7em {
        fn dense(records: &[u8], input: &[Quad], output: &mut [Quad]) -> [i32; 4] {
            super::simd::dense(records, input, output)
        }
    }
}

impl Kernels for Portable {}
#[cfg(dsp_kernels)]
impl Kernels for Armv7em {}
