//! What a reader does about a part of a recording that is damaged or not there.

use std::collections::BTreeMap;

use crate::input::InputError;

/// Damage that was found: a reader that may go on counts it, one that may not gives the first as its error.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Damage {
    keep_going: bool,
    /// Parts that are missing or unreadable, by file (sample blocks: by kind).
    gaps: BTreeMap<String, u64>,
    /// The first error of each.
    first: Vec<String>,
}

impl Damage {
    /// The first damage is an error.
    pub fn refused() -> Self {
        Self::default()
    }

    /// Damage is counted and left out.
    pub fn counted() -> Self {
        Self {
            keep_going: true,
            ..Self::default()
        }
    }

    /// Enters `records` records of `part` that are missing or unreadable.
    ///
    /// # Errors
    /// The error itself when damage is refused.
    pub(super) fn found(&mut self, part: &str, records: u64, error: InputError) -> Result<(), InputError> {
        if !self.keep_going {
            return Err(error);
        }
        if !self.gaps.contains_key(part) {
            self.first.push(error.to_string());
        }
        *self.gaps.entry(part.to_owned()).or_default() += records;
        Ok(())
    }

    /// What is missing or unreadable: part, number of records.
    pub fn gaps(&self) -> &BTreeMap<String, u64> {
        &self.gaps
    }

    /// The first error of each part.
    pub fn messages(&self) -> &[String] {
        &self.first
    }
}
