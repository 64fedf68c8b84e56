//! Directories of results: one holds the files of one run and no others.
//!
//! A run writes into a directory of its own beside the one that it was asked for, and takes that one's place when it is whole. So
//! a run that is killed leaves what was there, and no file of an older result survives beside those of a newer one. What is not
//! ours is never touched: a directory that holds anything else is refused before any work is done.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::input::InputError;

/// A kind of result, and how it is known again.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// What it is, in messages: "flight".
    pub what: &'static str,
    /// The file that describes a result of this kind; a directory without it holds none.
    pub description: &'static str,
    /// Whether a text is such a description.
    pub describes: fn(&str) -> bool,
    /// Whether a run of this kind writes files of this name.
    pub writes: fn(&str) -> bool,
}

/// A directory that is being filled. What was written is gone unless it is [committed](Self::commit).
#[derive(Debug)]
pub struct ResultDirectory {
    kind: Kind,
    target: PathBuf,
    part: PathBuf,
    made_target: bool,
}

impl ResultDirectory {
    /// Makes room for a result that is to be at `target`, which is made when it is missing.
    ///
    /// # Errors
    /// [`InputError`] naming the directory: it cannot be made, it is the current one, or it holds something else than one older
    /// result of this kind; then one such file is named.
    pub fn open(target: &Path, kind: Kind) -> Result<Self, InputError> {
        let cannot = |e: std::io::Error| InputError::unwritable(target, "cannot be made a directory", &e);
        let made_target = !target.exists();
        fs::create_dir_all(target).map_err(cannot)?;
        let whole = fs::canonicalize(target).map_err(cannot)?;
        let unfit = |message: String| Err(InputError::in_file(target, message));
        // It is replaced as a whole, and nobody should sit in what is gone.
        let here = std::env::current_dir().and_then(fs::canonicalize);
        if here.is_ok_and(|here| here.starts_with(&whole)) {
            return unfit("is the directory you are in, expected one for the results alone".to_owned());
        }
        if let Err(message) = is_free(&whole, kind) {
            return unfit(message);
        }
        let part = beside(&whole, "part");
        fs::create_dir(&part).map_err(|e| InputError::unwritable(&part, "cannot be made a directory", &e))?;
        Ok(Self {
            kind,
            target: whole,
            part,
            made_target,
        })
    }

    /// Where to write until the result is whole.
    pub fn path(&self) -> &Path {
        &self.part
    }

    /// Puts the result in its place, instead of the older one if there is one.
    ///
    /// # Errors
    /// When something else came into the directory meanwhile or a directory cannot be renamed. The result is kept, and the error
    /// says where.
    pub fn commit(mut self) -> anyhow::Result<()> {
        let kept = std::mem::take(&mut self.part);
        replace(&kept, &self.target, self.kind)
            .with_context(|| format!("the result was left in {}", kept.display()))
    }
}

impl Drop for ResultDirectory {
    fn drop(&mut self) {
        if self.part.as_os_str().is_empty() {
            return;
        }
        // Nobody is left to tell; what stays has a name that says what it is.
        let _gone = fs::remove_dir_all(&self.part);
        if self.made_target {
            let _unless_used = fs::remove_dir(&self.target);
        }
    }
}

/// Renames a whole result into its place. Between the two renames of a replacement both results are whole under other names.
fn replace(whole: &Path, target: &Path, kind: Kind) -> anyhow::Result<()> {
    is_free(target, kind).map_err(|message| InputError::in_file(target, message))?;
    let old = beside(target, "old");
    fs::rename(target, &old).with_context(|| format!("{} cannot be renamed", target.display()))?;
    if let Err(error) = fs::rename(whole, target) {
        let _back = fs::rename(&old, target);
        return Err(error).with_context(|| format!("{} cannot be renamed", whole.display()));
    }
    fs::remove_dir_all(&old).with_context(|| format!("{} cannot be removed", old.display()))
}

/// A name beside a directory that no other run takes.
fn beside(directory: &Path, what: &str) -> PathBuf {
    let mut name = directory.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{what}-{}", std::process::id()));
    directory.with_file_name(name)
}

/// Whether a directory is empty or holds one result of a kind and nothing else; if not, why, with the name of a file.
fn is_free(directory: &Path, kind: Kind) -> Result<(), String> {
    let entries = fs::read_dir(directory).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut entries = entries.map_err(|e| format!("cannot be read: {e}"))?;
    entries.sort_by_key(fs::DirEntry::file_name);
    let foreign = entries.iter().find(|entry| {
        let name = entry.file_name();
        let ours = name.to_str().is_some_and(kind.writes);
        !ours || !entry.file_type().is_ok_and(|t| t.is_file())
    });
    let what = kind.what;
    if let Some(foreign) = foreign {
        return Err(format!(
            "holds {}, which is no file of a {what}: expected a new or empty directory, or one with an older {what} alone",
            foreign.path().file_name().unwrap_or_default().display()
        ));
    }
    let Some(first) = entries.first() else {
        return Ok(());
    };
    let description = fs::read_to_string(directory.join(kind.description));
    if description.is_ok_and(|text| (kind.describes)(&text)) {
        return Ok(());
    }
    Err(format!(
        "holds {} and no {} of a {what}: expected a new or empty directory, or one with an older {what} alone",
        first.file_name().display(),
        kind.description
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: Kind = Kind {
        what: "test",
        description: "about.txt",
        describes: |text| text.starts_with("a test"),
        writes: |name| name == "about.txt" || name.starts_with("shard-"),
    };

    fn put(directory: &Path, files: &[(&str, &str)]) {
        fs::create_dir_all(directory).expect("writable");
        for (name, text) in files {
            fs::write(directory.join(name), text).expect("writable");
        }
    }

    fn names(directory: &Path) -> Vec<String> {
        let entries = fs::read_dir(directory).expect("a directory");
        let mut names: Vec<String> = entries
            .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_result_takes_the_place_of_an_older_one_whole() {
        let directory = tempfile::tempdir().expect("a directory");
        let out = directory.path().join("a/out");
        for (files, expected) in [
            (
                &["about.txt", "shard-0", "shard-1"][..],
                &["about.txt", "shard-0", "shard-1"][..],
            ),
            (&["about.txt", "shard-2"], &["about.txt", "shard-2"]),
        ] {
            let result = ResultDirectory::open(&out, KIND).expect("free");
            files
                .iter()
                .for_each(|file| put(result.path(), &[(file, "a test")]));
            result.commit().expect("free");
            assert_eq!(names(&out), expected);
            assert_eq!(names(&directory.path().join("a")), ["out"]);
        }
    }

    #[test]
    fn a_run_that_fails_leaves_what_was_there() {
        let directory = tempfile::tempdir().expect("a directory");
        let out = directory.path().join("out");
        let result = ResultDirectory::open(&out, KIND).expect("free");
        put(result.path(), &[("shard-0", "")]);
        drop(result);
        assert!(
            names(directory.path()).is_empty(),
            "{:?}",
            names(directory.path())
        );
        put(&out, &[("about.txt", "a test"), ("shard-7", "")]);
        let result = ResultDirectory::open(&out, KIND).expect("an older one");
        put(result.path(), &[("about.txt", "a test")]);
        drop(result);
        assert_eq!(names(directory.path()), ["out"]);
        assert_eq!(names(&out), ["about.txt", "shard-7"]);
    }

    #[test]
    fn what_is_not_ours_is_never_touched() {
        let directory = tempfile::tempdir().expect("a directory");
        let own = [("about.txt", "a test"), ("shard-7", "")];
        for (more, expected) in [
            (
                &[("notes.txt", "mine")][..],
                "holds notes.txt, which is no file of a test",
            ),
            (
                &[("about.txt", "a novel")],
                "holds about.txt and no about.txt of a test",
            ),
        ] {
            let out = directory.path().join("out");
            put(&out, &own);
            put(&out, more);
            let error = ResultDirectory::open(&out, KIND)
                .expect_err("foreign")
                .to_string();
            assert!(error.contains(expected), "{error}");
            assert_eq!(names(directory.path()), ["out"]);
            assert!(names(&out).contains(&"shard-7".to_owned()));
            fs::remove_dir_all(&out).expect("there");
        }
        // A directory of that name is no file of ours.
        fs::create_dir_all(directory.path().join("out/shard-1")).expect("writable");
        assert!(ResultDirectory::open(&directory.path().join("out"), KIND).is_err());
    }

    #[test]
    fn a_file_that_came_meanwhile_stays_and_so_does_the_result() {
        let directory = tempfile::tempdir().expect("a directory");
        let out = directory.path().join("out");
        let result = ResultDirectory::open(&out, KIND).expect("free");
        put(result.path(), &[("about.txt", "a test")]);
        let kept = result.path().to_owned();
        put(&out, &[("notes.txt", "mine")]);
        let error = format!("{:#}", result.commit().expect_err("foreign"));
        assert!(
            error.contains("holds notes.txt") && error.contains(&kept.display().to_string()),
            "{error}"
        );
        assert_eq!(
            (names(&out), names(&kept)),
            (vec!["notes.txt".to_owned()], vec!["about.txt".to_owned()])
        );
    }
}
