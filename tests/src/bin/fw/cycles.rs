//! Cycles of a Cortex-M7 that the flight may have taken: a profile of the emulated board, and a committed table of what it comes to.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, bail};
use cslam_tests::cost::{counts, rises};
use cslam_tests::cycles::instruction::Class;
use cslam_tests::cycles::profile::{Profile, Work};
use cslam_tests::root;

use crate::arguments::Arguments;
use crate::budget::{CLOCK_HZ, Excess, SWEEPS_PER_S};

/// Kernels that the table shows: the hottest.
const SHOWN: usize = 10;
/// Instructions of the same flight.
const COMMITTED: &str = "tests/golden/receiver_cost.txt";
/// The piece of work that keeps the thread for longest.
const LONGEST: &str = "end of sweep";

/// Compiles the plugin of the emulator.
pub(crate) fn build_plugin(library: &Path) -> anyhow::Result<()> {
    let status = Command::new("cc")
        .args(["-O2", "-shared", "-fPIC", "-o"])
        .arg(library)
        .arg(root().join("tests/tools/instruction_profile.c"))
        .status()
        .context("cc does not start; install a C compiler")?;
    if !status.success() {
        bail!("the profile's plugin does not compile");
    }
    Ok(())
}

/// Prints the table of a profile, and compares or writes it.
pub(crate) fn report(arguments: &Arguments, profile: &str) -> anyhow::Result<()> {
    let committed = std::fs::read_to_string(root().join(COMMITTED))
        .with_context(|| format!("{COMMITTED} cannot be read"))?;
    let committed = counts(&committed);
    let profile = Profile::read(profile, &committed).map_err(anyhow::Error::msg)?;
    let mut text = String::new();
    for (name, count) in table(&profile, &committed)? {
        text.push_str(&format!("{name}: {count:.0}\n"));
    }
    print!("{text}");
    if let Some(path) = &arguments.write {
        let header = HEADER.replace("SECONDS", &arguments.seconds.to_string());
        std::fs::write(path, header + &text)
            .with_context(|| format!("{} cannot be written", path.display()))?;
    }
    if let Some(path) = &arguments.check {
        let before =
            std::fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
        let over = rises(&counts(&before), &counts(&text));
        if !over.is_empty() {
            return Err(Excess(over).into());
        }
    }
    Ok(())
}

/// Rows of the hottest kernels and of the pieces of work, and the load that they make.
fn table(profile: &Profile, committed: &BTreeMap<String, f64>) -> anyhow::Result<Vec<(String, f64)>> {
    let mut rows = Vec::new();
    for (name, work) in profile.kernels.iter().take(SHOWN) {
        // What is inlined into the measurement of a piece has that piece's name.
        let inlined = if profile.pieces.contains_key(name) {
            " (inlined)"
        } else {
            ""
        };
        rows.extend(row(&format!("kernels, {name}{inlined}"), work, profile.sweeps));
    }
    rows.extend(row("kernels, whole sweep", &profile.all, profile.sweeps));
    for (name, work) in &profile.pieces {
        rows.extend(row(&format!("pieces, {name}"), work, profile.sweeps));
    }
    let count = |name: &str| {
        let found = committed.get(&format!("instructions, {name}")).copied();
        found.with_context(|| format!("{COMMITTED} has no `{name}`"))
    };
    let longest = profile.pieces.get(LONGEST).context("no longest piece")?.cycles();
    let mean = profile.all.cycles();
    // Of the dearest sweep nobody knows which work makes it dear: the least and the most of all pieces bound it.
    let pieces = || profile.pieces.values().map(Work::cycles);
    let least = pieces().map(|cycles| cycles.least).fold(f64::INFINITY, f64::min);
    let most = pieces().map(|cycles| cycles.most).fold(0.0, f64::max);
    let percent = 100.0 * SWEEPS_PER_S / CLOCK_HZ;
    for (name, instructions, scale, bounds) in [
        (
            "mean sweep, %",
            "sweep without checksum, mean",
            percent,
            [mean.least, mean.most],
        ),
        (
            "dearest sweep, %",
            "sweep without checksum, most",
            percent,
            [least, most],
        ),
        (
            "longest piece, ms",
            "end of sweep, most",
            1e3 / CLOCK_HZ,
            [longest.least, longest.most],
        ),
    ] {
        let instructions = count(instructions)?;
        for (bound, cycles) in ["least", "most"].into_iter().zip(bounds) {
            rows.push((format!("load, {name}, {bound}"), instructions * cycles * scale));
        }
    }
    Ok(rows)
}

/// A row: thousands of instructions a sweep, and what a thousand of them are.
fn row(name: &str, work: &Work, sweeps: f64) -> Vec<(String, f64)> {
    let cycles = work.cycles();
    let classes = [
        ("loads", Class::Load),
        ("stores", Class::Store),
        ("single", Class::Single),
        ("double", Class::Double),
        ("divisions", Class::Division),
        ("branches", Class::Branch),
        ("SIMD", Class::Simd),
    ];
    let shares = classes.map(|(column, class)| (column, 1e3 * work.share(class)));
    let all = [("thousands a sweep", work.instructions / sweeps / 1e3)]
        .into_iter()
        .chain(shares)
        .chain([
            ("least cycles", 1e3 * cycles.least),
            ("most cycles", 1e3 * cycles.most),
            ("of them memory", 1e3 * work.memory()),
        ]);
    all.map(|(column, count)| (format!("{name}, {column}"), count))
        .collect()
}

const HEADER: &str = "\
# Cycles of a Cortex-M7 that a flight in the loop may have taken. By kernel and by piece of work: thousands of instructions a sweep, and in a
# thousand of them those of each class, the least and the most cycles, and those of the most that wait for memory. Then the load of 480 MHz.
#
# Made by:  cargo fw --world budget --faults --profile --seconds SECONDS --write tests/golden/receiver_cycles.txt
# With:     what tests/golden/receiver_cost.txt was made with, and that table; rules and sources: tests/src/cycles.
# Checked:  cargo verify --only loop; more than 2 % over this table fails.
";
