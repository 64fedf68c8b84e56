//! Key files: the secret of one UAV's link.
//!
//! ```text
//! cslam-link-key 1
//! uav 7
//! key 64 hexadecimal digits
//! ```
//! Whoever reads the file can speak for the UAV and to it. So it is made for its owner's eyes only, a file that others may read
//! is refused, and no message ever shows what is in it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::Path;

use cslam_core::telemetry::Key;

use crate::input::limits::KEY;
use crate::input::{InputError, read_text};

/// First line of a key file.
const FIRST_LINE: &str = "cslam-link-key 1";

/// A key and the UAV that it belongs to.
#[derive(Clone, Debug)]
pub struct LinkKey {
    /// Number of the UAV.
    pub uav: u8,
    /// The secret.
    pub key: Key,
}

/// Makes a new file with a key from the operating system's random numbers, readable by its owner only.
///
/// # Errors
/// [`InputError`] when the file exists already or cannot be written, or when there are no random numbers.
pub fn create(file: &Path, uav: u8) -> Result<LinkKey, InputError> {
    let mut bytes = [0; Key::LENGTH];
    getrandom::fill(&mut bytes)
        .map_err(|e| InputError::new(format!("the operating system gives no random numbers: {e}")))?;
    let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let cannot = |e: io::Error| match e.kind() {
        io::ErrorKind::AlreadyExists => {
            InputError::in_file(file, "is there already; a key is not overwritten")
        }
        _ => InputError::unwritable(file, "cannot be written", &e),
    };
    let mut new = private(file).map_err(cannot)?;
    write!(new, "{FIRST_LINE}\nuav {uav}\nkey {digits}\n").map_err(cannot)?;
    new.sync_all().map_err(cannot)?;
    Ok(LinkKey {
        uav,
        key: Key::new(bytes),
    })
}

/// Reads a key file.
///
/// # Errors
/// [`InputError`] naming the line, never its content; also when others than the owner may read the file.
pub fn read(file: &Path) -> Result<LinkKey, InputError> {
    let (uav, bytes) = read_bytes(file)?;
    Ok(LinkKey {
        uav,
        key: Key::new(bytes),
    })
}

/// Reads a key file for the one place that the bytes themselves are for, the settings of a UAV.
pub(crate) fn read_bytes(file: &Path) -> Result<(u8, [u8; Key::LENGTH]), InputError> {
    check_private(file)?;
    let text = read_text(file, &KEY)?;
    let mut lines = text.lines();
    let mut value = |number: usize, name: &str, what: &str| {
        let line = lines.next().and_then(|line| line.strip_prefix(name));
        line.map(str::trim)
            .ok_or_else(|| InputError::at_line(file, number, format!("expected `{name}{what}`")))
    };
    if !value(1, FIRST_LINE, "")?.is_empty() {
        return Err(InputError::at_line(file, 1, format!("expected `{FIRST_LINE}`")));
    }
    let uav = value(2, "uav ", "NUMBER")?
        .parse()
        .map_err(|_| InputError::at_line(file, 2, "the number of a UAV is 0 to 255"))?;
    let key = decode(value(3, "key ", "DIGITS")?)
        .ok_or_else(|| InputError::at_line(file, 3, "a key has 64 hexadecimal digits"))?;
    if lines.any(|line| !line.trim().is_empty()) {
        return Err(InputError::at_line(file, 4, "nothing follows the key"));
    }
    if Key::new(key).is_test() {
        return Err(InputError::at_line(
            file,
            3,
            "this key is published: it proves nothing",
        ));
    }
    Ok((uav, key))
}

fn decode(digits: &str) -> Option<[u8; Key::LENGTH]> {
    let mut bytes = [0; Key::LENGTH];
    if digits.len() != 2 * bytes.len() || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    for (index, byte) in bytes.iter_mut().enumerate() {
        *byte = u8::from_str_radix(digits.get(2 * index..2 * index + 2)?, 16).ok()?;
    }
    Some(bytes)
}

/// A new file that only its owner may read and write.
pub(crate) fn private(file: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(file)
}

/// Refuses a file that others may read. Only Unix says who may.
fn check_private(file: &Path) -> Result<(), InputError> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = fs::metadata(file).map_or(0, |metadata| metadata.permissions().mode());
        if mode & 0o077 != 0 {
            return Err(InputError::in_file(
                file,
                format!(
                    "others may read this key (mode {:03o}); expected mode 600: chmod 600 {}",
                    mode & 0o777,
                    file.display()
                ),
            ));
        }
    }
    let _ = file;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_key_returns_and_is_never_the_same() {
        let directory = tempfile::tempdir().expect("a directory");
        let (a, b) = (directory.path().join("a.key"), directory.path().join("b.key"));
        create(&a, 7).expect("a new file");
        create(&b, 255).expect("a new file");
        let (first, second) = (read(&a).expect("sound"), read(&b).expect("sound"));
        assert_eq!((first.uav, second.uav), (7, 255));
        assert_ne!(first.key.fingerprint(), second.key.fingerprint());
        let text = fs::read_to_string(&a).expect("text");
        assert_eq!(
            create(&a, 7)
                .map(|k| k.uav)
                .map_err(|e| e.to_string().contains("not overwritten")),
            Err(true)
        );
        assert_eq!(fs::read_to_string(&a).expect("text"), text);
    }

    #[cfg(unix)]
    #[test]
    fn only_the_owner_may_read_it() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("uav.key");
        create(&file, 1).expect("a new file");
        let mode = fs::metadata(&file).expect("there").permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).expect("ours");
        let error = read(&file).expect_err("others may read it").to_string();
        assert!(
            error.contains("mode 640") && error.contains("chmod 600"),
            "{error}"
        );
    }

    #[test]
    fn errors_name_the_line_and_never_the_key() {
        let directory = tempfile::tempdir().expect("a directory");
        let digits = "c0ffee00".repeat(8);
        let key = format!("key {digits}");
        let test = "5055424c49534845442054455354204b45592c204e4f54204120534543524554";
        for (text, expected) in [
            (String::new(), ":1: expected `cslam-link-key 1`"),
            (
                format!("cslam-link-key 12\nuav 1\n{key}\n"),
                ":1: expected `cslam-link-key 1`",
            ),
            (format!("cslam-link-key 1\n{key}\n"), ":2: expected `uav NUMBER`"),
            (
                format!("cslam-link-key 1\nuav 256\n{key}\n"),
                ":2: the number of a UAV is 0 to 255",
            ),
            (
                format!("cslam-link-key 1\nuav 1\n{digits}\n"),
                ":3: expected `key DIGITS`",
            ),
            (format!("cslam-link-key 1\nuav 1\n{key}0\n"), ":3: a key has 64"),
            (
                format!("cslam-link-key 1\nuav 1\nkey +{}\n", &digits[1..]),
                ":3: a key has 64",
            ),
            (
                format!("cslam-link-key 1\nuav 1\n{key}\n{key}\n"),
                ":4: nothing follows",
            ),
            (
                format!("cslam-link-key 1\nuav 1\nkey {test}\n"),
                ":3: this key is published",
            ),
        ] {
            let file = directory.path().join("bad.key");
            let _ = fs::remove_file(&file);
            private(&file)
                .expect("a new file")
                .write_all(text.as_bytes())
                .expect("written");
            let error = read(&file).expect_err("not a key file").to_string();
            assert!(error.contains(expected), "{error} instead of {expected}");
            assert!(
                !error.contains("c0ffee") && !error.contains("5055424c"),
                "{error}"
            );
        }
    }
}
