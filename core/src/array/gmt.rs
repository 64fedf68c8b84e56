//! The GMT's transmit arrays: planar arrays on the faces of a mast.

use super::element::GmtElement;
use super::{centred, face_axes, phasor};
use crate::geometry::{Complex, Direction, Gmt, Real, Vector3};

/// Description of the GMT's arrays. All else is computed from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GmtArrayConfig {
    /// Element spacing in both directions, wavelengths of the carrier.
    pub spacing_wavelengths: f64,
    /// Element pattern.
    pub element: GmtElement,
}

impl Default for GmtArrayConfig {
    fn default() -> Self {
        Self {
            spacing_wavelengths: 0.5,
            element: GmtElement::default(),
        }
    }
}

/// One planar array, GMT frame. All faces share the GMT's position as their phase centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GmtFace<T: Real = f32> {
    /// Azimuth of the outward normal, rad.
    pub azimuth_rad: T,
    /// Outward normal.
    pub normal: Vector3<T>,
    /// Unit vector along a row, horizontal: the normal turned by +90 degrees. Columns run along z.
    pub tangent: Vector3<T>,
}

impl<T: Real> GmtFace<T> {
    /// Face `index` of so many that stand all around, from x on.
    pub fn of(index: usize, faces: usize) -> Self {
        let azimuth_rad = T::two_pi() * T::of(index as f64 / faces as f64);
        let (normal, tangent) = face_axes(azimuth_rad);
        Self {
            azimuth_rad,
            normal,
            tangent,
        }
    }
}

/// `FACES` planar arrays of `COLUMNS` x `ROWS` elements, faces at equal azimuth steps from x on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GmtArrays<T: Real = f32, const FACES: usize = 3, const COLUMNS: usize = 8, const ROWS: usize = 8> {
    faces: [GmtFace<T>; FACES],
    /// Phase between neighbours per unit of direction cosine, rad.
    phase_per_element_rad: T,
    element: GmtElement,
}

impl<T: Real, const FACES: usize, const COLUMNS: usize, const ROWS: usize>
    GmtArrays<T, FACES, COLUMNS, ROWS>
{
    /// The arrays of a description.
    // Once in an image, not at each of its callers.
    #[inline(never)]
    pub fn new(config: &GmtArrayConfig) -> Self {
        Self {
            faces: core::array::from_fn(|s| GmtFace::of(s, FACES)),
            phase_per_element_rad: T::two_pi() * T::of(config.spacing_wavelengths),
            element: config.element,
        }
    }

    /// The faces.
    pub fn faces(&self) -> &[GmtFace<T>; FACES] {
        &self.faces
    }

    /// Phase from an element to the next per unit of direction cosine, rad: pi at half a wavelength.
    pub fn phase_per_element_rad(&self) -> T {
        self.phase_per_element_rad
    }

    /// Direction cosines of `u` along the row and the column of a face (the `s_x`, `s_z` of docs/signal-model.md, "Beam squint").
    pub fn cosines(face: &GmtFace<T>, u: &Direction<Gmt, T>) -> [T; 2] {
        [face.tangent.dot(u.vector()), u.vector().z]
    }

    /// Element amplitude of a face towards `u` (dipole and face).
    pub fn amplitude(&self, face: &GmtFace<T>, u: &Direction<Gmt, T>) -> T {
        self.element.amplitude(u.vector(), &face.normal)
    }

    /// Response `w^T v(u)` of a face whose codeword is `conj(v)/|v|` of direction cosines `aim`, without the element
    /// pattern: real up to rounding, sqrt(COLUMNS ROWS) (18.06 dB for 8 x 8) where the face is aimed.
    pub fn response(&self, aim: [T; 2], cosines: [T; 2]) -> Complex<T> {
        let [dx, dz] = [cosines[0] - aim[0], cosines[1] - aim[1]].map(|d| d * self.phase_per_element_rad);
        planar_factor::<T, COLUMNS, ROWS>(dx, dz)
    }
}

impl<T: Real, const FACES: usize, const COLUMNS: usize, const ROWS: usize> Default
    for GmtArrays<T, FACES, COLUMNS, ROWS>
{
    fn default() -> Self {
        Self::new(&GmtArrayConfig::default())
    }
}

/// Array factor of a planar array with unit-norm weights whose residual phase steps are `row_rad` from column to column
/// and `column_rad` from row to row: `sum exp(j (n_p row + n_q column)) / sqrt(COLUMNS ROWS)`.
pub fn planar_factor<T: Real, const COLUMNS: usize, const ROWS: usize>(
    row_rad: T,
    column_rad: T,
) -> Complex<T> {
    let sum = |step_rad: T, count: usize| {
        (0..count).fold(Complex::new(T::zero(), T::zero()), |acc, i| {
            acc + phasor(step_rad * centred(i, count))
        })
    };
    sum(row_rad, COLUMNS) * sum(column_rad, ROWS) / T::of((COLUMNS * ROWS) as f64).sqrt()
}
