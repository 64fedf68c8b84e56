//! What each effect of the world `real` does: alone over `budget`, and left out of `real`.

use super::figure::Figure;
use super::shard::Shard;
use super::summary::Summary;
use crate::table::Table;
use crate::world::{EFFECTS, Profile};

/// Name of the world `budget` with one effect of `real`.
pub fn alone(effect: &str) -> String {
    format!("{}+{effect}", Profile::Budget.name())
}

/// Name of the world `real` without an effect.
pub fn left_out(effect: &str) -> String {
    format!("{}-{effect}", Profile::Real.name())
}

/// The figures of the table, by their keys, and whether the median over flights is given instead of all flights together.
const COLUMNS: [(&str, bool); 7] = [
    ("map.precision", false),
    ("map.precision_by_faces", false),
    ("map.accepted", false),
    ("map.accepted_surface_rmse_m", false),
    ("trajectory.position_rmse_m", true),
    ("trajectory.attitude_rmse_deg", true),
    ("link_state.measured.strongest_right", false),
];

/// A world beside the one that it differs from by an effect.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    effect: &'static str,
    flights: usize,
    values: [Option<f64>; COLUMNS.len()],
}

impl Row {
    fn of(effect: &'static str, world: &str, shards: &[&Shard]) -> Self {
        let summary = Summary::of_world(shards, world);
        let value = |(key, of_flights): (&str, bool)| {
            let line = summary.line(key)?;
            if of_flights { line.median } else { line.pooled }
        };
        Self {
            effect,
            flights: summary.flights,
            values: COLUMNS.map(value),
        }
    }

    /// Points of correct order in a flight; none without a figure.
    fn correct_points(&self) -> f64 {
        let value = |key| {
            let at = COLUMNS.iter().position(|(column, _)| *column == key);
            at.and_then(|at| self.values[at]).unwrap_or(0.0)
        };
        value("map.precision") * value("map.accepted")
    }
}

/// The effects in the order of the points of correct order that they cost, dearest first.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectsTable {
    /// `budget`, and with each effect alone.
    alone: Vec<Row>,
    /// `real`, and without each effect.
    left_out: Vec<Row>,
}

impl EffectsTable {
    /// Of the shards of one mode.
    pub fn of(shards: &[&Shard]) -> Self {
        let rows = |base: Profile, name: fn(&str) -> String| -> Vec<Row> {
            let effects = EFFECTS
                .iter()
                .map(|effect| Row::of(effect.name, &name(effect.name), shards));
            let mut rows: Vec<Row> = effects.collect();
            rows.sort_by(|a, b| a.correct_points().total_cmp(&b.correct_points()));
            rows.insert(0, Row::of(base.name(), base.name(), shards));
            rows
        };
        let mut left_out = rows(Profile::Real, left_out);
        // What costs most is what gives most back.
        left_out[1..].reverse();
        Self {
            alone: rows(Profile::Budget, alone),
            left_out,
        }
    }

    /// It as text.
    pub fn text(&self, mode: &str) -> String {
        let table = |title: String, rows: &[Row]| {
            let figures = COLUMNS.map(|(key, median)| (Figure::by_key(key), median));
            let mut header = vec![title, "flights".into(), "points of correct order".into()];
            header.extend(figures.iter().map(|(figure, median)| {
                let name = figure.map_or("", |figure| figure.name);
                if *median {
                    format!("{name} (median)")
                } else {
                    name.to_owned()
                }
            }));
            let mut table = Table::new(header);
            for row in rows {
                let mut cells = vec![
                    row.effect.to_owned(),
                    row.flights.to_string(),
                    format!("{:.0}", row.correct_points()),
                ];
                let texts = figures.iter().zip(row.values);
                cells.extend(
                    texts.map(|((figure, _), value)| figure.map_or_else(String::new, |f| f.text(value))),
                );
                table.row(cells);
            }
            table.to_string()
        };
        format!(
            "{}\n{}",
            table(format!("{mode}, budget with one effect"), &self.alone),
            table(format!("{mode}, real without one effect"), &self.left_out)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{Build, Flight};
    use serde_json::json;

    fn shard(world: String, accepted: f64, precision: f64) -> Shard {
        let flight = Flight {
            world,
            mode: "best".into(),
            scene: "outdoor".into(),
            seed: 1,
        };
        let build = Build {
            version: "0".into(),
            executable_crc: 0,
            config_crc: 0,
        };
        Shard {
            flight,
            build,
            report: Some(json!({"map": {"accepted": accepted, "precision": precision}})),
            error: None,
        }
    }

    #[test]
    fn what_costs_most_comes_first_in_both_orders() {
        let shards = [
            shard("budget".into(), 100.0, 1.0),
            shard(alone("wind"), 90.0, 1.0),
            shard(alone("rotors"), 100.0, 0.5),
            shard("real".into(), 20.0, 0.9),
            shard(left_out("wind"), 21.0, 0.9),
            shard(left_out("rotors"), 60.0, 0.9),
        ];
        let table = EffectsTable::of(&shards.iter().collect::<Vec<_>>());
        let flown = |rows: &[Row]| -> Vec<&str> {
            let flown = rows.iter().filter(|row| row.flights > 0);
            flown.map(|row| row.effect).collect()
        };
        assert_eq!(flown(&table.alone), ["budget", "rotors", "wind"]);
        assert_eq!(flown(&table.left_out), ["real", "rotors", "wind"]);
        let text = table.text("best");
        assert!(
            text.contains("best, real without one effect") && text.contains("correct reflection order, %"),
            "{text}"
        );
    }
}
