//! What a squint symbol sounds like at a receiver in a given direction: real numbers.
//!
//! Elements are counted from the centre of their row, so their phases cancel pairwise: the response of a row of N
//! elements at subcarrier k is `sum cos(n a_k)`, real, with the phase step `a_k = pi (s (1 + f_k/fc) - psi) - 2 pi f_k
//! T` that is linear in k. The delay of the path and the true time delays are thereby told apart exactly: the
//! derivatives over direction are real and the derivative over delay is imaginary, so their errors are uncorrelated.

use crate::array::{SquintSymbol, phasor};
use crate::geometry::Complex;

/// Subcarriers between fresh sines.
/// Derived: a product a step loses a unit in the last place, 32 of them 2e-6.
const FRESH: usize = 32;

/// `exp(j (first + k step))` for k = 0, 1, ...: products, begun anew every [`FRESH`] steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spin {
    first_rad: f32,
    step_rad: f32,
    turn: Complex<f32>,
    now: Complex<f32>,
    k: usize,
}

impl Spin {
    pub(super) fn new(first_rad: f32, step_rad: f32) -> Self {
        Self {
            first_rad,
            step_rad,
            turn: phasor(step_rad),
            now: phasor(first_rad),
            k: 0,
        }
    }

    /// The value, and moves on.
    pub(super) fn next(&mut self) -> Complex<f32> {
        let value = self.now;
        self.k += 1;
        self.now = if self.k.is_multiple_of(FRESH) {
            phasor(self.first_rad + self.k as f32 * self.step_rad)
        } else {
            value * self.turn
        };
        value
    }
}

/// Subcarriers as a fit runs over them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Band {
    /// Offset of the first subcarrier from the carrier, GHz.
    pub(super) first_ghz: f32,
    /// From one to the next, GHz.
    pub(super) step_ghz: f32,
    /// Carrier, GHz.
    pub(super) carrier_ghz: f32,
}

impl Band {
    /// Offset of a (fractional) subcarrier, GHz.
    pub(super) fn offset_ghz(&self, index: f32) -> f32 {
        self.first_ghz + index * self.step_ghz
    }

    /// Every `stride`-th subcarrier, from the middle of the first stride on.
    pub(super) fn decimated(&self, stride: usize) -> Self {
        Self {
            first_ghz: self.first_ghz + 0.5 * (stride as f32 - 1.0) * self.step_ghz,
            step_ghz: stride as f32 * self.step_ghz,
            ..*self
        }
    }
}

/// One axis of a symbol at one direction cosine: responses of a row of elements, subcarrier after subcarrier.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Half the phase step, as a phasor.
    half: Spin,
    /// Growth of the phase step with the cosine, `pi (1 + f/fc)` at half a wavelength, at the present subcarrier, and its growth.
    slope: f32,
    slope_step: f32,
}

impl Row {
    /// Axis `axis` (0 along the row of the face, 1 up) of a symbol at cosine `s`.
    pub(super) fn new(symbol: &SquintSymbol, axis: usize, s: f32, band: &Band) -> Self {
        const PI: f32 = core::f32::consts::PI;
        let pick = |values: &[f32; 2]| values.get(axis).copied().unwrap_or(0.0);
        let (psi, delay_ns) = (pick(&symbol.psi), pick(&symbol.delay_ns));
        let spacing = symbol.half_wavelengths;
        let s = s * spacing;
        let per_ghz = PI * (s / band.carrier_ghz - 2.0 * delay_ns);
        let first = PI * (s - psi) + per_ghz * band.first_ghz;
        Self {
            half: Spin::new(0.5 * first, 0.5 * per_ghz * band.step_ghz),
            slope: spacing * PI * (1.0 + band.first_ghz / band.carrier_ghz),
            slope_step: spacing * PI * band.step_ghz / band.carrier_ghz,
        }
    }

    /// Response of `N` elements and its derivative over the cosine, at the present subcarrier; moves on.
    pub(super) fn next<const N: usize>(&mut self) -> [f32; 2] {
        let half = self.half.next();
        let slope = self.slope;
        self.slope += self.slope_step;
        let turn = half * half;
        // Places 1/2, 3/2, ... or 1, 2, ...; each stands for itself and its mirror place.
        let even = N.is_multiple_of(2);
        let (mut z, mut place) = if even { (half, 0.5) } else { (turn, 1.0) };
        let (mut sum, mut moment) = (if even { 0.0 } else { 0.5 }, 0.0);
        for _ in 0..N / 2 {
            sum += z.re;
            moment += place * z.im;
            z *= turn;
            place += 1.0;
        }
        [2.0 * sum, -2.0 * moment * slope]
    }

    /// The response alone.
    pub(super) fn response<const N: usize>(&mut self) -> f32 {
        self.next::<N>()[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::{SquintConfig, SquintScheme};

    const BAND: Band = Band {
        first_ghz: -208.0 * 480e-6,
        step_ghz: 480e-6,
        carrier_ghz: 30.0,
    };

    #[test]
    fn the_product_of_two_rows_is_the_symbol_s_response() {
        let config = SquintConfig::default();
        for (scheme, index) in [
            (SquintScheme::Sequential, 1),
            (SquintScheme::Sequential, 6),
            (SquintScheme::Raster, 0),
        ] {
            let band_hz = [-208.0 * 480e3, 207.0 * 480e3];
            let single: SquintSymbol = config.symbol(scheme, index, 3, band_hz, 30e9).expect("symbol");
            let exact: SquintSymbol<f64> = config.symbol(scheme, index, 3, band_hz, 30e9).expect("symbol");
            for cosines in [[0.31_f32, 0.22], [-0.8, 0.6], [0.0, -0.05]] {
                let mut rows = [0, 1].map(|axis| Row::new(&single, axis, cosines[axis], &BAND));
                for k in 0..416 {
                    let [x, z] = &mut rows;
                    let ([x, dx], [z, dz]) = (x.next::<8>(), z.next::<8>());
                    let f = f64::from(k - 208) * 480e-6;
                    let at = |dx: f64, dz: f64| {
                        let c = cosines.map(f64::from);
                        exact.response::<8, 8>([c[0] + dx, c[1] + dz], f, 30.0)
                    };
                    let expected = at(0.0, 0.0);
                    assert!(expected.im.abs() < 1e-12, "real");
                    let off = (f64::from(x * z) / 8.0 - expected.re).abs();
                    assert!(off < 4e-5, "{scheme:?} {index} at {k}: {off:e}");
                    let quotient = [
                        (at(1e-6, 0.0).re - at(-1e-6, 0.0).re) / 2e-6,
                        (at(0.0, 1e-6).re - at(0.0, -1e-6).re) / 2e-6,
                    ];
                    assert!((f64::from(dx * z) / 8.0 - quotient[0]).abs() < 5e-4, "{k}");
                    assert!((f64::from(x * dz) / 8.0 - quotient[1]).abs() < 5e-4, "{k}");
                }
            }
        }
    }

    #[test]
    fn an_odd_row_has_an_element_at_its_centre() {
        let symbol = SquintSymbol {
            face: 0,
            psi: [0.0; 2],
            delay_ns: [0.0; 2],
            half_wavelengths: 1.0,
        };
        let narrow = Band {
            first_ghz: 0.0,
            ..BAND
        };
        let [response, slope] = Row::new(&symbol, 0, 0.2, &narrow).next::<5>();
        let expected: f64 = (-2..=2)
            .map(|n| libm::cos(f64::from(n) * core::f64::consts::PI * 0.2))
            .sum();
        assert!((f64::from(response) - expected).abs() < 1e-5);
        let expected: f64 = (-2..=2)
            .map(|n| {
                -f64::from(n) * core::f64::consts::PI * libm::sin(f64::from(n) * core::f64::consts::PI * 0.2)
            })
            .sum();
        assert!((f64::from(slope) - expected).abs() < 1e-4);
    }
}
