//! Arguments, by semihosting.

use core::ffi::CStr;

/// Longest argument, its final zero included.
const LONGEST: usize = 256;

/// An argument as semihosting takes it.
pub(crate) struct Word([u8; LONGEST]);

impl Word {
    fn new(text: &str) -> Option<Self> {
        let mut bytes = [0; LONGEST];
        // One zero stays at the end.
        bytes
            .get_mut(..LONGEST - 1)?
            .get_mut(..text.len())?
            .copy_from_slice(text.as_bytes());
        Some(Self(bytes))
    }

    pub(crate) fn path(&self) -> &CStr {
        CStr::from_bytes_until_nul(&self.0).unwrap_or(c"")
    }
}

/// The arguments behind the program's name, if they are `N`.
pub(crate) fn words<const N: usize>() -> Option<[Word; N]> {
    let arguments = semihosting::experimental::env::args::<{ 4 * LONGEST }>().ok()?;
    let mut words = heapless::Vec::<Word, N>::new();
    for word in arguments.skip(1) {
        words.push(Word::new(word.ok()?)?).ok()?;
    }
    words.into_array().ok()
}
