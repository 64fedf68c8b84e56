//! Made-up UAVs that send as much as their radio can carry, to load a station with: real packets of the real wire format, about
//! flights that nobody flew.

use cslam_core::estimator::{Health, SweepVerdict};
use cslam_core::link_state::LinkState;
use cslam_core::telemetry::{
    ClockReport, Event, EventReport, HealthCounters, HealthReport, Key, LinkReport, MAX_FRAME, MAX_POINTS,
    Message, PathOutcome, PointBatch, PointReport, PoseReport, ResetCause, Sender, Spread,
};

use crate::random::Stream;

/// Bytes per second that the radio of the budget carries: 57 600 baud, ten bits a byte.
pub const RADIO_BYTES_PER_S: f64 = 5760.0;

/// Time between two poses, s.
const POSE_S: f64 = 0.1;

/// Half the side of the block of walls that a UAV flies around in, m.
const HALF_SIDE_M: f64 = 60.0;

/// A made-up UAV.
#[derive(Debug)]
pub struct MadeUpUav {
    id: u8,
    sender: Sender,
    random: Stream,
    poses: u64,
    bytes: f64,
    points_per_s: f64,
    points: f64,
}

impl MadeUpUav {
    /// A UAV whose packets are signed with a key. It sends `points_per_s` points per second, or as many as fit beside everything
    /// else into [`RADIO_BYTES_PER_S`] when there are more.
    pub fn new(id: u8, key: &Key, seed: u64, points_per_s: f64) -> Self {
        Self {
            id,
            sender: Sender::new(id, key, 0),
            random: Stream::new(seed, u64::from(id)),
            poses: 0,
            bytes: 0.0,
            points_per_s,
            points: 0.0,
        }
    }

    /// Time of its clock, s.
    pub fn time_s(&self) -> f64 {
        self.poses as f64 * POSE_S
    }

    /// The frames of the next tenth of a second, each of them whole.
    pub fn step(&mut self) -> Vec<Vec<u8>> {
        let mut frames = Vec::new();
        let time_s = self.time_s();
        if self.poses == 0 {
            let started = EventReport {
                time_ns: 0,
                event: Event::Started,
            };
            self.send(&Message::Event(started), &mut frames);
        }
        let pose = self.pose(time_s);
        self.send(&Message::Pose(pose), &mut frames);
        if self.poses.is_multiple_of(5) {
            let link = self.link(time_s);
            self.send(&Message::Link(link), &mut frames);
        }
        if self.poses.is_multiple_of(10) {
            let health = self.health(time_s);
            self.send(&Message::Health(health), &mut frames);
        }
        self.points += self.points_per_s * POSE_S;
        let budget = RADIO_BYTES_PER_S * POSE_S * (self.poses + 1) as f64;
        // A batch takes some 200 bytes.
        while self.points >= MAX_POINTS as f64 && self.bytes + 220.0 < budget {
            let batch = self.batch(time_s);
            self.send(&Message::Points(batch), &mut frames);
            self.points -= MAX_POINTS as f64;
        }
        self.points = self.points.min(2.0 * MAX_POINTS as f64 + self.points_per_s);
        self.poses += 1;
        frames
    }

    fn send(&mut self, message: &Message, frames: &mut Vec<Vec<u8>>) {
        let mut frame = [0; MAX_FRAME];
        if let Ok(bytes) = self.sender.encode(message, &mut frame) {
            self.bytes += bytes.len() as f64;
            frames.push(bytes.to_vec());
        }
    }

    /// On a circle within the walls, every UAV on its own.
    fn place(&self, time_s: f64) -> ([f64; 3], f64) {
        let turn = 0.05 * time_s + f64::from(self.id);
        let radius = 15.0 + 0.35 * f64::from(self.id);
        let height = 8.0 + 0.2 * f64::from(self.id % 50);
        ([radius * libm::cos(turn), radius * libm::sin(turn), height], turn)
    }

    fn pose(&self, time_s: f64) -> PoseReport {
        let (position_m, turn) = self.place(time_s);
        let heading = turn + std::f64::consts::FRAC_PI_2;
        let speed = 0.05 * libm::hypot(position_m[0], position_m[1]);
        let spread = |sigma: f32| Spread {
            sigma: [sigma; 3],
            correlation: [0.1, 0.0, -0.1],
        };
        PoseReport {
            time_ns: (time_s * 1e9) as u64,
            position_m,
            velocity_m_per_s: [speed * libm::cos(heading), speed * libm::sin(heading), 0.0].map(|c| c as f32),
            quaternion_wb: [libm::cos(heading / 2.0), 0.0, 0.0, libm::sin(heading / 2.0)].map(|c| c as f32),
            clock: Some(ClockReport {
                offset_s: 1e-7,
                sigma_m: 0.1,
            }),
            position: spread(0.1),
            velocity: spread(0.05),
            attitude: spread(0.003),
            resets: 0,
            health: Health::default(),
            line_of_sight: libm::sin(0.3 * time_s) > -0.5,
        }
    }

    fn link(&mut self, time_s: f64) -> LinkReport {
        let sighted = libm::sin(0.3 * time_s) > -0.5;
        let mut outcomes = heapless::Vec::new();
        for outcome in [
            PathOutcome::LineOfSight,
            PathOutcome::Point,
            PathOutcome::NotFirstOrder,
        ] {
            if sighted || outcome != PathOutcome::LineOfSight {
                // There is room for more.
                let _fits = outcomes.push(outcome);
            }
        }
        LinkReport {
            sweep: (2.0 * time_s) as u32,
            time_ns: (time_s * 1e9) as u64,
            state: if sighted {
                LinkState::LineOfSight
            } else {
                LinkState::FirstOrder
            },
            verdict: if sighted {
                SweepVerdict::Accepted
            } else {
                SweepVerdict::NoSight
            },
            beams: 40,
            snr_db: Some((14.0 + 5.0 * libm::sin(0.3 * time_s) + self.random.normal()) as f32),
            gmt_m: Some([-40.0 + 20.0 * f64::from(self.stop(time_s)), -45.0, 2.0]),
            stop: self.stop(time_s),
            health: Health::default(),
            first_path: 0,
            outcomes,
        }
    }

    /// The GMT moves on every half minute.
    fn stop(&self, time_s: f64) -> u16 {
        (time_s / 30.0) as u16 % 5
    }

    fn health(&self, time_s: f64) -> HealthReport {
        let sweeps = (2.0 * time_s) as u32;
        HealthReport {
            time_ns: (time_s * 1e9) as u64,
            uptime_ms: (time_s * 1e3) as u32,
            load: 0.4,
            free_stack: 60_000,
            reset: ResetCause::PowerOn,
            counters: HealthCounters {
                sweeps,
                blocks: 72 * sweeps,
                imu_samples: (1000.0 * time_s) as u32,
                ..HealthCounters::default()
            },
        }
    }

    /// Points on the walls around, as far as a batch of one flight is spread.
    fn batch(&mut self, time_s: f64) -> PointBatch {
        let mut batch = PointBatch::new();
        let along = 2.0 * std::f64::consts::PI * self.random.uniform();
        for _ in 0..MAX_POINTS {
            let at = along + 0.2 * self.random.uniform();
            let (x, y) = (libm::cos(at), libm::sin(at));
            // From the circle out to the square.
            let out = HALF_SIDE_M / x.abs().max(y.abs());
            let noise = 0.1 * self.random.normal();
            let (wide, probability) = (out + noise, 0.6 + 0.4 * self.random.uniform());
            let report = PointReport {
                sweep: (2.0 * time_s) as u32,
                stop: self.stop(time_s),
                position_m: [wide * x, wide * y, 20.0 * self.random.uniform()].map(|c| c as f32),
                sigma_m: (0.05 + 0.2 * self.random.uniform()) as f32,
                probability: probability as f32,
                surface: None,
            };
            // All of them lie in range, and the batch takes as many.
            let _fits = batch.push(&report);
        }
        batch
    }
}
