//! A record as it lies in the flash.
//!
//! Little endian: magic `CSLS`, version (u16), bytes of content (u16), number (u32), content, zeros, and in the last four of
//! [`SLOT`] bytes the CRC-32 of all before. The checksum is written last, so a cut leaves a record without one.

use super::VERSION;
use super::error::RecordError;
use super::settings::{CONTENT, CONTENT_WITHOUT_RADIO, Settings};
use crate::front_end::SoftwareCrc;

/// Bytes of a record with what fills it up: four words of an STM32H743's flash.
pub const SLOT: usize = 128;

const MAGIC: [u8; 4] = *b"CSLS";
const HEAD: usize = 12;
const CHECKED: usize = SLOT - 4;
const _: () = assert!(HEAD + CONTENT <= CHECKED, "a record does not fit its slot");

/// A record of these settings.
pub(super) fn encode(number: u32, settings: &Settings) -> [u8; SLOT] {
    let mut slot = [0; SLOT];
    let fields: [&[u8]; 5] = [
        &MAGIC,
        &VERSION.to_le_bytes(),
        &(CONTENT as u16).to_le_bytes(),
        &number.to_le_bytes(),
        &settings.encode(),
    ];
    for (place, byte) in slot.iter_mut().zip(fields.into_iter().flatten()) {
        *place = *byte;
    }
    let checksum = checksum_of(&slot).to_le_bytes();
    if let Some(last) = slot.last_chunk_mut() {
        *last = checksum;
    }
    slot
}

/// Number and settings of a record.
pub(super) fn decode(slot: &[u8; SLOT]) -> Result<(u32, Settings), RecordError> {
    let [m0, m1, m2, m3, v0, v1, l0, l1, n0, n1, n2, n3, rest @ ..] = slot;
    if [*m0, *m1, *m2, *m3] != MAGIC {
        return Err(RecordError::Magic);
    }
    if slot.last_chunk().copied().map(u32::from_le_bytes) != Some(checksum_of(slot)) {
        return Err(RecordError::Checksum);
    }
    let version = u16::from_le_bytes([*v0, *v1]);
    if version != VERSION {
        return Err(RecordError::Version { found: version });
    }
    let length = u16::from_le_bytes([*l0, *l1]);
    let content = rest.first_chunk::<CONTENT>().ok_or(RecordError::Content)?;
    if ![CONTENT, CONTENT_WITHOUT_RADIO].contains(&usize::from(length)) {
        return Err(RecordError::Length { found: length });
    }
    let number = u32::from_le_bytes([*n0, *n1, *n2, *n3]);
    Ok((number, Settings::decode(content)?))
}

fn checksum_of(slot: &[u8; SLOT]) -> u32 {
    SoftwareCrc.bytes(slot.first_chunk::<CHECKED>().map_or(&[][..], |checked| checked))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn altered(at: usize, byte: u8) -> Result<(u32, Settings), RecordError> {
        let mut slot = encode(5, &Settings::default());
        slot[at] = byte;
        let checksum = checksum_of(&slot).to_le_bytes();
        slot[CHECKED..].copy_from_slice(&checksum);
        decode(&slot)
    }

    #[test]
    fn what_is_not_ours_is_named() {
        assert_eq!(altered(0, b'X'), Err(RecordError::Magic));
        assert_eq!(altered(4, 1), Err(RecordError::Version { found: 1 }));
        assert_eq!(altered(6, 47), Err(RecordError::Length { found: 47 }));
        // Mount, whether there is a key.
        for (at, byte) in [(13, 2), (14, 0), (26, 2)] {
            assert_eq!(altered(at, byte), Err(RecordError::Content), "byte {at}");
        }
        assert_eq!(
            altered(27, 7),
            Err(RecordError::Content),
            "a key that there is not"
        );
        // A place or a field that there is not, and ones that cannot be.
        for (at, byte) in [(59, 2), (60, 1), (59, 1), (76, 2), (77, 1), (76, 1)] {
            assert_eq!(altered(at, byte), Err(RecordError::Content), "byte {at}");
        }
        assert_eq!(altered(8, 6), Ok((6, Settings::default())));
    }

    #[test]
    fn a_record_from_before_there_was_a_radio_is_read() {
        assert_eq!(
            altered(6, CONTENT_WITHOUT_RADIO as u8),
            Ok((5, Settings::default()))
        );
        // A radio that there is not, and one that cannot be.
        for (at, byte) in [
            (HEAD + CONTENT_WITHOUT_RADIO, 1),
            (HEAD + CONTENT_WITHOUT_RADIO + 1, 1),
        ] {
            assert_eq!(altered(at, byte), Err(RecordError::Content), "byte {at}");
        }
    }

    #[test]
    fn no_changed_bit_passes() {
        let slot = encode(5, &Settings::default());
        assert_eq!(decode(&slot), Ok((5, Settings::default())));
        for bit in 0..8 * SLOT {
            let mut damaged = slot;
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&damaged).is_err(), "bit {bit}");
        }
    }
}
