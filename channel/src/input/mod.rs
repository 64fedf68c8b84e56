//! What comes from outside: read within limits, and bad input said in one line: which file, which line or key, what is wrong
//! and what was expected.

pub mod limits;
mod line;
mod ranges;
mod read;
pub mod toml_keys;
mod toml_places;

use cslam_core::field::FieldError;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

pub use ranges::{above_zero, within};
pub use read::{from_json, from_json_line, from_toml, lines, read_bytes, read_exactly, read_text, unpack};

/// Most characters of a message: what an input holds may be quoted in it, whatever its length.
const MESSAGE_CHARS: usize = 1000;

/// An input that cannot be used. The command ends with exit code 2 and prints this as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    file: Option<PathBuf>,
    line: Option<usize>,
    key: Option<String>,
    message: String,
    kind: Option<io::ErrorKind>,
}

impl InputError {
    /// An argument that belongs to no file.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            file: None,
            line: None,
            key: None,
            message: message.into(),
            kind: None,
        }
    }

    /// A key of a configuration, and what is wrong with its value: `is 3, expected 8 to 16`.
    pub fn at_key(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            key: Some(key.into()),
            ..Self::new(message)
        }
    }

    /// The same key, of a table.
    #[must_use]
    pub fn under(self, table: &str) -> Self {
        Self {
            key: self.key.map(|key| format!("{table}.{key}")),
            ..self
        }
    }

    /// The same error in a TOML file of this text, with the line of the key where the file has it.
    #[must_use]
    pub fn in_toml(self, file: &Path, text: &str) -> Self {
        let line = self.key.as_ref().and_then(|key| toml_places::line_of(text, key));
        Self {
            line: self.line.or(line),
            ..self.within(file)
        }
    }

    /// A whole file.
    pub fn in_file(file: &Path, message: impl Into<String>) -> Self {
        Self {
            file: Some(file.to_owned()),
            ..Self::new(message)
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
            line: Some(line),
            ..Self::in_file(file, message)
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

impl From<FieldError> for InputError {
    /// A key of a TOML file has the name of the field.
    fn from(error: FieldError) -> Self {
        let at = Self::at_key(error.field, error.wrong.to_string());
        match error.table {
            Some(table) => at.under(table),
            None => at,
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
        if let Some(key) = &self.key {
            write!(f, "{key} ")?;
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
        let error = InputError::at_key("b", "is 3")
            .under("a")
            .within(Path::new("x.toml"));
        assert_eq!(
            error.clone().within(Path::new("y")).to_string(),
            "x.toml: a.b is 3"
        );
    }

    #[test]
    fn a_key_has_the_line_that_the_file_gives_it() {
        let at = |key: &str, text: &str| {
            InputError::at_key(key, "is 3")
                .in_toml(Path::new("x"), text)
                .to_string()
        };
        assert_eq!(at("a.b", "# a.b\n[a]\nc = 1\nb = 3\n"), "x:4: a.b is 3");
        assert_eq!(at("a.b", "[a]\nc = 1\n"), "x: a.b is 3");
    }
}
