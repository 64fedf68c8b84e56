//! The GMT's codebook of transmit beams.

use super::centred;
use super::gmt::GmtArrays;
use crate::geometry::{Complex, Direction, Gmt, Real, Vector3};

/// Description of a codebook. `ELEVATIONS` beams in elevation for each azimuth of each face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CodebookConfig<const ELEVATIONS: usize = 3> {
    /// Beams in azimuth per face.
    pub azimuths: usize,
    /// Half the sector of a face, rad: the outermost beams are half a beam step (in sine space) inside it.
    pub sector_rad: f64,
    /// Elevations above the horizontal, rad.
    pub elevations_rad: [f64; ELEVATIONS],
}

impl Default for CodebookConfig<3> {
    /// 8 azimuths over +-60 degrees at elevations 0, 12 and 25 degrees.
    fn default() -> Self {
        Self {
            azimuths: 8,
            sector_rad: core::f64::consts::FRAC_PI_3,
            elevations_rad: [0.0, 12.0, 25.0].map(f64::to_radians),
        }
    }
}

/// Where a transmit beam looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam<T: Real = f32> {
    /// Face that sends it.
    pub face: usize,
    /// Azimuth in the GMT frame, rad (not wrapped: face azimuth + offset).
    pub azimuth_rad: T,
    /// Elevation above the horizontal, rad.
    pub elevation_rad: T,
    /// Direction cosines along the row and the column of its face.
    pub cosines: [T; 2],
}

impl<T: Real> Beam<T> {
    /// Direction of the beam's peak.
    pub fn direction(&self) -> Vector3<T> {
        let (sin_elevation, cos_elevation) = self.elevation_rad.sin_cos_libm();
        let (sin_azimuth, cos_azimuth) = self.azimuth_rad.sin_cos_libm();
        Vector3::new(
            cos_elevation * cos_azimuth,
            cos_elevation * sin_azimuth,
            sin_elevation,
        )
    }
}

/// A codebook over the faces of [`GmtArrays`]. Beam m = `(azimuths ELEVATIONS) s + ELEVATIONS k + e` for face s, azimuth
/// k, elevation e; azimuth = face + asin(sin(sector) (k - (azimuths-1)/2) / (azimuths/2)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Codebook<
    T: Real = f32,
    const FACES: usize = 3,
    const COLUMNS: usize = 8,
    const ROWS: usize = 8,
    const ELEVATIONS: usize = 3,
> {
    arrays: GmtArrays<T, FACES, COLUMNS, ROWS>,
    config: CodebookConfig<ELEVATIONS>,
}

impl<T: Real, const FACES: usize, const COLUMNS: usize, const ROWS: usize, const ELEVATIONS: usize>
    Codebook<T, FACES, COLUMNS, ROWS, ELEVATIONS>
{
    /// The codebook of a description.
    pub fn new(arrays: GmtArrays<T, FACES, COLUMNS, ROWS>, config: CodebookConfig<ELEVATIONS>) -> Self {
        Self { arrays, config }
    }

    /// The arrays that send it.
    pub fn arrays(&self) -> &GmtArrays<T, FACES, COLUMNS, ROWS> {
        &self.arrays
    }

    /// Number of beams, 72 by default.
    pub fn len(&self) -> usize {
        FACES * self.config.azimuths * ELEVATIONS
    }

    /// Whether the codebook has no beam.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Beam `index`; none beyond the codebook.
    pub fn beam(&self, index: usize) -> Option<Beam<T>> {
        let per_face = self.config.azimuths * ELEVATIONS;
        let face_index = index.checked_div(per_face)?;
        let face = self.arrays.faces().get(face_index)?;
        let within = index % per_face;
        let (k, e) = (within / ELEVATIONS, within % ELEVATIONS);
        let (sin_sector, _) = T::of(self.config.sector_rad).sin_cos_libm();
        let sine = sin_sector * centred(k, self.config.azimuths) * T::of(2.0 / self.config.azimuths as f64);
        let offset_rad = sine.asin_libm();
        let elevation_rad = T::of(*self.config.elevations_rad.get(e)?);
        let (sin_elevation, cos_elevation) = elevation_rad.sin_cos_libm();
        let (sin_offset, _) = offset_rad.sin_cos_libm();
        Some(Beam {
            face: face_index,
            azimuth_rad: face.azimuth_rad + offset_rad,
            elevation_rad,
            cosines: [sin_offset * cos_elevation, sin_elevation],
        })
    }

    /// Field of beam `index` towards `u` for unit transmit power, relative to an isotropic antenna: codeword `w =
    /// conj(v)/|v|` applied to the face's response, times the element pattern. Zero beyond the codebook.
    pub fn field(&self, index: usize, u: &Direction<Gmt, T>) -> Complex<T> {
        let zero = Complex::new(T::zero(), T::zero());
        let Some(beam) = self.beam(index) else {
            return zero;
        };
        self.arrays.faces().get(beam.face).map_or(zero, |face| {
            let cosines = GmtArrays::<T, FACES, COLUMNS, ROWS>::cosines(face, u);
            self.arrays.response(beam.cosines, cosines) * self.arrays.amplitude(face, u)
        })
    }
}

impl<T: Real, const FACES: usize, const COLUMNS: usize, const ROWS: usize> Default
    for Codebook<T, FACES, COLUMNS, ROWS, 3>
{
    fn default() -> Self {
        Self::new(GmtArrays::default(), CodebookConfig::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::half_wave_dipole;
    use crate::array::phasor;

    #[test]
    fn beams_are_numbered_face_azimuth_elevation() {
        let codebook = Codebook::<f64>::default();
        assert_eq!(codebook.len(), 72);
        // m = 24 s + 3 k + e.
        let beam = codebook.beam(24 + 3 * 7 + 2).expect("beam of face 1");
        assert_eq!(beam.face, 1);
        let sine = 3.5 / 4.0 * libm::sin(60_f64.to_radians());
        assert!((beam.azimuth_rad - (120_f64.to_radians() + libm::asin(sine))).abs() < 1e-12);
        assert!((beam.elevation_rad - 25_f64.to_radians()).abs() < 1e-15);
        assert!(codebook.beam(72).is_none());
        let u = Direction::from_vector(Vector3::x()).expect("unit");
        assert_eq!(codebook.field(72, &u), Complex::new(0.0, 0.0));
    }

    #[test]
    fn peak_gain_is_the_array_gain_times_the_element() {
        let codebook = Codebook::<f64>::default();
        for index in 0..codebook.len() {
            let beam = codebook.beam(index).expect("beam");
            let u = Direction::from_vector(beam.direction()).expect("unit");
            let face = codebook.arrays().faces()[beam.face];
            let element = half_wave_dipole(u.vector()) * face.normal.dot(u.vector()).sqrt();
            let field = codebook.field(index, &u);
            assert!(
                (field - Complex::new(8.0 * element, 0.0)).norm_sqr() < 1e-24,
                "beam {index}"
            );
        }
    }

    #[test]
    fn field_is_the_codeword_applied_to_the_elements() {
        let codebook = Codebook::<f64>::default();
        let u = Direction::from_zenith_azimuth(1.2, 2.3).expect("angles");
        for index in [0, 17, 40, 71] {
            let beam = codebook.beam(index).expect("beam");
            let face = codebook.arrays().faces()[beam.face];
            // v of the definition: phase pi (n_p t + n_q z) . direction.
            let v = |d: &Vector3<f64>, p: usize, q: usize| {
                let place = face.tangent * (p as f64 - 3.5) + Vector3::z() * (q as f64 - 3.5);
                phasor(core::f64::consts::PI * place.dot(d))
            };
            let mut sum = Complex::new(0.0, 0.0);
            for (p, q) in (0..64).map(|n| (n / 8, n % 8)) {
                sum += v(&beam.direction(), p, q).conj() / 8.0 * v(u.vector(), p, q);
            }
            let expected = sum * codebook.arrays().amplitude(&face, &u);
            assert!((codebook.field(index, &u) - expected).norm_sqr() < 1e-24);
        }
    }

    #[test]
    fn finer_and_coarser_codebooks_come_from_the_same_code() {
        let fine = Codebook::<f64, 3, 8, 8, 5>::new(
            GmtArrays::default(),
            CodebookConfig {
                azimuths: 16,
                sector_rad: core::f64::consts::FRAC_PI_3,
                elevations_rad: [-5.0, 0.0, 8.0, 16.0, 25.0].map(f64::to_radians),
            },
        );
        assert_eq!(fine.len(), 240);
        let (first, last) = (
            fine.beam(0).expect("first"),
            fine.beam(79).expect("last of face 0"),
        );
        let sine = 7.5 / 8.0 * libm::sin(60_f64.to_radians());
        assert!((first.azimuth_rad + libm::asin(sine)).abs() < 1e-12);
        assert!((last.azimuth_rad - libm::asin(sine)).abs() < 1e-12);
        let none = CodebookConfig {
            azimuths: 0,
            ..CodebookConfig::default()
        };
        assert!(Codebook::<f32>::new(GmtArrays::default(), none).beam(0).is_none());
    }
}
