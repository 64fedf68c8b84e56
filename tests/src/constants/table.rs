//! The page `docs/constants.md`.

use std::fmt::Write as _;

use super::effect::{Effect, Effects, Figures};
use super::{COUNTED, Class, Constant, ROOMS};

const HEAD: &str = "\
# Constants

*Written by `cargo constants > docs/constants.md` from the sources of the flight code and `tests/golden/constants.csv`; a test fails where
this page is another, and where a number does not say where it comes from. Change the doc comments, not this page.*

Every number of the flight code behind the front end, with where it comes from:

| class | a number |
|---|---|
| Tuned | chosen by what flights make of it, on tuning seeds alone ([flights.md](flights.md)) |
| Measured | read off a measurement that the text names |
| Derived | a formula of other numbers, or the quantile of a stated rate |
| Given | from outside: mathematics, a format, a data sheet, the error budget, what is asked for |
| Capacity | a bound of memory or of work |
| Numerical | a step, a guard or a tolerance of an iteration, beside which the result does not change |

Units are those that the names end in; process noise is a density, per root second as well.
";

/// Ends of names and their units, longer ends first.
const UNITS: [(&str, &str); 20] = [
    ("_rad2_per_s", "rad^2/s"),
    ("_m2_per_s3", "m^2/s^3"),
    ("_rad_per_s", "rad/s"),
    ("_m_per_s3", "m/s^3"),
    ("_m_per_s2", "m/s^2"),
    ("_m_per_s", "m/s"),
    ("_samples", "samples"),
    ("_sigmas", "standard deviations"),
    ("_per_m", "1/m"),
    ("_sweeps", "sweeps"),
    ("_taps", "taps"),
    ("_dbm", "dBm"),
    ("_deg", "degrees"),
    ("_rad", "rad"),
    ("_m2", "m^2"),
    ("_db", "dB"),
    ("_ns", "ns"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_s", "s"),
];

/// Unit that a name ends in; nothing where it has none.
fn unit(name: &str) -> &'static str {
    let name = name.to_lowercase();
    let found = UNITS.iter().find(|(end, _)| name.ends_with(end));
    found.map_or("", |(_, unit)| unit)
}

/// The page.
#[must_use]
pub fn page(constants: &[Constant], effects: &Effects) -> String {
    let mut text = HEAD.to_owned();
    counts(constants, &mut text);
    let _ = writeln!(text, "\n## Tuned\n");
    let _ = writeln!(text, "{}", effects.head.join("\n"));
    let is_tuned = |constant: &&Constant| is_of(constant, Class::Tuned);
    varied(constants.iter().filter(is_tuned), effects, &mut text);
    let _ = writeln!(text, "\n## Half and double of others\n");
    let is_measured = |constant: &&Constant| !is_of(constant, Class::Tuned) && has_effect(constant, effects);
    varied(constants.iter().filter(is_measured), effects, &mut text);
    for (room, _) in ROOMS {
        others(room, constants, &mut text);
    }
    text
}

fn is_of(constant: &Constant, class: Class) -> bool {
    constant
        .source
        .as_ref()
        .is_some_and(|source| source.class == class)
}

/// How many numbers of a room are of a class.
fn count(constants: &[Constant], room: &str, class: Class) -> usize {
    let of_room = constants.iter().filter(|constant| constant.room == room);
    let of_class = of_room.filter(|constant| is_of(constant, class));
    of_class.map(|constant| constant.numbers).sum()
}

fn counts(constants: &[Constant], text: &mut String) {
    let names = Class::ALL.map(Class::name).join(" | ");
    let _ = writeln!(
        text,
        "\n## How many\n\n| room | {names} |\n|---|{}",
        "---:|".repeat(Class::ALL.len())
    );
    for (room, _) in ROOMS {
        let cells = Class::ALL.map(|class| count(constants, room, class).to_string());
        let _ = writeln!(text, "| {room} | {} |", cells.join(" | "));
    }
    let sum = COUNTED
        .0
        .iter()
        .map(|room| count(constants, room, Class::Tuned))
        .sum::<usize>();
    let _ = writeln!(
        text,
        "\nTuned numbers of {}: {sum}. At most {} are wanted.",
        COUNTED.0.join(", "),
        COUNTED.1
    );
}

/// A cell of a table holds no bar and no line's end.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

/// Whether a name of the table of effects is that of a constant, or of an element of it.
fn is_own(name: &str, key: &str) -> bool {
    name.strip_prefix(key)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with('#'))
}

fn has_effect(constant: &Constant, effects: &Effects) -> bool {
    let key = constant.key();
    effects.of.keys().any(|(name, _)| is_own(name, &key))
}

/// Names of a constant's elements in the table of effects; its own where it has one, or none was measured.
fn elements(constant: &Constant, effects: &Effects) -> Vec<String> {
    let key = constant.key();
    let own = effects.of.keys().filter(|(name, _)| is_own(name, &key));
    let mut names: Vec<String> = own.map(|(name, _)| name.clone()).collect();
    names.dedup();
    if names.is_empty() {
        names.push(key);
    }
    names
}

/// A table of numbers with what half and double of each do: a row for each set of flights.
fn varied<'a>(constants: impl Iterator<Item = &'a Constant>, effects: &Effects, text: &mut String) {
    let _ = writeln!(
        text,
        "\n| number | value | unit | source | flights | half | double |\n|---|---|---|---|---|---:|---:|"
    );
    for (set, own) in &effects.as_it_is {
        let own = format!("{:.2} %; {:.3}", own.precision * 100.0, own.position_m);
        let _ = writeln!(text, "| *as it is* | | | | {set} | {own} | {own} |");
    }
    for constant in constants {
        let said = constant.source.as_ref().map_or("", |source| source.text.as_str());
        for name in elements(constant, effects) {
            let (value, unit) = (cell(&constant.value), unit(&constant.name));
            let head = format!("| `{name}` | `{value}` | {unit} | {} |", cell(said));
            let rows = effects.as_it_is.iter().filter_map(|(set, own)| {
                let effect = effects.of.get(&(name.clone(), set.clone()))?;
                Some(format!("{set} | {} |", cells(effect, *own)))
            });
            let rows: Vec<String> = rows.collect();
            if rows.is_empty() {
                let _ = writeln!(text, "{head} - | not measured | not measured |");
            }
            for row in rows {
                let _ = writeln!(text, "{head} {row}");
            }
        }
    }
}

/// Both cells of a number in one set of flights.
fn cells(effect: &Effect, own: Figures) -> String {
    let cell = |f: Figures| {
        format!(
            "{:+.2}; {:.3}",
            (f.precision - own.precision) * 100.0,
            f.position_m
        )
    };
    format!("{} | {}", cell(effect.half), cell(effect.twice))
}

fn others(room: &str, constants: &[Constant], text: &mut String) {
    let of_room = constants
        .iter()
        .filter(|constant| constant.room == room && !is_of(constant, Class::Tuned));
    let _ = writeln!(
        text,
        "\n## Others of {room}\n\n| number | file | value | unit | class | source |\n|---|---|---|---|---|---|"
    );
    for constant in of_room {
        let (class, said) = constant
            .source
            .as_ref()
            .map_or(("", ""), |s| (s.class.name(), s.text.as_str()));
        let (name, file, value) = (&constant.name, &constant.file, cell(&constant.value));
        let _ = writeln!(
            text,
            "| `{name}` | {file} | `{value}` | {} | {class} | {} |",
            unit(name),
            cell(said)
        );
    }
}
