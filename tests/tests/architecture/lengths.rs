//! A file holds one idea: what is over the bound says in its head why it is long.

use std::fs;
use std::path::Path;

use cslam_tests::{files, root};

/// Lines that a file may have without a reason.
const MOST_LINES: usize = 400;

/// Whether a file is short enough, or the comment at its head has a sentence that begins with `Long:`.
fn is_in_shape(text: &str) -> bool {
    let head = text.lines().take_while(|line| line.starts_with("//!"));
    let head: Vec<&str> = head.map(|line| line.trim_start_matches("//!").trim()).collect();
    let head = head.join(" ");
    let reason = |(at, _)| {
        let before = head[..at].trim_end();
        before.is_empty() || before.ends_with(['.', ':'])
    };
    text.lines().count() <= MOST_LINES || head.match_indices("Long: ").any(reason)
}

#[test]
fn long_files_say_why() {
    let files = files(root(), &[".rs"]);
    assert!(files.len() > 500, "{} files", files.len());
    let name = |file: &Path| file.strip_prefix(root()).expect("below").display().to_string();
    let long: Vec<String> = files
        .iter()
        .filter(|file| !is_in_shape(&fs::read_to_string(file).expect("a text")))
        .map(|file| name(file))
        .collect();
    assert!(
        long.is_empty(),
        "over {MOST_LINES} lines without a sentence `Long: ...` in the head: {long:?}"
    );
}

#[test]
fn a_reason_is_a_sentence_of_the_head() {
    let file = |head: &str, lines: usize| format!("{head}\n{}", "fn f() {}\n".repeat(lines));
    assert!(is_in_shape(&file("//! A short one.", MOST_LINES - 1)));
    assert!(!is_in_shape(&file("//! A long one.", MOST_LINES)));
    assert!(is_in_shape(&file(
        "//! One table.\n//! Long: it is one table.",
        MOST_LINES
    )));
    assert!(is_in_shape(&file("//! Long: it is one table.", MOST_LINES)));
    // Elsewhere it is no reason.
    assert!(!is_in_shape(&file("//! Not a Long: word.", MOST_LINES)));
    assert!(!is_in_shape(&file(
        "//! A long one.\n\n/// Long: not of the head.",
        MOST_LINES
    )));
}
