//! The data association that was flown beside the receiver's own, in the flights of a campaign.

use serde_json::Value;

use super::shard::Shard;
use crate::table::Table;

/// The flights as if that association had made their maps; those without one are left out.
pub fn beside(shards: &[&Shard]) -> Vec<Shard> {
    let as_flown = |shard: &&Shard| {
        let mut other = (*shard).clone();
        let report = other.report.as_mut()?.as_object_mut()?;
        let map = report.get("shadow")?.get("map")?.clone();
        report.insert("map".into(), map);
        Some(other)
    };
    shards.iter().filter_map(as_flown).collect()
}

/// Columns of the table: paths with points, by who made them and whether they are right.
const COLUMNS: [(&str, &str); 6] = [
    ("both, right", "both_right"),
    ("both, wrong", "both_wrong"),
    ("flown alone, right", "flown_right"),
    ("flown alone, wrong", "flown_wrong"),
    ("beside alone, right", "shadow_right"),
    ("beside alone, wrong", "shadow_wrong"),
];

/// Where the two differ, flight by flight and in all: numbers of paths that became points.
pub fn differences(shards: &[&Shard]) -> String {
    let mut table = Table::new(std::iter::once("paths with points").chain(COLUMNS.map(|(name, _)| name)));
    let mut all = [0; COLUMNS.len()];
    for shard in shards {
        let Some(counts) = shard
            .report
            .as_ref()
            .and_then(|report| report.get("shadow")?.get("differences"))
        else {
            continue;
        };
        let mut row = vec![shard.flight.text()];
        for ((_, key), all) in COLUMNS.iter().zip(&mut all) {
            let count = counts.get(key).and_then(Value::as_u64).unwrap_or(0);
            *all += count;
            row.push(count.to_string());
        }
        table.row(row);
    }
    let mut row = vec!["all".to_owned()];
    row.extend(all.map(|count| count.to_string()));
    table.row(row);
    table.to_string()
}

#[cfg(test)]
mod tests {
    use super::super::shard::{Build, Flight};
    use super::*;
    use serde_json::json;

    fn shard(seed: u64, report: Value) -> Shard {
        Shard {
            flight: Flight {
                world: "budget".into(),
                mode: "best".into(),
                scene: "outdoor".into(),
                seed,
            },
            build: Build {
                version: "0".into(),
                executable_crc: 0,
                config_crc: 0,
            },
            report: Some(report),
            error: None,
        }
    }

    #[test]
    fn the_map_beside_stands_for_the_one_that_was_flown() {
        let differences_of = |count: u64| json!({"both_right": count, "shadow_wrong": 2});
        let with = shard(
            1,
            json!({"map": {"accepted": 5}, "shadow": {"map": {"accepted": 7}, "differences": differences_of(4)}}),
        );
        let without = shard(2, json!({"map": {"accepted": 5}}));
        let other = beside(&[&with, &without]);
        assert_eq!(other.len(), 1);
        assert_eq!(other[0].report.as_ref().expect("kept")["map"]["accepted"], 7);
        let text = differences(&[&with, &with, &without]);
        let last = text.lines().last().expect("a row");
        assert_eq!(
            last.split_whitespace().collect::<Vec<_>>(),
            ["all", "8", "0", "0", "0", "0", "4"]
        );
        assert_eq!(text.lines().count(), 5);
    }
}
