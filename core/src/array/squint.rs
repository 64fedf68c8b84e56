//! Beam squint symbols: the transmit array sweeps a sector over frequency, so the strongest subcarrier names the
//! direction.
//!
//! Each element has a phase shifter and a true time delay, both linear in its place: weight `w_pq(f) = exp(-j [pi (n_p psi_x
//! + n_q psi_z) + 2 pi f (n_p T_x + n_q T_z)]) / |w|`, f off the carrier, so the beam of frequency f looks to the direction
//! cosine `s (1 + f/fc) = psi + 2 T f`. Source: docs/signal-model.md, "Beam squint".

use super::{centred, planar_factor};
use crate::geometry::{Complex, Real};

/// Which symbols are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SquintScheme {
    /// Per face, azimuth sweeps at fixed elevations, then elevation sweeps at fixed azimuths: 11 symbols.
    Sequential,
    /// Per face one symbol: several azimuth passes while the elevation rises.
    Raster,
}

/// Description of the sweeps, in direction cosines along the row (x) and the column (z) of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquintConfig<const AZIMUTH_SWEEPS: usize = 3, const ELEVATION_SWEEPS: usize = 8> {
    /// Azimuth sweeps run over +- this cosine.
    pub half_width: f64,
    /// Elevation cosines at which azimuth sweeps are sent.
    pub elevations: [f64; AZIMUTH_SWEEPS],
    /// First and last cosine of an elevation sweep.
    pub rise: [f64; 2],
    /// Cosine of the sector's edge: the elevation sweeps stand at the azimuths of a codebook of as many beams.
    pub sector: f64,
    /// Azimuth passes of a raster symbol.
    pub passes: usize,
    /// First and last elevation cosine of a raster symbol.
    pub raster_rise: [f64; 2],
}

impl Default for SquintConfig<3, 8> {
    fn default() -> Self {
        Self {
            half_width: 0.87,
            elevations: [0.05, 0.28, 0.51],
            rise: [-0.10, 0.75],
            sector: libm::sin(core::f64::consts::FRAC_PI_3),
            passes: 3,
            raster_rise: [0.0, 0.62],
        }
    }
}

/// Phase shifts and delays of one symbol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquintSymbol<T: Real = f32> {
    /// Face that sends it.
    pub face: usize,
    /// Phase from an element to the next, along the row and the column, in units of pi.
    pub psi: [T; 2],
    /// Delay from an element to the next, along the row and the column, ns. (Seconds would underflow products in `f32`.)
    pub delay_ns: [T; 2],
    /// From an element to the next, half wavelengths of the carrier.
    pub half_wavelengths: T,
}

/// Phase shift and delay that sweep the cosine from `first` at frequency `low_hz` to `last` at `high_hz`, wrapping around
/// `passes - 1` times, of elements that are half a wavelength apart: (psi, T in s). At another spacing cosines count by so much more.
fn sweep([first, last]: [f64; 2], passes: usize, [low_hz, high_hz]: [f64; 2], carrier_hz: f64) -> (f64, f64) {
    let wraps = 2.0 * passes.saturating_sub(1) as f64;
    let start = first * (1.0 + low_hz / carrier_hz);
    let delay_s = (last * (1.0 + high_hz / carrier_hz) - start + wraps) / (2.0 * (high_hz - low_hz));
    (start - 2.0 * delay_s * low_hz, delay_s)
}

impl<const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>
    SquintConfig<AZIMUTH_SWEEPS, ELEVATION_SWEEPS>
{
    /// Symbols of one face: 11 for the sequential scheme, one for the raster.
    pub fn per_face(&self, scheme: SquintScheme) -> usize {
        match scheme {
            SquintScheme::Sequential => AZIMUTH_SWEEPS + ELEVATION_SWEEPS,
            SquintScheme::Raster => 1,
        }
    }

    /// Symbol `index` of a schedule that sends the symbols of face 0 first; none beyond `faces` faces. `band_hz`: offsets
    /// of the first and last subcarrier from the carrier. The elements are half a wavelength apart.
    pub fn symbol<T: Real>(
        &self,
        scheme: SquintScheme,
        index: usize,
        faces: usize,
        band_hz: [f64; 2],
        carrier_hz: f64,
    ) -> Option<SquintSymbol<T>> {
        self.spaced_symbol(scheme, index, faces, band_hz, carrier_hz, 0.5)
    }

    /// The same of elements `spacing_wavelengths` apart.
    pub fn spaced_symbol<T: Real>(
        &self,
        scheme: SquintScheme,
        index: usize,
        faces: usize,
        band_hz: [f64; 2],
        carrier_hz: f64,
        spacing_wavelengths: f64,
    ) -> Option<SquintSymbol<T>> {
        let (face, within) = (index / self.per_face(scheme), index % self.per_face(scheme));
        if face >= faces {
            return None;
        }
        let half_wavelengths = 2.0 * spacing_wavelengths;
        let swept = |cosines: [f64; 2], passes| {
            sweep(
                cosines.map(|cosine| cosine * half_wavelengths),
                passes,
                band_hz,
                carrier_hz,
            )
        };
        let held = |cosine: f64| (cosine * half_wavelengths, 0.0);
        let across = [-self.half_width, self.half_width];
        let (x, z) = match scheme {
            SquintScheme::Raster => (swept(across, self.passes), swept(self.raster_rise, 1)),
            SquintScheme::Sequential => match self.elevations.get(within) {
                Some(elevation) => (swept(across, 1), held(*elevation)),
                None => {
                    let place: f64 = centred(within - AZIMUTH_SWEEPS, ELEVATION_SWEEPS);
                    let azimuth = self.sector * place * 2.0 / ELEVATION_SWEEPS as f64;
                    (held(azimuth), swept(self.rise, 1))
                }
            },
        };
        Some(SquintSymbol {
            face,
            psi: [T::of(x.0), T::of(z.0)],
            delay_ns: [T::of(x.1 * 1e9), T::of(z.1 * 1e9)],
            half_wavelengths: T::of(half_wavelengths),
        })
    }
}

impl<T: Real> SquintSymbol<T> {
    /// Array factor towards direction cosines at a frequency off the carrier (GHz: the reciprocal of a delay in ns),
    /// without the element pattern. The peak is sqrt(COLUMNS ROWS).
    pub fn response<const COLUMNS: usize, const ROWS: usize>(
        &self,
        cosines: [T; 2],
        offset_ghz: T,
        carrier_ghz: T,
    ) -> Complex<T> {
        let squint = T::one() + offset_ghz / carrier_ghz;
        let phase = |s: T, psi: T, delay_ns: T| {
            T::pi() * (s * self.half_wavelengths * squint - psi) - T::two_pi() * offset_ghz * delay_ns
        };
        let [x, z] = cosines;
        let ([px, pz], [tx, tz]) = (self.psi, self.delay_ns);
        planar_factor::<T, COLUMNS, ROWS>(phase(x, px, tx), phase(z, pz, tz))
    }

    /// Direction cosines the beam looks to at a frequency, not wrapped: `(psi + 2 T f) / (1 + f/fc)` at half a wavelength.
    pub fn aim(&self, offset_ghz: T, carrier_ghz: T) -> [T; 2] {
        let squint = (T::one() + offset_ghz / carrier_ghz) * self.half_wavelengths;
        let two = T::of(2.0);
        let ([px, pz], [tx, tz]) = (self.psi, self.delay_ns);
        [(px, tx), (pz, tz)].map(|(psi, delay_ns)| (psi + two * delay_ns * offset_ghz) / squint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BAND_HZ: [f64; 2] = [-208.0 * 480e3, 207.0 * 480e3];

    fn symbol(scheme: SquintScheme, index: usize) -> Option<SquintSymbol<f64>> {
        SquintConfig::default().symbol(scheme, index, 3, BAND_HZ, 30e9)
    }

    #[test]
    fn schedules_have_the_lengths_and_delays_of_the_design() {
        let count = |scheme| (0..100).take_while(|i| symbol(scheme, *i).is_some()).count();
        assert_eq!(count(SquintScheme::Sequential), 33);
        assert_eq!(count(SquintScheme::Raster), 3);
        let azimuth = symbol(SquintScheme::Sequential, 12).expect("face 1");
        assert_eq!(azimuth.face, 1);
        assert!((azimuth.delay_ns[0] - 4.37).abs() < 0.005 && azimuth.delay_ns[1] == 0.0);
        assert_eq!(azimuth.psi[1], 0.28);
        let elevation = symbol(SquintScheme::Sequential, 3).expect("face 0");
        assert!((elevation.delay_ns[1] - 2.14).abs() < 0.01 && elevation.delay_ns[0] == 0.0);
        assert!((elevation.psi[0] + libm::sin(core::f64::consts::FRAC_PI_3) * 3.5 / 4.0).abs() < 1e-12);
        let raster = symbol(SquintScheme::Raster, 2).expect("face 2");
        assert!(
            (14.3..14.7).contains(&raster.delay_ns[0]),
            "{}",
            raster.delay_ns[0]
        );
    }

    #[test]
    fn a_sweep_runs_from_its_first_to_its_last_cosine() {
        let [low, high] = BAND_HZ.map(|f| f * 1e-9);
        let azimuth = symbol(SquintScheme::Sequential, 0).expect("first");
        assert!((azimuth.aim(low, 30.0)[0] + 0.87).abs() < 1e-12);
        assert!((azimuth.aim(high, 30.0)[0] - 0.87).abs() < 1e-12);
        let elevation = symbol(SquintScheme::Sequential, 5).expect("first");
        assert!((elevation.aim(low, 30.0)[1] + 0.10).abs() < 1e-12);
        assert!((elevation.aim(high, 30.0)[1] - 0.75).abs() < 1e-12);
        let raster = symbol(SquintScheme::Raster, 0).expect("first");
        // Two wraps of the array's alias period 2 / (1 + f/fc) at the end of the band.
        let last = raster.aim(high, 30.0)[0] - 4.0 / (1.0 + high / 30.0);
        assert!((last - 0.87).abs() < 1e-12, "{last}");
    }

    #[test]
    fn the_strongest_subcarrier_looks_at_the_receiver() {
        for (index, cosines) in [(0, [0.31, 0.05]), (1, [-0.6, 0.28]), (7, [0.866 / 8.0, 0.4])] {
            let symbol = symbol(SquintScheme::Sequential, index).expect("symbol");
            let best = (-208..208)
                .map(|k| f64::from(k) * 480e-6)
                .max_by(|a, b| {
                    let power = |f: f64| symbol.response::<8, 8>(cosines, f, 30.0).norm_sqr();
                    power(*a).total_cmp(&power(*b))
                })
                .expect("subcarriers");
            let aim = symbol.aim(best, 30.0);
            assert!(
                (aim[0] - cosines[0]).abs() < 0.003 && (aim[1] - cosines[1]).abs() < 0.003,
                "{aim:?}"
            );
            assert!(libm::sqrt(symbol.response::<8, 8>(cosines, best, 30.0).norm_sqr()) > 7.99);
        }
    }

    #[test]
    fn response_is_the_sum_over_the_elements() {
        let symbol = symbol(SquintScheme::Raster, 0).expect("symbol");
        let (cosines, f) = ([0.2, 0.3], 0.0412);
        let sum = (0..64).fold(Complex::new(0.0, 0.0), |sum, e| {
            let n = [f64::from(e / 8) - 3.5, f64::from(e % 8) - 3.5];
            let along = |v: [f64; 2]| n[0] * v[0] + n[1] * v[1];
            let phase = core::f64::consts::PI * along(cosines) * (1.0 + f / 30.0)
                - core::f64::consts::PI * along(symbol.psi)
                - core::f64::consts::TAU * f * along(symbol.delay_ns);
            sum + super::super::phasor(phase) / 8.0
        });
        assert!((symbol.response::<8, 8>(cosines, f, 30.0) - sum).norm_sqr() < 1e-24);
    }
}
