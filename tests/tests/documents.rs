//! What sources and documents point to is there: pages, sections, files. Tables that are made from committed measurements are those of
//! the measurements; `CSLAM_WRITE_TABLES=1 cargo test -p cslam-tests --test documents` makes them anew.

use std::collections::BTreeSet;
use std::{env, fs};

use cslam_tests::{files, root, tables};

/// Headings of a page.
fn sections(page: &str) -> BTreeSet<String> {
    page.lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| line.trim_start_matches('#').trim().to_owned())
        .collect()
}

/// The anchor that a renderer gives a heading.
fn anchor(heading: &str) -> String {
    heading
        .to_lowercase()
        .chars()
        .filter_map(|c| match c {
            ' ' => Some('-'),
            c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
            _ => None,
        })
        .collect()
}

/// Comments run over lines: one text, without the marks.
fn unwrapped(source: &str) -> String {
    let mut text = String::new();
    for line in source.lines() {
        let line = line.trim();
        let line = ["//!", "///", "//"]
            .iter()
            .find_map(|mark| line.strip_prefix(mark))
            .unwrap_or(line);
        text.push_str(line.trim());
        text.push(' ');
    }
    text
}

/// Pages that a source names as `docs/PAGE.md`, each with the section that follows in quotes, if any.
fn pointers(source: &str) -> Vec<(String, Option<String>)> {
    let text = unwrapped(source);
    text.match_indices("docs/")
        .filter_map(|(at, _)| {
            let rest = &text[at + "docs/".len()..];
            let (page, rest) = rest.split_once(".md")?;
            let is_name = !page.is_empty() && page.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
            let section = rest
                .strip_prefix(", \"")
                .and_then(|rest| rest.split_once('"'))
                .map(|(section, _)| section.to_owned());
            is_name.then(|| (format!("{page}.md"), section))
        })
        .collect()
}

#[test]
fn sources_point_to_pages_and_sections_that_exist() {
    let mut sources = Vec::new();
    for folder in ["core", "firmware", "checks", "channel", "host-sim", "tests"] {
        sources.extend(files(&root().join(folder), &[".rs", ".toml"]));
    }
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for source in &sources {
        // This file holds made-up names.
        if source.ends_with("tests/tests/documents.rs") {
            continue;
        }
        let text = fs::read_to_string(source).expect("a source");
        for (page, section) in pointers(&text) {
            seen += 1;
            match fs::read_to_string(root().join("docs").join(&page)) {
                Err(_) => wrong.push(format!("{}: docs/{page} is not there", source.display())),
                Ok(content) => {
                    if let Some(section) = section.filter(|section| !sections(&content).contains(section)) {
                        wrong.push(format!(
                            "{}: docs/{page} has no section \"{section}\"",
                            source.display()
                        ));
                    }
                }
            }
        }
    }
    assert!(seen > 50, "only {seen} pointers were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn links_of_documents_lead_somewhere() {
    let pages = files(root(), &[".md"]);
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for page in &pages {
        let text = fs::read_to_string(page).expect("a page");
        for (at, _) in text.match_indices("](") {
            let Some((target, _)) = text[at + 2..].split_once(')') else {
                continue;
            };
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            seen += 1;
            let (file, fragment) = target.split_once('#').unwrap_or((target, ""));
            let path = if file.is_empty() {
                page.clone()
            } else {
                page.parent().expect("a folder").join(file)
            };
            if !path.exists() {
                wrong.push(format!("{}: {target} is not there", page.display()));
            } else if page.starts_with(root().join("docs")) && target.starts_with("..") {
                wrong.push(format!("{}: {target} is no part of the book", page.display()));
            } else if !fragment.is_empty() && file.ends_with(".md") | file.is_empty() {
                let content = fs::read_to_string(&path).expect("a page");
                if !sections(&content)
                    .iter()
                    .any(|heading| anchor(heading) == fragment)
                {
                    wrong.push(format!("{}: {target} has no such heading", page.display()));
                }
            }
        }
    }
    assert!(seen > 50, "only {seen} links were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Files and folders of the project that a page names between backticks: `core/src/map`.
fn named_sources(page: &str) -> Vec<&str> {
    const CRATES: [&str; 8] = [
        "core/",
        "firmware/",
        "checks/",
        "channel/",
        "host-sim/",
        "tests/",
        "capi/",
        "python/",
    ];
    let spans = page.split('`').skip(1).step_by(2);
    let paths = spans.filter(|span| CRATES.iter().any(|folder| span.starts_with(folder)));
    paths
        .filter(|span| !span.contains(|c: char| c.is_whitespace() || "*{<,".contains(c)))
        .collect()
}

#[test]
fn sources_that_pages_name_are_there() {
    let pages = files(root(), &[".md"]);
    let mut missing = Vec::new();
    let mut count = 0;
    for page in pages.iter().filter(|page| !page.ends_with("CHANGELOG.md")) {
        let text = fs::read_to_string(page).expect("a page");
        for source in named_sources(&text) {
            count += 1;
            if !root().join(source).exists() {
                missing.push(format!("{}: {source}", page.display()));
            }
        }
    }
    assert!(count > 50, "{count} named");
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn every_page_is_in_the_book() {
    let docs = root().join("docs");
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).expect("the book's contents");
    let pages = files(&docs, &[".md"]);
    assert!(pages.len() > 20, "{} pages", pages.len());
    for page in pages {
        let name = page.strip_prefix(&docs).expect("a page of the book").display();
        let times = summary.matches(&format!("]({name})")).count();
        let wanted = usize::from(name.to_string() != "SUMMARY.md");
        assert_eq!(times, wanted, "docs/{name} in docs/SUMMARY.md");
    }
}

#[test]
fn tables_are_those_of_the_committed_measurements() {
    let pages = files(&root().join("docs"), &[".md"]);
    let (mut stale, mut marked) = (Vec::new(), 0);
    for page in &pages {
        let text = fs::read_to_string(page).expect("a page");
        let made = tables::refreshed(&text, |file| fs::read_to_string(root().join(file)).ok())
            .unwrap_or_else(|error| panic!("{}: {error}", page.display()));
        marked += text.matches("<!-- end -->").count();
        if made != text {
            if env::var_os("CSLAM_WRITE_TABLES").is_some() {
                fs::write(page, &made).expect("writable");
            } else {
                stale.push(page.display().to_string());
            }
        }
    }
    assert!(marked >= 8, "only {marked} tables were found");
    assert!(
        stale.is_empty(),
        "not what the measurements give: {stale:?}; CSLAM_WRITE_TABLES=1 cargo test -p cslam-tests --test documents"
    );
}

#[test]
fn a_pointer_may_run_over_lines() {
    let source = "//! as it says (docs/some-page.md, \"The\n//! model\"), and docs/other.md.";
    assert_eq!(
        pointers(source),
        [
            ("some-page.md".to_owned(), Some("The model".to_owned())),
            ("other.md".to_owned(), None)
        ]
    );
    assert_eq!(anchor("Where points are lost"), "where-points-are-lost");
}
