//! What the flights of a campaign say together.

use serde::Serialize;
use serde_json::Value;

use super::figure::{FIGURES, Figure, number};
use super::shard::Shard;
use crate::random::Stream;
use crate::statistics::{median, quantile};
use crate::table::Table;

/// Draws of the bootstrap.
const DRAWS: usize = 2000;
/// Interval that is given, as quantiles of the draws.
const INTERVAL: [f64; 2] = [0.025, 0.975];
/// Flights that are named as the worst.
const WORST: usize = 10;
/// A standard deviation of normal numbers in median absolute deviations.
const SIGMA_PER_DEVIATION: f64 = 1.4826;

/// One figure over all flights. Values are those of the reports, not scaled.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Where it stands in a report.
    pub key: &'static str,
    /// Flights that have it.
    pub flights: usize,
    /// Median over flights.
    pub median: Option<f64>,
    /// Interval of the median, 95 %, by bootstrap over flights.
    pub median_interval: [Option<f64>; 2],
    /// What 90 % of the flights are no worse than.
    pub worse_10_percent: Option<f64>,
    /// The worst flight's.
    pub worst: Option<f64>,
    /// All flights together.
    pub pooled: Option<f64>,
    /// Interval of that, 95 %, by bootstrap over flights.
    pub pooled_interval: [Option<f64>; 2],
}

/// A flight far from the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// Which.
    pub flight: String,
    /// The figure by which it is furthest off, in robust standard deviations.
    pub sigmas: f64,
    /// That figure and what else was special.
    pub reason: String,
}

/// A campaign in one table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Flights that were flown.
    pub flights: usize,
    /// Those that could not be, and why.
    pub failed: Vec<String>,
    /// The figures.
    pub figures: Vec<Line>,
    /// Those that smoothing changes, of the flights that were smoothed; empty when none was.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub smoothed: Vec<Line>,
    /// The flights furthest off, worst first.
    pub worst: Vec<Worst>,
}

impl Summary {
    /// Of these shards.
    pub fn of(shards: &[&Shard]) -> Self {
        let flown: Vec<(&Shard, &Value)> = shards
            .iter()
            .filter_map(|shard| Some((*shard, shard.report.as_ref()?)))
            .collect();
        let reports: Vec<&Value> = flown.iter().map(|(_, report)| *report).collect();
        let failed = shards.iter().filter(|shard| shard.report.is_none()).map(|shard| {
            format!(
                "{}: {}",
                shard.flight.text(),
                shard.error.as_deref().unwrap_or("no report")
            )
        });
        let mut worst: Vec<Worst> = flown
            .iter()
            .filter_map(|(shard, report)| judge(shard, report, &reports))
            .collect();
        worst.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
        worst.truncate(WORST);
        Self {
            flights: flown.len(),
            failed: failed.collect(),
            figures: FIGURES.iter().map(|figure| line(figure, &reports)).collect(),
            smoothed: smoothed(&reports),
            worst,
        }
    }

    /// Of those of these shards that flew through a world.
    pub fn of_world(shards: &[&Shard], world: &str) -> Self {
        let own: Vec<&Shard> = shards
            .iter()
            .copied()
            .filter(|shard| shard.flight.world == world)
            .collect();
        Self::of(&own)
    }

    /// The figure of a key.
    pub fn line(&self, key: &str) -> Option<&Line> {
        self.figures.iter().find(|line| line.key == key)
    }

    /// It as text.
    pub fn text(&self, title: &str) -> String {
        let mut table = lines(&format!("{title}, {} flights", self.flights), &self.figures).to_string();
        // A flight without a point has no share of right ones, but it has a position.
        if let Some(flights) = self.smoothed.iter().map(|line| line.flights).max() {
            let smoothed = lines(&format!("{title}, {flights} flights, smoothed"), &self.smoothed);
            table = format!("{table}\n{smoothed}");
        }
        let mut worst = Table::new(["furthest from the others", "sigmas", "why"]);
        for flight in &self.worst {
            worst.row([
                flight.flight.clone(),
                format!("{:.1}", flight.sigmas),
                flight.reason.clone(),
            ]);
        }
        let failed: String = self
            .failed
            .iter()
            .map(|why| format!("not flown: {why}\n"))
            .collect();
        format!("{table}\n{worst}{failed}")
    }
}

/// A table of figures.
fn lines(title: &str, of: &[Line]) -> Table {
    let mut table = Table::new([
        title,
        "median",
        "95 % interval",
        "90 % within",
        "worst",
        "pooled",
        "95 % interval",
    ]);
    for line in of {
        let Some(figure) = Figure::by_key(line.key) else {
            continue;
        };
        let interval =
            |[low, high]: [Option<f64>; 2]| format!("{} .. {}", figure.text(low), figure.text(high));
        table.row([
            figure.name.to_owned(),
            figure.text(line.median),
            interval(line.median_interval),
            figure.text(line.worse_10_percent),
            figure.text(line.worst),
            figure.text(line.pooled),
            interval(line.pooled_interval),
        ]);
    }
    table
}

/// The figures of smoothed flights, as far as smoothing has any.
fn smoothed(reports: &[&Value]) -> Vec<Line> {
    let smoothed: Vec<&Value> = reports
        .iter()
        .filter_map(|report| report.get("smoothed"))
        .collect();
    let lines = FIGURES.iter().map(|figure| line(figure, &smoothed));
    lines.filter(|line| line.flights > 0).collect()
}

fn line(figure: &Figure, reports: &[&Value]) -> Line {
    let values: Vec<f64> = reports.iter().filter_map(|report| figure.of(report)).collect();
    // Read once: the draws are many.
    let flights: Vec<_> = reports
        .iter()
        .map(|report| (figure.of(report), figure.weighed(report)))
        .collect();
    let (mut medians, mut pools) = (Vec::with_capacity(DRAWS), Vec::with_capacity(DRAWS));
    // The draws of every figure are the same flights.
    let mut random = Stream::new(0, 0);
    for _ in 0..DRAWS {
        let drawn: Vec<_> = flights
            .iter()
            .filter_map(|_| flights.get((random.uniform() * flights.len() as f64) as usize))
            .collect();
        let of_drawn: Vec<f64> = drawn.iter().filter_map(|(value, _)| *value).collect();
        medians.extend(median(&of_drawn));
        pools.extend(figure.pool(drawn.iter().filter_map(|(_, weighed)| *weighed)));
    }
    Line {
        key: figure.key,
        flights: values.len(),
        median: median(&values),
        median_interval: INTERVAL.map(|q| quantile(&medians, q)),
        worse_10_percent: figure.worse(&values, 0.9),
        worst: figure.worse(&values, 1.0),
        pooled: figure.pool(flights.iter().filter_map(|(_, weighed)| *weighed)),
        pooled_interval: INTERVAL.map(|q| quantile(&pools, q)),
    }
}

/// How far a flight is off the others, on the bad side of the figure by which it is furthest.
fn judge(shard: &Shard, report: &Value, all: &[&Value]) -> Option<Worst> {
    let judged = FIGURES.iter().filter_map(|figure| {
        let values: Vec<f64> = all.iter().filter_map(|other| figure.of(other)).collect();
        let (middle, own) = (median(&values)?, figure.of(report)?);
        let deviations: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
        let sigma = SIGMA_PER_DEVIATION * median(&deviations)?;
        let worse = if figure.more_is_better {
            middle - own
        } else {
            own - middle
        };
        (sigma > 0.0).then(|| (worse / sigma, figure, own, middle))
    });
    let (sigmas, figure, own, middle) = judged.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut reason = format!(
        "{} {}, median {}",
        figure.name,
        figure.text(Some(own)),
        figure.text(Some(middle))
    );
    if report.get("interrupted").and_then(Value::as_bool) == Some(true) {
        reason.push_str("; ended early");
    }
    let visible = number(report, "link_state.los_visible").zip(number(report, "sweeps"));
    if let Some((seen, sweeps)) = visible.filter(|(_, sweeps)| *sweeps > 0.0) {
        reason.push_str(&format!(
            "; line of sight in {:.0} % of the sweeps",
            100.0 * seen / sweeps
        ));
    }
    Some(Worst {
        flight: shard.flight.text(),
        sigmas,
        reason,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{Build, Flight};
    use serde_json::json;

    fn shard(seed: u64, report: Option<Value>) -> Shard {
        Shard {
            flight: Flight {
                world: "default".into(),
                mode: "best".into(),
                scene: "outdoor".into(),
                seed,
            },
            build: Build {
                version: String::new(),
                executable_crc: 0,
                config_crc: 0,
            },
            error: report.is_none().then(|| "no flight was found".into()),
            report,
        }
    }

    fn flight(seed: u64, position_m: f64) -> Shard {
        shard(
            seed,
            Some(
                json!({"sweeps": 200, "link_state": {"los_visible": 50}, "map": {"precision": 0.99, "accepted": 100},
                "trajectory": {"position_rmse_m": position_m}}),
            ),
        )
    }

    #[test]
    fn median_worst_and_interval_of_nine_flights() {
        let shards: Vec<Shard> = (1..=9).map(|n| flight(n, n as f64 / 10.0)).collect();
        let summary = Summary::of(&shards.iter().collect::<Vec<_>>());
        let line = summary
            .figures
            .iter()
            .find(|line| line.key == "trajectory.position_rmse_m")
            .expect("a line");
        assert_eq!((line.flights, line.median, line.worst), (9, Some(0.5), Some(0.9)));
        // The median of nine lies between the second and the eighth with 96 %.
        let [low, high] = line.median_interval.map(|end| end.expect("known"));
        assert!(
            (0.2..=0.3).contains(&low) && (0.7..=0.8).contains(&high),
            "{low} {high}"
        );
        let pooled = (285.0_f64 / 9.0).sqrt() / 10.0;
        assert!((line.pooled.expect("known") - pooled).abs() < 1e-12);
        assert!(
            summary.text("a test").contains("0.500"),
            "{}",
            summary.text("a test")
        );
    }

    #[test]
    fn smoothed_flights_stand_in_a_table_of_their_own() {
        let mut shards: Vec<Shard> = (1..=3).map(|n| flight(n, 0.4)).collect();
        let plain = Summary::of(&shards.iter().collect::<Vec<_>>());
        assert!(plain.smoothed.is_empty() && !plain.text("a test").contains("smoothed"));
        for (shard, position_m) in shards.iter_mut().zip([0.1, 0.2]) {
            let report = shard.report.as_mut().expect("flown");
            report["smoothed"] = json!({"trajectory": {"position_rmse_m": position_m}});
        }
        let summary = Summary::of(&shards.iter().collect::<Vec<_>>());
        let [line] = summary.smoothed.as_slice() else {
            panic!("{:?}", summary.smoothed);
        };
        assert_eq!(
            (line.key, line.flights, line.worst),
            ("trajectory.position_rmse_m", 2, Some(0.2))
        );
        assert!(
            summary.text("a test").contains("2 flights, smoothed"),
            "{}",
            summary.text("a test")
        );
    }

    #[test]
    fn the_flight_that_is_off_is_named_with_the_reason() {
        let mut shards: Vec<Shard> = (1..=8).map(|n| flight(n, 0.1 + n as f64 / 1000.0)).collect();
        shards.push(flight(9, 1.6));
        shards.push(shard(10, None));
        let summary = Summary::of(&shards.iter().collect::<Vec<_>>());
        let worst = &summary.worst[0];
        assert!(
            worst.flight.contains("seed 9") && worst.sigmas > 100.0,
            "{worst:?}"
        );
        assert!(
            worst.reason.contains("position, rms, m 1.600") && worst.reason.contains("25 % of the sweeps"),
            "{worst:?}"
        );
        assert_eq!(
            summary.failed,
            ["outdoor best, default, seed 10: no flight was found"]
        );
        assert_eq!(summary.flights, 9);
    }
}
