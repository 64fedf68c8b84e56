//! `cslam reproduce complexity`: what a reflection point costs by the closed forms and by the ways that need no algebra.
//!
//! All solve the same: a point on the ray of arrival whose way to both ends is as long as the path. The paper's system of three
//! equations by Newton's method; the length alone, along the ray, by bisection; and every place on the ray tried in steps of
//! the precision asked for. Counted are evaluations of the length of the way, which are the same on every machine; the time is
//! this machine's.

use std::hint::black_box;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use cslam_core::geometry::{Direction, Matrix3, Position, Real, Vector3, World};
use cslam_core::reflection::{paper_point, vector_point};
use serde::Serialize;

use super::lines::{Curve, Panel, svg, write};
use crate::random::Stream;
use crate::statistics::rms;
use crate::table::Table;

/// Arguments of `cslam reproduce complexity`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Reflections to solve; the paper takes 10 000
    #[arg(long, value_name = "N", default_value_t = 10_000,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=1_000_000))]
    states: usize,
    /// Seed of the reflections
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// File for the plot (.svg)
    #[arg(long, value_name = "FILE", default_value = "out/complexity.svg")]
    out: PathBuf,
    /// Print one JSON object a row on standard output instead of the table
    #[arg(long)]
    json: bool,
}

/// Precisions that the searches are asked for, m.
const PRECISIONS_M: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-6];
/// The finest steps in which the whole ray is tried, m: finer ones take seconds.
const FINEST_STEP_M: f64 = 1e-3;
/// Reflections of which the whole ray is tried.
const TRIED: usize = 200;
/// Runs of which the fastest counts, and reflections of a run.
const RUNS: usize = 7;
const TIMED: usize = 50;
/// Newton steps after which there is no solution.
const MOST_STEPS: u32 = 50;

/// One reflection: the ends, where the wave met the wall, and what the receiver measures of it.
struct State {
    uav: Position<World, f64>,
    gmt: Position<World, f64>,
    aoa: Direction<World, f64>,
    c_tau_m: f64,
    truth_m: Vector3<f64>,
}

/// Reflections anywhere in the paper's volume of 120 m x 120 m x 20 m, up to 80 m from the UAV.
fn states(count: usize, seed: u64) -> Vec<State> {
    let mut stream = Stream::new(seed, 0);
    let mut place = |z: [f64; 2]| {
        let [x, y, share] = [(); 3].map(|()| stream.uniform());
        Vector3::new(120.0 * x, 120.0 * y, z[0] + (z[1] - z[0]) * share)
    };
    let mut states = Vec::with_capacity(count);
    while states.len() < count {
        let (uav, gmt, point) = (place([1.0, 20.0]), place([1.0, 2.0]), place([0.0, 20.0]));
        let arm_m = (point - uav).norm();
        let c_tau_m = arm_m + (point - gmt).norm();
        // No reflection: the point lies between the ends, or is one of them.
        if !(1.0..=80.0).contains(&arm_m) || c_tau_m - (uav - gmt).norm() < 0.5 {
            continue;
        }
        if let (Ok(uav), Ok(gmt), Ok(aoa)) = (
            Position::from_vector(uav),
            Position::from_vector(gmt),
            Direction::from_vector(point - uav),
        ) {
            states.push(State {
                uav,
                gmt,
                aoa,
                c_tau_m,
                truth_m: point,
            });
        }
    }
    states
}

/// A point, and how often the length of the way was evaluated for it.
type Solved = (Option<Vector3<f64>>, u32);

/// A way to solve, to a precision, m.
type Solver = fn(&State, f64) -> Solved;

fn closed_vector(state: &State, _: f64) -> Solved {
    let (uav, u) = (state.uav.vector(), state.aoa.vector());
    let solution = vector_point(&(uav - state.gmt.vector()), u, state.c_tau_m);
    (solution.map(|solution| uav + u * solution.distance_m), 1)
}

fn closed_paper(state: &State, _: f64) -> Solved {
    let point = paper_point(&state.uav, &state.gmt, &state.aoa, state.c_tau_m);
    (point.iter().all(|c| c.is_finite()).then_some(point), 1)
}

/// How much longer the way over a place on the ray is than the path, m: it grows with the distance.
fn excess_m(state: &State, distance_m: f64) -> f64 {
    let point = state.uav.vector() + state.aoa.vector() * distance_m;
    distance_m + (point - state.gmt.vector()).norm() - state.c_tau_m
}

/// Newton's method on the paper's system (geo): tangents of both angles, and the length. From the middle of the path.
fn newton(state: &State, precision_m: f64) -> Solved {
    let (uav, gmt) = (*state.uav.vector(), *state.gmt.vector());
    let tan = state.aoa.azimuth_rad().tan_libm();
    let cot = 1.0 / state.aoa.zenith_rad().tan_libm();
    let mut point = uav + state.aoa.vector() * (0.5 * state.c_tau_m);
    for steps in 1..=MOST_STEPS {
        let (arm, leg) = (point - uav, point - gmt);
        let level = (arm.x * arm.x + arm.y * arm.y).sqrt();
        let [a, b] = [arm.norm(), leg.norm()];
        let residual = Vector3::new(arm.y - tan * arm.x, arm.z - cot * level, a + b - state.c_tau_m);
        let gradient = arm / a + leg / b;
        let jacobian = Matrix3::new(
            -tan,
            1.0,
            0.0,
            -cot * arm.x / level,
            -cot * arm.y / level,
            1.0,
            gradient.x,
            gradient.y,
            gradient.z,
        );
        let Some(inverse) = jacobian.try_inverse() else {
            return (None, steps);
        };
        let step = inverse * residual;
        point -= step;
        if !step.iter().all(|c| c.is_finite()) {
            return (None, steps);
        }
        if step.norm() < precision_m {
            return (Some(point), steps);
        }
    }
    (None, MOST_STEPS)
}

/// Halves the ray until what is left is short enough.
fn bisection(state: &State, precision_m: f64) -> Solved {
    let (mut low, mut high, mut evaluations) = (0.0, state.c_tau_m, 0);
    while high - low > precision_m {
        let middle = 0.5 * (low + high);
        evaluations += 1;
        if excess_m(state, middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let distance_m = 0.5 * (low + high);
    (
        Some(state.uav.vector() + state.aoa.vector() * distance_m),
        evaluations,
    )
}

/// Tries one place on the ray after the other.
fn search(state: &State, precision_m: f64) -> Solved {
    let mut tried = 0;
    loop {
        tried += 1;
        let distance_m = f64::from(tried) * precision_m;
        if excess_m(state, distance_m) >= 0.0 {
            let middle_m = distance_m - 0.5 * precision_m;
            return (Some(state.uav.vector() + state.aoa.vector() * middle_m), tried);
        }
        if distance_m > state.c_tau_m {
            return (None, tried);
        }
    }
}

/// Name, way, whether its cost hangs on the precision, and the most reflections it is given.
const SOLVERS: [(&str, Solver, bool, usize); 5] = [
    ("closed, vector form", closed_vector, false, usize::MAX),
    ("closed, tan/cot form", closed_paper, false, usize::MAX),
    ("Newton on the three equations", newton, true, usize::MAX),
    ("bisection along the ray", bisection, true, usize::MAX),
    ("every place on the ray", search, true, TRIED),
];

/// A row of the table.
#[derive(Clone, Debug, Serialize)]
struct Row {
    solver: &'static str,
    /// `None` where it is that of the number type.
    precision_m: Option<f64>,
    states: usize,
    /// Reflections without a point within 1 m.
    failed: usize,
    /// Mean evaluations of the length of the way.
    evaluations: f64,
    /// Of the points that did not fail.
    rmse_m: Option<f64>,
    /// One point, this machine.
    time_ns: f64,
}

fn measured(name: &'static str, solver: Solver, precision_m: Option<f64>, states: &[State]) -> Row {
    let asked_m = precision_m.unwrap_or(0.0);
    let mut errors_m = Vec::with_capacity(states.len());
    let (mut evaluations, mut failed) = (0.0, 0);
    for state in states {
        let (point, count) = solver(state, asked_m);
        evaluations += f64::from(count);
        match point.map(|point| (point - state.truth_m).norm()) {
            Some(error_m) if error_m < 1.0 => errors_m.push(error_m),
            _ => failed += 1,
        }
    }
    // Of each few the fastest run: a busy machine interrupts some of any.
    let once = |some: &[State]| {
        let start = Instant::now();
        for state in some {
            black_box(solver(black_box(state), black_box(asked_m)));
        }
        start.elapsed().as_secs_f64()
    };
    let fastest = |some| (0..RUNS).map(|_| once(some)).fold(f64::INFINITY, f64::min);
    let seconds: f64 = states.chunks(TIMED).map(fastest).sum();
    let count = states.len() as f64;
    Row {
        solver: name,
        precision_m,
        states: states.len(),
        failed,
        evaluations: evaluations / count,
        rmse_m: rms(&errors_m),
        time_ns: 1e9 * seconds / count,
    }
}

fn rows(states: &[State]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (name, solver, searches, most) in SOLVERS {
        let some = &states[..states.len().min(most)];
        if !searches {
            rows.push(measured(name, solver, None, some));
            continue;
        }
        for precision_m in PRECISIONS_M {
            if most != TRIED || precision_m >= FINEST_STEP_M {
                rows.push(measured(name, solver, Some(precision_m), some));
            }
        }
    }
    rows
}

/// Cost over the precision asked for, both as logarithms.
fn panels(rows: &[Row]) -> Vec<Panel> {
    let curves = |cost: fn(&Row) -> f64| {
        SOLVERS
            .iter()
            .map(|(name, ..)| {
                let own = rows.iter().filter(|row| row.solver == *name);
                // A closed form costs the same at every precision.
                let points = own.flat_map(|row| {
                    let precisions = row.precision_m.map_or(PRECISIONS_M.to_vec(), |m| vec![m]);
                    precisions
                        .into_iter()
                        .map(|m| (-libm::log10(m), libm::log10(cost(row))))
                });
                Curve {
                    name: (*name).into(),
                    points: points.collect(),
                }
            })
            .collect()
    };
    let panel = |y: &str, range, curves| Panel {
        axes: ["precision, -log10 of m".into(), y.into()],
        range,
        curves,
    };
    vec![
        panel(
            "log10 of evaluations per point",
            [-0.2, 5.5],
            curves(|row| row.evaluations),
        ),
        panel("log10 of ns per point", [0.0, 6.5], curves(|row| row.time_ns)),
    ]
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let rows = rows(&states(args.states, args.seed));
    write(&args.out, &svg("cost of a reflection point", &panels(&rows))?)?;
    let mut out = std::io::stdout().lock();
    let mut table = Table::new([
        "solver",
        "precision m",
        "states",
        "failed",
        "evaluations",
        "RMSE m",
        "ns per point",
    ]);
    for row in &rows {
        if args.json {
            writeln!(out, "{}", serde_json::to_string(row)?)?;
            continue;
        }
        table.row([
            row.solver.to_owned(),
            row.precision_m
                .map_or_else(|| "f64".into(), |m| format!("{m:.0e}")),
            row.states.to_string(),
            row.failed.to_string(),
            format!("{:.1}", row.evaluations),
            row.rmse_m.map_or_else(|| "-".into(), |m| format!("{m:.1e}")),
            format!("{:.0}", row.time_ns),
        ]);
    }
    if !args.json {
        writeln!(out, "{table}plot: {}", args.out.display())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_solver_finds_the_point_at_the_cost_of_its_kind() {
        let rows = rows(&states(300, 5));
        let of = |name: &str, precision_m: Option<f64>| {
            let row = rows
                .iter()
                .find(|r| r.solver.starts_with(name) && r.precision_m == precision_m);
            row.unwrap_or_else(|| panic!("{name} {precision_m:?}"))
        };
        for name in ["closed, vector", "closed, tan"] {
            let row = of(name, None);
            assert!(
                row.failed == 0 && row.evaluations == 1.0 && row.rmse_m < Some(1e-6),
                "{row:?}"
            );
        }
        for precision_m in [1e-2, 1e-3] {
            for name in ["bisection", "every place"] {
                let row = of(name, Some(precision_m));
                assert!(row.failed == 0 && row.rmse_m < Some(precision_m), "{row:?}");
            }
        }
        let newton = of("Newton", Some(1e-6));
        assert!(
            newton.rmse_m < Some(1e-6) && newton.evaluations > 3.0,
            "{newton:?}"
        );
        // A digit more: a factor of ten for the search, log2(10) halvings for the bisection.
        let ratio = of("every place", Some(1e-3)).evaluations / of("every place", Some(1e-2)).evaluations;
        assert!((ratio - 10.0).abs() < 0.1, "{ratio}");
        let more = of("bisection", Some(1e-3)).evaluations - of("bisection", Some(1e-2)).evaluations;
        assert!((more - 3.32).abs() < 0.2, "{more}");
    }

    #[test]
    fn reflections_are_what_a_receiver_measures() {
        for state in states(200, 2) {
            let arm_m = (state.truth_m - state.uav.vector()).norm();
            assert!(excess_m(&state, arm_m).abs() < 1e-9 && (1.0..=80.0).contains(&arm_m));
        }
    }
}
