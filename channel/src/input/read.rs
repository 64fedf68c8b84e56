//! Bytes and text of files, never more than a limit allows.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;
use serde::de::DeserializeOwned;

use super::limits::Limit;
use super::line::line_at;
use super::{InputError, toml_places};

/// The bytes of a file.
///
/// # Errors
/// [`InputError`] naming the file when it cannot be read or is longer than its kind may be.
pub fn read_bytes(file: &Path, limit: &Limit) -> Result<Vec<u8>, InputError> {
    at_most(file, limit.bytes)
}

/// The bytes of a file that holds so many.
///
/// # Errors
/// [`InputError`] naming the file when it cannot be read, is cut short or too long; `why` says who expects that length.
pub fn read_exactly(file: &Path, expected: u64, why: &str) -> Result<Vec<u8>, InputError> {
    let cannot = |e| InputError::in_file(file, format!("cannot be read: {e}"));
    let opened = File::open(file).map_err(cannot)?;
    let mut length = opened.metadata().map_err(cannot)?.len();
    if length == expected {
        let mut bytes = Vec::new();
        opened.take(expected).read_to_end(&mut bytes).map_err(cannot)?;
        length = bytes.len() as u64;
        if length == expected {
            return Ok(bytes);
        }
    }
    let what = if length < expected {
        "is cut short"
    } else {
        "is too long"
    };
    Err(InputError::in_file(
        file,
        format!("{what}: {length} bytes, expected {expected} {why}"),
    ))
}

/// The text of a file, unpacked when its name ends in `.gz`.
///
/// # Errors
/// [`InputError`] naming the file when it cannot be read or unpacked, is longer than its kind may be, or is not UTF-8.
pub fn read_text(file: &Path, limit: &Limit) -> Result<String, InputError> {
    if file.extension().is_some_and(|e| e == "gz") {
        unpack(file, &at_most(file, limit.packed_bytes)?, limit)
    } else {
        as_text(file, at_most(file, limit.bytes)?)
    }
}

/// Unpacks gzipped text; `file` is for messages only.
///
/// # Errors
/// [`InputError`] naming the file when the bytes are no gzipped UTF-8, or would become longer than the kind may be.
pub fn unpack(file: &Path, packed: &[u8], limit: &Limit) -> Result<String, InputError> {
    let mut bytes = Vec::new();
    MultiGzDecoder::new(packed)
        .take(limit.bytes + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| InputError::in_file(file, format!("is not gzipped text: {e}")))?;
    if bytes.len() as u64 > limit.bytes {
        return Err(InputError::in_file(
            file,
            format!(
                "unpacks to more than {} bytes, the most that is read",
                limit.bytes
            ),
        ));
    }
    as_text(file, bytes)
}

/// The lines of a text with their numbers, from 1; `file` is for messages only.
///
/// # Errors
/// [`InputError`] naming file and line in the place of a line that is longer than the kind may have.
pub fn lines<'a>(
    file: &'a Path,
    text: &'a str,
    limit: &'a Limit,
) -> impl Iterator<Item = Result<(usize, &'a str), InputError>> {
    text.lines().enumerate().map(move |(index, line)| {
        if line.len() > limit.line_bytes {
            return Err(InputError::at_line(
                file,
                index + 1,
                format!(
                    "has {} bytes, expected a line of at most {}",
                    line.len(),
                    limit.line_bytes
                ),
            ));
        }
        Ok((index + 1, line))
    })
}

/// A file of one JSON value; `what` says what it should be.
///
/// # Errors
/// [`InputError`] naming file and line, and the key where one is wrong.
pub fn from_json<T: DeserializeOwned>(file: &Path, text: &str, what: &str) -> Result<T, InputError> {
    json_at(file, 0, text, what)
}

/// One line of a file that holds a JSON value a line; lines count from 1. `what` says what the value should be.
///
/// # Errors
/// As [`from_json`].
pub fn from_json_line<T: DeserializeOwned>(
    file: &Path,
    line: usize,
    text: &str,
    what: &str,
) -> Result<T, InputError> {
    json_at(file, line.saturating_sub(1), text, what)
}

/// A JSON value before which the file has so many lines.
fn json_at<T: DeserializeOwned>(
    file: &Path,
    lines_before: usize,
    text: &str,
    what: &str,
) -> Result<T, InputError> {
    serde_json::from_str(text).map_err(|e| {
        let said = e.to_string();
        // The library's own line is that of the file only where the file is one value.
        let place = format!(" at line {} column {}", e.line(), e.column());
        let reason = said.strip_suffix(&place).unwrap_or(&said);
        let message = format!("not {what}: {reason} (column {})", e.column());
        InputError::at_line(file, lines_before + e.line(), message)
    })
}

/// A TOML file.
///
/// # Errors
/// [`InputError`] naming the file, the line where there is one, and the key that is wrong.
pub fn from_toml<T: DeserializeOwned>(file: &Path, text: &str) -> Result<T, InputError> {
    toml::from_str(text).map_err(|e| {
        let Some(span) = e.span() else {
            return InputError::in_file(file, e.message());
        };
        let message = match toml_places::key_at(text, span.start) {
            // A message about a key that does not belong names it.
            Some(key) if !e.message().starts_with("unknown field") => format!("{key}: {}", e.message()),
            _ => e.message().to_owned(),
        };
        InputError::at_line(file, line_at(text.as_bytes(), span.start), message)
    })
}

fn at_most(file: &Path, most: u64) -> Result<Vec<u8>, InputError> {
    let cannot = |e| InputError::in_file(file, format!("cannot be read: {e}"));
    let opened = File::open(file).map_err(cannot)?;
    let length = opened.metadata().map_err(cannot)?.len();
    let mut bytes = Vec::new();
    // What has no length of its own, a pipe for one, ends at the limit as well.
    if length <= most {
        opened.take(most + 1).read_to_end(&mut bytes).map_err(cannot)?;
    }
    if length.max(bytes.len() as u64) > most {
        return Err(InputError::in_file(
            file,
            format!("has more than {most} bytes, the most that is read"),
        ));
    }
    Ok(bytes)
}

fn as_text(file: &Path, bytes: Vec<u8>) -> Result<String, InputError> {
    String::from_utf8(bytes).map_err(|e| {
        let line = line_at(e.as_bytes(), e.utf8_error().valid_up_to());
        InputError::at_line(file, line, format!("is not text: {}", e.utf8_error()))
    })
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const SMALL: Limit = Limit {
        bytes: 100,
        packed_bytes: 60,
        line_bytes: 10,
    };

    fn packed(text: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(text).expect("in memory");
        encoder.finish().expect("in memory")
    }

    fn in_file<R>(name: &str, bytes: &[u8], read: impl Fn(&Path) -> R) -> R {
        let folder = tempfile::tempdir().expect("a directory");
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).expect("written");
        read(&file)
    }

    #[test]
    fn a_file_is_read_up_to_its_limit_and_refused_beyond() {
        let read = |length: usize| in_file("a.txt", &vec![b'x'; length], |file| read_text(file, &SMALL));
        assert_eq!(read(100).expect("as long as it may be").len(), 100);
        let error = read(101).expect_err("too long").to_string();
        assert!(error.contains("a.txt: has more than 100 bytes"), "{error}");
    }

    /// A pipe or a device tells no length.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_without_end_is_refused() {
        let error = read_bytes(Path::new("/dev/zero"), &SMALL)
            .expect_err("endless")
            .to_string();
        assert_eq!(error, "/dev/zero: has more than 100 bytes, the most that is read");
    }

    #[test]
    fn a_compressed_file_has_two_limits() {
        let read = |bytes: &[u8]| in_file("a.gz", bytes, |file| read_text(file, &SMALL));
        assert_eq!(
            read(&packed(&[b'x'; 100])).expect("as long as it may be").len(),
            100
        );
        let twice = [packed(b"one"), packed(b"two")].concat();
        assert_eq!(read(&twice).expect("two members"), "onetwo");
        let error = |bytes: &[u8]| read(bytes).expect_err("refused").to_string();
        let bomb = packed(&vec![0; 10_000]);
        assert!(bomb.len() < 60, "{}", bomb.len());
        assert!(error(&bomb).contains("a.gz: unpacks to more than 100 bytes"));
        assert!(error(&[0; 61]).contains("a.gz: has more than 60 bytes"));
        assert!(error(b"plain").contains("not gzipped"));
        assert!(error(&packed(b"cut")[..15]).contains("not gzipped"));
    }

    #[test]
    fn a_long_line_and_one_that_is_no_text_are_named() {
        let text = "0123456789\n0123456789a\n";
        let read: Vec<_> = lines(Path::new("a.txt"), text, &SMALL).collect();
        assert_eq!(read[0], Ok((1, "0123456789")));
        let error = read[1].clone().expect_err("too long").to_string();
        assert_eq!(error, "a.txt:2: has 11 bytes, expected a line of at most 10");
        let error = in_file("a.txt", b"one\ntw\xff", |file| read_text(file, &SMALL));
        assert!(
            error
                .expect_err("no text")
                .to_string()
                .contains("a.txt:2: is not text")
        );
    }

    #[test]
    fn a_length_that_is_not_the_expected_one_is_told() {
        let read = |expected| in_file("a.bin", &[0; 5], |file| read_exactly(file, expected, "as I say"));
        assert_eq!(read(5).expect("five").len(), 5);
        let error = |expected| read(expected).expect_err("another").to_string();
        assert!(error(6).contains("a.bin: is cut short: 5 bytes, expected 6 as I say"));
        assert!(error(4).contains("a.bin: is too long: 5 bytes, expected 4 as I say"));
    }

    #[test]
    fn values_that_do_not_parse_name_line_and_key() {
        #[derive(Debug, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct One {
            #[expect(dead_code, reason = "only its name and type matter")]
            a: u8,
        }
        let file = Path::new("f");
        let toml = from_toml::<One>(file, "a = 1\n\nbee = 2\n")
            .expect_err("unknown")
            .to_string();
        assert!(toml.starts_with("f:3: unknown field `bee`"), "{toml}");
        let toml = from_toml::<One>(file, "\na = \"b\"\n")
            .expect_err("no number")
            .to_string();
        assert!(toml.starts_with("f:2: a: invalid type: string \"b\""), "{toml}");
        let json = from_json::<One>(file, "{\n\"bee\": 1}", "a thing")
            .expect_err("unknown")
            .to_string();
        assert!(
            json.starts_with("f:2: not a thing: unknown field `bee`"),
            "{json}"
        );
        let line = from_json_line::<One>(file, 7, "{\"a\": 999}", "a thing").expect_err("too large");
        assert_eq!(
            line.to_string(),
            "f:7: not a thing: invalid value: integer `999`, expected u8 (column 9)"
        );
    }
}
