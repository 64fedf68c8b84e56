//! The order in which events arrived, where it is not that of their time stamps: a byte an event, the place of its file among those of
//! events.

use std::collections::VecDeque;
use std::path::Path;

use super::{ARRIVALS, Damage, EVENT_FILES, FileEntry};
use crate::input::InputError;
use crate::sensors::{KINDS, Stamped};

/// Events by file in the order in which they arrived.
///
/// # Errors
/// [`InputError`] naming the byte that fits no event, or the file that has more of them; where that is counted, such bytes are left out, and
/// such events come last.
pub(super) fn merge(
    directory: &Path,
    bytes: &[u8],
    events: [Vec<Stamped>; KINDS],
    damage: &mut Damage,
) -> Result<Vec<Stamped>, InputError> {
    let file = directory.join(ARRIVALS);
    let mut waiting = events.map(VecDeque::from);
    let mut arrived = Vec::with_capacity(bytes.len());
    for (place, kind) in bytes.iter().enumerate() {
        match waiting.get_mut(usize::from(*kind)).and_then(VecDeque::pop_front) {
            Some(stamped) => arrived.push(stamped),
            None => {
                let message = match EVENT_FILES.get(usize::from(*kind)) {
                    Some(name) => format!("byte {place} wants another event of {name}, which has none left"),
                    None => format!("byte {place} is {kind}, expected 0 to {}", KINDS - 1),
                };
                damage.found(ARRIVALS, 1, InputError::in_file(&file, message))?;
            }
        }
    }
    for (left, name) in waiting.into_iter().zip(EVENT_FILES) {
        if !left.is_empty() {
            let message = format!("has {} events of {name} too few", left.len());
            damage.found(ARRIVALS, left.len() as u64, InputError::in_file(&file, message))?;
            arrived.extend(left);
        }
    }
    Ok(arrived)
}

/// The entry of a file in the description.
pub(super) fn entry(name: &str, records: u64, bytes: &[u8]) -> FileEntry {
    FileEntry {
        name: name.into(),
        records,
        bytes: bytes.len() as u64,
        crc32: super::crc32(bytes),
    }
}
