//! What comes from outside: read within limits, and bad input said in one line: which file, which line or key, what is wrong
//! and what was expected.

pub mod limits;
mod read;

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

pub use read::{from_json, from_json_line, from_toml, lines, read_bytes, read_exactly, read_text, unpack};

/// Most characters of a message: what an input holds may be quoted in it, whatever its length.
const MESSAGE_CHARS: usize = 1000;

/// An input that cannot be used. The command ends with exit code 2 and prints this as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    file: Option<PathBuf>,
    line: Option<usize>,
    message: String,
    kind: Option<io::ErrorKind>,
}

impl InputError {
    /// An argument or a key that belongs to no file.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            file: None,
            line: None,
            message: message.into(),
            kind: None,
        }
    }

    /// A whole file.
    pub fn in_file(file: &Path, message: impl Into<String>) -> Self {
        Self {
            file: Some(file.to_owned()),
            line: None,
            message: message.into(),
            kind: None,
        }
    }

    /// A file or directory that cannot be written or made, `what` saying which: `cannot be written`.
    pub fn unwritable(file: &Path, what: &str, error: &io::Error) -> Self {
        Self {
            kind: Some(error.kind()),
            ..Self::in_file(file, format!("{what}: {error}"))
        }
    }

    /// What the operating system said, where it was asked to write: a full disk is no bad input.
    pub fn kind(&self) -> Option<io::ErrorKind> {
        self.kind
    }

    /// One line of a file; lines count from 1.
    pub fn at_line(file: &Path, line: usize, message: impl Into<String>) -> Self {
        Self {
            file: Some(file.to_owned()),
            line: Some(line),
            message: message.into(),
            kind: None,
        }
    }

    /// The same error in a file, where it names none yet.
    #[must_use]
    pub fn within(self, file: &Path) -> Self {
        Self {
            file: self.file.or_else(|| Some(file.to_owned())),
            ..self
        }
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}:", file.display())?;
            if let Some(line) = self.line {
                write!(f, "{line}:")?;
            }
            f.write_str(" ")?;
        }
        // One line whatever a library's message holds.
        let message = self.message.split_whitespace().collect::<Vec<_>>().join(" ");
        match message.char_indices().nth(MESSAGE_CHARS) {
            Some((end, _)) => write!(f, "{}...", &message[..end]),
            None => f.write_str(&message),
        }
    }
}

impl std::error::Error for InputError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_of_bounded_length() {
        let error = InputError::at_line(Path::new("a"), 3, format!("one\ntwo {}", "\u{e9}".repeat(5000)));
        let text = error.to_string();
        assert!(
            text.starts_with("a:3: one two ") && text.ends_with("..."),
            "{text}"
        );
        assert_eq!(text.chars().count(), "a:3: ".len() + MESSAGE_CHARS + "...".len());
    }

    #[test]
    fn a_key_is_put_into_its_file_once() {
        let error = InputError::new("a.b is 3").within(Path::new("x.toml"));
        assert_eq!(
            error.clone().within(Path::new("y")).to_string(),
            "x.toml: a.b is 3"
        );
    }
}
