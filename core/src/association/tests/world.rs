//! Worlds of planes: paths are traced over them, and measured with the errors that the association reckons with.

use heapless::Vec;
use nalgebra::{SMatrix, Vector3};

use crate::association::chain::Chain;
use crate::association::{
    Association, AssociationConfig, Learned, PoseEstimate, ReceivedPath, SweepPaths, associate,
};
use crate::estimator::Transmitter;
use crate::geometry::{Body, Direction, Gmt, Matrix3, Plane, Position, Rotation, World};
use crate::link_state::Probabilities;
use crate::path::Departure;
use crate::surfaces::birth::Birth;
use crate::surfaces::{Kind, Status, Surfaces};

/// Paths of a sweep.
pub(in crate::association) const PATHS: usize = 9;
pub(in crate::association) type Paths = Vec<ReceivedPath, PATHS>;

/// A plane that is known to 2 cm and 1 mrad.
pub(in crate::association) fn wall(centre: [f32; 3], normal: [f32; 3]) -> Plane {
    Plane {
        normal: Direction::from_vector(normal.into()).expect("not zero"),
        centre: Position::new(centre[0], centre[1], centre[2]).expect("finite"),
        covariance: Matrix3::from_diagonal(&Vector3::new(4e-4, 1e-6, 1e-6)),
    }
}

/// Enters a confirmed wall that was seen so far on every side of its centre.
pub(in crate::association) fn confirmed<const N: usize>(
    surfaces: &mut Surfaces<N>,
    plane: &Plane,
    seen_m: f32,
) -> u16 {
    let birth = Birth {
        kind: Kind::Wall,
        plane: *plane,
        log_odds: 5.8,
    };
    let id = surfaces.add(&birth, &Vector3::zeros(), 0).expect("room");
    let surface = surfaces.get_mut(id).expect("there");
    surface.status = Status::Confirmed;
    surface.extent_m = [[-seen_m, seen_m]; 2];
    id
}

/// Normal numbers, the same in every run.
pub(in crate::association) struct Noise(u64);

impl Noise {
    pub(in crate::association) fn seeded(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(in crate::association) fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / 9_007_199_254_740_992.0
    }

    pub(in crate::association) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Both ends of a link, and how the UAV believes to be there.
#[derive(Clone, Copy, Debug)]
pub(in crate::association) struct Link {
    pub(in crate::association) transmitter_m: Vector3<f64>,
    pub(in crate::association) uav_m: Vector3<f64>,
}

impl Link {
    pub(in crate::association) fn between(transmitter: [f64; 3], uav: [f64; 3]) -> Self {
        Self {
            transmitter_m: transmitter.into(),
            uav_m: uav.into(),
        }
    }

    pub(in crate::association) fn transmitter(&self) -> Transmitter {
        Transmitter {
            position_m: self.transmitter_m,
            sigma_m: 0.0,
            attitude: Rotation::<Gmt, World, f64>::identity(),
            reach: crate::array::BeamReach::default(),
        }
    }

    /// A pose known to 4 cm, 1 mrad and 5 cm of clock, which is right.
    pub(in crate::association) fn pose(&self) -> PoseEstimate {
        let sigmas = [0.04, 0.04, 0.04, 1e-3, 1e-3, 1e-3, 0.05];
        PoseEstimate {
            position_m: self.uav_m,
            attitude: Rotation::from_yaw_pitch_roll(0.7, 0.05, -0.03).expect("finite"),
            clock_offset_m: 17.25,
            delay_period: crate::signal::Waveform::default().delay_period(),
            covariance: SMatrix::from_diagonal(&sigmas.map(|s: f64| s * s).into()),
        }
    }

    /// The same with an error drawn from its covariance.
    pub(in crate::association) fn pose_with(&self, noise: &mut Noise) -> PoseEstimate {
        let mut pose = self.pose();
        pose.position_m += Vector3::from_fn(|_, _| 0.04 * noise.normal());
        pose.clock_offset_m += 0.05 * noise.normal();
        let turn = Vector3::from_fn(|_, _| 1e-3 * noise.normal());
        let turn = Rotation::<World, World, f64>::from_rotation_vector(&turn).expect("finite");
        pose.attitude = turn.after(&pose.attitude);
        pose
    }

    /// The path over planes, without an error. `None` when there is none.
    pub(in crate::association) fn path(&self, planes: &[Plane], first_order: f32) -> Option<ReceivedPath> {
        let wide: Vec<Plane<f64>, 3> = planes.iter().map(Plane::to_f64).collect();
        let path = Chain::over(&wide).predict(&self.transmitter_m, &self.uav_m)?;
        let direction =
            |v: &Vector3<f64>| Direction::<World>::from_vector(v.map(|c| c as f32)).expect("unit");
        let body = self.pose().attitude.inverse().apply_vector(&path.arrival);
        let straight = if planes.is_empty() { 0.94 } else { 0.0 };
        Some(ReceivedPath {
            c_tau_m: path.range_m + self.pose().clock_offset_m,
            arrival: Direction::<Body>::from_vector(body.map(|c| c as f32)).expect("unit"),
            departure: Some(Departure {
                direction: direction(&path.departure),
                sigma_rad: 0.003,
            }),
            covariance: Matrix3::identity() * 1e-8,
            power_db: -6.0 * planes.len() as f32,
            probabilities: Some(Probabilities {
                los: straight,
                first_order: first_order * (1.0 - straight),
                higher_order: (1.0 - first_order) * (1.0 - straight),
                artefact: 0.0,
            }),
        })
    }
}

/// A path with errors of a path that stands alone.
pub(in crate::association) fn measured(path: &ReceivedPath, noise: &mut Noise) -> ReceivedPath {
    let mut path = *path;
    path.c_tau_m += 0.02 * noise.normal();
    let (e1, e2) = path.arrival.tangents();
    let [a, b] = [0, 1].map(|_| (0.94e-3 * noise.normal()) as f32);
    path.arrival = Direction::from_vector(path.arrival.vector() + e1 * a + e2 * b).expect("unit");
    if let Some(departure) = &mut path.departure {
        let (e1, e2) = departure.direction.tangents();
        let [a, b] = [0, 1].map(|_| departure.sigma_rad * noise.normal() as f32);
        let turned = departure.direction.vector() + e1 * a + e2 * b;
        departure.direction = Direction::from_vector(turned).expect("unit");
    }
    path
}

/// One sweep: associated and learnt from.
pub(in crate::association) fn sweep<const N: usize>(
    surfaces: &mut Surfaces<N>,
    link: &Link,
    pose: &PoseEstimate,
    paths: &Paths,
    number: u32,
) -> (Association<PATHS>, Learned<N>) {
    let config = AssociationConfig::default();
    let transmitter = link.transmitter();
    let association = associate(paths, pose, &transmitter, surfaces, &config);
    let of = SweepPaths {
        paths,
        pose,
        transmitter: &transmitter,
        sweep: number,
        held: &Vec::new(),
    };
    let learned = surfaces.learn(&association, &of, &config);
    (association, learned)
}
