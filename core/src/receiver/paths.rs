//! The paths of a sweep as the other stages take them: with their gain, in world axes with a state, as a measurement.

use heapless::Vec;

use super::PATHS;
use super::bend::Bend;
use super::config::{LinkStates, Pilots};
use super::localizer::left;
use super::receive::{ends, length_m, to_world};
use crate::estimator::{FaceDirection, GMT_PACE_M_PER_S, PathMeasurement, Pose, Transmitter};
use crate::geometry::{Direction, Matrix3, Rotation, Vector3, World};
use crate::link_state::{LinkGeometry, Probabilities, Received};
use crate::numeric::gather;
use crate::path::Path;
use crate::paths::EstimatedPath;
use crate::receiver::{Radio, Receiver};

/// A path as it was measured, before there is a pose: the estimate, its departure turned into world axes, and its gain.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredPath {
    pub(super) estimated: EstimatedPath<World>,
    pub(super) gain_db: Option<f32>,
}

/// A path in world axes, as a pose sees it, and its link state.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClassifiedPath {
    pub(super) path: Path<World>,
    pub(super) probabilities: Option<Probabilities>,
}

/// A path against the straight way from where it may have come from: the GMT, or an image of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Excess {
    /// Length beyond the straight way, m, and the variance of that.
    pub(super) excess_m: f32,
    pub(super) length_variance_m2: f32,
    /// Angle of arrival off the straight way, rad.
    pub(super) angle_rad: f32,
    /// What the position's error adds to the variance of that.
    pub(super) across_variance_rad2: f32,
}

impl Excess {
    /// `towards`: from the UAV to there, m. `None` when it is there.
    pub(super) fn against(
        path: &Path<World>,
        towards: &Vector3<f32>,
        position_covariance_m2: &Matrix3<f32>,
    ) -> Option<Self> {
        let length_m = towards.norm();
        let direction = Direction::<World>::from_vector(*towards).ok()?;
        let along = direction.vector();
        Some(Self {
            excess_m: path.c_tau_m - length_m,
            length_variance_m2: path.covariance.m11 + along.dot(&(position_covariance_m2 * along)),
            angle_rad: direction.angle_to_rad(&path.aoa),
            across_variance_rad2: position_covariance_m2.trace() / (length_m * length_m),
        })
    }
}

/// Where flat ground shows a point.
fn beneath(point_m: &Vector3<f64>, ground_z_m: f64) -> Vector3<f64> {
    Vector3::new(point_m.x, point_m.y, ground_z_m + ground_z_m - point_m.z)
}

/// Standard deviation of the upper direction cosine of departure where the bounce leaves this much further down. The beams see both as one path as long as
/// the band does not tell them apart, which takes longer here: a beam's amplitude is read at the delay of the path alone.
fn drawn_down(further_down: f64) -> f64 {
    MIXED * further_down * libm::exp(-further_down / BEAMS_APART)
}

/// Half of the difference between two paths.
/// Derived: what the weaker one may pull an estimate by that takes them for one.
const MIXED: f64 = 0.5;
/// Beams tell two departures apart that differ by more than this, direction cosine: a third of a beam.
/// Measured: of 5600 lines of sight in 44 flights of `real` (tuning seeds) half err in elevation by less than 14 mrad where the bounce leaves 0.15 further
/// down, 7.5 at 0.22, 4.3 at 0.27, 2.9 at 0.32, and 1.6 from 0.5 on, where nothing but the beams' own errors is left; in azimuth 1.1 to 1.9 everywhere.
const BEAMS_APART: f64 = 0.085;

/// Standard deviation that the ground bounce adds to the upper direction cosine in which a line of sight left, by the beams, between two points
/// over flat ground.
fn drawn_by_bounce(gmt_m: &Vector3<f64>, uav_m: &Vector3<f64>, ground_z_m: f64) -> f64 {
    let sine_up = |from: &Vector3<f64>| (uav_m.z - from.z) / (uav_m - from).norm();
    // The way to the image leaves as far down as the image looks up.
    drawn_down(sine_up(gmt_m) + sine_up(&beneath(gmt_m, ground_z_m)))
}

impl<R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'_, R, VOXELS, STATES> {
    /// The estimated paths with their gains. The estimator knows departures in the axes of the GMT's arrays; the beacon says
    /// how these stand in the world.
    pub(super) fn with_gain(&self, paths: &[EstimatedPath]) -> Vec<MeasuredPath, PATHS> {
        let mast = self
            .last_beacon
            .map_or_else(Rotation::identity, |(_, beacon)| beacon.attitude);
        let in_world = |path: &EstimatedPath| {
            let mut path = *path;
            // Of unit length once more: what the fit has rounded is not turned with it.
            if let Some(departure) = &mut path.path.aod
                && let Ok(unit) = Direction::from_vector(*departure.direction.vector())
            {
                departure.direction = unit;
            }
            path.with_departure_in_world(&mast)
        };
        gather(paths.iter().map(in_world).map(|estimated| MeasuredPath {
            estimated,
            gain_db: self.radio.path_gain_db(&self.config.budget, &estimated, &mast),
        }))
    }

    /// Where the GMT is, and at which of its stops: as the last beacon says, less sure the older it is.
    pub(super) fn transmitter(&self, time_ns: u64) -> Option<(Transmitter, u32)> {
        let (heard_ns, beacon) = self.last_beacon?;
        let age_s = time_ns.saturating_sub(heard_ns) as f64 * 1e-9;
        let moved_m = age_s * GMT_PACE_M_PER_S;
        let attitude = Rotation::from_matrix(beacon.attitude.matrix().map(f64::from)).ok()?;
        let transmitter = Transmitter {
            position_m: beacon.position_m,
            sigma_m: libm::sqrt(beacon.sigma_m * beacon.sigma_m + moved_m * moved_m),
            attitude,
            reach: self.radio.model().reach,
        };
        Some((transmitter, beacon.sweep / beacon.sweeps_per_stop.max(1)))
    }

    /// The paths in world axes with the clock taken out, as the networks take them.
    pub(super) fn received(&self, measured: &[MeasuredPath], pose: &Pose) -> Vec<Received, PATHS> {
        let period = self.delay_period();
        gather(measured.iter().map(|path| Received {
            path: to_world(
                &path.estimated,
                self.localizer.corrected(&path.estimated.path.aoa),
                pose,
                &period,
                &self.config.residuals,
            ),
            gain_db: path.gain_db,
        }))
    }

    /// The paths as a pose sees them, and what they are.
    pub(super) fn classify(
        &self,
        measured: &[MeasuredPath],
        pose: &Pose,
        gmt: &Transmitter,
    ) -> Vec<ClassifiedPath, PATHS> {
        let received = self.received(measured, pose);
        let Ok(ends) = ends(pose, &gmt.position_m) else {
            return Vec::new();
        };
        let classified = |path: &Received, probabilities| ClassifiedPath {
            path: path.path,
            probabilities,
        };
        match &self.config.link_states {
            LinkStates::Trees(_) | LinkStates::Geometric(_) => {
                let link = LinkGeometry::new(&ends, &received, &self.radio.model().waveform).ok();
                let probabilities = |path: &Received| match &self.config.link_states {
                    LinkStates::Trees(classifier) => classifier.path(link.as_ref()?, path).ok(),
                    LinkStates::Geometric(classifier) => classifier.path(link.as_ref()?, path).ok(),
                    LinkStates::Rules(_) | LinkStates::Paper(_) => None,
                };
                gather(received.iter().map(|path| classified(path, probabilities(path))))
            }
            LinkStates::Rules(rules) => gather(
                received
                    .iter()
                    .map(|path| classified(path, Some(rules.path(&ends, &path.path)))),
            ),
            LinkStates::Paper(classifier) => {
                let link = classifier.link(&received).ok().flatten();
                let strongest = |(index, path)| classified(path, link.filter(|_| index == 0));
                gather(received.iter().enumerate().map(strongest))
            }
        }
    }

    /// A path as the localizer takes it, with what beam squint told where it listened to this path.
    pub(super) fn measurement(
        &self,
        measured: &MeasuredPath,
        squint: Option<FaceDirection>,
        gmt: &Transmitter,
    ) -> Option<PathMeasurement> {
        let path = &measured.estimated.path;
        let covariance = &path.covariance;
        Some(PathMeasurement {
            c_tau_m: f64::from(path.c_tau_m),
            c_tau_sigma_m: libm::sqrt(f64::from(covariance.m11.max(0.0))),
            aoa: Direction::from_vector(path.aoa.vector().map(f64::from)).ok()?,
            aoa_sigma_rad: libm::sqrt(f64::from(0.5 * (covariance.m22 + covariance.m33).max(0.0))),
            departure: self.departure(measured, squint, gmt, 0.0),
            range_rate: measured
                .estimated
                .range_rate
                .filter(|_| self.config.pilots != Pilots::Unread && self.localizer.pose().is_some()),
        })
    }

    /// The same of the line of sight, with what its bend adds, and the ground bounce: it follows so closely that the beams may not tell in which
    /// elevation the line of sight left.
    pub(super) fn line_measurement(
        &self,
        path: &MeasuredPath,
        bend: &Bend,
        squint: Option<FaceDirection>,
        gmt: &Transmitter,
        time_ns: u64,
    ) -> Option<PathMeasurement> {
        let mut measured = self.measurement(path, squint, gmt)?;
        let drawn = self.drawn_by_bounce(path, measured.departure.as_ref(), gmt, time_ns);
        measured.departure = self
            .departure(path, squint, gmt, drawn.unwrap_or(0.0))
            .map(|departure| departure.widened(bend.angle_rad));
        measured.aoa_sigma_rad = libm::hypot(measured.aoa_sigma_rad, bend.angle_rad);
        measured.c_tau_sigma_m = libm::hypot(measured.c_tau_sigma_m, bend.length_m);
        Some(measured)
    }

    /// [`drawn_by_bounce`] of a line of sight that left so; `None` where ground, clock or departure are not known.
    fn drawn_by_bounce(
        &self,
        line: &MeasuredPath,
        departure: Option<&FaceDirection>,
        gmt: &Transmitter,
        time_ns: u64,
    ) -> Option<f64> {
        let left = left(&self.radio.model().faces, departure?, gmt)?;
        let ground_z_m = f64::from(self.config.accept.point.ground_z_m?);
        let offset_m = self.offset_m(time_ns)?;
        let range_m = length_m(line.estimated.path.c_tau_m, offset_m, &self.delay_period()).max(1.0);
        let uav_m = gmt.position_m + left.vector() * range_m;
        Some(drawn_by_bounce(&gmt.position_m, &uav_m, ground_z_m))
    }

    pub(super) fn face(&self, beam: u16) -> usize {
        self.radio.face(beam).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_low_line_of_sight_leaves_with_its_bounce_and_a_high_one_alone() {
        let gmt_m = Vector3::new(0.0, 0.0, 1.5);
        let at =
            |away_m: f64, height_m: f64| drawn_by_bounce(&gmt_m, &Vector3::new(away_m, 0.0, height_m), 0.0);
        // What flights showed at 60 m, half of the errors: 14 mrad of elevation; at 45 m 7 and less; half of a normal error is within 0.67 of its
        // standard deviation.
        let [low, higher, high] = [at(60.0, 4.5), at(45.0, 5.5), at(40.0, 12.0)].map(|drawn| 0.67 * drawn);
        assert!((8e-3..14e-3).contains(&low), "{low}");
        assert!((4e-3..8e-3).contains(&higher), "{higher}");
        assert!(high < 1e-3, "{high}");
    }

    #[test]
    fn the_ground_shows_a_point_as_far_beneath_it() {
        let point = Vector3::new(3.0, 4.0, 1.5);
        assert_eq!(beneath(&point, -0.5), Vector3::new(3.0, 4.0, -2.5));
    }
}
