//! `--check`: the links of a reference list traced and compared.

use std::path::Path;

use serde::Serialize;

use crate::paths;
use crate::table::Table;
use crate::tracer::{Comparison, DiffractionComparison, EDGE_EXCEPTION_M, STRONG_DB, Tally, Tracer};

/// What a comparison comes to, for `--json`.
#[derive(Serialize)]
struct Verdict<'a, C: Serialize> {
    passes: bool,
    #[serde(flatten)]
    comparison: &'a C,
}

/// Comparison of all paths.
pub(super) fn check(tracer: &Tracer<'_>, reference: &Path, json: bool) -> anyhow::Result<()> {
    let found = Comparison::run(tracer, &paths::read(reference)?);
    let summary = format!(
        "{} links; matched paths: c tau within {:.2e} m, angles within {:.2e} rad, gain within {:.4} dB ({} off)",
        found.links, found.worst_length_m, found.worst_angle_rad, found.worst_gain_db, found.gain_off
    );
    let table = tallies([found.confirmed, found.unconfirmed, found.traced]);
    conclude(
        &found,
        found.passes(),
        &format!("{table}{summary}"),
        reference,
        json,
    )
}

/// Comparison of the diffracted paths alone.
pub(super) fn check_diffraction(tracer: &Tracer<'_>, reference: &Path, json: bool) -> anyhow::Result<()> {
    let found = DiffractionComparison::run(tracer, &paths::read(reference)?);
    let summary = format!(
        "{} links, kinds D, RD and DR above {STRONG_DB} dB; matched paths: c tau within {:.2e} m, angles within {:.2e} rad, \
         edge points within {:.2e} m, gain within {:.4} dB ({} off) and {:.5} rad",
        found.links,
        found.worst_length_m,
        found.worst_angle_rad,
        found.worst_point_m,
        found.worst_gain_db,
        found.gain_off,
        found.worst_phase_rad,
    );
    let table = tallies([found.confirmed, found.unconfirmed, found.traced]);
    conclude(
        &found,
        found.passes(),
        &format!("{table}{summary}"),
        reference,
        json,
    )
}

/// Prints what a comparison came to; an error when the paths disagree.
fn conclude<C: Serialize>(
    comparison: &C,
    passes: bool,
    text: &str,
    reference: &Path,
    json: bool,
) -> anyhow::Result<()> {
    if json {
        println!("{}", serde_json::to_string(&Verdict { passes, comparison })?);
    } else {
        println!("{text}");
    }
    anyhow::ensure!(passes, "the traced paths disagree with {}", reference.display());
    Ok(())
}

/// Table of what was found of the confirmed and the other reference paths, and of ours.
fn tallies(of: [Tally; 3]) -> Table {
    let at_edge = format!("within {} mm of an edge", 1e3 * EDGE_EXCEPTION_M);
    let mut table = Table::new(["paths", "all", "matched", at_edge.as_str(), "unexplained"]);
    let names = ["reference, confirmed", "reference, unconfirmed", "traced"];
    for (name, tally) in names.into_iter().zip(of) {
        let counts = [tally.total, tally.matched, tally.at_edge, tally.unexplained()];
        table.row([name.to_owned()].into_iter().chain(counts.map(|n| n.to_string())));
    }
    table
}
