//! A message of every kind, with numbers at rest, in use and at their limits.

use cslam_core::estimator::{Health, SweepVerdict};
use cslam_core::link_state::LinkState;
use cslam_core::reflection::{InputError, Rejection};
use cslam_core::telemetry::{
    BeaconReport, ClockReport, Command, ConfigReport, DownlinkRates, Event, EventReport, FaultRecord,
    HealthCounters, HealthReport, LinkReport, MAX_POINTS, Message, ModeReport, PathOutcome, PointBatch,
    PointReport, PoseReport, ResetCause, Spread, TimingReport, Uplink,
};

/// Nearest f32 of 83.88 km, as far as a point may be.
const FAR_M: f32 = 83_886.0;

fn batch(points: &[PointReport]) -> Message {
    let mut batch = PointBatch::new();
    for point in points {
        batch.push(point).expect("it fits");
    }
    Message::Points(batch)
}

/// A point on a wall, the `n`-th of a flight.
pub(crate) fn wall_point(n: u16) -> PointReport {
    PointReport {
        sweep: 1000 + u32::from(n) / 2,
        stop: n / 7,
        position_m: [41.59 + f32::from(n) * 0.31, 39.09, 2.0 + f32::from(n % 5)],
        sigma_m: 0.04 * f32::from(1 + n % 3),
        probability: 0.99 - f32::from(n % 4) * 0.05,
        surface: None,
    }
}

/// A point on one of a few surfaces, out of the order of sweeps: every fifth has waited for its surface.
fn surface_point(n: u16) -> PointReport {
    let point = wall_point(n);
    PointReport {
        sweep: if n.is_multiple_of(5) {
            point.sweep - 40
        } else {
            point.sweep
        },
        surface: Some([0, 7, 300][usize::from(n % 3)]),
        ..point
    }
}

/// Surfaces whose list takes the most bits: each is above the one before it by a number of as many bits as there are for all.
fn widest_surface(n: usize) -> Option<u16> {
    let code = 2048 * n.min(14) + 4096 * n.saturating_sub(14);
    code.checked_sub(1).map(|number| number as u16)
}

/// A batch as wide as can be: every width of the format is used to the end.
pub(crate) fn widest_batch() -> Message {
    let corner = |n: usize| PointReport {
        sweep: u32::MAX - 255 * (MAX_POINTS - 1 - n) as u32,
        stop: if n.is_multiple_of(2) { 0 } else { u16::MAX },
        position_m: [0, 1, 2].map(|axis| if (n >> axis) & 1 == 0 { FAR_M } else { -FAR_M }),
        sigma_m: if n.is_multiple_of(3) { 0.0 } else { f32::INFINITY },
        probability: f32::from(n.is_multiple_of(5)),
        surface: widest_surface(n),
    };
    batch(&(0..MAX_POINTS).map(corner).collect::<Vec<_>>())
}

fn pose() -> PoseReport {
    PoseReport {
        time_ns: 12_345_678_000,
        position_m: [53.97, 23.24, -2.001],
        velocity_m_per_s: [3.5, -0.01, 0.25],
        quaternion_wb: [0.8, 0.0, 0.0, 0.6],
        clock: Some(ClockReport {
            offset_s: -1.25e-6,
            sigma_m: 0.03,
        }),
        position: Spread {
            sigma: [0.05, 0.04, 0.08],
            correlation: [0.5, -0.25, 1.0],
        },
        velocity: Spread {
            sigma: [0.02, 0.02, 0.01],
            correlation: [-1.0, 0.0, 0.1],
        },
        attitude: Spread {
            sigma: [0.002, 0.003, 0.004],
            correlation: [0.0; 3],
        },
        resets: 3,
        health: Health::default(),
        line_of_sight: true,
    }
}

fn link(outcomes: &[PathOutcome]) -> LinkReport {
    LinkReport {
        sweep: 300,
        time_ns: 150_000_000_000,
        state: LinkState::LineOfSight,
        verdict: SweepVerdict::Accepted,
        beams: 72,
        snr_db: Some(17.5),
        gmt_m: Some([28.2, 23.04, 2.0]),
        stop: 4,
        health: Health {
            dead_reckoning: true,
            ..Health::default()
        },
        first_path: 0,
        outcomes: outcomes.iter().copied().collect(),
    }
}

/// What goes down.
pub(crate) fn down() -> Vec<Message> {
    let flags = Health {
        starting: true,
        contested: true,
        clock_contested: true,
        beacon_implausible: true,
        inertial_missing: true,
        dead_reckoning: true,
        lost: true,
        attitude_lost: true,
    };
    let mut outcomes = vec![
        PathOutcome::Missing,
        PathOutcome::NoPose,
        PathOutcome::Unused,
        PathOutcome::LineOfSight,
        PathOutcome::NotFirstOrder,
        PathOutcome::Tentative,
        PathOutcome::Point,
        PathOutcome::PointOutOfRange,
    ];
    outcomes.extend(InputError::ALL.map(PathOutcome::Input));
    let mut counters = HealthCounters {
        sweeps: 240,
        imu_samples: 120_000,
        ..HealthCounters::default()
    };
    let health = HealthReport {
        time_ns: 120_000_000_000,
        uptime_ms: 119_500,
        load: 0.425,
        free_stack: 31_744,
        reset: ResetCause::PowerOn,
        counters,
    };
    counters.packets_dropped = u32::MAX;
    let event = |event| {
        Message::Event(EventReport {
            time_ns: 5_000,
            event,
        })
    };
    vec![
        batch(&[PointReport {
            sweep: 0,
            stop: 0,
            position_m: [0.0; 3],
            sigma_m: 0.0,
            probability: 0.0,
            surface: None,
        }]),
        batch(&[wall_point(0)]),
        batch(&(0..14).map(wall_point).collect::<Vec<_>>()),
        widest_batch(),
        Message::Pose(pose()),
        Message::Pose(PoseReport {
            time_ns: u64::MAX,
            position_m: [2_147_483.647, -2_147_483.648, 0.0],
            velocity_m_per_s: [327.67, -327.68, 0.0],
            quaternion_wb: [-0.5, 0.5, -0.5, 0.5],
            clock: None,
            position: Spread {
                sigma: [0.0, f32::INFINITY, 1e-4],
                correlation: [0.0; 3],
            },
            resets: 255,
            health: flags,
            line_of_sight: false,
            ..pose()
        }),
        Message::Link(link(&outcomes)),
        Message::Link(link(&Rejection::ALL.map(PathOutcome::Rejected))),
        Message::Link(LinkReport {
            sweep: u32::MAX,
            state: LinkState::Outage,
            verdict: SweepVerdict::TooLate,
            beams: 255,
            snr_db: None,
            gmt_m: None,
            stop: u16::MAX,
            health: flags,
            first_path: 255,
            ..link(&[])
        }),
        Message::Health(HealthReport::default()),
        Message::Health(health),
        Message::Health(HealthReport {
            time_ns: u64::MAX,
            uptime_ms: u32::MAX,
            load: 1.0,
            free_stack: u32::MAX,
            reset: ResetCause::Panic,
            counters,
        }),
        event(Event::Reset(FaultRecord {
            cause: ResetCause::Fault,
            program_counter: 0x0800_1234,
            link_register: 0x0800_4321,
            stage: 9,
            uptime_ms: 86_400_000,
        })),
        event(Event::ConfigAccepted(0xdead_beef)),
        event(Event::ConfigRefused(3)),
        event(Event::Started),
        event(Event::Refixed),
        event(Event::KeyMissing),
        event(Event::StorageDamaged(1)),
        event(Event::MapRestarted),
        Message::Config(ConfigReport {
            version: 1,
            crc: 0x1234_5678,
            mode: ModeReport::Paper,
            firmware: [0, 1, 0],
            map_capacity: 4096,
            voxel_edge_m: 0.25,
        }),
        // Counters that came after the first edition of this version.
        Message::Health(HealthReport {
            counters: HealthCounters {
                timing_refused: 6,
                beacons_refused: 160,
                ..HealthCounters::default()
            },
            ..HealthReport::default()
        }),
        Message::Health(HealthReport {
            counters: HealthCounters {
                uplink_unreserved: u32::MAX,
                ..counters
            },
            ..HealthReport::default()
        }),
        Message::Health(HealthReport {
            counters: HealthCounters {
                starts_refused: 3,
                contrary: u32::MAX,
                ..counters
            },
            ..HealthReport::default()
        }),
        batch(&(0..14).map(surface_point).collect::<Vec<_>>()),
        event(Event::SurfaceWithdrawn(u16::MAX)),
        event(Event::SurfaceMerged { gone: 300, stays: 7 }),
    ]
}

/// What goes up.
pub(crate) fn up() -> Vec<Uplink> {
    let beacon = BeaconReport {
        sweep: 300,
        position_m: [28.2, 23.04, 2.0],
        sigma_m: 0.02,
        heading_pitch_roll_rad: [0.001, -0.000_5, 3.1],
        sweeps_per_stop: 20,
    };
    vec![
        Uplink::Beacon(beacon),
        Uplink::Beacon(BeaconReport {
            sweep: u32::MAX,
            position_m: [54_975_581.0, -54_975_581.0, 0.0],
            sigma_m: 6.5535,
            heading_pitch_roll_rad: [core::f64::consts::PI, -core::f64::consts::PI, 0.0],
            sweeps_per_stop: 65_535,
        }),
        Uplink::Timing(TimingReport {
            time_ns: 12_345_678_901,
            clock_offset_s: -1.25e-6,
        }),
        Uplink::Timing(TimingReport {
            time_ns: u64::MAX,
            clock_offset_s: 89_999.0,
        }),
        Uplink::Command(Command::SetRates(DownlinkRates::default())),
        Uplink::Command(Command::SendConfig),
        Uplink::Command(Command::RestartMap),
        Uplink::Command(Command::Reboot),
    ]
}
