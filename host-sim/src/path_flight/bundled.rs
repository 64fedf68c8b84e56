//! The path list that comes with the program.

use std::path::Path;

use crate::input::limits::PATH_LIST;
use crate::input::{InputError, unpack};
use crate::paths::{Link, parse};

/// Five GMT positions, each heard at 200 places of an outdoor scene.
///
/// # Errors
/// None in a sound build; the signature is that of [`crate::paths::read`].
pub fn bundled() -> Result<Vec<Link>, InputError> {
    let packed = include_bytes!("../../fixtures/outdoor_a.jsonl.gz");
    let name = Path::new("bundled:outdoor_a.jsonl.gz");
    parse(name, &unpack(name, packed, &PATH_LIST)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bundled_list_is_sound() {
        let links = bundled().expect("sound");
        assert_eq!(links.len(), 1000);
        assert!(links.iter().map(|l| l.paths.len()).sum::<usize>() >= 1000);
    }
}
