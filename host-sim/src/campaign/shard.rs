//! One flight of a campaign on disk.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::input::InputError;
use crate::input::limits::REPORT;
use crate::input::read_text;

/// Which flight.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flight {
    /// Name of the world: the stem of its configuration file, its profile, or both.
    pub world: String,
    /// `best` or `paper`.
    pub mode: String,
    /// Scene.
    pub scene: String,
    /// Seed.
    pub seed: u64,
}

impl Flight {
    /// Name of its shard.
    pub fn file_name(&self) -> String {
        let scene: String = self
            .scene
            .chars()
            .map(|c| {
                if c.is_ascii_alphanumeric() || c == '_' {
                    c
                } else {
                    '-'
                }
            })
            .collect();
        format!("{}.{}.{scene}.{}.json", self.world, self.mode, self.seed)
    }

    /// It in words.
    pub fn text(&self) -> String {
        format!("{} {}, {}, seed {}", self.scene, self.mode, self.world, self.seed)
    }
}

/// What a flight was flown with: flights of two builds are not one campaign.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Build {
    /// Version of the command.
    pub version: String,
    /// CRC-32 of the executable.
    pub executable_crc: u32,
    /// CRC-32 of the configuration, as TOML with every key.
    pub config_crc: u32,
}

/// A flight and its report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Which.
    pub flight: Flight,
    /// With what.
    pub build: Build,
    /// Its `report.json`; absent when it could not be flown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub report: Option<Value>,
    /// Why it could not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Shard {
    /// Writes it whole or not at all.
    ///
    /// # Errors
    /// [`InputError`] naming the file.
    pub fn write(&self, directory: &Path) -> Result<(), InputError> {
        let file = directory.join(self.flight.file_name());
        let part = file.with_extension("part");
        let text =
            serde_json::to_string_pretty(self).map_err(|e| InputError::in_file(&file, e.to_string()))?;
        fs::write(&part, text)
            .and_then(|()| fs::rename(&part, &file))
            .map_err(|e| InputError::unwritable(&file, "cannot be written", &e))
    }

    /// The shard of a flight in a directory; `None` when there is none yet.
    ///
    /// # Errors
    /// [`InputError`] naming a file that is no shard, or one of another flight.
    pub fn read(directory: &Path, flight: &Flight) -> Result<Option<Self>, InputError> {
        let file = directory.join(flight.file_name());
        if !file.exists() {
            return Ok(None);
        }
        let shard = read(&file)?;
        if shard.flight != *flight {
            return Err(InputError::in_file(
                &file,
                format!("holds {}, expected {}", shard.flight.text(), flight.text()),
            ));
        }
        Ok(Some(shard))
    }
}

fn read(file: &Path) -> Result<Shard, InputError> {
    let text = read_text(file, &REPORT)?;
    serde_json::from_str(&text).map_err(|e| InputError::in_file(file, e.to_string()))
}

/// All shards of a directory, in the order of their flights.
///
/// # Errors
/// [`InputError`] naming a file that is no shard, or the directory when it holds none.
pub fn read_shards(directory: &Path) -> Result<Vec<Shard>, InputError> {
    let entries = fs::read_dir(directory).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let entries = entries.map_err(|e| InputError::in_file(directory, format!("cannot be read: {e}")))?;
    let mut files: Vec<PathBuf> = entries.iter().map(fs::DirEntry::path).collect();
    files.retain(|file| {
        file.extension().is_some_and(|e| e == "json") && file.file_name() != Some("summary.json".as_ref())
    });
    let mut shards = files
        .iter()
        .map(|file| read(file))
        .collect::<Result<Vec<_>, _>>()?;
    shards.sort_by(|a, b| a.flight.cmp(&b.flight));
    if shards.is_empty() {
        return Err(InputError::in_file(directory, "holds no flight of a campaign"));
    }
    Ok(shards)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn shard(seed: u64) -> Shard {
        Shard {
            flight: Flight {
                world: "default".into(),
                mode: "best".into(),
                scene: "city:3".into(),
                seed,
            },
            build: Build {
                version: "0.1.0".into(),
                executable_crc: 7,
                config_crc: 9,
            },
            report: Some(json!({"map": {"precision": 0.1 + 0.2}})),
            error: None,
        }
    }

    #[test]
    fn a_shard_is_read_as_it_was_written() {
        let directory = tempfile::tempdir().expect("a directory");
        assert!(read_shards(directory.path()).is_err());
        for seed in [12, 3] {
            shard(seed).write(directory.path()).expect("writable");
        }
        assert_eq!(read_shards(directory.path()).expect("two"), [shard(3), shard(12)]);
        assert_eq!(
            Shard::read(directory.path(), &shard(3).flight).expect("ours"),
            Some(shard(3))
        );
        assert_eq!(
            Shard::read(directory.path(), &shard(4).flight).expect("ours"),
            None
        );
    }

    #[test]
    fn what_is_no_shard_is_named() {
        let directory = tempfile::tempdir().expect("a directory");
        fs::write(
            directory.path().join("default.best.city-3.3.json"),
            "{\"flight\": 1}",
        )
        .expect("writable");
        let error = Shard::read(directory.path(), &shard(3).flight)
            .expect_err("none")
            .to_string();
        assert!(error.contains("default.best.city-3.3.json"), "{error}");
        let mut other = shard(3);
        other.flight.scene = "city-3".into();
        other.write(directory.path()).expect("writable");
        let error = Shard::read(directory.path(), &shard(3).flight)
            .expect_err("another")
            .to_string();
        assert!(error.contains("expected city:3 best"), "{error}");
    }
}
