//! The pose by phases of a flight: in sight, and in outages by what is taken in them. Where are the errors, and where are they larger than the
//! covariance claims?

use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::figures;
use crate::kept_flight::{KeptFlight, Phase, PhasedSweep, PoseErrors, fly_phases};
use crate::raw_flight::board_config;
use crate::statistics::{mean, median, quantile, rms};

/// Columns.
pub(super) const HEADER: [&str; 9] = [
    "phase",
    "sweeps, %",
    "position, m: rms, median, 95 %",
    "squared error, %",
    "attitude, deg",
    "velocity, m/s",
    "NEES, mean and median: position",
    "attitude",
    "velocity",
];
/// What stands below the table.
pub(super) const NOTE: &str = "NEES: normalised estimation error squared over its dimension. Where the covariance is honest its mean is 1, its median 0.79 (chi-square of \
    three); below, the covariance is too large, above, too small. A few sweeps may make the mean.";

/// A row of the table. Attitude and velocity: root mean squares.
#[derive(Serialize)]
pub(super) struct Line {
    phase: &'static str,
    /// Number, and share of all sweeps.
    sweeps: usize,
    share: Option<f64>,
    /// Position error: rms, median, 95 %; absent without a pose, as all that follows.
    position_m: [Option<f64>; 3],
    /// Share of the sum of all squared position errors.
    squared_share: Option<f64>,
    attitude_deg: Option<f64>,
    velocity_m_per_s: Option<f64>,
    /// Normalised estimation error squared over its dimension, mean and median: of position, attitude and velocity.
    nees: [[Option<f64>; 2]; 3],
}

impl Line {
    fn of(phase: &'static str, own: &[&PhasedSweep], all: &[PhasedSweep]) -> Self {
        let errors: Vec<&PoseErrors> = own.iter().filter_map(|sweep| sweep.errors.as_ref()).collect();
        let each =
            |figure: fn(&PoseErrors) -> f64| -> Vec<f64> { errors.iter().map(|e| figure(e)).collect() };
        let nees = |mahalanobis: fn(&PoseErrors) -> f64| {
            let nees: Vec<f64> = each(mahalanobis).iter().map(|root| root * root / 3.0).collect();
            [mean(nees.iter().copied()), median(&nees)]
        };
        let position_m = each(|e| e.position_m);
        let squared = |m: f64| m * m;
        let whole: f64 = (all.iter())
            .filter_map(|sweep| sweep.errors.map(|e| squared(e.position_m)))
            .sum();
        let part: f64 = position_m.iter().copied().map(squared).sum();
        Self {
            phase,
            sweeps: own.len(),
            share: (!all.is_empty()).then(|| own.len() as f64 / all.len() as f64),
            squared_share: (!errors.is_empty() && whole > 0.0).then(|| part / whole),
            attitude_deg: rms(&each(|e| e.attitude_deg)),
            velocity_m_per_s: rms(&each(|e| e.velocity_m_per_s)),
            nees: [
                nees(|e| e.position_mahalanobis),
                nees(|e| e.attitude_mahalanobis),
                nees(|e| e.velocity_mahalanobis),
            ],
            position_m: [rms(&position_m), median(&position_m), quantile(&position_m, 0.95)],
        }
    }

    pub(super) fn cells(&self) -> Vec<String> {
        let percent = |share: Option<f64>| figures(&[share.map(|share| share * 100.0)], 1);
        let mut cells = vec![
            self.phase.into(),
            percent(self.share),
            figures(&self.position_m, 3),
            percent(self.squared_share),
            figures(&[self.attitude_deg], 2),
            figures(&[self.velocity_m_per_s], 3),
        ];
        cells.extend(self.nees.iter().map(|nees| figures(nees, 2)));
        cells
    }
}

/// A phase in words.
fn name(phase: Phase) -> &'static str {
    match phase {
        Phase::WithoutPose => "no pose",
        Phase::Starting => "first 10 s of a pose",
        Phase::InSight => "in sight",
        Phase::Regained => "in sight, < 1.5 s after an outage",
        Phase::Missed => "line of sight there, not taken",
        Phase::Coasting => "outage: nothing taken yet",
        Phase::Ranges => "outage: delta ranges, range rates",
        Phase::Reflections => "outage: reflections",
        Phase::Bent => "outage: bent line of sight",
        Phase::FalseSight => "outage: false line of sight",
    }
}

/// The rows of these sweeps: one of each phase, one of all.
fn lines(sweeps: &[PhasedSweep]) -> Vec<Line> {
    let of_phase = |phase: Phase| {
        let own: Vec<_> = sweeps.iter().filter(|sweep| sweep.phase == phase).collect();
        Line::of(name(phase), &own, sweeps)
    };
    let all = Line::of("all", &sweeps.iter().collect::<Vec<_>>(), sweeps);
    Phase::ALL.into_iter().map(of_phase).chain([all]).collect()
}

/// Flies the board's receiver through all flights.
pub(super) fn fly(flights: &[KeptFlight<'_>], bar: &ProgressBar) -> anyhow::Result<Vec<Line>> {
    let sweeps = flights
        .par_iter()
        .map(|flight| fly_phases(flight, board_config()?))
        .collect::<anyhow::Result<Vec<_>>>()?
        .concat();
    bar.inc(1);
    Ok(lines(&sweeps))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sweep_is_in_one_row_and_in_the_last() {
        let sweep = |phase, errors| PhasedSweep { phase, errors };
        let off = |position_m: f64| {
            Some(PoseErrors {
                position_m,
                position_mahalanobis: 3.0,
                velocity_mahalanobis: f64::INFINITY,
                ..PoseErrors::default()
            })
        };
        let sweeps = [
            sweep(Phase::WithoutPose, None),
            sweep(Phase::InSight, off(1.0)),
            sweep(Phase::InSight, off(7.0)),
            sweep(Phase::Reflections, off(50.0_f64.sqrt())),
        ];
        let lines = lines(&sweeps);
        let (last, rows) = lines.split_last().expect("rows");
        assert_eq!(rows.len(), Phase::ALL.len());
        assert_eq!(
            (rows.iter().map(|line| line.sweeps).sum::<usize>(), last.sweeps),
            (4, 4)
        );
        let of = |phase| rows.iter().find(|line| line.phase == name(phase)).expect("a row");
        let in_sight = of(Phase::InSight);
        assert_eq!((in_sight.share, in_sight.squared_share), (Some(0.5), Some(0.5)));
        assert_eq!(in_sight.position_m[..2], [Some(5.0), Some(4.0)]);
        assert_eq!(in_sight.nees[0], [Some(3.0); 2]);
        // A covariance that is none is told, not left out.
        assert_eq!(in_sight.nees[2], [Some(f64::INFINITY); 2]);
        let without = of(Phase::WithoutPose);
        assert_eq!((without.share, without.squared_share), (Some(0.25), None));
        assert_eq!(without.cells()[2], "-, -, -");
        assert_eq!(last.cells().len(), HEADER.len());
    }
}
