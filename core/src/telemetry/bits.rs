//! Bit strings: the body of a packet, most significant bit first.

/// Writes a bit string into a slice. What does not fit is remembered, not written: [`BitWriter::finish`] tells.
#[derive(Debug)]
pub struct BitWriter<'a> {
    bytes: &'a mut [u8],
    /// Bits written.
    length: usize,
    overflowed: bool,
    unfit: bool,
}

/// Reads a bit string from a slice; `None` as soon as it has ended.
#[derive(Debug)]
pub struct BitReader<'a> {
    bytes: &'a [u8],
    /// Bits read.
    position: usize,
}

/// Why a bit string could not be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unwritten {
    /// It is longer than the slice.
    TooLong,
    /// A value does not fit the bits that it has.
    Unfit,
}

impl<'a> BitWriter<'a> {
    /// A writer at the start of a slice, whatever the slice holds.
    pub(super) fn new(bytes: &'a mut [u8]) -> Self {
        Self {
            bytes,
            length: 0,
            overflowed: false,
            unfit: false,
        }
    }

    /// Appends the lowest `bits` of `value`, 64 at most; a value of more bits makes the string void.
    #[inline(never)] // called from every field of every message: inlined it costs 15 KB of flash
    pub(super) fn put(&mut self, value: u64, bits: u32) {
        self.unfit |= width(value) > bits;
        for bit in (0..bits.min(64)).rev() {
            self.put_bit((value >> bit) & 1 == 1);
        }
    }

    /// Appends a bit.
    pub(super) fn put_bit(&mut self, bit: bool) {
        let Some(byte) = self.bytes.get_mut(self.length / 8) else {
            self.overflowed = true;
            return;
        };
        let place = 7 - self.length % 8;
        if place == 7 {
            *byte = 0;
        }
        *byte |= u8::from(bit) << place;
        self.length += 1;
    }

    /// Appends a number in two's complement.
    pub(super) fn put_signed(&mut self, value: i64, bits: u32) {
        self.unfit |= width(zigzag(value)) > bits;
        let mask = u64::MAX.checked_shr(64_u32.saturating_sub(bits)).unwrap_or(0);
        self.put(value as u64 & mask, bits);
    }

    /// Appends a number of unknown size: the number of its bits in six, then these.
    pub(super) fn put_sized(&mut self, value: u64) {
        let bits = width(value).min(63);
        self.put(u64::from(bits), 6);
        self.put(value, bits);
    }

    /// Makes the string void: it cannot say what it should.
    pub(super) fn spoil(&mut self) {
        self.unfit = true;
    }

    /// The number of bytes, the last one filled up with zeros.
    pub(super) fn finish(self) -> Result<usize, Unwritten> {
        if self.unfit {
            Err(Unwritten::Unfit)
        } else if self.overflowed {
            Err(Unwritten::TooLong)
        } else {
            Ok(self.length.div_ceil(8))
        }
    }
}

impl<'a> BitReader<'a> {
    /// A reader at the start of a slice.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, position: 0 }
    }

    /// The next `bits`, 64 at most, as a number.
    #[inline(never)] // called from every field of every message: inlined it costs 15 KB of flash
    pub(super) fn take(&mut self, bits: u32) -> Option<u64> {
        let mut value = 0;
        for _ in 0..bits {
            value = value << 1 | u64::from(self.take_bit()?);
        }
        Some(value)
    }

    /// The next bit.
    pub(super) fn take_bit(&mut self) -> Option<bool> {
        let byte = self.bytes.get(self.position / 8)?;
        let bit = byte >> (7 - self.position % 8) & 1;
        self.position += 1;
        Some(bit == 1)
    }

    /// The next number of at most 8 bits.
    pub(super) fn take_u8(&mut self, bits: u32) -> Option<u8> {
        u8::try_from(self.take(bits)?).ok()
    }

    /// The next number of at most 16 bits.
    pub(super) fn take_u16(&mut self, bits: u32) -> Option<u16> {
        u16::try_from(self.take(bits)?).ok()
    }

    /// The next number of at most 32 bits.
    pub(super) fn take_u32(&mut self, bits: u32) -> Option<u32> {
        u32::try_from(self.take(bits)?).ok()
    }

    /// The next number in two's complement, 1 to 64 bits.
    pub(super) fn take_signed(&mut self, bits: u32) -> Option<i64> {
        let unused = 64_u32.checked_sub(bits)?;
        let shifted = self.take(bits)?.checked_shl(unused)? as i64;
        Some(shifted >> unused)
    }

    /// The next number of unknown size, in its shortest form: the same number has one form only.
    pub(super) fn take_sized(&mut self) -> Option<u64> {
        let bits = self.take(6)? as u32;
        let value = self.take(bits)?;
        (width(value) == bits).then_some(value)
    }

    /// The end: less than a byte is left, and it is zero.
    pub(super) fn finish(mut self) -> Option<()> {
        let left = (self.bytes.len() * 8).checked_sub(self.position)?;
        (left < 8 && self.take(left as u32)? == 0).then_some(())
    }
}

/// Bits that a number needs.
pub(super) fn width(value: u64) -> u32 {
    u64::BITS - value.leading_zeros()
}

/// A signed number as one without sign, small when it is near zero: 0, -1, 1, -2 become 0, 1, 2, 3.
pub(super) fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

/// Undoes [`zigzag`].
pub(super) fn unzigzag(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_was_written_is_read(
            fields in prop::collection::vec((any::<u64>(), 1..=64_u32, 0..3_u8), 0..40),
        ) {
            let cut = |value: u64, bits: u32| value >> (64 - bits);
            let mut bytes = [0xff; 400];
            let mut writer = BitWriter::new(&mut bytes);
            for &(value, bits, how) in &fields {
                match how {
                    0 => writer.put(cut(value, bits), bits),
                    1 => writer.put_signed(value as i64 >> (64 - bits), bits),
                    _ => writer.put_sized(cut(value, bits) >> 1),
                }
            }
            let length = writer.finish().expect("room");
            let mut reader = BitReader::new(&bytes[..length]);
            for &(value, bits, how) in &fields {
                match how {
                    0 => prop_assert_eq!(reader.take(bits), Some(cut(value, bits))),
                    1 => prop_assert_eq!(reader.take_signed(bits), Some(value as i64 >> (64 - bits))),
                    _ => prop_assert_eq!(reader.take_sized(), Some(cut(value, bits) >> 1)),
                }
            }
            prop_assert_eq!(reader.finish(), Some(()));
        }

        #[test]
        fn zigzag_returns(value in any::<i64>()) {
            prop_assert_eq!(unzigzag(zigzag(value)), value);
        }
    }

    #[test]
    fn the_first_bit_is_the_highest_of_the_first_byte() {
        let mut bytes = [0; 2];
        let mut writer = BitWriter::new(&mut bytes);
        writer.put(0b101, 3);
        writer.put(0b1_0000_0001, 9);
        assert_eq!(writer.finish(), Ok(2));
        assert_eq!(bytes, [0b1011_0000, 0b0001_0000]);
    }

    #[test]
    fn values_and_strings_that_do_not_fit_are_errors() {
        let written = |write: fn(&mut BitWriter<'_>)| {
            let mut bytes = [0; 2];
            let mut writer = BitWriter::new(&mut bytes);
            write(&mut writer);
            writer.finish()
        };
        assert_eq!(written(|w| w.put(4, 2)), Err(Unwritten::Unfit));
        assert_eq!(written(|w| w.put_signed(-3, 2)), Err(Unwritten::Unfit));
        assert_eq!(written(|w| w.put_signed(2, 2)), Err(Unwritten::Unfit));
        assert_eq!(written(|w| w.put_signed(-2, 2)), Ok(1));
        assert_eq!(written(|w| w.put(0, 17)), Err(Unwritten::TooLong));
        assert_eq!(written(|w| w.spoil()), Err(Unwritten::Unfit));
    }

    #[test]
    fn a_string_ends_with_less_than_a_byte_of_zeros() {
        let left = |bytes: &[u8], bits| {
            let mut reader = BitReader::new(bytes);
            reader.take(bits).and_then(|_| reader.finish())
        };
        assert_eq!(left(&[0b1110_0000], 3), Some(()));
        assert_eq!(left(&[0b1110_0001], 3), None, "not zero");
        assert_eq!(left(&[0, 0], 8), None, "a byte too many");
        assert_eq!(left(&[0], 9), None, "too short");
        // The length of a number of unknown size is its shortest.
        assert_eq!(BitReader::new(&[0b0000_1001]).take_sized(), None);
    }
}
