//! Flights for the Monte Carlo: planned, traced and sensed once, then flown by any number of filters.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::localization::ImuSample;
use nalgebra::Vector3;

use crate::flight::{FlightConfig, FlightPlan, Motion};
use crate::input::InputError;
use crate::scene::Scene;
use crate::sensors::{Beacon, Event, SensedFlight, SensorsConfig};
use crate::tracer::{DEFAULT_MAX_ORDER, TracedPath, Tracer};

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
    /// Planes that reflected it, from the GMT on, by their place in [`planes_of`]; none of the line of sight, and where more than two did.
    pub planes: [Option<usize>; 2],
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
    /// The strongest paths, strongest first: as many as a receiver keeps (design section 7, K = 9).
    pub paths: Vec<TruePath>,
}

impl TrueSweep {
    /// The line-of-sight path.
    pub fn sight(&self) -> Option<&TruePath> {
        self.paths.iter().find(|path| path.order == 0)
    }
}

/// Paths that a receiver keeps.
const PATHS: usize = 9;

/// Normal of a plane, and a point in the middle of its faces, m.
type NormalAndMiddle = (Vector3<f64>, Vector3<f64>);

/// Normal of every flat surface of a scene, and a point in its middle, m. Faces in one plane count once.
pub fn planes_of(scene: &Scene) -> Vec<NormalAndMiddle> {
    flat(scene).0
}

/// The planes of a scene, and the place among them of each face's.
fn flat(scene: &Scene) -> (Vec<NormalAndMiddle>, Vec<usize>) {
    let mut planes: Vec<(Vector3<f64>, Vector3<f64>, f64)> = Vec::new();
    let mut of_faces = Vec::new();
    for face in scene.faces() {
        let normal = *face.normal();
        let middle = face.vertices().iter().sum::<Vector3<f64>>() / face.vertices().len() as f64;
        let same = |other: &(Vector3<f64>, Vector3<f64>, f64)| {
            (other.0 - normal).norm() < 1e-6 && normal.dot(&(other.1 - middle)).abs() < 1e-3
        };
        let place = planes.iter().position(same).unwrap_or(planes.len());
        of_faces.push(place);
        match planes.get_mut(place) {
            Some((_, mean, faces)) => {
                *mean = (*mean * *faces + middle) / (*faces + 1.0);
                *faces += 1.0;
            }
            None => planes.push((normal, middle, 1.0)),
        }
    }
    let planes = planes.into_iter().map(|(normal, middle, _)| (normal, middle));
    (planes.collect(), of_faces)
}

/// What the receiver gets besides paths.
#[derive(Clone, Copy, Debug)]
pub enum Heard {
    /// Inertial sample.
    Inertial(ImuSample),
    /// Two-way timing, offset in m.
    Timing(f64),
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
    /// Plan and sensors.
    pub sensed: SensedFlight,
    /// Everything heard, in order, with UAV time stamps in ns.
    pub heard: Vec<(u64, Heard)>,
}

impl Prepared {
    /// Plans, traces and senses the flight of `seed`.
    ///
    /// # Errors
    /// [`InputError`] when a figure is out of range or the scene has no room.
    pub fn new(
        scene: &Scene,
        flight: &FlightConfig,
        sensors: &SensorsConfig,
        seed: u64,
    ) -> Result<Self, InputError> {
        let tracer = Tracer::new(scene, DEFAULT_MAX_ORDER)
            .ok_or_else(|| InputError::new("more reflections are asked for than the tracer can follow"))?;
        let plan = FlightPlan::plan(scene, flight, seed)?;
        let sensed = SensedFlight::new(plan, sensors.clone(), seed)?;
        let (_, of_faces) = flat(scene);
        let (mut sweeps, mut tree) = (Vec::new(), None);
        for sweep in 0..sensed.plan().sweeps() {
            let truth = sensed.sweep_truth(sweep);
            let gmt: [f64; 3] = truth.gmt_position_m.into();
            if !matches!(&tree, Some((place, _)) if *place == gmt) {
                tree = Some((gmt, tracer.transmitter(gmt)));
            }
            let paths = tree.as_ref().map_or(Vec::new(), |(_, tree)| {
                strongest(tree.trace(truth.uav.position_m.into()), &of_faces)
            });
            sweeps.push(TrueSweep {
                motion: truth.uav,
                gmt_m: truth.gmt_position_m,
                clock_offset_m: truth.clock_offset_s * SPEED_OF_LIGHT_M_PER_S,
                paths,
            });
        }
        Ok(Self {
            seed,
            sweeps,
            heard: hear(&sensed),
            sensed,
        })
    }
}

fn strongest(mut paths: Vec<TracedPath>, of_faces: &[usize]) -> Vec<TruePath> {
    let power = |path: &TracedPath| path.gain().iter().map(|part| part * part).sum::<f64>();
    paths.sort_by(|a, b| power(b).total_cmp(&power(a)));
    paths
        .iter()
        .take(PATHS)
        .map(|path| true_path(path, of_faces))
        .collect()
}

fn true_path(path: &TracedPath, of_faces: &[usize]) -> TruePath {
    let vector = |[zenith, azimuth]: [f64; 2]| {
        let (sz, cz) = libm::sincos(zenith);
        let (sa, ca) = libm::sincos(azimuth);
        Vector3::new(sz * ca, sz * sa, cz)
    };
    let plane = |face: u32| of_faces.get(face as usize).copied();
    TruePath {
        order: path.order(),
        length_m: path.length_m(),
        arrival: vector(path.arrival_rad()),
        departure: vector(path.departure_rad()),
        planes: match *path.faces() {
            [one] => [plane(one), None],
            [one, two] => [plane(one), plane(two)],
            _ => [None; 2],
        },
    }
}

/// All events in order.
fn hear(sensed: &SensedFlight) -> Vec<(u64, Heard)> {
    let mut heard = Vec::new();
    for stamped in sensed.events() {
        let at = stamped.uav_time_ns;
        match stamped.event {
            Event::Imu(sample) => {
                heard.push((at, Heard::Inertial(sample.at(at))));
            }
            // Of no use beside line of sight, and outages here are too short for it.
            Event::Magnetometer(_) | Event::Barometer(_) => {}
            Event::Timing(sample) => {
                heard.push((at, Heard::Timing(sample.clock_offset_s * SPEED_OF_LIGHT_M_PER_S)));
            }
            Event::Sweep { sweep } => heard.push((at, Heard::Sweep(sweep))),
            Event::Beacon(beacon) => heard.push((at, Heard::Beacon(beacon))),
        }
    }
    heard
}
