//! What the filter takes in, and what it predicts in its place.
//!
//! Line of sight and a reflection off a plane are one thing: a reflected path comes straight from the mirror image of
//! the transmitter, a doubly reflected one from the image of that image. So one function gives the rows of all: delay, two
//! angles of arrival, two direction cosines of departure (docs/localization.md, "The model").

mod mirror;

use nalgebra::{Matrix3, Vector3};

use self::mirror::mirrors;
use super::config::RadioNoise;
use super::face_direction::FaceDirection;
use super::layout::{ARRAY_AXIS, ARRAY_SLOPE, ATTITUDE, CLOCK_OFFSET, FACE_BIAS, POSITION};
use super::nominal::Nominal;
use super::row::Row;
use crate::array::{BeamReach, MOST_ARRAYS};
use crate::geometry::{Body, Direction, Gmt, Plane, Real, Rotation, World};
use crate::path::RangeRate;
use crate::radio::RadioModel;

/// One measured path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathMeasurement {
    /// Speed of light times delay, clock offset included, m; a whole number of delay periods does not matter.
    pub c_tau_m: f64,
    /// Standard deviation of that, m.
    pub c_tau_sigma_m: f64,
    /// Angle of arrival, not corrected for the arrays' calibration.
    pub aoa: Direction<Body, f64>,
    /// Standard deviation of that along any tangent, rad.
    pub aoa_sigma_rad: f64,
    /// Angle of departure, when it was measured.
    pub departure: Option<FaceDirection>,
    /// How fast it grows, when that was measured.
    pub range_rate: Option<RangeRate>,
}

/// The GMT as its beacon describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmitter {
    /// Antenna position, world frame, m.
    pub position_m: Vector3<f64>,
    /// Standard deviation of that per axis, m.
    pub sigma_m: f64,
    /// Attitude of the mast: identity when it stands level and looks east.
    pub attitude: Rotation<Gmt, World, f64>,
    /// Elevations that its beams reach.
    pub reach: BeamReach,
}

/// A surface of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedPlane {
    /// Which surface: stays the same while its plane moves.
    pub id: u32,
    /// The plane. Its shift (m) and two tilts (rad) are the states of the filter.
    pub plane: Plane,
}

/// To double precision.
fn wide(v: &Vector3<f32>) -> Vector3<f64> {
    v.map(f64::from)
}

/// Most rows of one path.
/// Derived: delay, two of arrival, two of departure.
pub(super) const PATH_ROWS: usize = 5;
/// Determinant of the arrays' gains under which they tell no direction.
/// Numerical: a guard of a division.
const LEAST_DETERMINANT: f64 = 1e-9;
/// A way shorter than this has no direction, m.
/// Numerical: a guard of a division.
pub(super) const LEAST_RANGE_M: f64 = 0.1;

/// Rows of one path: delay, two angles of arrival, then two cosines of departure when measured.
pub(super) type PathRows<T> = heapless::Vec<Row<T>, PATH_ROWS>;

/// Antenna geometry and noise figures: what all predictions share.
#[derive(Clone, Debug)]
pub struct Model {
    pub(super) radio: RadioModel,
    noise: RadioNoise,
}

impl Transmitter {
    /// Whether its beams reach a direction of the world.
    #[must_use]
    pub fn leaves_in_beams(&self, departure: &Vector3<f64>) -> bool {
        self.reach
            .contains(self.attitude.inverse().apply_vector(departure).z)
    }

    /// The part of a beacon's standard deviation that stays from sweep to sweep, m per axis.
    pub(super) fn steady_sigma_m(&self, noise: &RadioNoise) -> f64 {
        self.sigma_m.min(noise.beacon_m)
    }
}

impl Model {
    /// A radio with these noise figures.
    pub fn new(radio: RadioModel, noise: RadioNoise) -> Self {
        Self { radio, noise }
    }

    /// Direction and along-tangent shift of the angle of arrival by the arrays' calibration errors, with its derivatives
    /// (docs/localization.md, "The model"): per array and tangent the weight `c_j`, and the two axis cosines.
    fn array_shift(&self, u: &Direction<Body, f64>, nominal: &Nominal) -> ArrayShift {
        let (e1, e2) = u.tangents();
        let mut shift = ArrayShift::default();
        let (mut h11, mut h12, mut h22) = (0.0, 0.0, 0.0);
        let mut along = [[0.0; 2]; MOST_ARRAYS];
        for (array, dw) in self.radio.arrays.iter().zip(&mut along) {
            let amplitude = self.radio.element.amplitude(u.vector(), &array.normal);
            let gain = amplitude * amplitude;
            let (a, b) = (array.axis.dot(&e1), array.axis.dot(&e2));
            (h11, h12, h22) = (h11 + gain * a * a, h12 + gain * a * b, h22 + gain * b * b);
            *dw = [gain * a, gain * b];
        }
        let determinant = h11 * h22 - h12 * h12;
        if determinant <= LEAST_DETERMINANT {
            return shift;
        }
        for (j, (array, [a, b])) in self.radio.arrays.iter().zip(along).enumerate() {
            let weight = [
                (h22 * a - h12 * b) / determinant,
                (h11 * b - h12 * a) / determinant,
            ];
            let side = array.axis.cross(&array.normal);
            let cosines = [array.normal.dot(u.vector()), side.dot(u.vector())];
            let slope = nominal.array_slope.get(j).copied().unwrap_or(0.0);
            let tilt = nominal.array_axis_rad.get(j).copied().unwrap_or([0.0; 2]);
            let error = slope + cosines[0] * tilt[0] + cosines[1] * tilt[1];
            for (e, c) in shift.error.iter_mut().zip(weight) {
                *e += c * error;
            }
            if let (Some(w), Some(m)) = (shift.weight.get_mut(j), shift.cosines.get_mut(j)) {
                (*w, *m) = (weight, cosines);
            }
        }
        shift
    }

    /// An angle of arrival without the arrays' estimated calibration errors: what the reflection solver is to be given.
    pub fn corrected(&self, aoa: &Direction<Body, f64>, nominal: &Nominal) -> Vector3<f64> {
        let (e1, e2) = aoa.tangents();
        let shift = self.array_shift(aoa, nominal);
        (aoa.vector() - e1 * shift.error[0] - e2 * shift.error[1]).normalize()
    }

    /// The same of an arrival as paths have it; one that is no direction afterwards stays as it was.
    pub fn corrected_arrival(&self, aoa: &Direction<Body>, nominal: &Nominal) -> Direction<Body> {
        let Ok(wide) = Direction::from_vector(aoa.vector().map(f64::from)) else {
            return *aoa;
        };
        Direction::from_vector(self.corrected(&wide, nominal).map(|c| c as f32)).unwrap_or(*aoa)
    }

    /// World direction of a departure without the face's estimated bias, pointing from the GMT; `None` when its face
    /// does not exist or the cosines exceed one.
    pub fn departed(
        &self,
        departure: &FaceDirection,
        gmt: &Transmitter,
        nominal: &Nominal,
    ) -> Option<Vector3<f64>> {
        let face = self.radio.faces.get(departure.face)?;
        let bias = nominal.face_bias.get(departure.face)?;
        let [sx, sz] = [departure.cosines[0] - bias[0], departure.cosines[1] - bias[1]];
        let square = 1.0 - sx * sx - sz * sz;
        if square.is_nan() || square < 0.0 {
            return None;
        }
        let local = face.normal * libm::sqrt(square) + face.tangent * sx + Vector3::z() * sz;
        Some(gmt.attitude.apply_vector(&local))
    }

    /// Where a path alone puts the UAV: from the (image of the) GMT along the direction of departure, or against that of arrival
    /// when the departure was not measured.
    pub fn place(
        &self,
        nominal: &Nominal,
        gmt: &Transmitter,
        path: &PathMeasurement,
        bounces: &[(&MappedPlane, usize)],
    ) -> Option<Vector3<f64>> {
        let range = nominal
            .delay_period
            .range_m(path.c_tau_m - nominal.clock_offset_m);
        let mirrors = mirrors(&gmt.position_m, bounces);
        let source = mirrors.last().map_or(gmt.position_m, |m| m.image_m);
        let onward = match &path.departure {
            Some(departure) => {
                let departed = self.departed(departure, gmt, nominal)?;
                mirrors.iter().fold(departed, |v, m| m.turn(&v))
            }
            None => -(nominal.attitude * self.corrected(&path.aoa, nominal)),
        };
        Some(source + onward * range)
    }

    /// The rows of a path for a position that may be far off: linearised where the path itself puts the UAV, so that a linear step
    /// of metres lands as precisely as one of millimetres.
    pub fn rows_from_afar<T: Real>(
        &self,
        nominal: &Nominal,
        gmt: &Transmitter,
        path: &PathMeasurement,
        bounces: &[(&MappedPlane, usize)],
    ) -> Option<PathRows<T>> {
        let place = self.place(nominal, gmt, path, bounces)?;
        let there = Nominal {
            position_m: place,
            ..*nominal
        };
        let mut rows = self.rows::<T>(&there, gmt, path, bounces)?;
        let shift = (place - nominal.position_m).map(T::of);
        for row in &mut rows {
            let along = row.entries().iter().fold(T::zero(), |sum, &(state, h)| {
                let axis = usize::from(state).checked_sub(POSITION);
                sum + axis
                    .and_then(|axis| shift.get(axis))
                    .map_or(T::zero(), |s| h * *s)
            });
            row.residual += along;
        }
        Some(rows)
    }

    /// The rows of a path, straight from the GMT or off the given planes in the order in which the wave met them; with each
    /// comes the state where its errors begin. `None` when UAV and (image of the) GMT coincide.
    #[inline(never)]
    pub fn rows<T: Real>(
        &self,
        nominal: &Nominal,
        gmt: &Transmitter,
        path: &PathMeasurement,
        bounces: &[(&MappedPlane, usize)],
    ) -> Option<PathRows<T>> {
        let mirrors = mirrors(&gmt.position_m, bounces);
        let source = mirrors.last().map_or(gmt.position_m, |m| m.image_m);
        let way = source - nominal.position_m;
        let range = way.norm();
        if range.is_nan() || range < LEAST_RANGE_M {
            return None;
        }
        let l = way / range;
        let across = (Matrix3::identity() - l * l.transpose()) / range;
        // The beacon's own error moves the source as the UAV's error does. What stays of it moves the world, and is no noise.
        let steady = gmt.steady_sigma_m(&self.noise);
        let gmt_range = gmt.sigma_m * gmt.sigma_m - steady * steady;
        let gmt_angle = gmt_range / (range * range);
        let squared = |a: f64, b: f64, c: f64| a * a + b * b + c;
        let mut rows = PathRows::new();

        let residual = nominal
            .delay_period
            .wrap_m(path.c_tau_m - nominal.clock_offset_m - range);
        let mut row = Row::new(
            residual,
            squared(path.c_tau_sigma_m, self.noise.delay_m, gmt_range),
        );
        row.push_vector(POSITION, &-l);
        row.push(CLOCK_OFFSET, 1.0);
        for mirror in &mirrors {
            mirror.push(&mut row, &l, [0.0; 2]);
        }
        let _ = rows.push(row);

        let u = Direction::<Body, f64>::from_vector(nominal.attitude.tr_mul(&l)).ok()?;
        let (e1, e2) = u.tangents();
        let shift = self.array_shift(&u, nominal);
        for (i, e) in [e1, e2].iter().enumerate() {
            let seen = e.dot(&(path.aoa.vector() - u.vector()));
            let expected = shift.error.get(i).copied().unwrap_or(0.0);
            let mut row = Row::new(
                seen - expected,
                squared(path.aoa_sigma_rad, self.noise.aoa_rad, gmt_angle),
            );
            let world = nominal.attitude * e;
            let moved = across * world;
            row.push_vector(POSITION, &-moved);
            row.push_vector(ATTITUDE, &world.cross(&l));
            for (j, (weight, cosines)) in shift.weight.iter().zip(&shift.cosines).enumerate() {
                let c = weight.get(i).copied().unwrap_or(0.0);
                row.push(ARRAY_SLOPE + j, c);
                row.push(ARRAY_AXIS + 2 * j, c * cosines[0]);
                row.push(ARRAY_AXIS + 2 * j + 1, c * cosines[1]);
            }
            for mirror in &mirrors {
                mirror.push(&mut row, &moved, [0.0; 2]);
            }
            let _ = rows.push(row);
        }

        let Some(departure) = &path.departure else {
            return Some(rows);
        };
        let (Some(face), Some(bias)) = (
            self.radio.faces.get(departure.face),
            nominal.face_bias.get(departure.face),
        ) else {
            return Some(rows);
        };
        for (i, axis) in [face.tangent, Vector3::z()].into_iter().enumerate() {
            let axis = gmt.attitude.apply_vector(&axis);
            // A reflected wave left along the mirrored direction: the same as measuring along the mirrored axis.
            let axis_seen = mirrors.iter().fold(axis, |axis, m| m.turn(&axis));
            let (Some(cosine), Some(bias), Some(sigma)) =
                (departure.cosines.get(i), bias.get(i), departure.sigma.get(i))
            else {
                continue;
            };
            let moved = across * axis_seen;
            let lasting = self.noise.departure_lasting * self.noise.departure_lasting;
            let variance = squared(*sigma, self.noise.departure, gmt_angle) + lasting;
            let mut row = Row::new(cosine + axis_seen.dot(&l) - bias, variance).with_lasting(lasting);
            row.push_vector(POSITION, &moved);
            row.push(FACE_BIAS + 2 * departure.face + i, 1.0);
            let mut axis_here = axis;
            for (k, mirror) in mirrors.iter().enumerate() {
                // The wave as it left this plane: the arriving one, led back over the planes behind it.
                let behind = mirrors.get(k + 1..).unwrap_or(&[]);
                let leaving = behind.iter().rev().fold(-l, |v, m| m.turn(&v));
                mirror.push(&mut row, &-moved, mirror.departure_tilts(&axis_here, &leaving));
                axis_here = mirror.turn(&axis_here);
            }
            let _ = rows.push(row);
        }
        Some(rows)
    }
}

/// Shift of the angle of arrival along its two tangents, and what it consists of.
#[derive(Default)]
struct ArrayShift {
    error: [f64; 2],
    weight: [[f64; 2]; MOST_ARRAYS],
    cosines: [[f64; 2]; MOST_ARRAYS],
}

/// Most planes of one path.
/// Capacity: memory of a row.
pub(super) const MAX_BOUNCES: usize = 2;

/// Planes that a wave met, from the GMT on.
pub type Bounces = heapless::Vec<MappedPlane, MAX_BOUNCES>;

/// A path with the surfaces that reflected it.
#[derive(Clone, Debug)]
pub struct ReflectedPath {
    /// The path.
    pub path: PathMeasurement,
    /// The surfaces, from the GMT on; one at least.
    pub planes: Bounces,
}
