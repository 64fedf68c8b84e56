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

Units are those that the names end in.
";

/// The page.
#[must_use]
pub fn page(constants: &[Constant], effects: &Effects) -> String {
    let mut text = HEAD.to_owned();
    counts(constants, &mut text);
    tuned(constants, effects, &mut text);
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

/// Name of an array's or a tuple's element in the table of effects, the number itself first.
fn elements(constant: &Constant, effects: &Effects) -> Vec<String> {
    let key = constant.key();
    let is_own =
        |name: &str| name == key || name.strip_prefix(&key).is_some_and(|rest| rest.starts_with('#'));
    let mut names: Vec<String> = effects
        .of
        .keys()
        .map(|(name, _)| name.clone())
        .filter(|name| is_own(name))
        .collect();
    names.dedup();
    if names.is_empty() {
        names.push(key);
    }
    names
}

fn tuned(constants: &[Constant], effects: &Effects, text: &mut String) {
    let _ = writeln!(text, "\n## Tuned\n");
    for line in &effects.head {
        let _ = writeln!(text, "{line}");
    }
    let sets: Vec<&String> = effects.as_it_is.keys().collect();
    let as_it_is = |set: &str| effects.as_it_is.get(set).copied();
    let mut header = "| number | value | source |".to_owned();
    let mut rule = "|---|---|---|".to_owned();
    for set in &sets {
        let _ = write!(header, " {set}: half | {set}: double |");
        rule.push_str("---:|---:|");
    }
    let _ = writeln!(
        text,
        "\nCells: change of the precision in thousandths; rms position error of the median flight, m.\n"
    );
    let _ = writeln!(text, "{header}\n{rule}");
    let mut first = "| *as it is* | | |".to_owned();
    for set in &sets {
        let own = as_it_is(set).map_or_else(String::new, |f| {
            format!("{:.4}; {:.3}", f.precision, f.position_m)
        });
        let _ = write!(first, " {own} | {own} |");
    }
    let _ = writeln!(text, "{first}");
    for constant in constants.iter().filter(|constant| is_of(constant, Class::Tuned)) {
        let said = constant.source.as_ref().map_or("", |source| source.text.as_str());
        for name in elements(constant, effects) {
            let mut row = format!("| `{name}` | `{}` | {} |", cell(&constant.value), cell(said));
            for set in &sets {
                let effect = effects.of.get(&(name.clone(), (*set).clone()));
                let _ = write!(row, " {} |", cells(effect, as_it_is(set)));
            }
            let _ = writeln!(text, "{row}");
        }
    }
}

fn cells(effect: Option<&Effect>, as_it_is: Option<Figures>) -> String {
    let (Some(effect), Some(own)) = (effect, as_it_is) else {
        return "not measured | not measured".to_owned();
    };
    let cell = |f: Figures| format!("{:+.1}; {:.3}", (f.precision - own.precision) * 1e3, f.position_m);
    format!("{} | {}", cell(effect.half), cell(effect.twice))
}

fn others(room: &str, constants: &[Constant], text: &mut String) {
    let of_room = constants
        .iter()
        .filter(|constant| constant.room == room && !is_of(constant, Class::Tuned));
    let _ = writeln!(
        text,
        "\n## Others of {room}\n\n| number | file | value | class | source |\n|---|---|---|---|---|"
    );
    for constant in of_room {
        let (class, said) = constant
            .source
            .as_ref()
            .map_or(("", ""), |s| (s.class.name(), s.text.as_str()));
        let (file, value) = (&constant.file, cell(&constant.value));
        let _ = writeln!(
            text,
            "| `{}` | {file} | `{value}` | {class} | {} |",
            constant.name,
            cell(said)
        );
    }
}
