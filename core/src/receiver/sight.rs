//! Which path is the line of sight.
//!
//! A pose that knows where the UAV is tells it by length and direction, whatever the angle of departure says: above and below its beams
//! the GMT is heard through sidelobes of any of them. Of the paths that fit the strongest is taken: artefacts stand before and behind it. None is,
//! where a path came before it as strong as through free space. Where none is, the first path may prove itself, by its strength and by the angle between its
//! two ends: it is the line of sight then, and the pose is wrong. The filter does not believe one such sweep, but several that agree. Two parallel walls turn a wave back into
//! its own direction, too: what known surfaces explain proves nothing. Nor does what fits the pose, but came weaker than straight, or nobody knows how strong: where the
//! line of sight is blocked, the ground's bounce comes a few decimetres after it and from a few degrees below.
//! Without such a pose it is the first path, since nothing else comes before the line of sight, if that is one: the path must have come nearly as strong as through free space and, as soon as the attitude is known, from the direction opposite to
//! its departure; a start or a re-fix then takes several that agree.
//!
//! The paper's calibration has a rule of its own ([`Localization::Baseline`]), which asks its network and not the pose: that pose
//! does not know when it has drifted, and one that has drifted would refuse every fix that could bring it back.

use super::bend::{Bend, UNREFLECTED_DB};
use super::config::Localization;
use super::localizer::left;
use super::paths::{Excess, MeasuredPath};
use super::receive::length_m;
use crate::array::half_wave_dipole;
use crate::estimator::{FaceDirection, Pose, Transmitter};
use crate::geometry::{Direction, World};
use crate::link_state::{LinkState, PaperClassifier};
use crate::path::{Departure, Path};
use crate::receiver::{Radio, Receiver};

/// Paths within this of the first one are one with it: images that the arrays' errors make, the ground bounce, m. The
/// strongest is taken.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const AT_ONCE_M: f64 = 0.45;
/// Standard deviation of the position, norm, from which on it does not tell whether a path is direct, m.
/// Derived: where a pose counts as lost.
pub(super) const PLACED_M: f32 = 3.0;
/// Standard deviations of length and angle within which a path may be direct.
/// Derived: one honest path in 15 800 is beyond.
const SIGMAS: f32 = 4.0;
/// Angle that a direct path may be off beside that, rad.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const ANGLE_RAD: f32 = 0.05;
/// The path that is the line of sight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// Its index.
    pub(super) index: usize,
    /// By how much it may be off the straight way.
    pub(super) bend: Bend,
    /// Whether it is where the pose puts it, or there is no pose that could tell.
    pub(super) expected: bool,
    /// Whether it came as strong as through free space. What lost more, or nobody knows how much, may have been reflected.
    pub(super) unreflected: bool,
}

impl Sight {
    /// A path that comes straight.
    pub(super) fn straight(index: usize) -> Self {
        Self {
            index,
            bend: Bend::default(),
            expected: true,
            unreflected: true,
        }
    }

    /// Whether it came from where the GMT is, as strong as through free space.
    pub(super) fn proves_itself(&self) -> bool {
        self.expected && self.unreflected
    }
}

impl<R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'_, R, VOXELS, STATES> {
    /// The path that is the line of sight, or a wave that is bent into the shadow of what stands before it, if there is one.
    pub(super) fn line_of_sight(&self, measured: &[MeasuredPath], time_ns: u64) -> Option<Sight> {
        let pose = self.localizer.expected();
        // Before its first fix nobody knows how the body is turned, which the network must: it begins as ours does.
        if let (Localization::Baseline(_, network), Some(pose)) = (&self.config.localization, &pose) {
            return self.classified(network, measured, pose).map(Sight::straight);
        }
        let gmt = self.transmitter(time_ns).map(|(gmt, _)| gmt);
        match (pose, gmt) {
            (Some(pose), Some(gmt)) if sigma(&pose.position_covariance_m2) < PLACED_M => {
                let received = self.received(measured, &pose);
                // The strongest of those that may be: artefacts of it come before it as well as after.
                let fitting = (measured.iter().zip(&received).enumerate())
                    .map(|(index, (path, received))| (index, path, &received.path))
                    .filter(|(_, _, in_world)| fits_line_of_sight(in_world, &pose, &gmt))
                    .max_by(|(_, a, _), (_, b, _)| a.estimated.energy.total_cmp(&b.estimated.energy));
                let first = self.first_unreflected(measured, time_ns);
                match fitting {
                    Some((index, path, in_world))
                        if !is_overtaken(f64::from(in_world.c_tau_m), first.map(|(_, first_m)| first_m)) =>
                    {
                        let over_db = self.over_db_in_beams(path, in_world, &pose, &gmt);
                        Some(Sight {
                            index,
                            bend: self.bend(over_db, in_world)?,
                            expected: true,
                            unreflected: over_db.is_some_and(|over_db| over_db >= -UNREFLECTED_DB),
                        })
                    }
                    _ => {
                        let (index, _) = first?;
                        let path = measured.get(index)?;
                        let left = path.estimated.path.aod?;
                        self_consistent(path, &left, &pose).then_some(Sight {
                            expected: false,
                            ..Sight::straight(index)
                        })
                    }
                }
            }
            (pose, _) => {
                let (first, _) = self.first_unreflected(measured, time_ns)?;
                let path = measured.get(first)?;
                let direct = pose.is_none_or(|pose| {
                    let left = path.estimated.path.aod;
                    left.is_some_and(|left| ends_agree(path, &left, &pose))
                });
                direct.then_some(Sight::straight(first))
            }
        }
    }

    /// The paper's rule: the strongest path, where the link state is line of sight. Of the pose, the network's inputs hold only
    /// attitude and clock.
    fn classified(
        &self,
        network: &PaperClassifier<'_>,
        measured: &[MeasuredPath],
        pose: &Pose,
    ) -> Option<usize> {
        let state = network.link(&self.received(measured, pose)).ok()??.state();
        (state == LinkState::LineOfSight).then_some(0)
    }

    /// Index of the path that speaks against the pose, of a sweep without line of sight: the first one, when it came as strong as
    /// through free space.
    pub(super) fn contrary(&self, measured: &[MeasuredPath], time_ns: u64) -> Option<usize> {
        self.localizer.expected()?;
        self.first_unreflected(measured, time_ns).map(|(first, _)| first)
    }

    /// Index of the first path and its length, m, when it came as strong as through free space.
    fn first_unreflected(&self, measured: &[MeasuredPath], time_ns: u64) -> Option<(usize, f64)> {
        let offset_m = self.offset_m(time_ns)?;
        let period = self.delay_period();
        let length_m = |path: &MeasuredPath| length_m(path.estimated.path.c_tau_m, offset_m, &period);
        let first = first_of(measured.iter().map(length_m), measured)?;
        let path = measured.get(first)?;
        let first_m = length_m(path);
        self.is_unreflected(path, first_m).then_some((first, first_m))
    }

    /// Whether a path of this length came nearly as strong as through free space, and no stronger.
    fn is_unreflected(&self, path: &MeasuredPath, length_m: f64) -> bool {
        self.over_free_space_db(path, length_m)
            .is_some_and(|over_db| over_db.abs() < UNREFLECTED_DB)
    }

    /// How much stronger than through free space a path came from where the GMT is, dB. `None` where nobody knows a gain well enough to tell: beside
    /// the GMT's beams.
    fn over_db_in_beams(
        &self,
        path: &MeasuredPath,
        in_world: &Path<World>,
        pose: &Pose,
        gmt: &Transmitter,
    ) -> Option<f32> {
        let way = Direction::<World, f64>::from_vector(pose.position.vector() - gmt.position_m).ok()?;
        gmt.leaves_in_beams(way.vector())
            .then(|| self.over_free_space_db(path, f64::from(in_world.c_tau_m)))?
    }

    /// How a path was bent, by what it lost; not at all where that is not known, and `None` when it lost too much.
    fn bend(&self, over_db: Option<f32>, in_world: &Path<World>) -> Option<Bend> {
        let wavelength_m = self.radio.model().waveform.wavelength_m();
        over_db.map_or(Some(Bend::default()), |over_db| {
            Bend::of(over_db, f64::from(in_world.c_tau_m), wavelength_m)
        })
    }

    /// How much stronger a path of this length is than through free space, dB; `None` without departure or gain.
    fn over_free_space_db(&self, path: &MeasuredPath, length_m: f64) -> Option<f32> {
        let (departure, gain_db) = path.estimated.path.aod.zip(path.gain_db)?;
        let dipoles = half_wave_dipole(departure.direction.vector())
            * half_wave_dipole(path.estimated.path.aoa.vector());
        let spread = self.radio.model().waveform.wavelength_m() as f32
            / (4.0 * core::f32::consts::PI * (length_m as f32).max(1.0));
        let free_space_db = 20.0 * libm::log10f((spread * dipoles).max(f32::MIN_POSITIVE));
        Some(gain_db - free_space_db)
    }

    /// Whether a path proves by itself that it is the line of sight: it has lost no more than through free space, and it comes,
    /// with an attitude that is known, from just where it left for. A wave that is turned so little by a reflection has made
    /// no detour.
    pub(super) fn is_self_consistent(
        &self,
        path: &MeasuredPath,
        departure: &FaceDirection,
        gmt: &Transmitter,
        time_ns: u64,
    ) -> bool {
        let (Some(pose), Some(offset_m), Some(left)) = (
            self.localizer.expected(),
            self.offset_m(time_ns),
            left(&self.radio.model().faces, departure, gmt),
        ) else {
            return false;
        };
        let Ok(direction) = Direction::from_vector(left.vector().map(|c| c as f32)) else {
            return false;
        };
        let [x, z] = departure.sigma_rad();
        let left = Departure {
            direction,
            sigma_rad: x.max(z) as f32,
        };
        let period = self.delay_period();
        self.is_unreflected(path, length_m(path.estimated.path.c_tau_m, offset_m, &period))
            && self_consistent(path, &left, &pose)
    }
}

/// Index of the strongest of the paths that came first.
fn first_of(lengths_m: impl Iterator<Item = f64> + Clone, measured: &[MeasuredPath]) -> Option<usize> {
    let first_m = lengths_m.clone().min_by(f64::total_cmp)?;
    lengths_m
        .zip(measured)
        .enumerate()
        .filter(|(_, (length_m, _))| *length_m < first_m + AT_ONCE_M)
        .max_by(|(_, (_, a)), (_, (_, b))| a.estimated.energy.total_cmp(&b.estimated.energy))
        .map(|(index, _)| index)
}

/// Whether a path of this length, m, comes after one that is as strong as through free space. Nothing comes before the line of sight: the pose is
/// wrong then, and what fits it is another path.
fn is_overtaken(length_m: f64, unreflected_m: Option<f64>) -> bool {
    unreflected_m.is_some_and(|first_m| first_m + AT_ONCE_M < length_m)
}

/// Whether a path is as long as the straight way and comes from where the GMT is.
fn fits_line_of_sight(path: &Path<World>, pose: &Pose, gmt: &Transmitter) -> bool {
    let towards = (gmt.position_m - pose.position.vector()).map(|c| c as f32);
    let Some(straight) = Excess::against(path, &towards, &pose.position_covariance_m2) else {
        return false;
    };
    let covariance = &path.covariance;
    let angle_variance = covariance.m22 + covariance.m33 + straight.across_variance_rad2;
    straight.excess_m.abs() < SIGMAS * libm::sqrtf(straight.length_variance_m2.max(0.0))
        && straight.angle_rad < ANGLE_RAD + SIGMAS * libm::sqrtf(angle_variance.max(0.0))
}

/// Whether a path comes from the direction opposite to its departure, as far as both and the attitude are known.
fn ends_agree(path: &MeasuredPath, left: &Departure, pose: &Pose) -> bool {
    let seen = pose.attitude.apply(path.estimated.path.aoa);
    let Ok(back) = Direction::<World>::from_vector(-left.direction.vector()) else {
        return false;
    };
    let sigma = libm::hypotf(sigma(&pose.attitude_covariance_rad2), left.sigma_rad);
    back.angle_to_rad(&seen) < ANGLE_RAD + SIGMAS * sigma
}

/// The same when both directions are known well enough to prove anything.
fn self_consistent(path: &MeasuredPath, left: &Departure, pose: &Pose) -> bool {
    let sure = |sigma_rad: f32| sigma_rad < ANGLE_RAD;
    sure(sigma(&pose.attitude_covariance_rad2)) && sure(left.sigma_rad) && ends_agree(path, left, pose)
}

/// Norm of the standard deviations of a covariance.
pub(super) fn sigma(covariance: &crate::geometry::Matrix3<f32>) -> f32 {
    libm::sqrtf(covariance.trace().max(0.0))
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::estimator::ClockEstimate;
    use crate::geometry::{Body, Position, Rotation, Vector3};
    use crate::paths::EstimatedPath;

    /// A pose whose attitude is known to `sigma_rad` about each axis.
    fn pose(sigma_rad: f32) -> Pose {
        Pose {
            time_ns: 0,
            position: Position::new(0.0, 0.0, 0.0).expect("finite"),
            velocity_m_per_s: Vector3::zeros(),
            attitude: Rotation::<Body, World>::from_yaw_pitch_roll(0.0, 0.0, 0.0).expect("finite"),
            clock: ClockEstimate {
                offset_m: 0.0,
                offset_sigma_m: 0.0,
                drift_m_per_s: 0.0,
                drift_sigma_m_per_s: 0.0,
            },
            position_covariance_m2: Matrix3::identity(),
            velocity_covariance_m2_per_s2: Matrix3::zeros(),
            attitude_covariance_rad2: Matrix3::identity() * (sigma_rad * sigma_rad),
            position_attitude_covariance_m_rad: Matrix3::zeros(),
            resets: 0,
        }
    }

    /// A departure `turned_rad` off the way straight to the UAV.
    fn turned(turned_rad: f32) -> Departure {
        let left = Vector3::new(-libm::cosf(turned_rad), libm::sinf(turned_rad), 0.0);
        Departure {
            direction: Direction::from_vector(left).expect("unit"),
            sigma_rad: 0.003,
        }
    }

    /// A path that arrives along x.
    fn path() -> MeasuredPath {
        MeasuredPath {
            estimated: EstimatedPath {
                path: Path {
                    c_tau_m: 30.0,
                    aoa: Direction::from_vector(Vector3::x()).expect("unit"),
                    aod: None,
                    covariance: Matrix3::identity() * 1e-6,
                },
                beam: 0,
                snr_db: 30.0,
                energy: 1.0,
                range_rate: None,
            },
            gain_db: Some(-92.0),
        }
    }

    #[test]
    fn nothing_comes_before_the_line_of_sight() {
        assert!(is_overtaken(24.0, Some(20.0)));
        // Itself, or an image that the arrays make of it.
        assert!(!is_overtaken(20.0, Some(20.0)) && !is_overtaken(20.4, Some(20.0)));
        assert!(!is_overtaken(24.0, None));
    }

    #[test]
    fn a_path_proves_itself_by_the_angle_between_its_two_ends() {
        let straight = |turned_rad, sigma_rad| ends_agree(&path(), &turned(turned_rad), &pose(sigma_rad));
        // Four times the root sum of 3.5 mrad of attitude and 3 of departure beside the 50 mrad.
        assert!(straight(0.0, 0.002) && straight(0.065, 0.002) && !straight(0.075, 0.002));
        // An attitude that is hardly known tells nothing.
        assert!(straight(1.0, 0.2));
    }

    #[test]
    fn what_is_hardly_known_proves_nothing() {
        let consistent =
            |turned_rad, sigma_rad| self_consistent(&path(), &turned(turned_rad), &pose(sigma_rad));
        assert!(consistent(0.0, 0.002) && !consistent(0.075, 0.002));
        // The norm of three axes.
        assert!(consistent(0.0, 0.028) && !consistent(0.0, 0.03));
        let vague = Departure {
            sigma_rad: 0.06,
            ..turned(0.0)
        };
        assert!(!self_consistent(&path(), &vague, &pose(0.002)));
    }
}
