//! `cslam reproduce localization`: Monte Carlo of the filter, the paper's HPC beside it.

use clap::ValueEnum;
use cslam_core::localization::filter::{ClockClass, FilterConfig};
use cslam_core::localization::hpc::Mode;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

use crate::flight::FlightConfig;
use crate::input::InputError;
use crate::localization::{
    AttitudeSource, Figures, OutageFigures, Outliers, Prepared, Record, Scenario, Start, StartFigures, fly,
    hpc, outage_start_s, planes_of, sighted_start_s,
};
use crate::progress;
use crate::scene::Scene;
use crate::sensors::{ClockConfig, SensorsConfig};
use crate::table::Table;

/// Arguments of `cslam reproduce localization`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Which table; all when absent
    part: Option<Part>,
    /// Flights of two minutes a row; the divergence rows take --many
    #[arg(long, value_name = "N", default_value_t = 24)]
    flights: u64,
    /// Flights of the divergence rows
    #[arg(long, value_name = "N", default_value_t = 200)]
    many: u64,
    /// Scene: a name or a file
    #[arg(long, value_name = "SCENE", default_value = "outdoor")]
    scene: String,
    /// Seed of the first flight; the others count up from it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print one JSON object a row on standard output instead of the tables
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Whole flights: position, attitude, clock, consistency; the paper's HPC beside them
    Flights,
    /// Twenty seconds without line of sight
    Outage,
    /// From nothing to a pose
    Start,
    /// Many flights with outliers: how many are lost
    Divergence,
}

/// Errors of mapped planes: offset m, tilt deg (docs/localization.md, "The model").
const MAP: (f64, f64) = (0.1, 0.2);

/// What the rows share.
struct Bench<'a> {
    args: &'a Args,
    scene: &'a Scene,
    planes: Vec<(Vector3<f64>, Vector3<f64>)>,
}

#[derive(Serialize)]
struct Line<'a, F> {
    table: &'a str,
    row: &'a str,
    #[serde(flatten)]
    figures: &'a F,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    for (key, value) in [("--flights", args.flights), ("--many", args.many)] {
        if !(1..=10_000).contains(&value) {
            return Err(InputError::new(format!("{key} is {value}, expected 1 to 10000")).into());
        }
    }
    let scene = Scene::load(&args.scene)?;
    let bench = Bench {
        args,
        scene: &scene,
        planes: planes_of(&scene),
    };
    let wanted = |part: Part| args.part.is_none_or(|only| only == part);
    if wanted(Part::Flights) {
        bench.flights()?;
    }
    if wanted(Part::Outage) {
        bench.outage()?;
    }
    if wanted(Part::Start) {
        bench.start()?;
    }
    if wanted(Part::Divergence) {
        bench.divergence()?;
    }
    Ok(())
}

/// Sensors with a good TCXO and two-way timing of 0.1 ns white and 0.05 ns fixed, and the filter that knows of it.
fn good_clock(filter: FilterConfig) -> (SensorsConfig, FilterConfig) {
    let mut sensors = SensorsConfig {
        clock: ClockConfig::good_tcxo(),
        ..SensorsConfig::default()
    };
    (sensors.timing.white_ns, sensors.timing.fixed_ns) = (0.1, 0.05);
    (
        sensors,
        filter.with_clock(ClockClass::GoodTcxo).with_two_way_ns(0.1, 0.05),
    )
}

/// When the temperature ramp of flight `k`'s clock turns, s: evenly over 30 to 90. Were it the same time in all flights, their
/// errors would not be independent there, which the band of NEES and NIS assumes.
fn reversal_s(k: u64) -> f64 {
    let golden = (5_f64.sqrt() - 1.0) / 2.0;
    30.0 + 60.0 * (golden * k as f64).fract()
}

impl Bench<'_> {
    fn prepare(
        &self,
        count: u64,
        sensors: &SensorsConfig,
        bar: &ProgressBar,
    ) -> anyhow::Result<Vec<Prepared>> {
        let flights: Result<Vec<_>, InputError> = (0..count)
            .into_par_iter()
            .map(|k| {
                let prepared = self.one(k, sensors);
                bar.inc(1);
                prepared
            })
            .collect();
        Ok(flights?)
    }

    fn one(&self, k: u64, sensors: &SensorsConfig) -> Result<Prepared, InputError> {
        let mut sensors = sensors.clone();
        sensors.clock.ramp_reversal_s = reversal_s(k);
        Prepared::new(
            self.scene,
            &FlightConfig::default(),
            &sensors,
            self.args.seed.wrapping_add(k),
        )
    }

    /// The filter over a flight; with four planes in its state when there is a map.
    fn flown(&self, flight: &Prepared, scenario: &Scenario) -> Vec<Record> {
        if scenario.map.is_some() {
            fly::<f32, 58>(flight, &self.planes, scenario)
        } else {
            fly::<f32, 46>(flight, &self.planes, scenario)
        }
    }

    fn all(&self, flights: &[Prepared], scenario: &Scenario, bar: &ProgressBar) -> Vec<Vec<Record>> {
        let records = flights
            .par_iter()
            .map(|flight| self.flown(flight, scenario))
            .collect();
        bar.inc(1);
        records
    }

    fn flights(&self) -> anyhow::Result<()> {
        let bar = progress::bar(2 * self.args.flights + 9, "flights");
        let default = Scenario::default();
        let (good, good_filter) = good_clock(FilterConfig::default());
        let mut rows: Vec<(&str, Figures)> = Vec::new();
        let flights = self.prepare(self.args.flights, &SensorsConfig::default(), &bar)?;
        for (name, map) in [("filter, no map", None), ("filter, with map", Some(MAP))] {
            let scenario = Scenario { map, ..default };
            rows.push((name, Figures::of(&self.all(&flights, &scenario, &bar))));
        }
        let scenario = Scenario {
            map: Some(MAP),
            most_reflections: 1,
            ..default
        };
        let name = "filter, with map, single reflections only";
        rows.push((name, Figures::of(&self.all(&flights, &scenario, &bar))));
        let scenario = Scenario {
            outliers: Outliers { rate: 0.0, run: 1 },
            ..default
        };
        rows.push((
            "filter, no map, no outliers",
            Figures::of(&self.all(&flights, &scenario, &bar)),
        ));
        for (name, mode, source) in [
            (
                "HPC literal, gyro attitude",
                Mode::Literal,
                AttitudeSource::Gyroscope,
            ),
            (
                "HPC velocity from fixes, gyro",
                Mode::VelocityFromFixes,
                AttitudeSource::Gyroscope,
            ),
            (
                "HPC velocity from fixes, AHRS",
                Mode::VelocityFromFixes,
                AttitudeSource::Reference,
            ),
        ] {
            let records: Vec<_> = flights
                .par_iter()
                .map(|flight| hpc(flight, mode, source))
                .collect();
            bar.inc(1);
            rows.push((name, Figures::of(&records)));
        }
        drop(flights);
        let flights = self.prepare(self.args.flights, &good, &bar)?;
        for (name, map) in [("good clock, no map", None), ("good clock, with map", Some(MAP))] {
            let scenario = Scenario {
                map,
                filter: good_filter,
                ..default
            };
            rows.push((name, Figures::of(&self.all(&flights, &scenario, &bar))));
        }
        bar.finish_and_clear();
        let header = [
            "whole flights (rms m; median, 90 % of flights)",
            "settled",
            "whole flight",
            "in sight, median",
            "attitude deg (x y z)",
            "clock ns",
            "NEES pos/att/clk",
            "in band",
            "NIS",
            "in band",
            "lost",
        ];
        self.print("flights", header, &rows, |f| {
            let triple = |v: [f64; 3]| v.map(|x| figure(x, 2)).join(" ");
            let pair = |rms: f64, [m, p]: [f64; 2]| {
                format!("{} ({}; {})", figure(rms, 3), figure(m, 3), figure(p, 3))
            };
            vec![
                pair(f.settled_m, f.settled_flights_m),
                pair(f.all_m, f.all_flights_m),
                figure(f.sight_median_m, 3),
                format!("{} ({})", figure(f.attitude_deg, 3), triple(f.attitude_axes_deg)),
                figure(f.clock_ns, 3),
                triple(f.nees),
                triple(f.nees_in_band),
                figure(f.nis, 2),
                figure(f.nis_in_band, 2),
                format!("{}/{}", f.lost, f.flights),
            ]
        })
    }

    fn outage(&self) -> anyhow::Result<()> {
        let bar = progress::bar(self.args.flights + 3, "outage");
        let flights = self.prepare(self.args.flights, &SensorsConfig::default(), &bar)?;
        let flights: Vec<_> = flights
            .iter()
            .filter_map(|flight| outage_start_s(flight).map(|start_s| (start_s, flight)))
            .collect();
        let mut rows: Vec<(&str, OutageFigures)> = Vec::new();
        for (name, map, reflected_departure) in [
            ("no map", None, true),
            ("map: delay, AoA, AoD", Some(MAP), true),
            ("map: delay, AoA", Some(MAP), false),
        ] {
            let records: Vec<_> = flights
                .par_iter()
                .map(|&(start_s, flight)| {
                    let scenario = Scenario {
                        map,
                        reflected_departure,
                        outage_s: Some((start_s, start_s + 20.0)),
                        ..Scenario::default()
                    };
                    (start_s, self.flown(flight, &scenario))
                })
                .collect();
            bar.inc(1);
            rows.push((name, OutageFigures::of(&records)));
        }
        bar.finish_and_clear();
        let header = [
            "20 s without line of sight",
            "flights",
            "rms m at 0 s",
            "5 s",
            "10 s",
            "15 s",
            "20 s",
            "end: median",
            "90 %",
            "max",
            "sweeps with reflections",
        ];
        self.print("outage", header, &rows, |f| {
            let mut cells = vec![f.flights.to_string()];
            cells.extend(f.rms_m.iter().chain(&f.end_m).map(|x| figure(*x, 2)));
            cells.push(figure(f.reflections, 2));
            cells
        })
    }

    fn start(&self) -> anyhow::Result<()> {
        let bar = progress::bar(2 * self.args.flights + 2, "start");
        let mut five_mg = SensorsConfig::default();
        five_mg.imu.accel_turn_on_bias_mg = 5.0;
        let mut rows: Vec<(&str, StartFigures)> = Vec::new();
        type Begin = fn(f64) -> Start;
        for (name, sensors, limit, begin) in [
            (
                "gyro bias from rest, 5 mg",
                five_mg,
                [0.3, 0.5],
                Start::FlightAligned as Begin,
            ),
            (
                "all unknown",
                SensorsConfig::default(),
                [0.5, 1.0],
                Start::Flight as Begin,
            ),
        ] {
            let flights = self.prepare(self.args.flights, &sensors, &bar)?;
            let records: Vec<_> = flights
                .par_iter()
                .filter_map(|flight| sighted_start_s(flight).map(|start_s| (start_s, flight)))
                .map(|(start_s, flight)| {
                    let mut scenario = Scenario {
                        start: begin(start_s),
                        ..Scenario::default()
                    };
                    scenario.filter.priors.accel_bias_m_per_s2 *= sensors.imu.accel_turn_on_bias_mg / 20.0;
                    (start_s, self.flown(flight, &scenario))
                })
                .collect();
            bar.inc(1);
            rows.push((name, StartFigures::of(&records, limit)));
        }
        bar.finish_and_clear();
        let header = [
            "start in flight",
            "flights",
            "to m, deg",
            "median s",
            "90 % s",
            "max s",
        ];
        self.print("start", header, &rows, |f| {
            let mut cells = vec![f.flights.to_string(), format!("{}, {}", f.limit[0], f.limit[1])];
            cells.extend(f.time_s.map(|t| figure(t, 1)));
            cells
        })
    }

    fn divergence(&self) -> anyhow::Result<()> {
        let bar = progress::bar(self.args.many, "divergence");
        let cases = [
            ("2 % gross outliers", Outliers { rate: 0.02, run: 1 }),
            ("2 % in runs of 5 equal ones", Outliers { rate: 0.004, run: 5 }),
            ("2 % begin a run of 5 equal ones", Outliers { rate: 0.02, run: 5 }),
        ];
        // One flight at a time: hundreds of them do not fit into memory.
        let flown: Result<Vec<_>, InputError> = (0..self.args.many)
            .into_par_iter()
            .map(|k| {
                let flight = self.one(k, &SensorsConfig::default())?;
                bar.inc(1);
                Ok(cases.map(|(_, outliers)| {
                    let scenario = Scenario {
                        outliers,
                        ..Scenario::default()
                    };
                    self.flown(&flight, &scenario)
                }))
            })
            .collect();
        let flown = flown?;
        bar.finish_and_clear();
        let mut rows: Vec<(&str, Figures)> = Vec::new();
        for (k, (name, _)) in cases.iter().enumerate() {
            let records: Vec<_> = flown.iter().map(|flight| flight[k].clone()).collect();
            rows.push((name, Figures::of(&records)));
        }
        let header = ["outliers", "flights", "lost", "settled m", "median", "90 %"];
        self.print("divergence", header, &rows, |f| {
            vec![
                f.flights.to_string(),
                f.lost.to_string(),
                figure(f.settled_m, 3),
                figure(f.settled_flights_m[0], 3),
                figure(f.settled_flights_m[1], 3),
            ]
        })
    }

    /// Prints the rows of a table.
    fn print<F: Serialize, const N: usize>(
        &self,
        name: &str,
        header: [&str; N],
        rows: &[(&str, F)],
        cells: impl Fn(&F) -> Vec<String>,
    ) -> anyhow::Result<()> {
        let mut table = Table::new(header);
        for (row, figures) in rows {
            if self.args.json {
                let line = Line {
                    table: name,
                    row,
                    figures,
                };
                println!("{}", serde_json::to_string(&line)?);
            } else {
                let mut line = vec![(*row).to_string()];
                line.extend(cells(figures));
                table.row(line);
            }
        }
        if !self.args.json {
            println!("{table}");
        }
        Ok(())
    }
}

/// A figure, or a dash where there is none.
fn figure(value: f64, digits: usize) -> String {
    if value.is_nan() {
        "-".into()
    } else if value.is_infinite() {
        "never".into()
    } else {
        format!("{value:.digits$}")
    }
}
