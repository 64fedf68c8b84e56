//! The bytes of a ROS 2 message: CDR, little-endian (OMG DDS-XTypes, "plain CDR, version 1").
//!
//! Four bytes say so; after them every number is aligned to its own size, counted from there.

/// A message that is being written.
#[derive(Debug)]
pub(super) struct Cdr {
    bytes: Vec<u8>,
}

/// Bytes that tell the encoding.
const HEAD: [u8; 4] = [0, 1, 0, 0];

impl Cdr {
    pub(super) fn new() -> Self {
        Self { bytes: HEAD.to_vec() }
    }

    fn align(&mut self, to: usize) {
        let length = self.bytes.len() - HEAD.len();
        self.bytes.resize(HEAD.len() + length.next_multiple_of(to), 0);
    }

    pub(super) fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    pub(super) fn f64(&mut self, value: f64) {
        self.align(8);
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    /// An array of fixed length: nothing tells how long it is.
    pub(super) fn f64s(&mut self, values: impl IntoIterator<Item = f64>) {
        for value in values {
            self.f64(value);
        }
    }

    /// Length with the closing zero, the bytes, the zero.
    pub(super) fn string(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
    }

    /// The length that a sequence begins with.
    pub(super) fn length(&mut self, length: usize) {
        // Nothing here has four thousand million elements.
        self.u32(u32::try_from(length).unwrap_or(u32::MAX));
    }

    /// A sequence of bytes.
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.length(bytes.len());
        self.bytes.extend_from_slice(bytes);
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lie_at_multiples_of_their_size_after_the_head() {
        let mut cdr = Cdr::new();
        cdr.u8(7);
        cdr.u32(0x0403_0201);
        cdr.string("ab");
        cdr.f64(1.0);
        let expected = [
            &HEAD[..],
            &[7, 0, 0, 0, 1, 2, 3, 4],
            &[3, 0, 0, 0, b'a', b'b', 0],
            // 15 bytes so far: one of padding.
            &[0],
            &1.0_f64.to_le_bytes(),
        ];
        assert_eq!(cdr.finish(), expected.concat());
    }
}
