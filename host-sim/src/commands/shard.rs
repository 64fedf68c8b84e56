//! Which part of a command's work is done, when several processes do it.

use crate::input::InputError;

/// One of several parts of equal size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct OneOf {
    /// Which, counted from 0.
    pub(crate) shard: usize,
    /// Of how many.
    pub(crate) shards: usize,
}

impl OneOf {
    /// What `--shard` says, of at most `most` parts.
    ///
    /// # Errors
    /// [`InputError`] naming the option.
    pub(crate) fn parse(text: &str, most: usize) -> Result<Self, InputError> {
        let numbers = text
            .split_once('/')
            .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((shard, shards)) if shard < shards && shards <= most => Ok(Self { shard, shards }),
            _ => Err(InputError::new(format!(
                "--shard {text}: expected I/N, shard I of N counted from 0, such as 3/16"
            ))),
        }
    }

    /// Whether a piece of work is of this part, by its place among all: they go round, so that parts are alike.
    pub(crate) fn has(self, place: usize) -> bool {
        place % self.shards == self.shard
    }
}
