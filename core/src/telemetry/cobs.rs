//! Consistent overhead byte stuffing (Cheshire and Baker, 1999): no zero byte inside a frame, so a zero ends it.
//!
//! Written out here, and not taken from a library, because the ones at hand keep panicking paths (indexing) that the
//! flight image must not have. A library is the oracle of the tests.

/// Stuffs `data` into `frame` and returns the stuffed length, without closing zero; `None` when `frame` is too small.
pub(super) fn encode(data: &[u8], frame: &mut [u8]) -> Option<usize> {
    let mut code_at = 0;
    let mut code = 1_u8;
    let mut length = 1;
    for &byte in data {
        // A full block of 254 bytes is closed only when more data follows.
        if code == u8::MAX {
            *frame.get_mut(code_at)? = code;
            (code_at, code) = (length, 1);
            length += 1;
        }
        if byte == 0 {
            *frame.get_mut(code_at)? = code;
            (code_at, code) = (length, 1);
        } else {
            *frame.get_mut(length)? = byte;
            code += 1;
        }
        length += 1;
    }
    *frame.get_mut(code_at)? = code;
    (length <= frame.len()).then_some(length)
}

/// Undoes [`encode`] into `data` and returns the length; `None` for a damaged frame or when `data` is too small.
pub(super) fn decode(frame: &[u8], data: &mut [u8]) -> Option<usize> {
    let mut length = 0;
    let mut rest = frame;
    while let Some((&code, tail)) = rest.split_first() {
        let block = usize::from(code).checked_sub(1)?;
        let (bytes, after) = tail.split_at_checked(block)?;
        for &byte in bytes {
            if byte == 0 {
                return None;
            }
            *data.get_mut(length)? = byte;
            length += 1;
        }
        if code < u8::MAX && !after.is_empty() {
            *data.get_mut(length)? = 0;
            length += 1;
        }
        rest = after;
    }
    Some(length)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn equals_the_library_and_returns(
            // Few zeros as well as many: blocks of 254 bytes and more must occur.
            data in prop_oneof![
                prop::collection::vec(prop_oneof![Just(0_u8), any::<u8>()], 0..600),
                prop::collection::vec(prop_oneof![1 => Just(0_u8), 400 => 1_u8..], 250..600),
            ],
        ) {
            let (mut ours, mut theirs) = ([0xaa; 700], [0xaa; 700]);
            let length = encode(&data, &mut ours).expect("room");
            let expected = ::cobs::try_encode(&data, &mut theirs).expect("room");
            prop_assert_eq!(&ours[..length], &theirs[..expected]);
            prop_assert!(!ours[..length].contains(&0));
            let mut back = [0; 700];
            let n = decode(&ours[..length], &mut back).expect("sound");
            prop_assert_eq!(&back[..n], &data[..]);
        }

        #[test]
        fn damaged_frames_never_panic(frame in prop::collection::vec(any::<u8>(), 0..80)) {
            let mut data = [0; 64];
            let _ = decode(&frame, &mut data);
        }
    }

    #[test]
    fn a_small_buffer_is_an_error() {
        assert_eq!(encode(&[1, 2, 3], &mut [0; 3]), None);
        assert_eq!(encode(&[0], &mut [0; 1]), None);
        assert_eq!(encode(&[], &mut []), None);
        assert_eq!(decode(&[4, 1, 2, 3], &mut [0; 2]), None);
    }
}
