//! Tables of the documents that are made from committed measurements.
//!
//! A page says where a table comes from, and everything up to the end mark is made from that file:
//! ```text
//! <!-- from: tests/golden/receiver_cost.txt; only: bytes; unit: bytes -->
//! <!-- end -->
//! ```
//! A file of counts (`name: number`) becomes a table: `only` takes the names that begin so, `unit` says what is counted ("million ..." divides).
//! Where a name is `row, column` and a column has several rows, there is one line a row. Any other file is shown as it is;
//! `where: COLUMN = VALUE` takes those of its lines that have this value there.

use std::fmt::Write;

const BEGIN: &str = "<!-- from: ";
const END: &str = "<!-- end -->";

/// The page with every marked table made anew. `read` gives the text of a file, by its path from the workspace's root.
///
/// # Errors
/// A mark that cannot be read, has no end, or names a file or a choice that gives nothing.
pub fn refreshed(page: &str, read: impl Fn(&str) -> Option<String>) -> Result<String, String> {
    let mut made = String::new();
    let mut rest = page;
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let (mark, after) = after.split_once(" -->\n").ok_or("a mark does not end")?;
        let (_, after) = after
            .split_once(END)
            .ok_or_else(|| format!("`{mark}` has no end"))?;
        let source = Source::parse(mark)?;
        let text = read(source.file).ok_or_else(|| format!("{} cannot be read", source.file))?;
        let table = source.table(&text);
        if table.is_empty() {
            return Err(format!("`{mark}` gives nothing"));
        }
        let _infallible = write!(made, "{before}{BEGIN}{mark} -->\n{table}{END}");
        rest = after;
    }
    Ok(made + rest)
}

/// What a mark says.
struct Source<'a> {
    file: &'a str,
    only: Option<&'a str>,
    unit: &'a str,
    having: Option<(&'a str, &'a str)>,
}

impl<'a> Source<'a> {
    fn parse(mark: &'a str) -> Result<Self, String> {
        let mut parts = mark.split("; ");
        let mut source = Self {
            file: parts.next().unwrap_or_default(),
            only: None,
            unit: "",
            having: None,
        };
        for part in parts {
            match part.split_once(": ") {
                Some(("only", names)) => source.only = Some(names),
                Some(("unit", unit)) => source.unit = unit,
                Some(("where", column)) => source.having = column.split_once(" = "),
                _ => return Err(format!("`{mark}`: `{part}` says nothing")),
            }
        }
        Ok(source)
    }

    fn table(&self, text: &str) -> String {
        let counts: Vec<(&str, u64)> = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .filter_map(|line| line.rsplit_once(": "))
            .filter_map(|(name, count)| Some((name, count.trim().parse().ok()?)))
            .collect();
        if counts.is_empty() {
            return self.lines(text);
        }
        let chosen: Vec<(&str, u64)> = counts
            .into_iter()
            .filter_map(|(name, count)| match self.only {
                None => Some((name, count)),
                Some(prefix) => Some((name.strip_prefix(prefix)?.strip_prefix(", ")?, count)),
            })
            .collect();
        let cells: Option<Vec<(&str, &str, u64)>> = chosen
            .iter()
            .map(|&(name, count)| name.rsplit_once(", ").map(|(row, column)| (row, column, count)))
            .collect();
        match cells {
            Some(cells) if shares_columns(&cells) => self.crossed(&cells),
            _ => self.listed(&chosen),
        }
    }

    /// Lines of a table that is text already.
    fn lines(&self, text: &str) -> String {
        let columns = |line: &str| -> Vec<String> {
            let parts = line.split("  ").map(str::trim).filter(|part| !part.is_empty());
            parts.map(str::to_owned).collect()
        };
        let header = columns(text.lines().next().unwrap_or_default());
        let mut shown = String::from("```text\n");
        for (index, line) in text.lines().enumerate() {
            let is_chosen = index < 2
                || self.having.is_none_or(|(column, value)| {
                    let at = header.iter().position(|name| name == column);
                    at.and_then(|at| columns(line).get(at).cloned()).as_deref() == Some(value)
                });
            if is_chosen {
                shown += line;
                shown.push('\n');
            }
        }
        shown + "```\n"
    }

    fn listed(&self, counts: &[(&str, u64)]) -> String {
        if counts.is_empty() {
            return String::new();
        }
        let mut table = format!("\n| | {} |\n|---|---:|\n", self.unit);
        for (name, count) in counts {
            let _infallible = writeln!(table, "| {name} | {} |", self.number(*count));
        }
        table + "\n"
    }

    fn crossed(&self, cells: &[(&str, &str, u64)]) -> String {
        let rows = in_order(cells.iter().map(|(row, ..)| *row));
        let columns = in_order(cells.iter().map(|(_, column, _)| *column));
        let mut table = format!("\n| {} | {} |\n|---|", self.unit, columns.join(" | "));
        table += &"---:|".repeat(columns.len());
        table.push('\n');
        for row in rows {
            let _infallible = write!(table, "| {row} |");
            for column in &columns {
                let cell = cells.iter().find(|cell| (cell.0, cell.1) == (row, *column));
                let number = cell.map(|cell| self.number(cell.2)).unwrap_or_default();
                let _infallible = write!(table, " {number} |");
            }
            table.push('\n');
        }
        table + "\n"
    }

    fn number(&self, count: u64) -> String {
        if self.unit.starts_with("million ") {
            return format!("{:.2}", count as f64 / 1e6);
        }
        let digits = count.to_string();
        let mut grouped = String::new();
        for (index, digit) in digits.chars().enumerate() {
            if index > 0 && (digits.len() - index).is_multiple_of(3) {
                grouped.push(' ');
            }
            grouped.push(digit);
        }
        grouped
    }
}

/// Whether any column has more than one row.
fn shares_columns(cells: &[(&str, &str, u64)]) -> bool {
    in_order(cells.iter().map(|(_, column, _)| *column)).len() < cells.len()
}

/// Each name once, as they come.
fn in_order<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut each = Vec::new();
    for name in names {
        if !each.contains(&name) {
            each.push(name);
        }
    }
    each
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(mark: &str, text: &str) -> Result<String, String> {
        refreshed(
            &format!("a\n<!-- from: {mark} -->\nold\n<!-- end -->\nb\n"),
            |file| (file == "f").then(|| text.to_owned()),
        )
    }

    #[test]
    fn counts_become_rows_and_columns() {
        let table = made(
            "f; only: work; unit: million steps",
            "# x: 1\nwork, a, mean: 1500000\nwork, a, most: 2\nwork, b, most: 3000000\nbytes, c: 9\n",
        );
        let expected = "a\n<!-- from: f; only: work; unit: million steps -->\n\n| million steps | mean | most |\n|---|---:|---:|\n\
            | a | 1.50 | 0.00 |\n| b |  | 3.00 |\n\n<!-- end -->\nb\n";
        assert_eq!(table.as_deref(), Ok(expected));
    }

    #[test]
    fn other_counts_are_a_list() {
        let table = made("f; unit: bytes", "flash, code: 1234567\nmemory, data: 12\n").expect("a table");
        assert!(
            table.contains("\n| | bytes |\n|---|---:|\n| flash, code | 1 234 567 |\n| memory, data | 12 |\n")
        );
    }

    #[test]
    fn lines_of_a_text_are_chosen_by_a_column() {
        let text = "lost, %  late by\n-----\n0.1            0\n0.1           63\n";
        let table = made("f; where: late by = 63", text).expect("a table");
        assert!(table.contains("```text\nlost, %  late by\n-----\n0.1           63\n```\n"));
    }

    #[test]
    fn wrong_marks_are_named() {
        assert!(made("g", "").is_err_and(|error| error.contains("g cannot be read")));
        assert!(made("f; only: x", "a: 1\n").is_err_and(|error| error.contains("gives nothing")));
        assert!(made("f; colour: x", "a: 1\n").is_err_and(|error| error.contains("says nothing")));
        assert!(refreshed("<!-- from: f -->\n", |_| None).is_err_and(|error| error.contains("no end")));
    }
}
