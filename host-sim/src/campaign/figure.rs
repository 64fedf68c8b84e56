//! The figures that a campaign looks at: where they stand in a report, which way is better, and how those of flights become one.

use serde_json::Value;

use crate::statistics;

/// How the figures of flights become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pooled {
    /// Mean.
    Mean,
    /// Root of the mean square: of figures that are rms themselves.
    Rms,
    /// Mean weighted by another figure: of shares, the share over all flights together.
    By(&'static str),
}

/// A figure of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Name in tables, unit included.
    pub name: &'static str,
    /// Where it stands in `report.json`: keys with a dot between.
    pub key: &'static str,
    /// Whether more is better.
    pub more_is_better: bool,
    /// What it is multiplied by for a table.
    pub scale: f64,
    /// Decimals in a table.
    pub decimals: usize,
    /// Over all flights.
    pub pooled: Pooled,
}

const fn share(name: &'static str, key: &'static str, pooled: Pooled) -> Figure {
    Figure {
        name,
        key,
        more_is_better: true,
        scale: 100.0,
        decimals: 1,
        pooled,
    }
}

const fn error(name: &'static str, key: &'static str, pooled: Pooled) -> Figure {
    Figure {
        name,
        key,
        more_is_better: false,
        scale: 1.0,
        decimals: 3,
        pooled,
    }
}

/// The figures of a campaign, in the order of its table.
pub const FIGURES: [Figure; 16] = [
    share(
        "correct reflection order, %",
        "map.precision",
        Pooled::By("map.accepted"),
    ),
    share(
        "correct surface, %",
        "map.precision_by_faces",
        Pooled::By("map.accepted"),
    ),
    share(
        "correct surface, edges aside, %",
        "map.precision_edges_aside",
        Pooled::By("map.accepted"),
    ),
    share(
        "first-order paths accepted, %",
        "map.recall_first_order",
        Pooled::By("map.first_order.paths"),
    ),
    Figure {
        scale: 1.0,
        decimals: 0,
        ..share("accepted points", "map.accepted", Pooled::Mean)
    },
    error("map to surface, rms, m", "map.surface_rmse_m", Pooled::Rms),
    error(
        "accepted points to surface, rms, m",
        "map.accepted_surface_rmse_m",
        Pooled::Rms,
    ),
    share("lit walls mapped, %", "map.completeness_0p5m", Pooled::Mean),
    error("position, rms, m", "trajectory.position_rmse_m", Pooled::Rms),
    error(
        "position, median, m",
        "trajectory.position_median_m",
        Pooled::Mean,
    ),
    error("attitude, rms, deg", "trajectory.attitude_rmse_deg", Pooled::Rms),
    error("clock, rms, ns", "clock.rmse_ns", Pooled::Rms),
    share(
        "class of the strongest path right, %",
        "link_state.measured.strongest_right",
        Pooled::Mean,
    ),
    share(
        "class of every path right, %",
        "link_state.measured.right",
        Pooled::By("link_state.measured.paths"),
    ),
    share(
        "P(first order) >= .8 right, %",
        "link_state.measured.sure_precision",
        Pooled::Mean,
    ),
    share(
        "first order with P >= .8, %",
        "link_state.measured.sure_recall",
        Pooled::Mean,
    ),
];

/// A number of a report; `None` where there is none.
pub fn number(report: &Value, key: &str) -> Option<f64> {
    key.split('.')
        .try_fold(report, |value, part| value.get(part))?
        .as_f64()
}

impl Figure {
    /// The figure of a key.
    pub fn by_key(key: &str) -> Option<&'static Self> {
        FIGURES.iter().find(|figure| figure.key == key)
    }

    /// The figure of a flight.
    pub fn of(&self, report: &Value) -> Option<f64> {
        number(report, self.key)
    }

    /// The figure of a flight, and what it weighs among others.
    pub fn weighed(&self, report: &Value) -> Option<(f64, f64)> {
        let weight = match self.pooled {
            Pooled::Mean | Pooled::Rms => 1.0,
            Pooled::By(key) => number(report, key)?,
        };
        Some((self.of(report)?, weight))
    }

    /// The figure of all flights together, of what each [weighs](Self::weighed).
    pub fn pool(&self, flights: impl IntoIterator<Item = (f64, f64)>) -> Option<f64> {
        let is_rms = self.pooled == Pooled::Rms;
        let (mut sum, mut all) = (0.0, 0.0);
        for (value, weight) in flights {
            sum += weight * if is_rms { value * value } else { value };
            all += weight;
        }
        (all > 0.0).then(|| if is_rms { (sum / all).sqrt() } else { sum / all })
    }

    /// The worse end of a list: the value that 90 % of the flights are no worse than (`share` .9), or the worst (1).
    pub fn worse(&self, values: &[f64], share: f64) -> Option<f64> {
        let place = if self.more_is_better { 1.0 - share } else { share };
        statistics::quantile(values, place)
    }

    /// How a value stands in a table.
    pub fn text(&self, value: Option<f64>) -> String {
        value.map_or_else(
            || "-".to_owned(),
            |value| format!("{:.*}", self.decimals, value * self.scale),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::Evaluation;
    use crate::report::Report;
    use serde_json::json;

    #[test]
    fn every_figure_has_its_place_in_a_report() {
        let report = Report::new(
            &crate::test_flight::log_of(Vec::new()),
            &Evaluation::default(),
            0.0,
        );
        let report = serde_json::to_value(&report).expect("serialises");
        for figure in &FIGURES {
            let mut value = &report;
            for part in figure.key.split('.') {
                value = value.get(part).unwrap_or_else(|| panic!("no {}", figure.key));
            }
        }
        assert!(report["map"]["first_order"]["paths"].is_u64());
    }

    #[test]
    fn a_share_is_pooled_over_the_points_not_over_the_flights() {
        let of = |precision, accepted| json!({"map": {"precision": precision, "accepted": accepted}});
        let (many, few) = (of(1.0, 900), of(0.5, 100));
        let weighed = [&many, &few].map(|report| FIGURES[0].weighed(report).expect("known"));
        let pooled = FIGURES[0].pool(weighed).expect("known");
        assert!((pooled - 0.95).abs() < 1e-12);
        assert_eq!(FIGURES[0].worse(&[1.0, 0.5], 1.0), Some(0.5));
        let error = FIGURES
            .iter()
            .find(|figure| !figure.more_is_better)
            .expect("errors");
        assert_eq!(error.worse(&[0.1, 0.5], 1.0), Some(0.5));
        assert_eq!(FIGURES[0].pool([]), None);
    }
}
