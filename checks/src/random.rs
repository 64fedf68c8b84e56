//! Numbers for checks, the same on every machine: Xorshift64*.

/// A stream of pseudo-random numbers.
pub(crate) struct Random(u64);

impl Random {
    /// Stream `index`.
    pub(crate) fn new(index: u64) -> Self {
        Self(0x9e37_79b9_7f4a_7c15 ^ index)
    }

    /// 64 bits.
    pub(crate) fn word(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// A number below `limit`, which is over 0 and far below 2^40.
    pub(crate) fn below(&mut self, limit: u64) -> u64 {
        ((self.word() >> 40) * limit) >> 24
    }

    /// A number from 0 to under 1, a multiple of 2^-24.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.word() >> 40) as f32 / 16_777_216.0
    }
}
