//! Whose packets are taken: keys from files, or an explicit wish to do without.

use std::collections::BTreeMap;
use std::path::PathBuf;

use cslam_core::telemetry::{Key, Opener};

use crate::input::InputError;
use crate::link_key::{self, LinkKey};

/// What is taken.
#[derive(Clone, Debug)]
pub enum Trust {
    /// Packets signed with the key of their UAV.
    Keys(BTreeMap<u8, Key>),
    /// Packets signed with the published key, of every UAV: anybody can forge them.
    Test,
    /// Unsigned packets, and no others: anybody can forge them.
    Unsigned,
}

impl Trust {
    /// Keys from the files that `cslam key` makes, each of one UAV.
    ///
    /// # Errors
    /// [`InputError`] naming the file, never its content; also when two files hold a key of one UAV.
    pub fn from_files(files: &[PathBuf]) -> Result<Self, InputError> {
        let mut keys = BTreeMap::new();
        for file in files {
            let LinkKey { uav, key } = link_key::read(file)?;
            if keys.insert(uav, key).is_some() {
                return Err(InputError::in_file(file, format!("UAV {uav} has a key already")));
            }
        }
        Ok(Self::Keys(keys))
    }

    /// What opens packets of a link; `None` when there is no key for it.
    pub(super) fn opener(&self, uav: u8) -> Option<Opener> {
        match self {
            Self::Keys(keys) => keys.get(&uav).map(|key| Opener::new(uav, key)),
            Self::Test => Some(Opener::new(uav, &Key::TEST)),
            Self::Unsigned => Some(Opener::unsigned(uav)),
        }
    }

    /// In words, for the log and the page.
    pub fn words(&self) -> String {
        match self {
            Self::Keys(keys) => match keys.len() {
                1 => "takes signed packets of 1 UAV".to_owned(),
                count => format!("takes signed packets of {count} UAVs"),
            },
            Self::Test => "takes packets with the published test key: anybody can forge them".to_owned(),
            Self::Unsigned => "takes unsigned packets: anybody can forge them".to_owned(),
        }
    }
}
