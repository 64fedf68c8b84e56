//! What half and twice each number of data association and its surfaces does.

use serde::Serialize;

use super::figure::{FIGURES, Figure};
use super::shard::Shard;
use super::summary::Summary;
use crate::config::Config;
use crate::table::Table;

/// Tables of the configuration whose numbers are varied.
const TABLES: [[&str; 2]; 2] = [["receiver", "association"], ["receiver", "surfaces"]];
/// Probabilities that are wanted: what is halved and doubled is how often they are missed.
const WANTED: [&str; 3] = ["explained", "tentative", "confirmed_probability"];
/// Shares end here when they are doubled.
const MOST_SHARE: f64 = 0.9999;
/// Those are shares.
const SHARES: [&str; 4] = [
    "departure_outliers",
    "unknown_share",
    "detection",
    "indistinct_shares",
];

/// Name of the flights with the constants as they are.
pub const AS_THEY_ARE: &str = "constants";

/// One number of the configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// From the table `receiver` on, as messages have it; of a list with its place.
    pub name: String,
    path: Vec<String>,
    element: Option<usize>,
    /// As it is.
    pub value: f64,
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
        let value = toml::Value::try_from(config)?;
        let mut found = Vec::new();
        for table in TABLES {
            let path: Vec<String> = table.map(str::to_owned).into();
            let table = table.iter().try_fold(&value, |value, key| value.get(key));
            if let Some(table) = table {
                collect(table, &path, &mut found);
            }
        }
        Ok(found)
    }

    /// What it becomes.
    pub fn varied(&self, varied: Varied) -> f64 {
        let factor = match varied {
            Varied::Halved => 0.5,
            Varied::Doubled => 2.0,
        };
        let is_one_of = |keys: &[&str]| self.path.last().is_some_and(|key| keys.contains(&key.as_str()));
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
        format!("{}-{by}", self.name)
    }

    /// The configuration with it varied.
    ///
    /// # Errors
    /// The message of the parser.
    pub fn set(&self, config: &Config, varied: Varied) -> anyhow::Result<Config> {
        let mut value = toml::Value::try_from(config)?;
        let mut at = Some(&mut value);
        for key in &self.path {
            at = at.and_then(|value| value.get_mut(key));
        }
        if let Some(element) = self.element {
            at = at.and_then(|value| value.get_mut(element));
        }
        if let Some(number) = at {
            let wanted = self.varied(varied);
            *number = match number {
                toml::Value::Integer(_) => toml::Value::Integer(wanted as i64),
                _ => toml::Value::Float(wanted),
            };
        }
        Ok(value.try_into()?)
    }
}

fn collect(value: &toml::Value, path: &[String], found: &mut Vec<Constant>) {
    let constant = |value: f64, element: Option<usize>| {
        let name = path[1..].join(".");
        Constant {
            name: element.map_or_else(|| name.clone(), |index| format!("{name}.{index}")),
            path: path.to_vec(),
            element,
            value,
        }
    };
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                collect(value, &[path, std::slice::from_ref(key)].concat(), found);
            }
        }
        toml::Value::Array(values) => {
            let numbers = values.iter().enumerate();
            found.extend(numbers.filter_map(|(index, value)| Some(constant(value.as_float()?, Some(index)))));
        }
        toml::Value::Integer(value) => found.push(constant(*value as f64, None)),
        toml::Value::Float(value) => found.push(constant(*value, None)),
        _ => {}
    }
}

/// The figures of the table, by their keys.
const COLUMNS: [&str; 2] = ["map.precision_by_faces", "map.accepted"];

/// One number, and what comes of half and twice of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Row {
    name: String,
    value: f64,
    halved: [Option<f64>; COLUMNS.len()],
    doubled: [Option<f64>; COLUMNS.len()],
}

/// Every number, in the order of the configuration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConstantsTable {
    flights: usize,
    as_they_are: [Option<f64>; COLUMNS.len()],
    rows: Vec<Row>,
}

impl ConstantsTable {
    /// Of the shards of one mode.
    pub fn of(shards: &[&Shard], constants: &[Constant]) -> Self {
        let of = |world: &str| {
            let own: Vec<&Shard> = shards
                .iter()
                .copied()
                .filter(|shard| shard.flight.world == world)
                .collect();
            let summary = Summary::of(&own);
            let pooled = COLUMNS.map(|key| summary.figures.iter().find(|line| line.key == key)?.pooled);
            (summary.flights, pooled)
        };
        let (flights, as_they_are) = of(AS_THEY_ARE);
        let row = |constant: &Constant| Row {
            name: constant.name.clone(),
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
        let figures = COLUMNS.map(|key| FIGURES.iter().find(|figure| figure.key == key));
        let name = |figure: Option<&Figure>| figure.map_or("", |figure| figure.name);
        let mut header = vec![format!("{mode}, {} flights", self.flights), "value".into()];
        for by in ["half", "twice"] {
            header.extend(figures.map(|figure| format!("{by}: {}", name(figure))));
        }
        let cells = |values: &[Option<f64>; COLUMNS.len()]| -> Vec<String> {
            let figures = figures.iter().zip(values);
            figures
                .map(|(figure, value)| figure.map_or_else(String::new, |figure| figure.text(*value)))
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
        let before = toml::Value::try_from(&config).expect("serialisable");
        for constant in &all {
            for varied in [Varied::Halved, Varied::Doubled] {
                let changed = constant.set(&config, varied).expect("in range");
                changed.receiver.check().expect("in range");
                assert_ne!(changed, config, "{}", constant.name);
                let after = toml::Value::try_from(&changed).expect("serialisable");
                let numbers = |value: &toml::Value| -> Vec<f64> {
                    let mut found = Vec::new();
                    collect(value, &["all".to_owned()], &mut found);
                    found.into_iter().map(|constant| constant.value).collect()
                };
                let pairs = numbers(&before).into_iter().zip(numbers(&after));
                assert_eq!(pairs.filter(|(a, b)| a != b).count(), 1, "{}", constant.name);
            }
        }
    }

    #[test]
    fn of_a_wanted_probability_the_misses_are_halved() {
        let config = Config::default();
        let all = Constant::all(&config).expect("serialisable");
        let of = |name: &str| all.iter().find(|constant| constant.name == name).expect("known");
        let explained = of("association.explained");
        assert!((explained.varied(Varied::Halved) - 0.975).abs() < 1e-6);
        assert!((explained.varied(Varied::Doubled) - 0.9).abs() < 1e-6);
        let outliers = of("association.errors.departure_outliers.2");
        assert!((outliers.varied(Varied::Doubled) - MOST_SHARE).abs() < 1e-9);
        assert!((of("surfaces.reach_m").varied(Varied::Doubled) - 12.0).abs() < 1e-9);
    }
}
