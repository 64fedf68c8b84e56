//! The receiver on an emulated MPS2+ board with the AN500 image (Cortex-M7), in the loop with a simulated world.
//!
//! The host is the world: through the PSRAM, which QEMU shares with it, come the frames of the front end and, in a second ring,
//! everything else that reaches a receiver ([`cslam_firmware::sensor_stream`]). Packets leave by UART1. What else a flight came to,
//! every bit of it, is written to a file of the host by semihosting.
//!
//! Argument: the file for the lines. Exit codes are those of `exit.rs`.
#![no_std]
#![no_main]

#[path = "../icount/clock.rs"]
mod clock;
mod counts;
#[path = "../an500/exit.rs"]
mod exit;
#[path = "../semihosting/lines.rs"]
mod lines;
mod memory;
#[path = "../an500/psram.rs"]
mod psram;
#[path = "../icount/stages.rs"]
mod stages;
#[path = "../an500/uart.rs"]
mod uart;
#[path = "../semihosting/words.rs"]
mod words;

use core::fmt::Write as _;
use core::mem::MaybeUninit;

use cortex_m_rt::entry;
use cslam_core::beam_squint::BeamSquint;
use cslam_core::estimator::states;
use cslam_core::link_state::models;
use cslam_core::paths::EstimatorConfig;
use cslam_core::profile::Radio;
use cslam_core::receiver::{Config, LinkStates, Memory, PATHS, Receiver, SweepReport};
use cslam_core::telemetry::{Decoder, Key};
use cslam_firmware::app::{
    AppConfig, Application, Downlink, Fed, Ground, Map, Observer, PointLine, Stage, SweepLine, VOXELS,
};
use cslam_firmware::front_end::{
    Block, FRAME_LENGTH, FrontEnd, HEADER_LENGTH, SAMPLE_BYTES, SoftwareCrc, read_samples,
};
use cslam_firmware::ring::{Consumer, RingError};
use cslam_firmware::sensor_stream::{self, UAV};
use defmt_semihosting as _;
use embedded_io::Write as _;

use counts::Counts;
use exit::{Exit, exit};
use lines::Lines;
use psram::Psram;
use stages::Stages;
use words::words;

type Best = cslam_firmware::app::Best<&'static Stages>;
type App = Application<'static, Radio<Best>, VOXELS, { states(2) }>;
type Frames = Consumer<Psram, FRAME_LENGTH>;
type Records = Consumer<Psram, { sensor_stream::LENGTH }>;

#[entry]
fn main() -> ! {
    let Some([lines]) = words() else {
        defmt::error!("one argument is expected: the file for the lines");
        exit(Exit::Usage)
    };
    let Some(lines) = Lines::create(&lines) else {
        defmt::error!("the file for the lines cannot be made");
        exit(Exit::Usage)
    };
    let Some(stages) = cortex_m::singleton!(: Stages = Stages::new()) else {
        exit(Exit::Panic)
    };
    let Some(receiver) = receiver(stages) else {
        defmt::error!("the models in flash are damaged");
        exit(Exit::Failed)
    };
    exit(match fly(receiver, stages, lines) {
        Ok(()) => Exit::Done,
        Err(end) => end,
    })
}

/// The application with every part in its place. Each large part is built by a function of its own, never inlined: what it needs on
/// the stack on the way to its place is given back before the next one is built, and is not there in flight.
#[inline(never)]
fn receiver(stages: &'static Stages) -> Option<&'static mut App> {
    let config = Config::best(LinkStates::Trees(models::trees().ok()?));
    let estimator = estimator(stages)?;
    memory::print_built();
    let memory = Memory {
        estimator,
        squint: squint(&config)?,
        map: map()?,
    };
    application(config, memory)
}

/// The application of these parts.
#[inline(never)]
fn application(
    config: Config<'static>,
    memory: Memory<'static, Radio<Best>, VOXELS>,
) -> Option<&'static mut App> {
    // The world's own key: whatever flies in earnest brings one from its storage and refuses this one.
    let ground = Ground {
        downlink: Downlink::new(UAV, &Key::TEST, 0),
        uplink: Decoder::new(UAV, &Key::TEST),
    };
    let place = cortex_m::singleton!(: Option<App> = None)?;
    Some(place.insert(Application::new(
        AppConfig::default(),
        FrontEnd::new(SoftwareCrc, sensor_stream::SESSION),
        ground,
        Receiver::new(config, memory),
    )))
}

#[inline(never)]
#[expect(
    clippy::mut_from_ref,
    reason = "it lies in static memory, apart from the meter"
)]
fn estimator(stages: &'static Stages) -> Option<&'static mut Best> {
    let place = cortex_m::singleton!(: MaybeUninit<Best> = MaybeUninit::uninit())?;
    Some(Best::init(place, &EstimatorConfig::default(), stages))
}

#[inline(never)]
fn squint(config: &Config<'_>) -> Option<&'static mut BeamSquint> {
    let place = cortex_m::singleton!(: Option<BeamSquint> = None)?;
    Some(place.insert(config.beam_squint::<Radio>().ok()?))
}

#[inline(never)]
fn map() -> Option<&'static mut Map> {
    cortex_m::singleton!(: Map = Map::new())
}

/// Sees the flight: counts the work, writes a line for every sweep.
struct Watch {
    counts: Counts,
    lines: Lines,
    failed: bool,
}

impl Observer for Watch {
    fn stage<R>(&mut self, stage: Stage, work: impl FnOnce() -> R) -> R {
        self.counts.measure(stage, work)
    }

    fn swept(&mut self, report: &SweepReport<PATHS>) {
        self.counts.end_sweep(report.paths.is_empty());
        self.failed |= writeln!(self.lines, "{}", SweepLine(report)).is_err();
    }
}

#[inline(never)]
fn fly(receiver: &mut App, stages: &'static Stages, lines: Lines) -> Result<(), Exit> {
    let frame = cortex_m::singleton!(: [u8; FRAME_LENGTH] = [0; FRAME_LENGTH]).ok_or(Exit::Panic)?;
    let samples =
        cortex_m::singleton!(: Block = [[cslam_core::signal::Iq::ZERO; 512]; 32]).ok_or(Exit::Panic)?;
    let mut downlink = uart::Downlink::enable();
    let mut records: Records = open(sensor_stream::RECORDS_AT)?;
    let mut frames: Frames = open(sensor_stream::FRAMES_AT)?;
    let mut watch = Watch {
        counts: Counts::new(stages),
        lines,
        failed: false,
    };
    defmt::info!("flying");
    let mut record = [0; sensor_stream::LENGTH];
    loop {
        await_pop(&mut records, &mut record)?;
        match receiver.record(&record, &mut watch) {
            Ok(Fed::Used) => {}
            Ok(Fed::Frames(count)) => {
                for _ in 0..count {
                    await_pop(&mut frames, frame)?;
                    let (header, bytes) = frame.split_at(HEADER_LENGTH);
                    let (Ok(header), Ok(bytes)) = (header.try_into(), <&[u8; SAMPLE_BYTES]>::try_from(bytes))
                    else {
                        return Err(Exit::Panic);
                    };
                    read_samples(bytes, samples);
                    if let Err(error) = receiver.frame(header, samples, &mut watch) {
                        defmt::warn!("{}", error);
                    }
                    drain(receiver, &mut downlink);
                }
            }
            Ok(Fed::End) => break,
            Err(error) => defmt::warn!("{}", error),
        }
        drain(receiver, &mut downlink);
    }
    receiver.end(&mut watch);
    receiver.close();
    drain(receiver, &mut downlink);
    let Ok(()) = downlink.flush();
    for point in receiver.cslam().map().points() {
        watch.failed |= writeln!(watch.lines, "{}", PointLine(point)).is_err();
    }
    watch.failed |= watch.lines.flush().is_err();
    watch.counts.print();
    memory::print();
    defmt::info!("{}", receiver.counters());
    if watch.failed {
        defmt::error!("the lines could not be written");
        return Err(Exit::Lost);
    }
    Ok(())
}

/// Everything that waits goes out: the emulated wire is as fast as it has to be.
fn drain(receiver: &mut App, downlink: &mut uart::Downlink) {
    let mut bytes = [0; 64];
    loop {
        let taken = receiver.downlink().take(&mut bytes);
        let Some(taken) = bytes.get(..taken).filter(|taken| !taken.is_empty()) else {
            return;
        };
        let Ok(_all) = downlink.write(taken);
    }
}

/// Waits for the host to make a ring. Whoever runs the board sets it a limit; its own clock is one of instructions.
fn open<const SLOT: usize>(at: usize) -> Result<Consumer<Psram, SLOT>, Exit> {
    loop {
        match Consumer::open(Psram::from(at)) {
            Ok(ring) => return Ok(ring),
            Err(RingError::NotReady) => {}
            Err(error) => return Err(unusable(error)),
        }
    }
}

/// Waits for the next slot of a ring.
fn await_pop<const SLOT: usize>(ring: &mut Consumer<Psram, SLOT>, slot: &mut [u8; SLOT]) -> Result<(), Exit> {
    while !ring.pop(slot).map_err(unusable)? {}
    Ok(())
}

fn unusable(error: RingError) -> Exit {
    defmt::error!("a ring cannot be used: {}", error);
    Exit::Ring
}
