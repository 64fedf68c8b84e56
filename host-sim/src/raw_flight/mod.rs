//! A flight from raw samples: the world on one side, the receiver on the other, and nothing between them but what sensors
//! and front end deliver.
//!
//! [`fly`] hands the events of a [`World`] to a [`Cslam`] one by one, as a board would, and keeps a [`FlightLog`]. The world's
//! sweeps are synthesised ahead on a thread of their own while the receiver works; the log does not depend on it.

mod events;
mod logbook;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use cslam_core::cslam::{CHANNELS, Cslam, PATHS, SweepReport};
use cslam_core::ltd::PathEstimator;
use cslam_core::telemetry::{Key, Sender};

use crate::flight_log::{FlightLog, Header};
use crate::input::InputError;
use crate::sensors::Event;
use crate::world::{HeardSweep, World};
use logbook::Logbook;

/// Sweeps that may lie ready: 6.9 MB each.
const AHEAD: usize = 3;

/// Time between two poses in the log, ns: 20 Hz.
const POSE_INTERVAL_NS: u64 = 50_000_000;

/// Number of the UAV in its packets, which are signed with the published key.
pub const UAV: u8 = 1;

/// A receiver's map on the host: as many voxels as a board has.
pub const VOXELS: usize = 4096;

/// Flies through `world` until its end, or until `interrupted`. `swept` sees the report of each sweep.
///
/// # Errors
/// [`InputError`] naming a sweep that cannot be synthesised.
///
/// Returns the log and every byte that went to the ground.
pub fn fly<E: PathEstimator<CHANNELS, PATHS>, const STATES: usize>(
    world: &World<'_>,
    receiver: &mut Cslam<'_, E, VOXELS, STATES>,
    header: Header,
    interrupted: &AtomicBool,
    mut swept: impl FnMut(&SweepReport<PATHS>),
) -> Result<(FlightLog, Vec<u8>), InputError> {
    let sweeps = u32::try_from(header.planned_sweeps)
        .unwrap_or(u32::MAX)
        .min(world.sweeps());
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let (sender, ready) = sync_channel(AHEAD);
        let halt = &stop;
        scope.spawn(move || synthesise(world, sweeps, halt, &sender));
        let result = receive(world, receiver, header, sweeps, &ready, |report| {
            swept(report);
            !interrupted.load(Ordering::Relaxed)
        });
        // The other thread may wait for room: it finds the channel closed.
        stop.store(true, Ordering::Relaxed);
        drop(ready);
        result
    })
}

type Ready = Result<HeardSweep, InputError>;

/// Makes one sweep after the other until nobody wants more.
fn synthesise(world: &World<'_>, sweeps: u32, stop: &AtomicBool, sender: &SyncSender<Ready>) {
    for sweep in 0..sweeps {
        if stop.load(Ordering::Relaxed) || sender.send(world.sweep(sweep)).is_err() {
            return;
        }
    }
}

/// Hands events to the receiver in their order. `go_on` is asked after each sweep.
fn receive<E: PathEstimator<CHANNELS, PATHS>, const STATES: usize>(
    world: &World<'_>,
    receiver: &mut Cslam<'_, E, VOXELS, STATES>,
    header: Header,
    sweeps: u32,
    ready: &Receiver<Ready>,
    mut go_on: impl FnMut(&SweepReport<PATHS>) -> bool,
) -> Result<(FlightLog, Vec<u8>), InputError> {
    let sender = Sender::new(UAV, &Key::TEST, 0);
    let mut logbook = Logbook::new(header, receiver.map().edge_m(), sender);
    let mut hand: Option<HeardSweep> = None;
    let mut pose_due_ns = 0;
    // Ends the sweep in hand; whether to go on.
    let mut end = |receiver: &mut Cslam<'_, E, VOXELS, STATES>, logbook: &mut Logbook, heard: HeardSweep| {
        receiver.end_sweep().is_none_or(|report| {
            logbook.sweep(&report, heard);
            go_on(&report)
        })
    };
    for stamped in world.flight().events() {
        let at = stamped.uav_time_ns;
        if let Some(heard) = hand.take_if(|heard| events::is_overdue(heard, at, world, &stamped.event))
            && !end(receiver, &mut logbook, heard)
        {
            break;
        }
        match stamped.event {
            Event::Imu(sample) => {
                receiver.imu(&events::imu_sample(at, &sample));
                if at >= pose_due_ns {
                    pose_due_ns += POSE_INTERVAL_NS;
                    // The pose is as old as the last whole inertial step.
                    let pose = receiver.pose();
                    let stamp_ns = pose.as_ref().map_or(at, |pose| pose.time_ns);
                    let truth = world.flight().truth(events::gmt_time_s(world, stamp_ns));
                    let clock_offset_m = pose.as_ref().and_then(|pose| receiver.clock_offset_m(pose));
                    logbook.pose(pose.as_ref(), clock_offset_m, receiver.health(), &truth);
                }
            }
            Event::Magnetometer(sample) => receiver.magnetometer(at, &events::field_ut(&sample)),
            Event::Timing(sample) => receiver.timing(at, sample.clock_offset_s),
            Event::Beacon(said) => {
                match events::beacon(&said) {
                    Some(beacon) => receiver.beacon(at, &beacon),
                    None => logbook.count("beacons with an impossible attitude"),
                }
                if let Some(heard) = hand.take_if(|heard| heard.number == said.sweep)
                    && !end(receiver, &mut logbook, heard)
                {
                    break;
                }
            }
            Event::Sweep { sweep } if sweep < sweeps => {
                let Ok(heard) = ready.recv() else { break };
                let mut heard = heard?;
                receiver.sweep(at, sweep);
                for block in &mut heard.beams.blocks {
                    let _counted = receiver.beam(block.view());
                }
                for block in &mut heard.squint.blocks {
                    receiver.squint(block.view());
                }
                hand = Some(heard);
            }
            Event::Sweep { .. } => break,
        }
    }
    if let Some(heard) = hand {
        end(receiver, &mut logbook, heard);
    }
    Ok(logbook.close(receiver.map()))
}
