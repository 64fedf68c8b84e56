//! Data association: a round of walls, learnt from many sweeps, and digests of every verdict. Equal digests on two machines mean
//! equal bits.
//!
//! The store fills to its last surface. What is counted on a chip is association with a pose that is known as in flight, and with one as after an
//! outage, where nearly every chain of surfaces lies near a path.

use cslam_core::association::chain::Chain;
use cslam_core::association::{
    Association, AssociationConfig, PoseEstimate, ReceivedPath, SweepPaths, associate,
};
use cslam_core::estimator::Transmitter;
use cslam_core::geometry::{Body, Direction, Gmt, Matrix3, Plane, Position, Rotation, Vector3, World};
use cslam_core::link_state::Probabilities;
use cslam_core::path::Departure;
use cslam_core::receiver::{PATHS, SURFACES};
use cslam_core::signal::Waveform;
use cslam_core::surfaces::{SurfaceConfig, Surfaces};
use heapless::Vec;

use crate::digest::Digest;
use crate::random::Random;

/// Walls, one for each place in the store beside the ground's.
const WALLS: usize = SURFACES - 1;
/// Sweeps that are learnt from.
pub const LEARNT: u32 = 160;
/// Sweeps after them, with a pose that is hardly known; nothing is learnt from these.
pub const WIDE: u32 = 16;
/// Errors of a pose in flight and after an outage: position (m), attitude (rad), clock (m).
const SIGMAS: [[f64; 3]; 2] = [[0.05, 2e-3, 0.05], [1.0, 0.05, 0.3]];
/// Clock offset, m.
const OFFSET_M: f64 = 17.25;

/// What is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// Association with a pose as in flight.
    Associate,
    /// Learning from its verdicts.
    Learn,
    /// Association with a pose as after an outage.
    AssociateWide,
}

/// A sweep: both ends, and a pose in error by what it claims.
struct Sweep {
    transmitter: Transmitter,
    uav_m: Vector3<f64>,
    attitude: Rotation<Body, World, f64>,
}

/// Flies past the walls. `measure` wraps each piece of work, `each` takes the number and the digest of every sweep.
///
/// `None` when a figure of this module does not exist as a path, a plane or a rotation, which the tests exclude.
pub fn run(
    surfaces: &mut Surfaces<SURFACES>,
    mut measure: impl FnMut(Work, &mut dyn FnMut()),
    mut each: impl FnMut(u32, u64),
) -> Option<()> {
    let config = AssociationConfig::default();
    let walls = walls()?;
    let mut random = Random::new(7);
    *surfaces = Surfaces::with_ground(SurfaceConfig::default(), Position::new(0.0, 0.0, 0.0).ok()?);
    for number in 0..LEARNT + WIDE {
        let wide = number >= LEARNT;
        let sweep = Sweep::of(number)?;
        let paths = sweep.paths(&walls, number, wide, &mut random)?;
        let pose = sweep.pose(SIGMAS[usize::from(wide)], &mut random)?;
        let mut association = None;
        let work = if wide {
            Work::AssociateWide
        } else {
            Work::Associate
        };
        measure(work, &mut || {
            association = Some(associate(&paths, &pose, &sweep.transmitter, surfaces, &config));
        });
        let association = association?;
        each(number, digest(&association));
        if !wide {
            let of = SweepPaths {
                paths: &paths,
                pose: &pose,
                transmitter: &sweep.transmitter,
                sweep: number,
                held: &Vec::new(),
            };
            measure(Work::Learn, &mut || {
                let _learned = surfaces.learn(&association, &of, &config);
            });
        }
    }
    Some(())
}

/// Walls all around, at five distances.
fn walls() -> Option<Vec<Plane<f64>, WALLS>> {
    let mut walls = Vec::new();
    for index in 0..WALLS {
        let turn = core::f64::consts::TAU * index as f64 / WALLS as f64;
        let away = 30.0 + 4.0 * (index % 5) as f64;
        let inwards = Vector3::new(-libm::cos(turn), -libm::sin(turn), 0.0);
        let plane = Plane {
            normal: Direction::from_vector(inwards).ok()?,
            centre: Position::from_vector(-inwards * away + Vector3::new(0.0, 0.0, 5.0)).ok()?,
            covariance: Matrix3::zeros(),
        };
        walls.push(plane).ok()?;
    }
    Some(walls)
}

/// Uniform from minus the root of three to plus: mean zero, variance one.
fn error(random: &mut Random) -> f64 {
    let wide = f64::from(random.unit());
    3.464_101_615_137_754_5 * (wide - 0.5)
}

impl Sweep {
    /// The UAV flies round the middle, the transmitter moves on after every four sweeps.
    fn of(number: u32) -> Option<Self> {
        let (k, stop) = (f64::from(number), f64::from(number / 4));
        let turn = 0.04 * k;
        Some(Self {
            transmitter: Transmitter {
                position_m: Vector3::new(-4.0 + 0.2 * stop, 3.0 - 0.15 * stop, 1.5),
                sigma_m: 0.0,
                attitude: Rotation::<Gmt, World, f64>::identity(),
                reach: cslam_core::array::BeamReach::default(),
            },
            uav_m: Vector3::new(9.0 * libm::cos(turn), 9.0 * libm::sin(turn), 6.0 + 0.01 * k),
            attitude: Rotation::from_yaw_pitch_roll(0.7, 0.05, -0.03).ok()?,
        })
    }

    /// The line of sight and eight reflections: off one wall each, in turn; with a pose that is hardly known, every other off two.
    fn paths(
        &self,
        walls: &Vec<Plane<f64>, WALLS>,
        number: u32,
        wide: bool,
        random: &mut Random,
    ) -> Option<Vec<ReceivedPath, PATHS>> {
        let mut paths = Vec::new();
        paths.push(self.path(&[], random)?).ok()?;
        let mut next = number as usize * (PATHS - 1);
        while !paths.is_full() {
            let first = *walls.get(next % WALLS)?;
            let second = *walls.get((next + WALLS / 3) % WALLS)?;
            let pair = [first, second];
            let chain = pair.get(..1 + usize::from(wide && next.is_multiple_of(2)))?;
            paths.push(self.path(chain, random)?).ok()?;
            next += 1;
        }
        Some(paths)
    }

    fn path(&self, planes: &[Plane<f64>], random: &mut Random) -> Option<ReceivedPath> {
        let path = Chain::over(planes).predict(&self.transmitter.position_m, &self.uav_m)?;
        let body = self.attitude.inverse().apply_vector(&path.arrival);
        let arrival = Direction::<Body>::from_vector(body.map(|c| c as f32)).ok()?;
        let (e1, e2) = arrival.tangents();
        let [a, b] = [0, 1].map(|_| (1e-3 * error(random)) as f32);
        let straight = if planes.is_empty() { 0.9 } else { 0.0 };
        Some(ReceivedPath {
            c_tau_m: path.range_m + OFFSET_M + 0.02 * error(random),
            arrival: Direction::from_vector(arrival.vector() + e1 * a + e2 * b).ok()?,
            departure: Some(Departure {
                direction: Direction::from_vector(path.departure.map(|c| c as f32)).ok()?,
                sigma_rad: 0.003,
            }),
            covariance: Matrix3::identity() * 1e-8,
            power_db: -6.0 * planes.len() as f32,
            probabilities: Some(Probabilities {
                los: straight,
                first_order: 0.98 * (1.0 - straight),
                higher_order: 0.02 * (1.0 - straight),
                artefact: 0.0,
            }),
        })
    }

    /// A pose with an error of these standard deviations.
    fn pose(
        &self,
        [position_m, attitude_rad, clock_m]: [f64; 3],
        random: &mut Random,
    ) -> Option<PoseEstimate> {
        let sigmas = [
            position_m,
            position_m,
            position_m,
            attitude_rad,
            attitude_rad,
            attitude_rad,
            clock_m,
        ];
        let mut errors = sigmas;
        for error_of in &mut errors {
            *error_of *= error(random);
        }
        let [x, y, z, a, b, c, clock] = errors;
        let turn = Rotation::<World, World, f64>::from_rotation_vector(&Vector3::new(a, b, c)).ok()?;
        let mut pose = PoseEstimate {
            position_m: self.uav_m + Vector3::new(x, y, z),
            attitude: turn.after(&self.attitude),
            clock_offset_m: OFFSET_M + clock,
            delay_period: Waveform::default().delay_period(),
            covariance: Default::default(),
        };
        for (index, sigma) in sigmas.into_iter().enumerate() {
            *pose.covariance.get_mut((index, index))? = sigma * sigma;
        }
        Some(pose)
    }
}

/// Of every bit of the verdicts.
fn digest(association: &Association<PATHS>) -> u64 {
    let mut digest = Digest::new();
    for verdict in &association.verdicts {
        digest.add(verdict.decision as u64);
        verdict.chain.iter().for_each(|id| digest.add(u64::from(*id)));
        for number in [verdict.posterior, verdict.chi_square, verdict.departure_held] {
            digest.add_bits(number);
        }
    }
    digest.add(u64::from(association.left_out.unweighed));
    digest.value()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_store_fills_and_a_wide_pose_leaves_chains_out() {
        let mut surfaces = Surfaces::new(SurfaceConfig::default());
        let mut sweeps = 0;
        let mut works = [0; 3];
        let done = run(
            &mut surfaces,
            |work, each| {
                works[work as usize] += 1;
                each();
            },
            |_, _| sweeps += 1,
        );
        assert!(done.is_some());
        assert_eq!(works, [LEARNT, LEARNT, WIDE]);
        assert_eq!(sweeps, LEARNT + WIDE);
        let confirmed = surfaces.iter().filter(|surface| surface.is_confirmed()).count();
        assert_eq!(
            (surfaces.len(), confirmed),
            (SURFACES, WALLS),
            "{:?}",
            surfaces.counters
        );
    }
}
