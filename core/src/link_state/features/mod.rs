//! What the networks look at: numbers of a measured path that tell one reflection from none and from several.
//!
//! If the path was reflected once, it was reflected at the point P that the closed form gives, and everything else about
//! it must fit P: the direction in which it left the GMT, its strength, the height of P. The features say how well it
//! does; lengths, angles and ratios that may reach far are compressed by asinh. They are computed in f32, before
//! anything is rounded to int8, where a raw delay would have steps of a metre. Source: docs/link-state.md.
//!
//! Every feature is defined for every path: where the excess delay is not positive (line of sight, with its error), the
//! point is solved for an excess of a centimetre. Nothing here knows the world, its bounds or its material.

mod beside;
mod departure;
mod paper;
mod twins;

use nalgebra::Vector3;

pub use self::beside::{TREE_INPUTS, tree_names};
use self::departure::Point;
pub use self::paper::{PAPER_INPUTS_PER_PATH, PAPER_NAMES, paper_inputs};
use self::twins::twins;
use super::bounce::Bounce;
use crate::geometry::{Direction, World};
use crate::kernels::sqrt;
use crate::path::Path;
use crate::reflection::{Ends, InputError, Jacobians, VectorSolution, point_covariance, vector_point};
use crate::signal::Waveform;

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

/// Names of the geometric network's inputs. The last six need an angle of departure; the network without it takes the
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
    "rank",
    "residual_of_others",
    "twins",
    "departure_off_point",
    "departure_off_point_sigmas",
    "departure_off_uav",
    "turn",
    "twins_departure_off_point",
    "twins_departure_off_point_sigmas",
];

/// Inputs of the geometric network without angle of departure.
pub const GEOMETRIC_INPUTS: usize = 17;

/// Inputs of the geometric network with angle of departure.
pub const GEOMETRIC_WITH_DEPARTURE_INPUTS: usize = 23;

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

/// A point nearer to the GMT than this has no better known direction, m.
const NEAREST_M: f32 = 1e-3;

/// Ranks are counted in eighths: the ninth path of nine has 1.
const RANKS: f32 = 8.0;

/// Twins are counted in quarters: few paths have more than three.
const TWINS: f32 = 4.0;

/// A path with less excess says nothing of how well the world reflects, m.
const REFLECTED_EXCESS_M: f32 = 1.0;

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

/// What all paths of a link have in common: where its ends are, which path came first, which is the strongest, and how
/// well the world around reflects. The last matters much: the second of two reflections costs as many dB as one off
/// poor material.
#[derive(Clone, Copy, Debug)]
pub struct LinkGeometry<'a> {
    ends: &'a Ends,
    baseline: Vector3<f32>,
    baseline_m: f32,
    first_m: f32,
    strongest_db: f32,
    paths: &'a [Received],
    /// Of the carrier, m.
    wavelength_m: f32,
    /// The two greatest residuals of reflected paths.
    residuals: [f32; 2],
}

/// What a path shows without its departure.
struct Arrived {
    /// In the order of [`GEOMETRIC_NAMES`].
    values: [f32; GEOMETRIC_INPUTS],
    single: Single,
    /// Its place among the link's paths.
    rank: Option<usize>,
}

/// A path taken as a single reflection.
struct Single {
    length_m: f32,
    solution: VectorSolution,
    from_gmt: Vector3<f32>,
    incoming: Direction<World>,
    bounce: Bounce,
}

impl<'a> LinkGeometry<'a> {
    /// A link between measured ends, with all its measured paths, strongest first, at the carrier of a waveform. Inputs of the networks are ratios
    /// to free space, so that the wavelength changes what free space leaves and nothing else.
    ///
    /// # Errors
    /// [`InputError::CoincidentEnds`] when UAV and GMT are at the same place, [`InputError::NotFinite`] when their
    /// distance overflows.
    pub fn new(ends: &'a Ends, paths: &'a [Received], waveform: &Waveform) -> Result<Self, InputError> {
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
        let mut link = Self {
            ends,
            baseline,
            baseline_m,
            first_m,
            strongest_db,
            paths,
            wavelength_m: waveform.wavelength_m() as f32,
            residuals: [-MOST_DB / DB_UNIT; 2],
        };
        for received in paths {
            if let Some(residual) = link.residual(received) {
                let [best, second] = link.residuals;
                link.residuals = if residual > best {
                    [residual, best]
                } else {
                    [best, second.max(residual)]
                };
            }
        }
        Ok(link)
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

    /// Where a path that was reflected once was, and how strong it would be. `None` for lengths that overflow.
    fn single(&self, path: &Path<World>) -> Option<Single> {
        // With this much excess there is a point in every direction. Only for a line of sight without any error can
        // rounding put it beyond the GMT: then it is at the GMT.
        let length_m = path.c_tau_m.max(self.baseline_m + LEAST_EXCESS_M);
        let at_gmt = || {
            (length_m < self.baseline_m + REFLECTED_EXCESS_M).then_some(VectorSolution {
                distance_m: self.baseline_m,
                denominator_m: LEAST_EXCESS_M,
                one_plus_cos_bistatic: 1.0,
            })
        };
        let solution = vector_point(&self.baseline, path.aoa.vector(), length_m).or_else(at_gmt)?;
        let from_gmt = self.baseline + path.aoa.vector() * solution.distance_m;
        // A line of sight without any error has its point at the GMT: what left there left straight for the UAV.
        let straight = || Direction::<World>::from_vector(self.baseline);
        let incoming = Direction::<World>::from_vector(from_gmt)
            .or_else(|_| straight())
            .ok()?;
        let bounce = Bounce::new(incoming.vector(), path.aoa.vector(), length_m, self.wavelength_m);
        Some(Single {
            length_m,
            solution,
            from_gmt,
            incoming,
            bounce,
        })
    }

    /// How much stronger a reflected path is than a single bounce would be, as [`decibels`].
    fn residual(&self, received: &Received) -> Option<f32> {
        if self.excess_m(&received.path) < REFLECTED_EXCESS_M {
            return None;
        }
        let gain_db = received.gain_db?;
        let bounce = self.single(&received.path)?.bounce;
        Some(decibels(gain_db - bounce.unreflected_db - bounce.reflection_db))
    }

    /// The greatest residual of the link's other reflected paths: how well this world reflects. `own` is the residual of
    /// the path that asks, if it has one.
    fn residual_of_others(&self, own: Option<f32>) -> f32 {
        let [greatest, second] = self.residuals;
        if own.is_some_and(|own| own >= greatest) {
            second
        } else {
            greatest
        }
    }

    /// Features of one of the link's paths, as it was given to [`Self::new`].
    ///
    /// # Errors
    /// [`InputError::NotFinite`] for a delay, gain or covariance that is no number, [`InputError::NoLength`] for a delay
    /// that is not positive.
    pub fn features(&self, received: &Received) -> Result<Features, InputError> {
        let Arrived {
            values: common,
            single,
            rank,
        } = self.arrived(received)?;
        let path = &received.path;
        let mut values = [0.0; GEOMETRIC_WITH_DEPARTURE_INPUTS];
        if let Some(places) = values.first_chunk_mut() {
            *places = common;
        }
        if let (Some(departure), Some(places)) = (&path.aod, values.last_chunk_mut()) {
            let jacobians = Jacobians::at(&self.baseline, path, &single.solution);
            let point = Point {
                from_gmt: single.from_gmt,
                line: single.incoming,
                covariance: point_covariance(&jacobians, path, &self.ends.uav_covariance),
            };
            let group = core::iter::once(path).chain(twins(path, rank, self.paths));
            *places = self.departure_features(path, departure, &point, group)?;
        }
        let departure = path.aod.is_some();
        all_finite(Features { values, departure }, &values)
    }

    /// Inputs of the trees for one of the link's paths, as it was given to [`Self::new`], in the order of [`tree_names`].
    ///
    /// # Errors
    /// As [`Self::features`].
    pub fn tree_inputs(&self, received: &Received) -> Result<[f32; TREE_INPUTS], InputError> {
        let arrived = self.arrived(received)?;
        let mut values = [0.0; TREE_INPUTS];
        if let Some(places) = values.first_chunk_mut() {
            *places = arrived.values;
        }
        if let Some(places) = values.last_chunk_mut() {
            *places = self.beside(received, &arrived)?;
        }
        all_finite(values, &values)
    }

    /// The features that need no departure.
    fn arrived(&self, received: &Received) -> Result<Arrived, InputError> {
        let path = &received.path;
        check(self.ends, received)?;
        let (gmt, uav) = (self.ends.gmt.vector(), self.ends.uav.vector());
        let single = self.single(path).ok_or(InputError::NotFinite)?;
        let bounce = &single.bounce;
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
        let counts = known > 0.0 && self.excess_m(path) >= REFLECTED_EXCESS_M;
        let own = counts.then_some(residual);
        let rank = self.paths.iter().position(|other| other == received);
        let source_height_m = uav.z + path.c_tau_m * path.aoa.vector().z - gmt.z;
        let values = [
            compressed(self.excess_m(path), EXCESS_UNIT_M),
            compressed(towards_gmt.angle_to_rad(&path.aoa), ANGLE_UNIT_RAD),
            compressed(path.c_tau_m - self.first_m.min(path.c_tau_m), EXCESS_UNIT_M),
            compressed(source_height_m, HEIGHT_UNIT_M),
            compressed(single.from_gmt.z, HEIGHT_UNIT_M),
            single.solution.distance_m / single.length_m,
            bounce.cos_incidence,
            bounce.normal.z,
            compressed(self.baseline_m, LENGTH_UNIT_M),
            compressed(path.c_tau_m, LENGTH_UNIT_M),
            residual,
            over_free_space,
            under,
            known,
            rank.map_or(1.0, |rank| (rank as f32 / RANKS).min(1.0)),
            self.residual_of_others(own),
            twins(path, rank, self.paths).count() as f32 / TWINS,
        ];
        Ok(Arrived { values, single, rank })
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

/// Features, when all numbers are numbers.
fn all_finite<F>(features: F, values: &[f32]) -> Result<F, InputError> {
    let sound = values.iter().all(|x| x.is_finite());
    sound.then_some(features).ok_or(InputError::NotFinite)
}

fn decibels(value_db: f32) -> f32 {
    value_db.clamp(-MOST_DB, MOST_DB) / DB_UNIT
}

#[cfg(test)]
mod tests;
