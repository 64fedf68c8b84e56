//! What the networks look at: numbers of a measured path that tell one reflection from none and from several.
//!
//! If the path was reflected once, it was reflected at the point P that the closed form gives, and everything else about
//! it must fit P: the direction in which it left the GMT, its strength, the height of P. The features say how well it
//! does; lengths, angles and ratios that may reach far are compressed by asinh. They are computed in f32, before
//! anything is rounded to int8, where a raw delay would have steps of a metre. Source: link-state.md.
//!
//! Every feature is defined for every path: where the excess delay is not positive (line of sight, with its error), the
//! point is solved for an excess of a centimetre. Nothing here knows the world, its bounds or its material.

use nalgebra::Vector3;

use super::bounce::Bounce;
use crate::constants::SPEED_OF_LIGHT_M_PER_S;
use crate::geometry::{Direction, World};
use crate::path::Path;
use crate::reflection::{Ends, InputError, Jacobians, point_covariance, vector_point};
use crate::sqrt::sqrt;

/// A measured path and how strong it came in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received {
    /// The path, in world axes.
    pub path: Path<World>,
    /// Power gain from the GMT's antenna port to the UAV's with vertical half-wave dipoles at both ends, dB (negative;
    /// -90 dB at 25 m); `None` when the receiver is not calibrated. Only its rough value matters: 3 dB of error are
    /// reckoned with.
    pub gain_db: Option<f32>,
}

/// Names of the geometric network's inputs. The last three need an angle of departure; the network without it takes the
/// first [`GEOMETRIC_INPUTS`].
pub const GEOMETRIC_NAMES: [&str; GEOMETRIC_WITH_DEPARTURE_INPUTS] = [
    "excess",
    "arrival_off_gmt",
    "behind_first",
    "source_height",
    "point_height",
    "uav_share",
    "cos_incidence",
    "normal_z",
    "baseline",
    "length",
    "gain_residual",
    "gain_over_free_space",
    "under_strongest",
    "gain_known",
    "departure_off_point",
    "departure_off_point_sigmas",
    "departure_off_uav",
];

/// Inputs of the geometric network without angle of departure.
pub const GEOMETRIC_INPUTS: usize = 14;

/// Inputs of the geometric network with angle of departure.
pub const GEOMETRIC_WITH_DEPARTURE_INPUTS: usize = 17;

/// Inputs of each path of the paper's network: c tau in m, zenith and azimuth of arrival in rad.
pub const PAPER_INPUTS_PER_PATH: usize = 3;

/// Names of [`PAPER_INPUTS_PER_PATH`].
pub const PAPER_NAMES: [&str; PAPER_INPUTS_PER_PATH] = ["c_tau_m", "aoa_zenith_rad", "aoa_azimuth_rad"];

/// Carrier wavelength of the power prediction, m (30 GHz).
const WAVELENGTH_M: f32 = (SPEED_OF_LIGHT_M_PER_S / 30e9) as f32;

/// The point is solved for at least this much excess delay, m.
const LEAST_EXCESS_M: f32 = 0.01;

/// Compression: asinh of a value over these. About its error where the value is near the decision.
const EXCESS_UNIT_M: f32 = 0.3;
const ANGLE_UNIT_RAD: f32 = 0.05;
const HEIGHT_UNIT_M: f32 = 1.0;
const LENGTH_UNIT_M: f32 = 10.0;

/// Gains are limited to +-40 dB of what is expected, and counted in tens of dB.
const MOST_DB: f32 = 40.0;
const DB_UNIT: f32 = 10.0;

/// Features of one path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    values: [f32; GEOMETRIC_WITH_DEPARTURE_INPUTS],
    departure: bool,
}

impl Features {
    /// Inputs of the network with angle of departure, in the order of [`GEOMETRIC_NAMES`]; `None` when the path has none.
    pub fn with_departure(&self) -> Option<&[f32; GEOMETRIC_WITH_DEPARTURE_INPUTS]> {
        self.departure.then_some(&self.values)
    }

    /// Inputs of the network without angle of departure, in the order of [`GEOMETRIC_NAMES`].
    pub fn without_departure(&self) -> &[f32; GEOMETRIC_INPUTS] {
        // The array is longer; there is no reachable other case.
        self.values.first_chunk().unwrap_or(&[0.0; GEOMETRIC_INPUTS])
    }
}

/// What all paths of a link have in common: where its ends are, which path came first and which is the strongest.
#[derive(Clone, Copy, Debug)]
pub struct LinkGeometry<'a> {
    ends: &'a Ends,
    baseline: Vector3<f32>,
    baseline_m: f32,
    first_m: f32,
    strongest_db: f32,
}

impl<'a> LinkGeometry<'a> {
    /// A link between measured ends, with all its measured paths.
    ///
    /// # Errors
    /// [`InputError::CoincidentEnds`] when UAV and GMT are at the same place, [`InputError::NotFinite`] when their
    /// distance overflows.
    pub fn new(ends: &'a Ends, paths: &[Received]) -> Result<Self, InputError> {
        let baseline = ends.uav.from_origin(&ends.gmt);
        let baseline_m = sqrt(baseline.norm_squared());
        if !baseline_m.is_finite() {
            return Err(InputError::NotFinite);
        }
        if baseline_m <= LEAST_EXCESS_M {
            return Err(InputError::CoincidentEnds);
        }
        let first_m = paths.iter().map(|p| p.path.c_tau_m).fold(f32::INFINITY, f32::min);
        let strongest_db = paths
            .iter()
            .filter_map(|p| p.gain_db)
            .fold(f32::NEG_INFINITY, f32::max);
        Ok(Self {
            ends,
            baseline,
            baseline_m,
            first_m,
            strongest_db,
        })
    }

    /// Excess delay of a path over the straight way between the ends, m.
    pub fn excess_m(&self, path: &Path<World>) -> f32 {
        path.c_tau_m - self.baseline_m
    }

    /// Standard deviation of [`Self::excess_m`], m: delay, and the UAV's position along the baseline.
    pub fn excess_sigma_m(&self, path: &Path<World>) -> f32 {
        let along = self.baseline / self.baseline_m;
        let position = along.dot(&(self.ends.uav_covariance * along));
        sqrt((path.covariance.m11 + position).max(0.0))
    }

    /// Features of one of the link's paths.
    ///
    /// # Errors
    /// [`InputError::NotFinite`] for a delay, gain or covariance that is no number, [`InputError::NoLength`] for a delay
    /// that is not positive.
    pub fn features(&self, received: &Received) -> Result<Features, InputError> {
        let path = &received.path;
        check(self.ends, received)?;
        let (gmt, uav) = (self.ends.gmt.vector(), self.ends.uav.vector());
        let arrival = path.aoa.vector();
        let length_m = path.c_tau_m.max(self.baseline_m + LEAST_EXCESS_M);
        // With this much excess there is a point in every direction, unless the length overflows.
        let solution = vector_point(&self.baseline, arrival, length_m).ok_or(InputError::NotFinite)?;
        let from_gmt = self.baseline + arrival * solution.distance_m;
        let incoming = Direction::<World>::from_vector(from_gmt)?;
        let bounce = Bounce::new(incoming.vector(), arrival, length_m, WAVELENGTH_M);

        let towards_gmt = Direction::<World>::from_vector(-self.baseline)?;
        let (residual, over_free_space, under, known) = match received.gain_db {
            Some(gain_db) => {
                let over = gain_db - bounce.unreflected_db;
                (
                    decibels(over - bounce.reflection_db),
                    decibels(over),
                    decibels(self.strongest_db - gain_db),
                    1.0,
                )
            }
            None => (0.0, 0.0, 0.0, 0.0),
        };
        let source_height_m = uav.z + path.c_tau_m * arrival.z - gmt.z;
        let mut values = [
            compressed(self.excess_m(path), EXCESS_UNIT_M),
            compressed(towards_gmt.angle_to_rad(&path.aoa), ANGLE_UNIT_RAD),
            compressed(path.c_tau_m - self.first_m.min(path.c_tau_m), EXCESS_UNIT_M),
            compressed(source_height_m, HEIGHT_UNIT_M),
            compressed(from_gmt.z, HEIGHT_UNIT_M),
            solution.distance_m / length_m,
            bounce.cos_incidence,
            bounce.normal.z,
            compressed(self.baseline_m, LENGTH_UNIT_M),
            compressed(path.c_tau_m, LENGTH_UNIT_M),
            residual,
            over_free_space,
            under,
            known,
            0.0,
            0.0,
            0.0,
        ];
        if let (Some(departure), [.., off_point, off_point_sigmas, off_uav]) = (&path.aod, &mut values) {
            let mismatch_rad = incoming.angle_to_rad(&departure.direction);
            let jacobians = Jacobians::at(&self.baseline, path, &solution);
            let covariance = point_covariance(&jacobians, path, &self.ends.uav_covariance);
            // Only the point's error across the line from the GMT turns it; both tangents together.
            let line = incoming.vector();
            let across_m2 = (covariance.trace() - line.dot(&(covariance * line))).max(0.0);
            let variance =
                2.0 * departure.sigma_rad * departure.sigma_rad + across_m2 / from_gmt.norm_squared();
            *off_point = compressed(mismatch_rad, ANGLE_UNIT_RAD);
            *off_point_sigmas = compressed(mismatch_rad, sqrt(variance).max(1e-6));
            let straight = Direction::<World>::from_vector(self.baseline)?;
            *off_uav = compressed(straight.angle_to_rad(&departure.direction), ANGLE_UNIT_RAD);
        }
        if values.iter().all(|x| x.is_finite()) {
            let departure = path.aod.is_some();
            Ok(Features { values, departure })
        } else {
            Err(InputError::NotFinite)
        }
    }
}

fn check(ends: &Ends, received: &Received) -> Result<(), InputError> {
    let path = &received.path;
    let covariances = path.covariance.iter().chain(ends.uav_covariance.iter());
    let mut numbers = covariances
        .copied()
        .chain([path.c_tau_m, received.gain_db.unwrap_or(0.0)])
        .chain(path.aod.map(|departure| departure.sigma_rad));
    if !numbers.all(f32::is_finite) {
        return Err(InputError::NotFinite);
    }
    if path.c_tau_m <= 0.0 {
        return Err(InputError::NoLength);
    }
    Ok(())
}

/// `asinh(value / unit)`: linear below the unit, logarithmic above. Within 3e-7 (`libm`'s is relatively exact near 0 and
/// twice as dear).
fn compressed(value: f32, unit: f32) -> f32 {
    let ratio = value / unit;
    // Squares beyond would overflow; the comparison leaves NaN as it is.
    let size = if ratio.abs() > 1e18 { 1e18 } else { ratio.abs() };
    libm::copysignf(libm::logf(size + sqrt(size * size + 1.0)), ratio)
}

fn decibels(value_db: f32) -> f32 {
    value_db.clamp(-MOST_DB, MOST_DB) / DB_UNIT
}

/// Inputs of the paper's network: c tau (m), zenith and azimuth of arrival (rad) of each path, strongest first, as many
/// as there is room for. Where there are fewer paths, zeros.
pub fn paper_inputs(paths: &[Received], inputs: &mut [f32]) {
    inputs.fill(0.0);
    for (path, place) in paths.iter().zip(inputs.chunks_exact_mut(PAPER_INPUTS_PER_PATH)) {
        let values = [
            path.path.c_tau_m,
            path.path.aoa.zenith_rad(),
            path.path.aoa.azimuth_rad(),
        ];
        place
            .iter_mut()
            .zip(values)
            .for_each(|(place, value)| *place = value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Position;
    use crate::path::{Departure, diagonal_covariance};
    use nalgebra::Matrix3;

    fn at(x: f32, y: f32, z: f32) -> Position {
        Position::new(x, y, z).expect("finite")
    }

    /// GMT and UAV in front of a wall at x = 10 and over the ground at z = 0.
    fn ends() -> Ends {
        Ends {
            uav: at(2.0, 40.0, 9.0),
            uav_covariance: Matrix3::identity() * 0.09,
            gmt: at(4.0, 5.0, 1.5),
        }
    }

    /// The path over the given points, from the GMT to the UAV.
    fn over(points: &[Position]) -> Received {
        let ends = ends();
        let all = [&[ends.gmt], points, &[ends.uav]].concat();
        let length = all.windows(2).map(|leg| leg[1].distance_m(&leg[0])).sum();
        let towards =
            |from: &Position, to: &Position| Direction::from_vector(to.from_origin(from)).expect("apart");
        let n = all.len();
        Received {
            path: Path {
                c_tau_m: length,
                aoa: towards(&all[n - 1], &all[n - 2]),
                aod: Some(Departure {
                    direction: towards(&all[0], &all[1]),
                    sigma_rad: 0.035,
                }),
                covariance: diagonal_covariance(0.2, 0.0087),
            },
            gain_db: Some(-95.0),
        }
    }

    fn mirrored_at_wall() -> Received {
        // Image of the GMT at x = 16: the wall is met where the line from it crosses x = 10.
        let share = 6.0 / 14.0;
        over(&[at(10.0, 5.0 + 35.0 * share, 1.5 + 7.5 * share)])
    }

    fn named(received: &Received, others: &[Received], name: &str) -> f32 {
        let ends = ends();
        let all = [&[*received], others].concat();
        let features = LinkGeometry::new(&ends, &all)
            .expect("apart")
            .features(received)
            .expect("sound");
        let place = GEOMETRIC_NAMES
            .iter()
            .position(|n| *n == name)
            .expect("a feature");
        features.with_departure().expect("has a departure")[place]
    }

    #[test]
    fn a_wall_bounce_fits_its_point() {
        let path = mirrored_at_wall();
        let feature = |name| named(&path, &[over(&[])], name);
        let excess = path.path.c_tau_m - ends().uav.distance_m(&ends().gmt);
        assert!((feature("excess") - libm::asinhf(excess / 0.3)).abs() < 1e-4);
        assert!(
            (feature("behind_first") - feature("excess")).abs() < 1e-4,
            "the line of sight came first"
        );
        assert!(feature("departure_off_point").abs() < 2e-3);
        assert!(
            feature("source_height").abs() < 1e-3,
            "walls keep the height of the source"
        );
        assert!(feature("normal_z").abs() < 1e-4);
        assert!((feature("point_height") - libm::asinhf(7.5 * 6.0 / 14.0)).abs() < 1e-3);
        assert!((feature("uav_share") - 8.0 / 14.0).abs() < 1e-4);
        let cos = 14.0 / (14.0_f32 * 14.0 + 35.0 * 35.0 + 7.5 * 7.5).sqrt();
        assert!((feature("cos_incidence") - cos).abs() < 1e-4);
    }

    #[test]
    fn a_ground_bounce_comes_from_below_the_gmt() {
        let share = 1.5 / 10.5;
        let path = over(&[at(4.0 - 2.0 * share, 5.0 + 35.0 * share, 0.0)]);
        let feature = |name| named(&path, &[], name);
        assert!((feature("source_height") - libm::asinhf(-3.0)).abs() < 1e-3);
        assert!((feature("normal_z") - 1.0).abs() < 1e-4);
        assert!((feature("point_height") - libm::asinhf(-1.5)).abs() < 1e-3);
    }

    #[test]
    fn two_bounces_leave_in_another_direction_than_their_point() {
        // Off the wall at x = 10, then off one at y = 44; from the image at (16, 83).
        let (image, uav) = (at(16.0, 83.0, 1.5), ends().uav);
        let line = image.from_origin(&uav);
        let second = *uav.vector() + line * (4.0 / 43.0);
        let after = at(16.0, 5.0, 1.5);
        let line = second - after.vector();
        let first = *after.vector() + line * ((10.0 - 16.0) / line.x);
        let point = |v: Vector3<f32>| Position::from_vector(v).expect("finite");
        let path = over(&[point(first), point(second)]);
        assert!(
            (path.path.c_tau_m - image.distance_m(&uav)).abs() < 1e-3,
            "the construction holds"
        );
        assert!(named(&path, &[], "departure_off_point") > 2.0);
        assert!(named(&path, &[], "departure_off_point_sigmas") > 2.0);
    }

    #[test]
    fn line_of_sight_has_no_excess_and_free_space_gain() {
        let mut path = over(&[]);
        let db = |r: f32| 20.0 * libm::log10f(r);
        let length = path.path.c_tau_m;
        let sin = (1.0 - (7.5 / length) * (7.5 / length)).sqrt();
        let dipole = 1.281_8 * libm::cosf(core::f32::consts::FRAC_PI_2 * 7.5 / length) / sin;
        path.gain_db = Some(db(WAVELENGTH_M / (4.0 * core::f32::consts::PI * length)
            * dipole
            * dipole));
        for short in [0.0, -0.5] {
            let mut path = path;
            path.path.c_tau_m += short;
            let feature = |name| named(&path, &[mirrored_at_wall()], name);
            assert!((feature("excess") - libm::asinhf(short / 0.3)).abs() < 1e-4);
            assert!(feature("arrival_off_gmt") < 1e-2 && feature("departure_off_uav") < 1e-2);
            assert!(
                feature("gain_over_free_space").abs() < 0.02,
                "{}",
                feature("gain_over_free_space")
            );
            assert_eq!((feature("behind_first"), feature("under_strongest")), (0.0, 0.0));
        }
    }

    #[test]
    fn what_is_not_known_is_said() {
        let mut path = mirrored_at_wall();
        path.gain_db = None;
        for name in [
            "gain_known",
            "gain_residual",
            "gain_over_free_space",
            "under_strongest",
        ] {
            assert_eq!(named(&path, &[over(&[])], name), 0.0, "{name}");
        }
        assert_eq!(named(&over(&[]), &[], "gain_known"), 1.0);
        let ends = ends();
        let with = LinkGeometry::new(&ends, &[path])
            .and_then(|l| l.features(&path))
            .expect("sound");
        path.path.aod = None;
        let without = LinkGeometry::new(&ends, &[path])
            .and_then(|l| l.features(&path))
            .expect("sound");
        assert_eq!(without.with_departure(), None);
        assert_eq!(without.without_departure(), with.without_departure());
    }

    #[test]
    fn a_sure_departure_makes_a_mismatch_count_for_more() {
        let mut path = mirrored_at_wall();
        let tilted = path.path.aod.expect("set").direction.vector() + Vector3::new(0.0, 0.0, 0.1);
        let with_sigma = |path: &mut Received, sigma_rad| {
            path.path.aod = Some(Departure {
                direction: Direction::from_vector(tilted).expect("some"),
                sigma_rad,
            });
            named(path, &[], "departure_off_point_sigmas")
        };
        assert!(with_sigma(&mut path, 0.01) > with_sigma(&mut path, 0.1) + 0.5);
    }

    #[test]
    fn hostile_measurements_are_refused_by_name() {
        let good = mirrored_at_wall();
        let ends = ends();
        let features =
            |received: Received| LinkGeometry::new(&ends, &[good]).and_then(|l| l.features(&received));
        let with_length = |c_tau_m| Received {
            path: Path { c_tau_m, ..good.path },
            ..good
        };
        assert_eq!(features(with_length(f32::NAN)), Err(InputError::NotFinite));
        assert_eq!(features(with_length(0.0)), Err(InputError::NoLength));
        assert_eq!(features(with_length(f32::MAX)), Err(InputError::NotFinite));
        let loud = Received {
            gain_db: Some(f32::INFINITY),
            ..good
        };
        assert_eq!(features(loud), Err(InputError::NotFinite));
        let mut unsure = good;
        unsure.path.covariance.m11 = f32::NAN;
        assert_eq!(features(unsure), Err(InputError::NotFinite));
        let same = Ends {
            gmt: ends.uav,
            ..ends
        };
        assert_eq!(
            LinkGeometry::new(&same, &[]).expect_err("same place"),
            InputError::CoincidentEnds
        );
    }

    #[test]
    fn the_papers_inputs_are_raw_and_padded() {
        let paths = [over(&[]), mirrored_at_wall()];
        let mut inputs = [9.0; 9];
        paper_inputs(&paths, &mut inputs);
        assert_eq!(inputs[3], paths[1].path.c_tau_m);
        assert!((inputs[5] - paths[1].path.aoa.azimuth_rad()).abs() < 1e-6);
        assert_eq!(inputs[6..], [0.0; 3]);
        let mut one = [0.0; 3];
        paper_inputs(&paths, &mut one);
        assert_eq!(one, inputs[..3]);
    }
}
