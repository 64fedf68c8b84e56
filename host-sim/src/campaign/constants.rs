//! What half and twice each number of data association, its surfaces and the gates of the pose does.

use cslam_core::field::MOST_SHARE;
use toml::Value;

use super::figure::Figure;
use super::shard::Shard;
use super::summary::Summary;
use crate::config::Config;
use crate::input::toml_keys::{find, put};
use crate::table::Table;

/// Tables of the configuration whose numbers are varied.
const TABLES: [&str; 4] = [
    "receiver.association",
    "receiver.surfaces",
    "receiver.filter.gates",
    "receiver.filter.beacon",
];
/// Probabilities that are wanted: what is halved and doubled is how often they are missed.
const WANTED: [&str; 3] = ["explained", "tentative", "confirmed_probability"];
/// Shares: doubled, they end at [`MOST_SHARE`].
const SHARES: [&str; 5] = [
    "departure_outliers",
    "memory",
    "unknown_share",
    "detection",
    "indistinct_share",
];

/// Name of the flights with the constants as they are.
pub const AS_THEY_ARE: &str = "constants";

/// One number of the configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Its key, from the root on.
    key: String,
    /// Its place, when the key has a list.
    element: Option<usize>,
    /// As it is.
    value: f64,
}

/// Which way a constant is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Varied {
    /// To its half.
    Halved,
    /// To its double.
    Doubled,
}

impl Constant {
    /// All of a configuration.
    ///
    /// # Errors
    /// That of the serialiser.
    pub fn all(config: &Config) -> Result<Vec<Self>, toml::ser::Error> {
        let all = toml::Table::try_from(config)?;
        let mut found = Vec::new();
        for key in TABLES {
            if let Some(table) = find(&all, key) {
                collect(table, key, &mut found);
            }
        }
        Ok(found)
    }

    /// Its key without the table that all have in common; of a list with its place.
    fn name(&self) -> String {
        let key = self.key.trim_start_matches("receiver.");
        self.element
            .map_or_else(|| key.to_owned(), |element| format!("{key}.{element}"))
    }

    /// What it becomes.
    fn varied(&self, varied: Varied) -> f64 {
        let factor = match varied {
            Varied::Halved => 0.5,
            Varied::Doubled => 2.0,
        };
        let is_one_of = |keys: &[&str]| {
            let (_, key) = self.key.rsplit_once('.').unwrap_or_default();
            keys.contains(&key)
        };
        if is_one_of(&WANTED) {
            1.0 - (1.0 - self.value) * factor
        } else if is_one_of(&SHARES) {
            (self.value * factor).min(MOST_SHARE)
        } else {
            self.value * factor
        }
    }

    /// Name of the flights with it varied.
    pub fn world(&self, varied: Varied) -> String {
        let by = match varied {
            Varied::Halved => "half",
            Varied::Doubled => "twice",
        };
        format!("{}-{by}", self.name())
    }

    /// The configuration with it varied.
    ///
    /// # Errors
    /// The message of the parser.
    pub fn set(&self, config: &Config, varied: Varied) -> anyhow::Result<Config> {
        let mut all = toml::Table::try_from(config)?;
        let mut value = find(&all, &self.key).cloned();
        let number = match self.element {
            None => value.as_mut(),
            Some(element) => value.as_mut().and_then(|list| list.get_mut(element)),
        };
        if let Some(number) = number {
            let wanted = self.varied(varied);
            *number = match number {
                Value::Integer(_) => Value::Integer(wanted as i64),
                _ => Value::Float(wanted),
            };
        }
        put(&mut all, &self.key, value);
        Ok(all.try_into()?)
    }
}

/// Every number of a value, which the key has.
fn collect(value: &Value, key: &str, found: &mut Vec<Constant>) {
    let mut push = |value: Option<f64>, element| {
        found.extend(value.map(|value| Constant {
            key: key.to_owned(),
            element,
            value,
        }));
    };
    match value {
        Value::Table(table) => {
            for (inner, value) in table {
                collect(value, &format!("{key}.{inner}"), found);
            }
        }
        Value::Array(values) => {
            for (element, value) in values.iter().enumerate() {
                push(value.as_float(), Some(element));
            }
        }
        Value::Integer(value) => push(Some(*value as f64), None),
        other => push(other.as_float(), None),
    }
}

/// The figures of the table, by their keys, and whether the median over flights is given instead of all flights together.
const COLUMNS: [(&str, bool); 3] = [
    ("map.precision_by_faces", false),
    ("map.accepted", false),
    ("trajectory.position_rmse_m", true),
];

/// One number, and what comes of half and twice of it.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    name: String,
    value: f64,
    halved: [Option<f64>; COLUMNS.len()],
    doubled: [Option<f64>; COLUMNS.len()],
}

/// Every number, in the order of the configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstantsTable {
    flights: usize,
    as_they_are: [Option<f64>; COLUMNS.len()],
    rows: Vec<Row>,
}

impl ConstantsTable {
    /// Of the shards of one mode.
    pub fn of(shards: &[&Shard], constants: &[Constant]) -> Self {
        let of = |world: &str| {
            let summary = Summary::of_world(shards, world);
            let value = |(key, of_flights): (&str, bool)| {
                let line = summary.line(key)?;
                if of_flights { line.median } else { line.pooled }
            };
            (summary.flights, COLUMNS.map(value))
        };
        let (flights, as_they_are) = of(AS_THEY_ARE);
        let row = |constant: &Constant| Row {
            name: constant.name(),
            value: constant.value,
            halved: of(&constant.world(Varied::Halved)).1,
            doubled: of(&constant.world(Varied::Doubled)).1,
        };
        Self {
            flights,
            as_they_are,
            rows: constants.iter().map(row).collect(),
        }
    }

    /// It as text.
    pub fn text(&self, mode: &str) -> String {
        let figures = COLUMNS.map(|(key, median)| (Figure::by_key(key), median));
        let name = |(figure, median): (Option<&Figure>, bool)| {
            let name = figure.map_or("", |figure| figure.name);
            if median {
                format!("{name} (median)")
            } else {
                name.to_owned()
            }
        };
        let mut header = vec![format!("{mode}, {} flights", self.flights), "value".into()];
        for by in ["half", "twice"] {
            header.extend(figures.map(|figure| format!("{by}: {}", name(figure))));
        }
        let cells = |values: &[Option<f64>; COLUMNS.len()]| -> Vec<String> {
            let figures = figures.iter().zip(values);
            figures
                .map(|((figure, _), value)| figure.map_or_else(String::new, |figure| figure.text(*value)))
                .collect()
        };
        let mut table = Table::new(header);
        let as_they_are = cells(&self.as_they_are);
        let first = ["as they are".to_owned(), String::new()];
        table.row([&first[..], &as_they_are, &as_they_are].concat());
        for row in &self.rows {
            // In single precision, as the receiver has it.
            let first = [row.name.clone(), format!("{}", row.value as f32)];
            table.row([&first[..], &cells(&row.halved), &cells(&row.doubled)].concat());
        }
        table.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_halved_and_doubled_alone() {
        let config = Config::default();
        let all = Constant::all(&config).expect("serialisable");
        assert!(all.len() > 35, "{}", all.len());
        let before = Value::try_from(&config).expect("serialisable");
        for constant in &all {
            for varied in [Varied::Halved, Varied::Doubled] {
                let changed = constant.set(&config, varied).expect("in range");
                changed.receiver.check().expect("in range");
                assert_ne!(changed, config, "{}", constant.name());
                let after = Value::try_from(&changed).expect("serialisable");
                let numbers = |value: &Value| -> Vec<f64> {
                    let mut found = Vec::new();
                    collect(value, "all", &mut found);
                    found.into_iter().map(|constant| constant.value).collect()
                };
                let pairs = numbers(&before).into_iter().zip(numbers(&after));
                assert_eq!(pairs.filter(|(a, b)| a != b).count(), 1, "{}", constant.name());
            }
        }
    }

    #[test]
    fn of_a_wanted_probability_the_misses_are_halved() {
        let config = Config::default();
        let all = Constant::all(&config).expect("serialisable");
        let of = |name: &str| {
            all.iter()
                .find(|constant| constant.name() == name)
                .expect("known")
        };
        let explained = of("association.explained");
        assert!((explained.varied(Varied::Halved) - 0.975).abs() < 1e-6);
        assert!((explained.varied(Varied::Doubled) - 0.9).abs() < 1e-6);
        let outliers = of("association.errors.departure_outliers.2");
        assert!((outliers.varied(Varied::Doubled) - MOST_SHARE).abs() < 1e-9);
        assert!((of("surfaces.reach_m").varied(Varied::Doubled) - 12.0).abs() < 1e-9);
    }
}
