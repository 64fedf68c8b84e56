//! A flight from raw samples: the world on one side, the receiver on the other, and nothing between them but what sensors
//! and front end deliver.
//!
//! [`fly`] hands the events of a [`Source`] (a simulated world or a recording) to the [`Application`] that flies on a board, and keeps
//! a [`FlightLog`]. The sweeps are made, or read, ahead on threads of their own while the receiver works; the log does not depend on
//! them.
//!
//! Source and application are of the same radio, whichever that is. Frames as bytes ([`FrontEndLink`]) are the default radio's alone.

mod ahead;
mod board;
mod events;
mod frames;
mod logbook;
mod remap;
mod shared;
mod source;

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use cslam_core::estimator::Counters;
use cslam_core::paths::EstimatedPath;
use cslam_core::receiver::{PATHS, Radio, SweepReport};
use cslam_core::signal::BeamBlock;
use cslam_firmware::app::{Application, Capture, Downlink, Observer, Symbol, VOXELS};

use crate::flight_log::{FlightLog, Header};
use crate::input::InputError;
use crate::sensors::Event;
use ahead::Ahead;
pub use board::{
    BOARD_STATES, BoardMemory, BoardReceiver, board_config, ground, with_board_receiver, with_receiver,
};
pub use events::Recorder;
pub(crate) use events::report;
pub use frames::{FrameBytes, FrontEndLink};
use logbook::Logbook;
pub use logbook::{pose_estimate, verdict};
pub(crate) use remap::{Remap, Remapped};
pub use shared::{Listener, Shared};
pub use source::{Given, Source};

/// Time between two poses in the log, ns: 20 Hz.
const POSE_INTERVAL_NS: u64 = 50_000_000;

/// What the log counts of sweeps that have no bearing because estimated paths are flown.
pub(crate) const UNHEARD: &str = "sighted another path than was kept: no bearing";

/// A sweep that has ended.
#[derive(Clone, Copy, Debug)]
pub struct Swept<'a> {
    /// What the receiver made of it.
    pub report: &'a SweepReport<PATHS>,
    /// Its paths as they were estimated, angles of departure in the axes of the GMT's arrays.
    pub paths: &'a [EstimatedPath],
    /// Index of the path that beam squint listened to.
    pub sighted: Option<usize>,
    /// What has happened to the filter until then, this sweep included; all zero without one.
    pub filter: Counters,
}

/// What the receiver reports of a sweep, until it has been entered into the log.
#[derive(Default)]
struct Reports {
    report: Option<SweepReport<PATHS>>,
    paths: Vec<EstimatedPath>,
    sighted: Option<usize>,
}

impl Observer for Reports {
    fn estimated(&mut self, paths: &[EstimatedPath], sighted: Option<usize>) {
        self.paths = paths.to_vec();
        self.sighted = sighted;
    }

    fn swept(&mut self, report: &SweepReport<PATHS>) {
        self.report = Some(report.clone());
    }
}

/// Flies through what `source` gives until its end, or until `interrupted`. `swept` sees each sweep that has ended, `sent` what goes to the
/// ground as it goes, with the UAV's time, ns.
///
/// # Errors
/// [`InputError`] naming a sweep that cannot be synthesised.
///
/// Returns the log and every byte that went to the ground.
pub fn fly<R, const CHANNELS: usize, const STATES: usize>(
    source: &impl Source<CHANNELS>,
    receiver: &mut Application<'_, R, VOXELS, STATES>,
    header: Header,
    interrupted: &AtomicBool,
    mut swept: impl FnMut(&Swept<'_>),
    sent: impl FnMut(u64, &[u8]),
) -> Result<(FlightLog, Vec<u8>), InputError>
where
    R: for<'b> Radio<Block<'b> = BeamBlock<'b, CHANNELS>>,
{
    let sweeps = u32::try_from(header.planned_sweeps)
        .unwrap_or(u32::MAX)
        .min(source.sweeps());
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let ready = Ahead::begin(scope, source, sweeps, &stop);
        let go_on = |ended: &Swept<'_>| {
            swept(ended);
            !interrupted.load(Ordering::Relaxed)
        };
        let result = receive(source, receiver, header, sweeps, &ready, go_on, sent);
        // The other threads may wait for room: they find their channels closed.
        stop.store(true, Ordering::Relaxed);
        drop(ready);
        result
    })
}

/// Hands events to the receiver in their order. `go_on` is asked after each sweep.
fn receive<R, const CHANNELS: usize, const STATES: usize>(
    source: &impl Source<CHANNELS>,
    receiver: &mut Application<'_, R, VOXELS, STATES>,
    header: Header,
    sweeps: u32,
    ready: &Ahead<CHANNELS>,
    mut go_on: impl FnMut(&Swept<'_>) -> bool,
    mut sent: impl FnMut(u64, &[u8]),
) -> Result<(FlightLog, Vec<u8>), InputError>
where
    R: for<'b> Radio<Block<'b> = BeamBlock<'b, CHANNELS>>,
{
    let mut logbook = Logbook::new(header, receiver.cslam().map().edge_m());
    let mut hand: Option<Given<CHANNELS>> = None;
    let mut reports = Reports::default();
    let mut pose_due_ns = 0;
    let mut now_ns = 0;
    // The first whose samples have not been taken.
    let mut next_sweep = 0;
    // Enters a sweep that has ended; whether to go on.
    let mut enter = |reports: &mut Reports,
                     hand: &mut Option<Given<CHANNELS>>,
                     logbook: &mut Logbook,
                     receiver: &Application<'_, R, VOXELS, STATES>| {
        let Some(report) = reports.report.take() else {
            return true;
        };
        if let Some(heard) = hand.take() {
            logbook.sweep(&report, heard.truth);
        }
        go_on(&Swept {
            report: &report,
            paths: &reports.paths,
            sighted: reports.sighted,
            filter: receiver.cslam().filter_counters(),
        })
    };
    let mut recorder = Recorder::default();
    let mut packets = Vec::new();
    for stamped in source.events() {
        if matches!(stamped.event, Event::Sweep { sweep } if sweep >= sweeps) {
            break;
        }
        let at = stamped.uav_time_ns;
        now_ns = at;
        // A record that is refused is in the receiver's counters.
        if let Some(record) = recorder.record(&stamped) {
            let _refused = receiver.record(&record.encode(), &mut reports);
        }
        match stamped.event {
            Event::Imu(_) if at >= pose_due_ns => {
                pose_due_ns += POSE_INTERVAL_NS;
                // The pose is as old as the last whole inertial step.
                let pose = receiver.cslam().pose();
                let stamp_ns = pose.as_ref().map_or(at, |pose| pose.time_ns);
                let truth = source.truth(stamp_ns);
                let clock_offset_m = pose
                    .as_ref()
                    .and_then(|pose| receiver.cslam().clock_offset_m(pose));
                logbook.pose(stamp_ns, pose.as_ref(), clock_offset_m, truth);
            }
            Event::Sweep { sweep } => {
                // The samples of a sweep whose beginning was lost are lost with it; one that begins again brings none.
                if next_sweep > sweep {
                    continue;
                }
                let Some(heard) = ready.take(sweep) else { break };
                let mut heard = heard?;
                next_sweep = sweep + 1;
                // One that is still open ends now.
                receiver.end(&mut reports);
                if !enter(&mut reports, &mut hand, &mut logbook, receiver) {
                    break;
                }
                // A sweep that has ended is in the receiver's counters.
                let _used = hear(receiver, &mut heard, sweep, at, &mut reports);
                hand = Some(heard);
            }
            Event::Beacon(beacon) => logbook.beacon(beacon.position_m),
            _ => {}
        }
        if !enter(&mut reports, &mut hand, &mut logbook, receiver) {
            break;
        }
        sent(at, drain(receiver.downlink(), &mut packets));
    }
    receiver.end(&mut reports);
    enter(&mut reports, &mut hand, &mut logbook, receiver);
    receiver.close();
    sent(now_ns, drain(receiver.downlink(), &mut packets));
    logbook.add(UNHEARD, receiver.counters().sightings_unheard.into());
    let log = logbook.close(receiver.cslam().map(), &packets);
    Ok((log, packets))
}

/// Takes what waits for the radio and appends it to `packets`; gives what was taken.
pub fn drain<'a>(downlink: &mut Downlink, packets: &'a mut Vec<u8>) -> &'a [u8] {
    let before = packets.len();
    packets.resize(before + downlink.waiting(), 0);
    downlink.take(&mut packets[before..]);
    &packets[before..]
}

/// Hands over all blocks of a sweep, or what was made of them; whether the receiver took them: of a sweep that has ended it takes none.
pub fn hear<R, const CHANNELS: usize, const STATES: usize>(
    receiver: &mut Application<'_, R, VOXELS, STATES>,
    heard: &mut Given<CHANNELS>,
    sweep: u32,
    sweep_ns: u64,
    observer: &mut impl Observer,
) -> bool
where
    R: for<'b> Radio<Block<'b> = BeamBlock<'b, CHANNELS>>,
{
    let mut used = true;
    // A sweep of which no block was there has not begun.
    if let Some(estimated) = heard
        .estimated
        .take()
        .filter(|it| it.beams > 0 || it.pilots > 0 || it.squint_symbols > 0)
    {
        used &= receiver.estimated(sweep, sweep_ns, estimated, observer);
    }
    if !heard.beams.blocks.is_empty() {
        receiver.powers(sweep, sweep_ns, &heard.beams.powers(), observer);
    }
    let beams = heard
        .beams
        .strongest_first()
        .map(|block| Symbol::Beam(block.view()));
    let pilots = heard
        .pilots
        .blocks
        .iter_mut()
        .map(|block| Symbol::Pilot(block.view()));
    let squint = heard
        .squint
        .blocks
        .iter_mut()
        .map(|block| Symbol::Squint(block.view()));
    for symbol in beams.chain(pilots).chain(squint) {
        let capture = Capture {
            sweep,
            sweep_ns,
            symbol,
        };
        used &= receiver.capture(capture, observer);
    }
    used
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::FlightConfig;
    use crate::scene::Scene;
    use crate::sensors::faults::{TransportFault, Traveller};
    use crate::world::{Profile, World, WorldConfig};

    /// Flies eight sweeps whose beginnings fare as `fault` says: numbers of the sweeps in the log, and how far from where the UAV was
    /// in each of them the samples were that it was given, m.
    fn flown(lost: f64, doubled: f64) -> Vec<(u32, f64)> {
        let scene = Scene::load("outdoor").expect("built in");
        let mut config = WorldConfig {
            flight: FlightConfig {
                duration_s: 4.0,
                rest_s: 0.5,
                ..FlightConfig::default()
            },
            ..WorldConfig::of(Profile::Budget)
        };
        config.sensors.faults.transport.push(TransportFault {
            events: vec![Traveller::Sweep],
            start_s: 0.0,
            duration_s: 1e9,
            lost,
            doubled,
            late: 0.0,
            late_by_s: 0.0,
        });
        let world = World::new(&scene, config, 3).expect("a flight");
        let header = Header {
            mode: "best".into(),
            scene: "outdoor".into(),
            world: Some(world.profile().name().to_owned()),
            seed: 3,
            planned_sweeps: 8,
            sweep_period_s: 0.5,
            delay_cycle_m: None,
        };
        let never = AtomicBool::new(false);
        let log = with_board_receiver(|receiver| {
            let (log, _) = fly(&world, receiver, header, &never, |_| (), |_, _| ())?;
            Ok(log)
        });
        let log = log.expect("flown");
        let sweeps = log.sweeps.iter();
        sweeps
            .map(|s| {
                let heard_m: nalgebra::Vector3<f64> = s.truth.link.as_ref().expect("known").rx.into();
                let true_m = world.flight().sweep_truth(s.sweep).uav.position_m;
                (s.sweep, (heard_m - true_m).norm())
            })
            .collect()
    }

    #[test]
    fn a_sweep_has_its_own_samples_whatever_became_of_those_before() {
        for (lost, doubled) in [(0.4, 0.0), (0.0, 0.5)] {
            let sweeps = flown(lost, doubled);
            let numbers: Vec<u32> = sweeps.iter().map(|s| s.0).collect();
            assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
            assert_eq!(sweeps.len() == 8, lost == 0.0, "{numbers:?}");
            assert!(sweeps.len() > 2);
            for (sweep, apart_m) in &sweeps {
                assert!(
                    *apart_m < 1e-9,
                    "sweep {sweep}: samples of a place {apart_m} m away"
                );
            }
        }
    }
}
