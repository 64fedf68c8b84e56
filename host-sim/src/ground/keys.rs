//! Whose packets are taken: keys from files, or an explicit wish to do without.

use std::collections::BTreeMap;
use std::path::PathBuf;

use cslam_core::telemetry::{Key, Opener};

use crate::input::InputError;

/// What is taken.
#[derive(Clone, Debug)]
pub enum Trust {
    /// Packets signed with the key of their UAV, or with the one that holds for every other UAV.
    Keys {
        /// Keys by link id.
        of: BTreeMap<u8, Key>,
        /// Key of every other link.
        others: Option<Key>,
    },
    /// Unsigned packets, and no others: anybody can forge them.
    Unsigned,
}

impl Trust {
    /// The published key, for every link: anybody can forge its packets.
    pub fn test() -> Self {
        Self::Keys {
            of: BTreeMap::new(),
            others: Some(Key::TEST),
        }
    }

    /// Keys from files: `FILE` for every UAV, or `UAV=FILE` for one.
    ///
    /// # Errors
    /// [`InputError`] naming the argument or the file, never its content.
    pub fn from_files(arguments: &[String]) -> Result<Self, InputError> {
        let (mut of, mut others) = (BTreeMap::new(), None);
        for argument in arguments {
            let (uav, file) = match argument.split_once('=') {
                Some((uav, file)) => {
                    let uav: u8 = uav.parse().map_err(|_| {
                        InputError::new(format!(
                            "--key {argument}: `{uav}` is no UAV, expected 0 to 255 before ="
                        ))
                    })?;
                    (Some(uav), file)
                }
                None => (None, argument.as_str()),
            };
            let key = read_key(&PathBuf::from(file))?;
            let twice = match uav {
                Some(uav) => of.insert(uav, key).is_some(),
                None => others.replace(key).is_some(),
            };
            if twice {
                return Err(InputError::new(format!(
                    "--key {argument}: there is a key for that already"
                )));
            }
        }
        Ok(Self::Keys { of, others })
    }

    /// What opens packets of a link; `None` when there is no key for it.
    pub(super) fn opener(&self, uav: u8) -> Option<Opener> {
        match self {
            Self::Keys { of, others } => of.get(&uav).or(others.as_ref()).map(|key| Opener::new(uav, key)),
            Self::Unsigned => Some(Opener::unsigned(uav)),
        }
    }

    /// In words, for the log and the page.
    pub fn words(&self) -> String {
        match self {
            Self::Keys { of, others } => {
                let test = of.values().chain(others).any(Key::is_test);
                let whose = match (of.len(), others) {
                    (0, None) => "no key: nothing is taken".to_owned(),
                    (0, Some(_)) => "signed packets, one key".to_owned(),
                    (keys, _) => format!("signed packets, {} keys", keys + usize::from(others.is_some())),
                };
                whose
                    + if test {
                        " (the published test key: anybody can forge)"
                    } else {
                        ""
                    }
            }
            Self::Unsigned => "unsigned packets: anybody can forge them".to_owned(),
        }
    }
}

fn read_key(file: &std::path::Path) -> Result<Key, InputError> {
    let text = crate::input::read_text(file)?;
    let digits: String = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .collect::<String>()
        .trim()
        .to_owned();
    let mut bytes = [0; Key::LENGTH];
    let ok = digits.len() == 64
        && bytes.iter_mut().enumerate().all(|(k, byte)| {
            u8::from_str_radix(&digits[2 * k..2 * k + 2], 16).is_ok_and(|b| {
                *byte = b;
                true
            })
        });
    if ok {
        Ok(Key::new(bytes))
    } else {
        Err(InputError::in_file(
            file,
            "is no key, expected 64 hexadecimal digits",
        ))
    }
}
