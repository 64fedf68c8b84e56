//! Bad input, said in one line: which file, which line or key, what is wrong and what was expected.

use std::fmt;
use std::io::Read;
use std::path::{Path, PathBuf};

/// An input that cannot be used. The command ends with exit code 2 and prints this as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    file: Option<PathBuf>,
    line: Option<usize>,
    message: String,
}

impl InputError {
    /// An argument or a key that belongs to no file.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            file: None,
            line: None,
            message: message.into(),
        }
    }

    /// A whole file.
    pub fn in_file(file: &Path, message: impl Into<String>) -> Self {
        Self {
            file: Some(file.to_owned()),
            line: None,
            message: message.into(),
        }
    }

    /// One line of a file; lines count from 1.
    pub fn at_line(file: &Path, line: usize, message: impl Into<String>) -> Self {
        Self {
            file: Some(file.to_owned()),
            line: Some(line),
            message: message.into(),
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
        f.write_str(&self.message.split_whitespace().collect::<Vec<_>>().join(" "))
    }
}

impl std::error::Error for InputError {}

/// Reads a text file, unpacking it when its name ends in `.gz`.
///
/// # Errors
/// [`InputError`] naming the file when it cannot be read, unpacked, or is not UTF-8.
pub fn read_text(file: &Path) -> Result<String, InputError> {
    let bytes = std::fs::read(file).map_err(|e| InputError::in_file(file, format!("cannot be read: {e}")))?;
    if file.extension().is_some_and(|e| e == "gz") {
        unpack(file, &bytes)
    } else {
        String::from_utf8(bytes).map_err(|e| InputError::in_file(file, format!("is not text: {e}")))
    }
}

/// Unpacks gzipped text; `file` is for messages only.
///
/// # Errors
/// [`InputError`] naming the file when the bytes are no gzipped UTF-8.
pub fn unpack(file: &Path, packed: &[u8]) -> Result<String, InputError> {
    let mut text = String::new();
    flate2::read::GzDecoder::new(packed)
        .read_to_string(&mut text)
        .map_err(|e| InputError::in_file(file, format!("is not gzipped text: {e}")))?;
    Ok(text)
}
