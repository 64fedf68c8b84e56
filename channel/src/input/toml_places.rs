//! Where in the text of a TOML file a key stands. Keys are written with dots, places in a list in brackets: `a.b[2].c`.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::line::line_at;

/// Number of the line in which the value of a key begins, from 1; `None` when the text has no such key.
pub(super) fn line_of(text: &str, key: &str) -> Option<usize> {
    let mut found = None;
    each(text, &mut |path, key_at, _| {
        if path == key {
            found = Some(line_at(text.as_bytes(), key_at.start));
        }
    });
    found
}

/// The innermost key whose name or value holds a byte.
pub(super) fn key_at(text: &str, byte: usize) -> Option<String> {
    let mut found = None;
    // Outer keys are seen before those in them.
    each(text, &mut |path, key_at, value_at| {
        if key_at.contains(&byte) || value_at.contains(&byte) {
            found = Some(path.to_owned());
        }
    });
    found
}

/// Calls `see` with every key of a text, and where its name and its value stand. A text that is no TOML has none.
fn each(text: &str, see: &mut impl FnMut(&str, Range<usize>, Range<usize>)) {
    if let Ok(document) = DeTable::parse(text) {
        in_table(document.get_ref(), "", see);
    }
}

fn in_table(table: &DeTable<'_>, path: &str, see: &mut impl FnMut(&str, Range<usize>, Range<usize>)) {
    for (key, value) in table {
        let name = key.get_ref();
        let path = if path.is_empty() {
            name.to_string()
        } else {
            format!("{path}.{name}")
        };
        see(&path, key.span(), value.span());
        in_value(value, &path, see);
    }
}

fn in_value(
    value: &Spanned<DeValue<'_>>,
    path: &str,
    see: &mut impl FnMut(&str, Range<usize>, Range<usize>),
) {
    match value.get_ref() {
        DeValue::Table(table) => in_table(table, path, see),
        DeValue::Array(values) => {
            for (number, value) in values.iter().enumerate() {
                let path = format!("{path}[{number}]");
                see(&path, value.span(), value.span());
                in_value(value, &path, see);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "a.b = 1\n[c]\nd = [1,\n 2]\n\n[[c.e]]\nf = 0\n[[c.e]]\nf = 3\n";

    #[test]
    fn keys_are_found_in_tables_and_lists() {
        let lines = [
            ("a.b", 1),
            ("c.d", 3),
            ("c.d[1]", 4),
            ("c.e[0].f", 7),
            ("c.e[1].f", 9),
        ];
        for (key, line) in lines {
            assert_eq!(line_of(TEXT, key), Some(line), "{key}");
        }
        assert_eq!(line_of(TEXT, "c.f"), None);
        assert_eq!(line_of("no TOML", "no"), None);
    }

    #[test]
    fn a_place_has_its_innermost_key() {
        let at = |part: &str| key_at(TEXT, TEXT.rfind(part).expect("in the text"));
        assert_eq!(at("3").as_deref(), Some("c.e[1].f"));
        assert_eq!(at("2").as_deref(), Some("c.d[1]"));
        assert_eq!(at("1\n").as_deref(), Some("a.b"));
        assert_eq!(key_at("\n", 0), None);
    }
}
