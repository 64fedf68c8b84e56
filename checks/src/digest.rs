//! A digest of words: equal on two machines where all words are.

/// FNV-1a over whole words.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Digest(u64);

impl Digest {
    /// Of nothing yet.
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Takes a word in.
    pub(crate) fn add(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
    }

    /// Takes in every bit of a number.
    pub(crate) fn add_bits(&mut self, number: f32) {
        self.add(u64::from(number.to_bits()));
    }

    /// Of all so far.
    pub(crate) fn value(self) -> u64 {
        self.0
    }
}
