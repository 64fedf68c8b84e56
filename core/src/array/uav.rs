//! The UAV's receive arrays: tilted linear arrays around the body, or one planar array of rows.

use super::element::UavElement;
use super::{centred, face_axes, phasor};
use crate::geometry::{Body, Complex, Direction, Real, Vector3};

/// Linear arrays around the body at most, each with calibration states in the filter; a planar array has more rows.
/// Capacity: states of the filter.
pub const MOST_ARRAYS: usize = 4;

/// How the linear arrays stand to each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum UavLayout {
    /// Faces all around the body, an array on each, at most [`MOST_ARRAYS`]. Each has an oscillator of its own.
    #[default]
    Around,
    /// One planar array: rows on a face that looks at this azimuth, rad, as far apart as the elements of a row, more than [`MOST_ARRAYS`] of them.
    /// All have one oscillator. It hears what is before the face; what comes from behind looks as if it came from before.
    Planar {
        /// Azimuth of the face's outward normal, body axes, rad.
        azimuth_rad: f64,
    },
}

/// Description of the UAV's arrays. All else is computed from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UavArrayConfig {
    /// How the arrays stand to each other.
    pub layout: UavLayout,
    /// Distance of an array's centre from the body origin, of a planar one from the middle of all rows, m.
    pub radius_m: f64,
    /// Tilt of the array axis out of the horizontal, in the plane of its face, rad.
    pub tilt_rad: f64,
    /// Element spacing, wavelengths of the carrier.
    pub spacing_wavelengths: f64,
    /// Element pattern.
    pub element: UavElement,
}

impl Default for UavArrayConfig {
    /// 0.2 m, half a wavelength, and the tilt `atan(1/sqrt 2)` = 35.264 degrees that makes the axes of four faces the
    /// diagonals of a cube: their angular information is then isotropic (docs/signal-model.md, "Arrays").
    fn default() -> Self {
        Self {
            layout: UavLayout::Around,
            radius_m: 0.2,
            tilt_rad: libm::atan(core::f64::consts::FRAC_1_SQRT_2),
            spacing_wavelengths: 0.5,
            element: UavElement::default(),
        }
    }
}

/// One uniform linear array, body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ula<T: Real = f32> {
    /// Outward normal of the face.
    pub normal: Vector3<T>,
    /// Unit vector along the elements.
    pub axis: Vector3<T>,
    /// Centre, m.
    pub centre_m: Vector3<T>,
}

/// `ARRAYS` linear arrays of `ELEMENTS` elements: faces at equal azimuth steps from the nose on, or the rows of a planar array. Channel order is
/// array-major: channel = `ELEMENTS` j + i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UavArrays<T: Real = f32, const ARRAYS: usize = 4, const ELEMENTS: usize = 8> {
    arrays: [Ula<T>; ARRAYS],
    /// From row to row of a planar array, unit vector.
    column: Option<Vector3<T>>,
    /// Phase between neighbours per unit of `axis . u`, rad.
    phase_per_element_rad: T,
    element: UavElement,
}

impl<T: Real, const ARRAYS: usize, const ELEMENTS: usize> UavArrays<T, ARRAYS, ELEMENTS> {
    /// Channels of all arrays.
    pub const CHANNELS: usize = ARRAYS * ELEMENTS;

    /// The arrays of a description.
    // Once in an image, not at each of its callers.
    #[inline(never)]
    pub fn new(config: &UavArrayConfig) -> Self {
        let (sin_tilt, cos_tilt) = T::of(config.tilt_rad).sin_cos_libm();
        let array = |azimuth_rad| {
            let (normal, tangent) = face_axes(azimuth_rad);
            Ula {
                normal,
                axis: tangent * cos_tilt + Vector3::z() * sin_tilt,
                centre_m: normal * T::of(config.radius_m),
            }
        };
        let (arrays, column) = match config.layout {
            UavLayout::Around => (
                core::array::from_fn(|j| array(T::two_pi() * T::of(j as f64 / ARRAYS as f64))),
                None,
            ),
            UavLayout::Planar { azimuth_rad } => {
                let row = array(T::of(azimuth_rad));
                // All rows have the centre of the whole: a delay does not tell them apart.
                ([row; ARRAYS], Some(row.normal.cross(&row.axis)))
            }
        };
        Self {
            arrays,
            column,
            phase_per_element_rad: T::two_pi() * T::of(config.spacing_wavelengths),
            element: config.element,
        }
    }

    /// The arrays, in channel order.
    pub fn arrays(&self) -> &[Ula<T>; ARRAYS] {
        &self.arrays
    }

    /// Unit vector from row to row where the arrays are the rows of a planar one, with one oscillator: element i of row j then has the phase
    /// `(n_i axis + n_j column) . u` times [`Self::phase_per_element_rad`].
    pub fn column(&self) -> Option<&Vector3<T>> {
        self.column.as_ref()
    }

    /// The arrays, for a simulation or a calibration that moves them.
    pub fn arrays_mut(&mut self) -> &mut [Ula<T>; ARRAYS] {
        &mut self.arrays
    }

    /// Phase from an element to the next per unit of `axis . u`, rad: pi at half a wavelength.
    pub fn phase_per_element_rad(&self) -> T {
        self.phase_per_element_rad
    }

    /// Per array, the phase from an element to the next for a wave from `u`, rad: `pi axis_j . u` at half a wavelength.
    pub fn phase_step_rad(&self, u: &Direction<Body, T>) -> [T; ARRAYS] {
        self.arrays
            .map(|array| self.phase_per_element_rad * array.axis.dot(u.vector()))
    }

    /// Steering of one array whose phase step is `step_rad`: element i has `exp(+j n_i step)`, n_i = i - (ELEMENTS-1)/2.
    pub fn steering(step_rad: T) -> [Complex<T>; ELEMENTS] {
        core::array::from_fn(|i| phasor(step_rad * centred(i, ELEMENTS)))
    }

    /// Element amplitude of each array towards `u` (dipole and face).
    pub fn amplitude(&self, u: &Direction<Body, T>) -> [T; ARRAYS] {
        self.arrays
            .map(|array| self.element.amplitude(u.vector(), &array.normal))
    }

    /// Per array, how much earlier than at the body origin a wave from `u` arrives, m: `p_j . u`, so that
    /// `c tau_j = c tau - p_j . u`.
    pub fn lead_m(&self, u: &Direction<Body, T>) -> [T; ARRAYS] {
        self.arrays.map(|array| array.centre_m.dot(u.vector()))
    }
}

impl<T: Real, const ARRAYS: usize, const ELEMENTS: usize> Default for UavArrays<T, ARRAYS, ELEMENTS> {
    fn default() -> Self {
        Self::new(&UavArrayConfig::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Matrix3;

    #[test]
    fn axes_are_the_diagonals_of_a_cube() {
        let arrays = UavArrays::<f64>::default();
        let information: Matrix3<f64> = arrays.arrays().iter().map(|a| a.axis * a.axis.transpose()).sum();
        assert!((information - Matrix3::identity() * (4.0 / 3.0)).norm() < 1e-14);
        for (j, array) in arrays.arrays().iter().enumerate() {
            assert!(
                array.axis.dot(&array.normal).abs() < 1e-15,
                "axis {j} lies in its face"
            );
            assert!((array.axis.norm() - 1.0).abs() < 1e-15);
            assert!((array.centre_m - array.normal * 0.2).norm() < 1e-15);
        }
        let left = arrays.arrays().get(1).expect("four arrays");
        assert!((left.normal - Vector3::y()).norm() < 1e-15, "face 1 looks left");
        assert!(left.axis.x < 0.0 && left.axis.z > 0.0, "its tangent points back");
    }

    #[test]
    fn steering_is_the_phase_of_the_element_positions() {
        let arrays = UavArrays::<f64>::default();
        let u = Direction::from_zenith_azimuth(1.1, 0.4).expect("angles");
        for (array, step) in arrays.arrays().iter().zip(arrays.phase_step_rad(&u)) {
            for (i, s) in UavArrays::<f64>::steering(step).iter().enumerate() {
                // Element position along the axis, in wavelengths; a wave from u leads where position . u > 0.
                let position = array.axis * (0.5 * (i as f64 - 3.5));
                let expected = phasor(core::f64::consts::TAU * position.dot(u.vector()));
                assert!((s - expected).norm_sqr() < 1e-26);
            }
        }
    }

    #[test]
    fn lead_is_the_lever_arm_along_the_wave() {
        let arrays = UavArrays::<f64>::default();
        let ahead = Direction::from_vector(Vector3::x()).expect("unit");
        let lead = arrays.lead_m(&ahead);
        assert!((lead[0] - 0.2).abs() < 1e-15 && lead[1].abs() < 1e-15 && (lead[2] + 0.2).abs() < 1e-15);
    }

    #[test]
    fn single_precision_steers_within_a_millionth_of_a_turn() {
        let (single, double) = (UavArrays::<f32>::default(), UavArrays::<f64>::default());
        for k in 0..200 {
            let (zenith, azimuth) = (0.05 + 0.015 * f64::from(k), -3.0 + 0.03 * f64::from(k));
            let u64 = Direction::from_zenith_azimuth(zenith, azimuth).expect("angles");
            let u32 = Direction::from_zenith_azimuth(zenith as f32, azimuth as f32).expect("angles");
            for (a, b) in single
                .phase_step_rad(&u32)
                .iter()
                .zip(double.phase_step_rad(&u64))
            {
                assert!((f64::from(*a) - b).abs() < 2e-6);
            }
        }
    }

    #[test]
    fn rows_of_a_planar_array_are_parallel_on_one_face() {
        let config = UavArrayConfig {
            layout: UavLayout::Planar {
                azimuth_rad: core::f64::consts::FRAC_PI_2,
            },
            tilt_rad: 0.0,
            ..UavArrayConfig::default()
        };
        let planar = UavArrays::<f64, 8, 8>::new(&config);
        for row in planar.arrays() {
            assert!((row.normal - Vector3::y()).norm() < 1e-15 && (row.axis + Vector3::x()).norm() < 1e-15);
            assert!((row.centre_m - Vector3::y() * 0.2).norm() < 1e-15);
        }
        assert!((planar.column().expect("planar") - Vector3::z()).norm() < 1e-15);
        assert!(UavArrays::<f64>::default().column().is_none());
    }
}
