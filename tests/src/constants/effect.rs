//! What half and double of each number does to flights: the committed figures.

use std::collections::BTreeMap;

/// Figures of flights: how many points lie on the surface that reflected them, and how far off the position is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Share of all accepted points together.
    pub precision: f64,
    /// Median over the flights of the position's rms error, m.
    pub position_m: f64,
}

/// What becomes of flights with a number halved and doubled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// With half of it.
    pub half: Figures,
    /// With twice of it.
    pub twice: Figures,
}

/// The committed figures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects {
    /// By name of the set of flights: the figures of the receiver as it is.
    pub as_it_is: BTreeMap<String, Figures>,
    /// By [`super::Constant::key`], of a list with the place of its element behind `#`, and set of flights.
    pub of: BTreeMap<(String, String), Effect>,
    /// Lines of the head, which name the commands.
    pub head: Vec<String>,
}

impl Effects {
    /// Those of `tests/golden/constants.csv`.
    ///
    /// # Panics
    /// When the file is not there or a line is not as its head says.
    #[must_use]
    pub fn committed() -> Self {
        let path = crate::root().join("tests/golden/constants.csv");
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self::read(&text)
    }

    /// From a table `constant,flights,half precision,half position m,twice precision,twice position m`, comments above it.
    ///
    /// # Panics
    /// With the line that is not so.
    #[must_use]
    pub fn read(text: &str) -> Self {
        let mut effects = Self::default();
        for line in text.lines() {
            if let Some(comment) = line.strip_prefix('#') {
                effects.head.push(comment.trim().to_owned());
                continue;
            }
            let cells: Vec<&str> = line.split(',').collect();
            let numbers: Vec<f64> = cells.iter().skip(2).flat_map(|cell| cell.parse()).collect();
            let figures = |at: usize| Figures {
                precision: numbers[at],
                position_m: numbers[at + 1],
            };
            match (&cells[..], numbers.len()) {
                (["constant", ..], _) => {}
                (["as it is", flights, ..], 2) => {
                    effects.as_it_is.insert((*flights).to_owned(), figures(0));
                }
                ([constant, flights, ..], 4) => {
                    let key = ((*constant).to_owned(), (*flights).to_owned());
                    let effect = Effect {
                        half: figures(0),
                        twice: figures(2),
                    };
                    assert!(
                        effects.of.insert(key, effect).is_none(),
                        "twice in the table: {line}"
                    );
                }
                _ => panic!("expected a constant, flights and two or four numbers: {line}"),
            }
        }
        effects
    }
}
