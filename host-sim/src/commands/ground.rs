//! `cslam ground`: the ground station.

use std::io::{self, BufWriter, Write};
use std::net::SocketAddr;
use std::path::PathBuf;

use crate::ground::cloud::Size;
use crate::ground::decode::Ears;
use crate::ground::keys::Trust;
use crate::ground::mavlink::Frame;
use crate::ground::playback::{Pace, Playback};
use crate::ground::{self, Inputs, LISTEN, Options, PAGE};
use crate::input::InputError;
use crate::interrupt;

/// Arguments of `cslam ground`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Take packets over UDP on this address (may be repeated); 0.0.0.0:14650 takes them from other machines too [default:
    /// 127.0.0.1:14650, unless there is another input]
    #[arg(long, value_name = "ADDR")]
    listen: Vec<SocketAddr>,
    /// Take packets from a radio on a serial port (may be repeated), at 57600 bit/s when no rate is given
    #[cfg(unix)]
    #[arg(long, value_name = "DEV[:BAUD]")]
    serial: Vec<ground::inputs::SerialPort>,
    /// Take packets from a file: packets.bin of a flight or of a recording
    #[arg(long, value_name = "FILE", conflicts_with_all = FILE_STANDS_ALONE)]
    file: Option<PathBuf>,
    /// With --file: how many times as fast as it was, 0 for at once
    #[arg(long, value_name = "X", default_value_t = 1.0, requires = "file")]
    speed: f64,
    /// With --file: stay when the file ends, and take what is appended to it
    #[arg(long, requires = "file")]
    follow: bool,
    /// With --file: print every message as a JSON line and end
    #[arg(long, requires = "file", conflicts_with_all = ["http", "record", "mavlink", "speed", "follow"])]
    json: bool,
    /// Key file of a UAV, as `cslam key` makes it (may be repeated): packets of other UAVs or with other keys are refused
    #[arg(long, value_name = "FILE", conflicts_with_all = ["unsigned", "test_key"])]
    key: Vec<PathBuf>,
    /// Trust the published key of simulated flights: anybody can forge its packets
    #[arg(long, conflicts_with = "unsigned")]
    test_key: bool,
    /// Take unsigned packets, and no others: anybody can forge them
    #[arg(long)]
    unsigned: bool,
    /// Serve the page on this address; anybody who reaches it sees the map [default: 127.0.0.1:8080]
    #[arg(long, value_name = "ADDR")]
    http: Option<SocketAddr>,
    /// Record into this directory: packets.bin, ground.mcap and, at the end, map.ply
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Send MAVLink 2 to this UDP address
    #[arg(long, value_name = "ADDR")]
    mavlink: Option<SocketAddr>,
    /// With --mavlink: what the frame of the poses is called. ArduPilot takes frd alone and ignores ned without a word; PX4 takes both,
    /// ned with a world whose north is true (docs/autopilots.md)
    #[arg(long, value_name = "FRAME", default_value = "frd", requires = "mavlink")]
    mavlink_frame: Frame,
    /// Draw the walls of a scene behind the map: a built-in one or a file
    #[arg(long, value_name = "NAME|FILE")]
    scene: Option<String>,
    /// Most points of the merged map, about 80 bytes each
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    capacity: u32,
    /// Edge of the voxels in which points are merged, m
    #[arg(long, value_name = "M", default_value_t = 0.25)]
    voxel: f32,
}

#[cfg(unix)]
const FILE_STANDS_ALONE: [&str; 2] = ["listen", "serial"];
#[cfg(not(unix))]
const FILE_STANDS_ALONE: [&str; 1] = ["listen"];

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    // Before anything is opened: from then on an end is a clean one.
    let interrupted = (!args.json).then(interrupt::flag).unwrap_or_default();
    let trust = trust(args)?;
    if let (Some(file), true) = (&args.file, args.json) {
        let mut out = BufWriter::new(io::stdout().lock());
        Playback::open(file)?.print(&mut Ears::new(trust), &mut out)?;
        out.flush()?;
        return Ok(());
    }
    if !(args.voxel.is_finite() && args.voxel >= 0.01) {
        let message = format!("--voxel {}: expected a length of 0.01 m or more", args.voxel);
        return Err(InputError::new(message).into());
    }
    if !(args.speed.is_finite() && args.speed >= 0.0) {
        return Err(InputError::new(format!("--speed {}: expected 0 or more", args.speed)).into());
    }
    let inputs = match &args.file {
        Some(file) => {
            let pace = Pace {
                speed: args.speed,
                follow: args.follow,
            };
            Inputs::File(Playback::open(file)?, pace)
        }
        None => live(args)?,
    };
    let options = Options {
        trust,
        http: args.http.unwrap_or(PAGE),
        record: args.record.clone(),
        mavlink: args.mavlink,
        mavlink_frame: args.mavlink_frame,
        scene: args.scene.clone(),
        size: Size {
            capacity: args.capacity,
            edge_m: args.voxel,
        },
    };
    ground::run(inputs, &options, &interrupted)
}

/// What is heard live.
fn live(args: &Args) -> Result<Inputs, InputError> {
    use crate::ground::inputs::Udp;
    #[cfg(unix)]
    let serial = args.serial.iter().cloned().map(ground::inputs::Serial::open);
    #[cfg(unix)]
    let serial = serial.collect::<Result<Vec<_>, _>>()?;
    #[cfg(unix)]
    let has_other = !serial.is_empty();
    #[cfg(not(unix))]
    let has_other = false;
    let listen = if args.listen.is_empty() && !has_other {
        vec![LISTEN]
    } else {
        args.listen.clone()
    };
    Ok(Inputs::Live {
        udp: listen.into_iter().map(Udp::open).collect::<Result<_, _>>()?,
        #[cfg(unix)]
        serial,
    })
}

fn trust(args: &Args) -> Result<Trust, InputError> {
    match (args.unsigned, args.test_key) {
        (true, _) => Ok(Trust::Unsigned),
        (_, true) => Ok(Trust::Test),
        _ if args.key.is_empty() => Err(InputError::new(
            "packets are taken only when they are signed: give --key FILE, or --test-key for a simulated flight, or --unsigned",
        )),
        _ => Trust::from_files(&args.key),
    }
}
