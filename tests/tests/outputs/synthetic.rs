//! A flight without a receiver: the world's truth with small errors on it, written down as a receiver would have. Only
//! paths, poses and states are made up; reflection points come from the core's own solver and map.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction, Matrix3, Position, Rotation, Vector3};
use cslam_core::inertial::ImuSample;
use cslam_core::map::PointCloud;
use cslam_core::path::{Departure, Path, diagonal_covariance};
use cslam_core::reflection::{Ends, Form, Gates, Verdict, solve};
use cslam_host_sim::flight::{FlightConfig, FlightPlan};
use cslam_host_sim::flight_log::{
    Downlink, FlightLog, Header, Innovation, LinkEstimate, MapVoxel, MeasuredPath, Measurement, PointRecord,
    PoseEstimate, PoseRecord, PoseTruth, SweepEstimate, SweepRecord, SweepTruth,
};
use cslam_host_sim::paths::{Link, LinkPath};
use cslam_host_sim::random::Stream;
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::{SensedFlight, SensorsConfig, Truth};
use cslam_host_sim::tracer::Tracer;

/// Standard deviations of what is made up.
const POSITION_M: f64 = 0.06;
const ATTITUDE_RAD: f64 = 0.0015;
const CLOCK_S: f64 = 0.3e-9;
const RANGE_M: f64 = 0.03;
const ANGLE_RAD: f64 = 0.001;
const DEPARTURE_RAD: f64 = 0.03;
/// Poses between two sweeps.
const POSES_A_SWEEP: u32 = 5;
/// Strongest paths that are measured.
const PATHS: usize = 9;
/// SNR of a path with a gain of 1, dB: a budget, not a channel.
const SNR_AT_UNIT_GAIN_DB: f64 = 118.0;

/// Errors that wander: each step keeps most of the last one.
struct Wander {
    stream: Stream,
    state: [f64; 7],
}

impl Wander {
    /// Seven errors of unit standard deviation.
    fn step(&mut self) -> [f64; 7] {
        const KEEP: f64 = 0.95;
        for value in &mut self.state {
            *value = KEEP * *value + (1.0 - KEEP * KEEP).sqrt() * self.stream.normal();
        }
        self.state
    }
}

/// Flies `duration_s` through a scene.
pub(crate) fn fly(scene: &Scene, duration_s: f64, seed: u64) -> FlightLog {
    let config = FlightConfig {
        duration_s,
        ..FlightConfig::default()
    };
    let plan = FlightPlan::plan(scene, &config, seed).expect("there is room");
    let flight = SensedFlight::new(plan, SensorsConfig::default(), seed).expect("default sensors");
    let tracer = Tracer::new(scene, 3).expect("three reflections");
    let schedule = flight.plan().schedule();
    let header = Header {
        mode: "best".into(),
        scene: scene.name().to_owned(),
        world: None,
        seed,
        planned_sweeps: flight.plan().sweeps() as usize,
        sweep_period_s: schedule.sweep_period_s,
        delay_cycle_m: None,
    };
    let mut map = Box::new(PointCloud::<4096>::new());
    let mut log = FlightLog::new(header, f64::from(map.edge_m()));
    let mut wander = Wander {
        stream: Stream::new(seed, 77),
        state: [0.0; 7],
    };
    for sweep in 0..flight.plan().sweeps() {
        let time_s = schedule.sweep_time_s(sweep);
        for k in (0..POSES_A_SWEEP).rev() {
            let time_s = time_s - f64::from(k) * schedule.sweep_period_s / f64::from(POSES_A_SWEEP);
            log.poses.push(pose(&flight.truth(time_s), &wander.step()));
        }
        let last = log.poses.last().expect("just made").to_owned();
        let truth = flight.sweep_truth(sweep);
        let tree = tracer.transmitter(truth.gmt_position_m.into());
        let rx_m: [f64; 3] = truth.uav.position_m.into();
        let link = tree.to_link(rx_m, &tree.trace(rx_m));
        listen(&mut log, &mut map, &last, &truth, link, sweep, seed);
    }
    log.map = map.points().map(MapVoxel::from).collect();
    log.downlink = Downlink {
        packets: log.points.len() as u64,
        bytes: 8 * log.points.len() as u64,
        points: log.points.len() as u64,
        point_bytes: 8 * log.points.len() as u64,
    };
    log
}

fn pose(truth: &Truth, errors: &[f64; 7]) -> PoseRecord {
    let [x, y, z, a, b, c, clock] = *errors;
    let turn = nalgebra::Rotation3::new(Vector3::new(a, b, c) * ATTITUDE_RAD) * truth.uav.attitude;
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&turn);
    let square = |sigma: f64| {
        let v = sigma * sigma;
        [[v, 0.0, 0.0], [0.0, v, 0.0], [0.0, 0.0, v]]
    };
    PoseRecord {
        time_s: truth.time_s,
        estimate: Some(PoseEstimate {
            position_m: (truth.uav.position_m + Vector3::new(x, y, z) * POSITION_M).into(),
            quaternion_wb: [q.w, q.i, q.j, q.k],
            velocity_m_per_s: (truth.uav.velocity_m_per_s + Vector3::new(y, z, x) * 0.05).into(),
            position_covariance_m2: square(POSITION_M),
            attitude_covariance_rad2: square(ATTITUDE_RAD),
            velocity_covariance_m2_per_s2: square(0.05),
            clock_offset_s: Some(truth.clock_offset_s + clock * CLOCK_S),
            clock_sigma_s: Some(CLOCK_S),
        }),
        truth: Some(PoseTruth {
            position_m: truth.uav.position_m.into(),
            quaternion_wb: truth.uav.quaternion_wb(),
            velocity_m_per_s: truth.uav.velocity_m_per_s.into(),
            clock_offset_s: truth.clock_offset_s,
        }),
    }
}

/// One sweep: measures the link, solves and maps its points, and writes it all down.
fn listen(
    log: &mut FlightLog,
    map: &mut PointCloud<4096>,
    at: &PoseRecord,
    truth: &Truth,
    link: Link,
    sweep: u32,
    seed: u64,
) {
    let mut stream = Stream::new(seed, 1000 + u64::from(sweep));
    let estimate = at.estimate.expect("made with one");
    let attitude = Rotation::<Body, _, f64>::from_quaternion(estimate.quaternion_wb).expect("unit");
    let ends = Ends {
        uav: Position::from_vector(estimate.position_m.into()).expect("finite"),
        uav_covariance: Matrix3::identity() * (POSITION_M * POSITION_M),
        gmt: Position::from_vector(truth.gmt_position_m).expect("finite"),
    };
    let gmt_index = sweep / 2;
    let clock_m = estimate.clock_offset_s.expect("made with one") * SPEED_OF_LIGHT_M_PER_S;
    let mut paths = Vec::new();
    for path in link.paths.iter().take(PATHS) {
        let [re, im] = path.gain.expect("traced");
        let snr_db = 10.0 * (re * re + im * im).log10() + SNR_AT_UNIT_GAIN_DB;
        if snr_db < 0.0 {
            continue;
        }
        let (measured, seen) = measure(path, truth, clock_m, &mut stream);
        let first_order = path.order == Some(1);
        // Right in 99 of 100.
        let said = if stream.uniform() < 0.99 {
            first_order
        } else {
            !first_order
        };
        let probability = if said {
            0.8 + 0.2 * stream.uniform()
        } else {
            0.5 * stream.uniform()
        };
        let world = seen.to_world(&attitude, &(Matrix3::identity() * (ATTITUDE_RAD * ATTITUDE_RAD)));
        let verdict = match solve(&ends, &world, Form::Vector, &Gates::default()) {
            Ok(Verdict::Accepted(_)) if !said => "higher order by its features",
            Ok(Verdict::Accepted(point)) => {
                let f32_point = cslam_core::reflection::ReflectionPoint {
                    position: Position::from_vector(point.position.vector().map(|c| c as f32))
                        .expect("finite"),
                    covariance: point.covariance.map(|c| c as f32),
                    distance_m: point.distance_m as f32,
                };
                map.insert(&f32_point).expect("near the origin");
                log.points.push(PointRecord {
                    sweep,
                    path: paths.len() as u8,
                    order: 1,
                    reflection: 1,
                    surface: None,
                    mapped_sweep: None,
                    time_s: truth.time_s,
                    gmt_index,
                    position_m: f32_point.position.to_array().map(f64::from),
                    covariance_trace_m2: point.covariance.trace(),
                    probability: Some(probability),
                    snr_db: Some(snr_db),
                });
                "ok"
            }
            Ok(Verdict::Rejected(reason)) => reason.as_str(),
            Err(error) => error.as_str(),
        };
        if verdict != "ok" {
            *log.counters.entry(verdict.to_owned()).or_default() += 1;
        }
        paths.push(MeasuredPath {
            snr_db: Some(snr_db),
            probabilities: Some([0.0, probability, 1.0 - probability]),
            verdict: verdict.to_owned(),
            ..measured
        });
    }
    let los = link.paths.iter().any(|p| p.order == Some(0));
    let state = cslam_host_sim::flight_log::link_state_of(&link).expect("traced");
    let told = if stream.uniform() < 0.97 {
        state
    } else {
        (state + 1) % 4
    };
    let mut probabilities = [0.02; 3];
    if let Some(best) = usize::from(told)
        .checked_sub(1)
        .and_then(|k| probabilities.get_mut(k))
    {
        *best = 0.96;
    }
    log.sweeps.push(SweepRecord {
        sweep,
        time_s: truth.time_s,
        estimate: SweepEstimate {
            pose: Some(estimate),
            gmt_position_m: Some(truth.gmt_position_m.into()),
            gmt_index,
            link: (!paths.is_empty()).then_some(LinkEstimate {
                state: told,
                probabilities: Some(probabilities),
            }),
            paths,
            los_used: los && told == 1,
            innovations: innovations(los, &mut stream),
        },
        truth: SweepTruth {
            pose: at.truth,
            link: Some(link),
            matches: Vec::new(),
        },
    });
}

/// A path as measured in body axes: for the log (clock on it) and for the solver (estimated clock off it).
fn measure(
    path: &LinkPath,
    truth: &Truth,
    clock_m: f64,
    stream: &mut Stream,
) -> (MeasuredPath, Path<Body, f64>) {
    let direction = |zenith: f64, azimuth: f64| {
        Vector3::new(
            zenith.sin() * azimuth.cos(),
            zenith.sin() * azimuth.sin(),
            zenith.cos(),
        )
    };
    let mut bent = |v: Vector3<f64>, sigma: f64| v + Vector3::from_fn(|_, _| stream.normal()) * sigma;
    let world = direction(path.aoa_zenith_rad, path.aoa_azimuth_rad);
    let body = bent(truth.uav.attitude.inverse() * world, ANGLE_RAD);
    let aoa = Direction::<Body, f64>::from_vector(body).expect("not zero");
    let away = direction(
        path.aod_zenith_rad.expect("traced"),
        path.aod_azimuth_rad.expect("traced"),
    );
    let away = bent(away, DEPARTURE_RAD);
    let c_tau_m = (path.delay_s + truth.clock_offset_s) * SPEED_OF_LIGHT_M_PER_S + stream.normal() * RANGE_M;
    let logged = MeasuredPath {
        c_tau_m,
        aoa_zenith_rad: aoa.zenith_rad(),
        aoa_azimuth_rad: aoa.azimuth_rad(),
        snr_db: None,
        probabilities: None,
        verdict: String::new(),
    };
    let seen = Path {
        c_tau_m: c_tau_m - clock_m,
        aoa,
        aod: Some(Departure {
            direction: Direction::from_vector(away).expect("not zero"),
            sigma_rad: DEPARTURE_RAD,
        }),
        covariance: diagonal_covariance(0.1, ANGLE_RAD),
    };
    (logged, seen)
}

fn innovations(los: bool, stream: &mut Stream) -> Vec<Innovation> {
    let kinds: &[(Measurement, u32, f64)] = if los {
        &[(Measurement::Los, 5, 27.0), (Measurement::Timing, 1, 9.0)]
    } else {
        &[(Measurement::Timing, 1, 9.0)]
    };
    let mut draw = |&(measurement, dof, gate): &(Measurement, u32, f64)| {
        let outlier = if stream.uniform() < 0.02 { 40.0 } else { 1.0 };
        let nis = outlier * (0..dof).map(|_| stream.normal().powi(2)).sum::<f64>();
        Innovation {
            measurement,
            dof,
            nis,
            test_ratio: nis / gate,
            accepted: nis <= gate,
        }
    };
    kinds.iter().map(&mut draw).collect()
}

/// An inertial sensor that hovers, ten times per second for as long as there are poses, its rate the number of the sample.
pub(crate) fn imu(log: &FlightLog) -> Vec<ImuSample> {
    let end_s = log.poses.last().map_or(0.0, |pose| pose.time_s);
    (0..=(end_s * 10.0) as u16)
        .map(|number| ImuSample {
            time_ns: u64::from(number) * 100_000_000,
            rate_rad_per_s: Vector3::new(f32::from(number), 0.0, 0.0),
            specific_force_m_per_s2: Vector3::new(0.0, 0.0, 9.81),
        })
        .collect()
}
