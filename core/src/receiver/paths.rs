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

/// Share of the difference between line of sight and ground bounce by which the former errs, standard deviation: all that the bounce's
/// amplitude allows where the two are one path, and nothing when the bounce's way is so much longer that they are told apart.
fn mixed(longer_m: f64) -> f64 {
    let apart = longer_m / TOLD_APART_M;
    MIXED * libm::exp(-apart * apart)
}

/// Standard deviation of the upper direction cosine of departure where the bounce leaves this much further down. The beams see both as one path as long as
/// the band does not tell them apart, which takes longer here: a beam's amplitude is read at the delay of the path alone.
fn drawn_down(further_down: f64) -> f64 {
    MIXED * further_down * libm::exp(-further_down / BEAMS_APART)
}

/// Half of the difference between two paths.
/// Derived: what the weaker one may pull an estimate by that takes them for one.
const MIXED: f64 = 0.5;
/// Two paths are told apart when their lengths differ by more than this, m: a sixth of what the band resolves.
/// Measured: the errors of 1348 lines of sight in flight decided: 13 mrad (nine of ten) where the bounce is 0.25 m longer, 7 at 0.35 m,
/// none beyond 0.5 m.
const TOLD_APART_M: f64 = 0.235;
/// Beams tell two departures apart that differ by more than this, direction cosine: a third of a beam.
/// Measured: of 5600 lines of sight in 44 flights of `real` (tuning seeds) half err in elevation by less than 14 mrad where the bounce leaves 0.15 further
/// down, 7.5 at 0.22, 4.3 at 0.27, 2.9 at 0.32, and 1.6 from 0.5 on, where nothing but the beams' own errors is left; in azimuth 1.1 to 1.9 everywhere.
const BEAMS_APART: f64 = 0.085;

/// What the ground bounce adds to the errors of a line of sight that it is not told apart from, standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bounce {
    /// Of the length, m.
    length_m: f64,
    /// Of the elevation that it comes from, rad.
    arrival_rad: f64,
    /// Of the upper direction cosine in which it left, by the beams.
    departure: f64,
}

impl Bounce {
    /// Of a line of sight between two points over flat ground.
    fn between(gmt_m: &Vector3<f64>, uav_m: &Vector3<f64>, ground_z_m: f64) -> Self {
        let image_m = beneath(gmt_m, ground_z_m);
        let range_m = (gmt_m - uav_m).norm();
        let way_m = (image_m - uav_m).norm();
        let share = mixed(way_m - range_m);
        let up = (uav_m.z - gmt_m.z) / range_m;
        let down = (image_m.z - uav_m.z) / way_m;
        Self {
            length_m: share * (way_m - range_m),
            arrival_rad: share * (image_m - gmt_m).norm() / range_m,
            departure: drawn_down(up - down),
        }
    }
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
            aoa_rise_sigma_rad: 0.0,
            departure: self.departure(measured, squint, gmt, 0.0),
            range_rate: measured
                .estimated
                .range_rate
                .filter(|_| self.config.pilots != Pilots::Unread && self.localizer.pose().is_some()),
        })
    }

    /// The same of the line of sight, which the ground bounce follows so closely that the two may not be told apart: then delay and
    /// elevations are anything between those of both.
    pub(super) fn line_measurement(
        &self,
        path: &MeasuredPath,
        bend: &Bend,
        squint: Option<FaceDirection>,
        gmt: &Transmitter,
        time_ns: u64,
    ) -> Option<PathMeasurement> {
        let mut measured = self.measurement(path, squint, gmt)?;
        let bounce = self.bounce(path, measured.departure.as_ref(), gmt, time_ns);
        measured.departure = self.departure(path, squint, gmt, bounce.departure);
        measured.aoa_sigma_rad = libm::hypot(measured.aoa_sigma_rad, bend.angle_rad);
        measured.aoa_rise_sigma_rad = bounce.arrival_rad;
        let late_m = libm::hypot(bend.length_m, bounce.length_m);
        measured.c_tau_sigma_m = libm::hypot(measured.c_tau_sigma_m, late_m);
        if let Some(departure) = &mut measured.departure {
            departure.sigma = departure.sigma.map(|sigma| libm::hypot(sigma, bend.angle_rad));
        }
        Some(measured)
    }

    /// What the ground bounce adds to the errors of a line of sight that left so; nothing where ground, clock or departure are not known.
    fn bounce(
        &self,
        line: &MeasuredPath,
        departure: Option<&FaceDirection>,
        gmt: &Transmitter,
        time_ns: u64,
    ) -> Bounce {
        let left = departure.and_then(|departure| left(&self.radio.model().faces, departure, gmt));
        let (Some(left), Some(ground_z_m), Some(offset_m)) =
            (left, self.config.accept.point.ground_z_m, self.offset_m(time_ns))
        else {
            return Bounce::default();
        };
        let range_m = length_m(line.estimated.path.c_tau_m, offset_m, &self.delay_period()).max(1.0);
        let uav_m = gmt.position_m + left.vector() * range_m;
        Bounce::between(&gmt.position_m, &uav_m, f64::from(ground_z_m))
    }

    pub(super) fn face(&self, beam: u16) -> usize {
        self.radio.face(beam).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bounce_is_mixed_with_the_line_of_sight_until_the_band_tells_them_apart() {
        assert!((mixed(0.0) - 0.5).abs() < 1e-12);
        assert!(mixed(0.1) > mixed(0.2) && mixed(0.2) > mixed(0.35));
        // What flights showed at 65 and at 46 m: 46 and 65 mrad between the two arrivals, errors of 8 and 4 mrad.
        assert!((mixed(0.25) * 46.0 - 7.4).abs() < 0.2 && (mixed(0.35) * 65.0 - 3.5).abs() < 0.2);
        assert!(mixed(0.6) < 1e-3);
    }

    #[test]
    fn a_low_line_of_sight_leaves_with_its_bounce_and_a_high_one_alone() {
        let gmt_m = Vector3::new(0.0, 0.0, 1.5);
        let at =
            |away_m: f64, height_m: f64| Bounce::between(&gmt_m, &Vector3::new(away_m, 0.0, height_m), 0.0);
        // What flights showed at 60 m, half of the errors: 14 mrad of elevation; at 45 m 7 and less; half of a normal error is within 0.67 of its
        // standard deviation.
        let [low, higher, high] =
            [at(60.0, 4.5), at(45.0, 5.5), at(40.0, 12.0)].map(|bounce| 0.67 * bounce.departure);
        assert!((8e-3..14e-3).contains(&low), "{low}");
        assert!((4e-3..8e-3).contains(&higher), "{higher}");
        assert!(high < 1e-3, "{high}");
        // The band tells them apart long before.
        assert!(at(45.0, 5.5).length_m < 0.02 && at(45.0, 5.5).arrival_rad < 1e-2);
    }

    #[test]
    fn the_ground_shows_a_point_as_far_beneath_it() {
        let point = Vector3::new(3.0, 4.0, 1.5);
        assert_eq!(beneath(&point, -0.5), Vector3::new(3.0, 4.0, -2.5));
    }
}
