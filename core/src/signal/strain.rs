//! Clipped lanes of the transform: seldom, so they are counted only where a pass was strained.

use crate::kernels::stages::Pass;

/// Counts clipped lanes. A strained pass is examined, that is repeated by its portable form, which counts; but only so
/// many in a beam, lest a jammer take the processor's time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Watch {
    examined: u32,
    /// Lanes that clipped in the examined passes.
    pub(crate) clips: u32,
    /// Strained passes that were not examined.
    pub(crate) unexamined: u32,
}

impl Watch {
    /// Passes examined in a beam.
    /// Capacity: with one channel's six, every kind of pass has its chance.
    const MOST: u32 = 6;

    #[inline(always)]
    pub(crate) fn pass(&mut self, strained: bool, repeat: impl FnOnce() -> Pass) {
        if strained {
            self.examine(repeat);
        }
    }

    #[cold]
    #[inline(never)]
    fn examine(&mut self, repeat: impl FnOnce() -> Pass) {
        if self.examined < Self::MOST {
            self.examined += 1;
            self.clips += repeat().clips;
        } else {
            self.unexamined += 1;
        }
    }
}
