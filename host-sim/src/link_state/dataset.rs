//! A data set on disk: `dataset.json`, which says how it is made, and its shards.
//!
//! ```text
//! DIR/dataset.json                 protocol, number of shards, transmitter positions
//! DIR/shard-0003-of-0016/*.npy     the links of the fourth sixteenth of all link numbers, a column a file
//! ```
//! Shards may be made one by one, anywhere and in any order: their bytes are the same as those of one run.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::links::Links;
use super::protocol::{Protocol, Source};
use crate::input::limits::{DATASET_DESCRIPTION, DATASET_LINKS, DATASET_SHARDS};
use crate::input::{InputError, from_json, read_text};

/// Name of the description.
pub const DESCRIPTION: &str = "dataset.json";

/// Version of the layout.
const VERSION: u32 = 1;

/// What `dataset.json` holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Version of the layout, 1.
    pub version: u32,
    /// How the links were made.
    pub protocol: Protocol,
    /// Number of shards.
    pub shards: usize,
    /// Transmitter positions, m.
    pub transmitters_m: Vec<[f64; 3]>,
}

impl Description {
    /// Of a source cut into shards.
    pub fn new(protocol: &Protocol, source: &Source<'_>, shards: usize) -> Self {
        Self {
            version: VERSION,
            protocol: protocol.clone(),
            shards,
            transmitters_m: source.transmitters_m().to_vec(),
        }
    }

    /// Writes `dataset.json` to a directory, which is made. Another shard's run may have done so already.
    ///
    /// # Errors
    /// [`InputError`] when it cannot be written, or the directory holds another data set.
    pub fn write(&self, directory: &Path) -> Result<(), InputError> {
        let cannot = |file: &Path, e: std::io::Error| InputError::unwritable(file, "cannot be written", &e);
        std::fs::create_dir_all(directory).map_err(|e| cannot(directory, e))?;
        let file = directory.join(DESCRIPTION);
        if file.exists() && Self::read(directory)? != *self {
            return Err(InputError::in_file(
                &file,
                "describes another data set: choose another directory",
            ));
        }
        let mut text = serde_json::to_string_pretty(self)
            .map_err(|e| InputError::unwritable(&file, "cannot be written", &e.into()))?;
        text.push('\n');
        std::fs::write(&file, text).map_err(|e| cannot(&file, e))
    }

    /// Reads `dataset.json` of a directory.
    ///
    /// # Errors
    /// [`InputError`] naming the file and what was expected.
    pub fn read(directory: &Path) -> Result<Self, InputError> {
        let file = directory.join(DESCRIPTION);
        let read: Self = from_json(
            &file,
            &read_text(&file, &DATASET_DESCRIPTION)?,
            "the description of a data set",
        )?;
        let wrong = |message| Err(InputError::in_file(&file, message));
        if read.version != VERSION {
            return wrong(format!("version: expected {VERSION}, found {}", read.version));
        }
        if !(1..=DATASET_SHARDS).contains(&read.shards) {
            return wrong(format!(
                "shards: expected 1 to {DATASET_SHARDS}, found {}",
                read.shards
            ));
        }
        Ok(read)
    }
}

/// Link numbers of one of several shards.
pub fn range(all_links: u64, shard: usize, shards: usize) -> std::ops::Range<u64> {
    // 128 bits: the product may be large.
    let cut = |i: usize| (u128::from(all_links) * i as u128 / shards.max(1) as u128) as u64;
    cut(shard)..cut(shard + 1)
}

/// Directory of one of several shards.
pub fn shard_directory(directory: &Path, shard: usize, shards: usize) -> PathBuf {
    directory.join(format!("shard-{shard:04}-of-{shards:04}"))
}

/// Writes one shard, whole or not at all.
///
/// # Errors
/// [`InputError`] naming the file that cannot be written.
pub fn write_shard(directory: &Path, shard: usize, shards: usize, links: &Links) -> Result<(), InputError> {
    let last = shard_directory(directory, shard, shards);
    let part = last.with_extension("part");
    let cannot = |e: std::io::Error| InputError::unwritable(&last, "cannot be written", &e);
    if last.exists() {
        std::fs::remove_dir_all(&last).map_err(cannot)?;
    }
    std::fs::create_dir_all(&part).map_err(cannot)?;
    links.write(&part)?;
    std::fs::rename(&part, &last).map_err(cannot)
}

/// Reads all shards of a data set.
///
/// # Errors
/// [`InputError`] naming what is missing or wrong.
pub fn read(directory: &Path) -> Result<(Description, Links), InputError> {
    let description = Description::read(directory)?;
    let mut all = Links::default();
    for shard in 0..description.shards {
        let place = shard_directory(directory, shard, description.shards);
        if !place.is_dir() {
            let message = format!("is missing: expected all {} shards", description.shards);
            return Err(InputError::in_file(&place, message));
        }
        all.append(&Links::read(&place)?);
        if all.len() > DATASET_LINKS {
            let message = format!(
                "brings the links to {}, at most {DATASET_LINKS} are read",
                all.len()
            );
            return Err(InputError::in_file(&place, message));
        }
    }
    Ok((description, all))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_cover_all_links_once() {
        for (links, shards) in [(10, 3), (28_800_000, 16), (2, 5), (u64::MAX, 7)] {
            let mut next = 0;
            for shard in 0..shards {
                let range = range(links, shard, shards);
                assert_eq!(range.start, next);
                next = range.end;
            }
            assert_eq!(next, links);
        }
    }
}
