//! Flights for the Monte Carlo: planned, traced and sensed once, then flown by any number of filters.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::localization::{ImuErrors, ImuIncrement};
use nalgebra::{Rotation3, Vector3};

use crate::flight::{FlightConfig, FlightPlan, Motion};
use crate::input::InputError;
use crate::scene::Scene;
use crate::sensors::{Beacon, Event, SensedFlight, SensorsConfig};
use crate::tracer::Tracer;

/// A traced path, as far as localization cares.
#[derive(Clone, Copy, Debug)]
pub struct TruePath {
    /// Number of reflections.
    pub order: usize,
    /// Length, m.
    pub length_m: f64,
    /// From the UAV towards the last interaction, world axes.
    pub arrival: Vector3<f64>,
    /// From the GMT towards the first interaction, world axes.
    pub departure: Vector3<f64>,
    /// Index of the reflecting plane in [`Planes`], for one reflection.
    pub plane: Option<usize>,
}

/// Truth at a sweep.
#[derive(Clone, Debug)]
pub struct TrueSweep {
    /// State of the UAV.
    pub motion: Motion,
    /// GMT antenna, m.
    pub gmt_m: Vector3<f64>,
    /// Clock offset, m.
    pub clock_offset_m: f64,
    /// All paths up to two reflections.
    pub paths: Vec<TruePath>,
}

impl TrueSweep {
    /// The line-of-sight path.
    pub fn sight(&self) -> Option<&TruePath> {
        self.paths.iter().find(|path| path.order == 0)
    }
}

/// The flat surfaces of a scene: faces in one plane count once.
#[derive(Clone, Debug)]
pub struct Planes {
    /// Normal, and a point in the middle of the faces, m.
    pub planes: Vec<(Vector3<f64>, Vector3<f64>)>,
    of_face: Vec<usize>,
}

impl Planes {
    /// Those of a scene.
    pub fn of(scene: &Scene) -> Self {
        let mut planes: Vec<(Vector3<f64>, Vector3<f64>, f64)> = Vec::new();
        let of_face = scene
            .faces()
            .iter()
            .map(|face| {
                let normal = *face.normal();
                let count = face.vertices().len() as f64;
                let middle = face.vertices().iter().sum::<Vector3<f64>>() / count;
                let same = |other: &(Vector3<f64>, Vector3<f64>, f64)| {
                    (other.0 - normal).norm() < 1e-6 && normal.dot(&(other.1 - middle)).abs() < 1e-3
                };
                let index = planes.iter().position(same).unwrap_or(planes.len());
                match planes.get_mut(index) {
                    Some((_, sum, faces)) => {
                        *sum = (*sum * *faces + middle) / (*faces + 1.0);
                        *faces += 1.0;
                    }
                    None => planes.push((normal, middle, 1.0)),
                }
                index
            })
            .collect();
        Self {
            planes: planes
                .into_iter()
                .map(|(normal, middle, _)| (normal, middle))
                .collect(),
            of_face,
        }
    }
}

/// What the receiver gets besides paths.
#[derive(Clone, Copy, Debug)]
pub enum Heard {
    /// Inertial increment.
    Inertial(ImuIncrement),
    /// Two-way timing, offset in m.
    Timing(f64),
    /// Magnetic heading field, body axes, uT.
    Magnetic(Vector3<f64>),
    /// A sweep.
    Sweep(u32),
    /// A beacon.
    Beacon(Beacon),
}

/// A flight, ready to be flown.
#[derive(Debug)]
pub struct Prepared {
    /// Seed.
    pub seed: u64,
    /// Truth, sweep by sweep.
    pub sweeps: Vec<TrueSweep>,
    /// True attitude of the mast.
    pub gmt_attitude: Rotation3<f64>,
    /// Everything heard, in order, with UAV time stamps in ns.
    pub heard: Vec<(u64, Heard)>,
    /// Share of sweeps with line of sight.
    pub visible_share: f64,
}

/// Length of an increment, samples.
const SAMPLES: usize = 10;

impl Prepared {
    /// Plans, traces and senses the flight of `seed`.
    ///
    /// # Errors
    /// [`InputError`] when a figure is out of range or the scene has no room.
    pub fn new(
        scene: &Scene,
        planes: &Planes,
        flight: &FlightConfig,
        sensors: &SensorsConfig,
        seed: u64,
    ) -> Result<Self, InputError> {
        let tracer = Tracer::new(scene, 2)
            .ok_or_else(|| InputError::new("more reflections are asked for than the tracer can follow"))?;
        let plan = FlightPlan::plan(scene, flight, seed)?;
        let visible_share = plan.contact().visible_share;
        let sensed = SensedFlight::new(plan, sensors.clone(), seed)?;
        let (mut sweeps, mut tree) = (Vec::new(), None);
        for sweep in 0..sensed.plan().sweeps() {
            let truth = sensed.sweep_truth(sweep);
            let gmt: [f64; 3] = truth.gmt_position_m.into();
            if !matches!(&tree, Some((place, _)) if *place == gmt) {
                tree = Some((gmt, tracer.transmitter(gmt)));
            }
            let paths = tree.as_ref().map_or(Vec::new(), |(_, tree)| {
                tree.trace(truth.uav.position_m.into())
                    .iter()
                    .map(|path| true_path(path, planes))
                    .collect()
            });
            sweeps.push(TrueSweep {
                motion: truth.uav,
                gmt_m: truth.gmt_position_m,
                clock_offset_m: truth.clock_offset_s * SPEED_OF_LIGHT_M_PER_S,
                paths,
            });
        }
        let gmt_attitude = sensed.sweep_truth(0).gmt_attitude;
        Ok(Self {
            seed,
            sweeps,
            gmt_attitude,
            heard: hear(&sensed),
            visible_share,
        })
    }
}

fn true_path(path: &crate::tracer::TracedPath, planes: &Planes) -> TruePath {
    let vector = |[zenith, azimuth]: [f64; 2]| {
        let (sz, cz) = libm::sincos(zenith);
        let (sa, ca) = libm::sincos(azimuth);
        Vector3::new(sz * ca, sz * sa, cz)
    };
    let plane = match path.faces() {
        [face] => planes.of_face.get(*face as usize).copied(),
        _ => None,
    };
    TruePath {
        order: path.order(),
        length_m: path.length_m(),
        arrival: vector(path.arrival_rad()),
        departure: vector(path.departure_rad()),
        plane,
    }
}

/// All events, the inertial ones joined to increments.
fn hear(sensed: &SensedFlight) -> Vec<(u64, Heard)> {
    let mut heard = Vec::new();
    let mut joined = Vec::with_capacity(SAMPLES);
    let mut end_ns = 0;
    for stamped in sensed.events() {
        let at = stamped.uav_time_ns;
        match stamped.event {
            Event::Imu(sample) => {
                joined.push((sample.rate_rad_per_s(), sample.specific_force_m_per_s2()));
                if joined.len() == SAMPLES {
                    heard.push((at, Heard::Inertial(join(end_ns, at, &joined))));
                    joined.clear();
                    end_ns = at;
                }
            }
            Event::Magnetometer(sample) => heard.push((at, Heard::Magnetic(sample.field_ut()))),
            Event::Timing(sample) => {
                heard.push((at, Heard::Timing(sample.clock_offset_s * SPEED_OF_LIGHT_M_PER_S)));
            }
            Event::Sweep { sweep } => heard.push((at, Heard::Sweep(sweep))),
            Event::Beacon(beacon) => heard.push((at, Heard::Beacon(beacon))),
        }
    }
    heard
}

/// Samples joined to an increment, in double precision, nothing taken out.
fn join(start_ns: u64, end_ns: u64, samples: &[(Vector3<f64>, Vector3<f64>)]) -> ImuIncrement {
    let dt = (end_ns - start_ns) as f64 * 1e-9 / samples.len() as f64;
    let mut turn = Rotation3::identity();
    let (mut velocity, mut position) = (Vector3::zeros(), Vector3::zeros());
    for (rate, force) in samples {
        let half = Rotation3::new(rate * (0.5 * dt));
        let gained = turn * half * force * dt;
        position += velocity * dt + gained * (0.5 * dt);
        velocity += gained;
        turn = turn * half * half;
    }
    ImuIncrement {
        start_ns,
        end_ns,
        delta_angle_rad: turn.scaled_axis().map(|c| c as f32),
        delta_velocity_m_per_s: velocity.map(|c| c as f32),
        delta_position_m: position.map(|c| c as f32),
        removed: ImuErrors::default(),
    }
}
