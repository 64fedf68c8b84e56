//! What the flight took of the chip, against the budgets of the design and the committed table.

use std::collections::BTreeMap;
use std::fmt;

use anyhow::Context;
use cslam_host_sim::world::Profile;
use cslam_tests::cost::{counts, rises};

use crate::arguments::Arguments;

/// Clock of an STM32H743, Hz, and sweeps per second.
pub(crate) const CLOCK_HZ: f64 = 480e6;
pub(crate) const SWEEPS_PER_S: f64 = 2.0;
/// Cycles an instruction that the load table is made for. QEMU counts instructions; the processor ends up to two a cycle, and waits
/// for its memory.
const CYCLES: [f64; 3] = [1.0, 1.25, 1.5];
/// Up to so many, even the dearest sweep must end before the next one does; beyond, it is only shown: the front end holds a whole
/// sweep, and the mean is far below.
const PROMISED: f64 = 1.25;
/// Bytes that the design allows (docs/signal-model.md, "Error budget"): static data, flash, three quarters of a stack of 128 KiB.
const ALLOWED: [(&str, f64); 3] = [
    ("bytes, static data", 400.0 * 1024.0),
    ("bytes, flash", 512.0 * 1024.0),
    ("bytes, stack", 96.0 * 1024.0),
];
/// Samples that the sensor's FIFO and the driver's queue hold while the application is busy with one piece of work.
const IMU_QUEUE: f64 = 102.0;
const IMU_HZ: f64 = 1000.0;

/// More than is allowed, or than is committed.
#[derive(Debug)]
pub(crate) struct Excess(pub(crate) Vec<String>);

impl fmt::Display for Excess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join("\n"))
    }
}

impl std::error::Error for Excess {}

/// Lines of the board's log that belong to the table.
fn table(log: &str) -> BTreeMap<String, f64> {
    let mut all = counts(log);
    all.retain(|name, _| name.starts_with("bytes, ") || name.starts_with("instructions, "));
    all
}

/// Static data, flash and stack, against what is allowed.
pub(crate) fn memory(log: &str) -> anyhow::Result<()> {
    let table = table(log);
    let mut over = Vec::new();
    for (name, bytes) in table.iter().filter(|(name, _)| name.starts_with("bytes, ")) {
        match ALLOWED.iter().find(|(allowed, _)| allowed == name) {
            Some((_, allowed)) => println!("{name}: {bytes} of {allowed} allowed"),
            None => println!("{name}: {bytes}"),
        }
    }
    for (name, allowed) in ALLOWED {
        match table.get(name) {
            Some(bytes) if *bytes <= allowed => {}
            Some(bytes) => over.push(format!("{name}: {bytes}, {allowed} are allowed")),
            None => over.push(format!("{name}: the board did not say")),
        }
    }
    ended(over)
}

/// What a sweep may take in the mean over flights, and the dearest of any, in a world: instructions without the checksum of the frames.
fn most_of_flights(world: Profile) -> [f64; 2] {
    match world {
        Profile::Ideal | Profile::Budget => [45e6, 110e6],
        Profile::Real => [60e6, 130e6],
    }
}

/// A row for each of several flights, and whether their sweeps are within what is allowed.
pub(crate) fn flights(world: Profile, logs: &[(String, String)]) -> anyhow::Result<()> {
    println!(
        "million instructions a sweep, without the checksum of the frames, which the chip's own unit makes:"
    );
    println!(
        "{:<14} {:>6} {:>8} {:>20} {:>8}",
        "flight", "mean", "dearest", "without paths: mean", "dearest"
    );
    let (mut sum, mut dearest) = (0.0, 0.0_f64);
    for (name, log) in logs {
        let table = table(log);
        let of = |sweeps: &str| {
            ["mean", "most"].map(|which| {
                let count = table.get(&format!("instructions, {sweeps}, {which}"));
                count.copied().unwrap_or(f64::INFINITY)
            })
        };
        let [mean, most] = of("sweep without checksum");
        let silent = of("sweep without paths").map(|count| match count {
            0.0 => "-".to_owned(),
            count => format!("{:.1}", count / 1e6),
        });
        println!(
            "{name:<14} {:>6.1} {:>8.1} {:>20} {:>8}",
            mean / 1e6,
            most / 1e6,
            silent[0],
            silent[1]
        );
        sum += mean / logs.len() as f64;
        dearest = dearest.max(most);
    }
    let [mean, most] = most_of_flights(world);
    println!(
        "{:<14} {:>6.1} {:>8.1}   of {:.0} and {:.0} allowed",
        "all",
        sum / 1e6,
        dearest / 1e6,
        mean / 1e6,
        most / 1e6
    );
    let mut over = Vec::new();
    if sum > mean {
        over.push(format!(
            "{:.1} million instructions a sweep in the mean",
            sum / 1e6
        ));
    }
    if dearest > most {
        over.push(format!(
            "{:.1} million instructions in the dearest sweep",
            dearest / 1e6
        ));
    }
    ended(over)
}

/// Instructions, the load they make, and the committed table.
pub(crate) fn time(arguments: &Arguments, log: &str) -> anyhow::Result<()> {
    let table = table(log);
    let of = |name: &str| table.get(name).copied().unwrap_or(f64::INFINITY);
    for (name, count) in table
        .iter()
        .filter(|(name, _)| name.starts_with("instructions, "))
    {
        println!("{name}: {count}");
    }
    let [mean, most] =
        ["mean", "most"].map(|which| of(&format!("instructions, sweep without checksum, {which}")));
    let piece = ["beam", "end of beams", "pilot", "squint symbol", "end of sweep"]
        .map(|stage| of(&format!("instructions, {stage}, most")))
        .into_iter()
        .fold(0.0, f64::max);
    println!(
        "\nload of a core of {} MHz at {SWEEPS_PER_S} sweeps per second, by cycles an instruction; without the checksum of the frames, \
         which the chip's own unit makes:",
        CLOCK_HZ / 1e6
    );
    println!("cycles  mean sweep  dearest sweep  longest piece, IMU samples that wait meanwhile");
    let mut over = Vec::new();
    for cycles in CYCLES {
        let load = |instructions: f64| instructions * cycles * SWEEPS_PER_S / CLOCK_HZ;
        let waiting = piece * cycles / CLOCK_HZ * IMU_HZ;
        println!(
            "{cycles:>6}  {:>8.0} %  {:>11.0} %  {:>10.0} ms, {waiting:.0} of {IMU_QUEUE}",
            100.0 * load(mean),
            100.0 * load(most),
            1e3 * piece * cycles / CLOCK_HZ,
        );
        if cycles <= PROMISED && load(most) > 1.0 {
            over.push(format!(
                "at {cycles} cycles an instruction the dearest sweep takes longer than a sweep"
            ));
        }
        if waiting > IMU_QUEUE {
            over.push(format!(
                "at {cycles} cycles an instruction inertial samples are lost"
            ));
        }
    }
    if let Some(path) = &arguments.write {
        let mut text = HEADER.replace("SECONDS", &arguments.seconds.to_string());
        for (name, value) in &table {
            text.push_str(&format!("{name}: {value}\n"));
        }
        std::fs::write(path, text).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    if let Some(path) = &arguments.check {
        let text =
            std::fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
        over.extend(rises(&counts(&text), &table));
    }
    ended(over)
}

fn ended(over: Vec<String>) -> anyhow::Result<()> {
    if over.is_empty() {
        Ok(())
    } else {
        Err(Excess(over).into())
    }
}

const HEADER: &str = "\
# The whole receiver on a Cortex-M7 over a flight in the loop: instructions (not cycles) of each piece of work, mean and most, and the
# most of a sweep; bytes of each stage's memory, of all static data, of flash with the models, and of the stack as it was used.
#
# Made by:  cargo fw --world budget --faults --count --seconds SECONDS --write tests/golden/receiver_cost.txt
# With:     rustc 1.95.0, -C target-cpu=cortex-m7, opt-level 2, fat LTO, one codegen unit; QEMU 7.2.22, mps2-an500, -icount shift=10:
#           the board's 25 MHz counter advances 25.6 ticks an instruction (resolution: one or two).
# Checked:  cargo verify --only loop; more than 2 % over this table fails.
#
# frame: header and CRC-32 of the samples in software; on an STM32H743 the chip's CRC unit does that. end of beams: paths of the
# sweep and which one is the line of sight. end of sweep: link states, pose, points, planes.
";
