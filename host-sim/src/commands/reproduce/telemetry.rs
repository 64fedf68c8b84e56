//! `cslam reproduce telemetry`: what the link to the ground costs, and what it does when the radio is bad.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use cslam_core::telemetry::Key;

use crate::commands::fly::raw::{Hooks, fly_world};
use crate::config::{Mode, ReceiverConfig};
use crate::input::limits::PACKETS;
use crate::input::{InputError, read_bytes};
use crate::link_traffic::{BAUD, Budget, damage, loss, rivals};
use crate::progress;
use crate::raw_flight::Swept;
use crate::scene::Scene;
use crate::table::Table;
use crate::world::{Profile, World, WorldConfig};
use cslam_firmware::sensor_stream::UAV;

/// Arguments of `cslam reproduce telemetry`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Which table; all when absent
    #[arg(value_enum)]
    what: Option<What>,
    /// Scene of the flight: outdoor, indoor, street, outdoor_a, city:SEED, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "outdoor")]
    scene: String,
    /// Seed of the flight and of the radio
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Length of the flight, s
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0)]
    duration: f64,
    /// packets.bin of a flight that was flown already, instead of flying
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scene", "duration"])]
    packets: Option<PathBuf>,
    /// Fail when a point costs more than 8 bytes or the fullest second more than half of a 57 600 baud radio
    #[arg(long)]
    check: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum What {
    /// Bytes per point and per second over a flight, raw points and MAVLink messages beside them
    Bytes,
    /// Lost and overtaken packets: what of the map arrives, and when the receiver is in step again
    Loss,
    /// Lost, changed and inserted bytes on a serial line
    Damage,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let wanted = |what| args.what.is_none_or(|wanted| wanted == what);
    if wanted(What::Bytes) {
        let packets = match &args.packets {
            Some(file) => read_bytes(file, &PACKETS)?,
            None => flight(args)?,
        };
        let budget = Budget::new(&packets, UAV, &Key::TEST).ok_or_else(|| {
            let expected = "holds no packet of a simulated flight, version 3, with a time in it";
            args.packets.as_deref().map_or_else(
                || InputError::new("the flight sent nothing"),
                |file| InputError::in_file(file, expected),
            )
        })?;
        println!("{}\n{}", kinds(&budget), points(&budget));
        if args.check {
            check(&budget)?;
        }
    }
    if wanted(What::Loss) {
        println!("{}", loss::table(&loss::grid(args.seed)));
    }
    if wanted(What::Damage) {
        println!("{}", damage::table(&damage::grid(args.seed)));
    }
    Ok(())
}

/// Everything that a flight from raw samples sends.
fn flight(args: &Args) -> anyhow::Result<Vec<u8>> {
    let scene = Scene::load(&args.scene)?;
    let mut config = WorldConfig::of(Profile::Budget);
    config.flight.duration_s = args.duration;
    let world = World::new(&scene, config, args.seed)?;
    let planned = usize::try_from(world.sweeps())?;
    let bar = progress::bar(planned as u64, "flying");
    let hooks = Hooks {
        interrupted: &AtomicBool::new(false),
        swept: |_: &Swept<'_>| bar.inc(1),
        sent: |_: u64, _: &[u8]| {},
    };
    let (_, packets) = fly_world(
        &ReceiverConfig::of(Mode::Best),
        &args.scene,
        &world,
        args.seed,
        planned,
        hooks,
    )?;
    bar.finish_and_clear();
    Ok(packets)
}

/// Most bytes of a point, and most of the radio that a second may take.
const POINT_BYTES: f64 = 8.0;
const RADIO_SHARE: f64 = 0.5;

/// Whether the link is as cheap as is asked for.
fn check(budget: &Budget) -> anyhow::Result<()> {
    let point = budget.bytes_per_point();
    if point.is_none_or(|bytes| bytes > POINT_BYTES) {
        anyhow::bail!("a point costs {point:?} bytes, asked for are {POINT_BYTES} at most");
    }
    let most = RADIO_SHARE * BAUD / 10.0;
    if budget.peak_bytes_per_s as f64 > most {
        anyhow::bail!(
            "a second took {} bytes, asked for are {most} at most",
            budget.peak_bytes_per_s
        );
    }
    Ok(())
}

/// Bytes by kind of message.
fn kinds(budget: &Budget) -> Table {
    let mut table = Table::new([
        "",
        "packets",
        "bytes",
        "bytes per packet",
        "bytes/s",
        "of 57 600 baud, %",
    ]);
    let mut row = |kind: &str, packets: u64, bytes: u64| {
        if packets == 0 {
            return;
        }
        let per_s = bytes as f64 / budget.duration_s;
        table.row([
            kind.to_owned(),
            packets.to_string(),
            bytes.to_string(),
            format!("{:.1}", bytes as f64 / packets as f64),
            format!("{per_s:.1}"),
            format!(
                "{:.1}",
                100.0 * per_s * budget.share_of_radio() / budget.bytes_per_s()
            ),
        ]);
    };
    for kind in &budget.rows {
        row(kind.kind, kind.packets, kind.bytes);
    }
    let sum = |of: fn(&crate::link_traffic::BudgetRow) -> u64| budget.rows.iter().map(of).sum();
    row("all", sum(|row| row.packets), sum(|row| row.bytes));
    table
}

/// A point and everything, ours and others'.
fn points(budget: &Budget) -> Table {
    let mut table = Table::new(["", "bytes per point", "bytes/s, all", "signed"]);
    let decimals = |value: f64| format!("{value:.2}");
    let obstacle = rivals::OBSTACLE_DISTANCE_3D + rivals::MAVLINK_FRAME;
    table.row([
        format!("ours, {} points", budget.points),
        budget.bytes_per_point().map_or_else(String::new, decimals),
        format!("{:.0} (peak {})", budget.bytes_per_s(), budget.peak_bytes_per_s),
        "yes".into(),
    ]);
    table.row([
        "raw PointXYZ, no frame".into(),
        rivals::POINT_XYZ.to_string(),
        "-".into(),
        "no".into(),
    ]);
    table.row([
        "PointXYZ as PCL aligns it, no frame".into(),
        rivals::POINT_XYZ_ALIGNED.to_string(),
        "-".into(),
        "no".into(),
    ]);
    table.row([
        "MAVLink 2 OBSTACLE_DISTANCE_3D".into(),
        obstacle.to_string(),
        "-".into(),
        "no".into(),
    ]);
    table.row([
        "the same signed, with ODOMETRY and SYS_STATUS".into(),
        (obstacle + rivals::MAVLINK_SIGNATURE).to_string(),
        format!("{:.0}", budget.mavlink_bytes_per_s()),
        "yes".into(),
    ]);
    table
}
