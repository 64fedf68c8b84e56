//! The kernel that the networks run on: portable, or assembly for ARM cores with the DSP instructions. Both give the same
//! bits; on a chip both are there, so that the equality can be tested there.

/// Dense layers. Sealed: [`Portable`] and, where the target has the DSP instructions, `Armv7em` implement it.
pub trait Kernels: layer::Dense {}

/// Plain Rust: the definition of the results.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

/// Assembly for ARMv7E-M with single-precision registers (Cortex-M4F, M7, M33, M55).
#[cfg(dsp_kernels)]
#[derive(Clone, Copy, Debug)]
pub struct Armv7em;

/// The fastest kernel of the target.
#[cfg(not(dsp_kernels))]
pub type Native = Portable;
/// The fastest kernel of the target.
#[cfg(dsp_kernels)]
pub type Native = Armv7em;

/// Keeps the trait's function to this crate.
pub(super) mod layer {
    use super::super::dense::{self, Quad};
    use super::Portable;

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
            crate::simd::dense(records, input, output)
        }
    }
}

impl Kernels for Portable {}
#[cfg(dsp_kernels)]
impl Kernels for Armv7em {}
