//! One word, one meaning: words that were given up stand nowhere any more.

use std::fs;

use cslam_tests::{files, root};

/// A word that was given up, and what it is now. The paper's abbreviations in capitals are names of its methods and stay.
const GIVEN_UP: [(&str, &str); 12] = [
    ("ltd", "paths, path estimation"),
    ("Ltd", "Path"),
    ("lscn", "link_state"),
    ("Lscn", "LinkState"),
    ("bsm", "beam_squint"),
    ("Bsm", "BeamSquint"),
    ("supposed", "tentative"),
    ("hpc", "baseline"),
    ("Hpc", "Baseline"),
    ("proven", "self_consistent"),
    ("misfit", "chi2"),
    ("Levelled", "Scaled"),
];

/// What stays: the ending of a model file, the codebooks' names in recordings, the equations' in the paper.
const KEPT: [&str; 4] = [".lscn", "bsm-seq", "bsm-raster", "(bsm)"];

/// The words of a line: identifiers in snake case and camel case are taken apart.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    for c in line.chars() {
        let ends_a_word = words
            .last()
            .is_some_and(|word| word.ends_with(char::is_lowercase));
        if !c.is_alphanumeric() || c.is_uppercase() && ends_a_word {
            words.push(String::new());
        }
        if c.is_alphanumeric() {
            words.last_mut().expect("one at least").push(c);
        }
    }
    words
}

#[test]
fn words_that_were_given_up_stand_nowhere() {
    let mut files = files(root(), &[".rs", ".md", ".toml", ".py", ".sh"]);
    // The history tells of the words, and so does this file.
    files.retain(|file| {
        !["CHANGELOG.md", "names.rs"]
            .iter()
            .any(|name| file.ends_with(name))
    });
    assert!(files.len() > 500, "{} files", files.len());
    let mut found = Vec::new();
    for file in files {
        let text = fs::read_to_string(&file).expect("a text");
        for (number, line) in text.lines().enumerate() {
            let rest = KEPT
                .iter()
                .fold(line.to_owned(), |rest, kept| rest.replace(kept, ""));
            let words = words(&rest);
            for (word, now) in GIVEN_UP
                .iter()
                .filter(|(word, _)| words.iter().any(|met| met == word))
            {
                found.push(format!(
                    "{}:{}: `{word}` is now {now}",
                    file.display(),
                    number + 1
                ));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn identifiers_are_taken_apart() {
    let met = words("let BsmConfig = ltd_cost(LTD);")
        .into_iter()
        .filter(|word| !word.is_empty());
    assert_eq!(
        met.collect::<Vec<_>>(),
        ["let", "Bsm", "Config", "ltd", "cost", "LTD"]
    );
}
