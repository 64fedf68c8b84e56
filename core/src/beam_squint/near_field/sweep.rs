//! Symbols that sweep the focus: weights, field and focus in closed form.

use nalgebra::Complex;

use super::super::pattern::Spin;
use crate::array::centred;
use crate::constants::SPEED_OF_LIGHT_M_PER_S;

const TAU: f32 = core::f32::consts::TAU;
const ZERO: Complex<f32> = Complex::new(0.0, 0.0);

/// A point in the plane of the row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    /// Distance from the centre of the row, m, positive.
    pub range_m: f64,
    /// Sine of the angle off the normal, towards growing element index.
    pub sine: f64,
}

/// A symbol that sweeps the focus of a row of `N` elements over the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocusSweep<const N: usize> {
    from: Focus,
    to: Focus,
    spacing_m: f64,
    /// First and last frequency, Hz.
    pub(super) edges_hz: [f64; 2],
}

/// Longer way from an element at `y` than from the centre, m, and its derivative over the inverse range `q`, m^2.
/// Written without differences of near-equal lengths.
fn longer(y: f64, q: f64, sine: f64) -> (f64, f64) {
    let ratio = libm::sqrt(1.0 + y * q * (y * q - 2.0 * sine));
    let (above, below) = (y * (y * q - 2.0 * sine), ratio + 1.0);
    let slope = y * (y * q - sine) / ratio;
    (above / below, (y * y * below - above * slope) / (below * below))
}

impl<const N: usize> FocusSweep<N> {
    /// The sweep of a row with `spacing_m` between its elements, from a focus at the first of `edges_hz` (absolute
    /// frequencies) to one at the last. None unless ranges and frequencies are positive and the frequencies grow.
    #[must_use]
    pub fn new(spacing_m: f64, from: Focus, to: Focus, edges_hz: [f64; 2]) -> Option<Self> {
        let sound = from.range_m > 0.0 && to.range_m > 0.0 && edges_hz[0] > 0.0 && edges_hz[1] > edges_hz[0];
        (sound && from.sine.abs() <= 1.0 && to.sine.abs() <= 1.0 && spacing_m > 0.0).then_some(Self {
            from,
            to,
            spacing_m,
            edges_hz,
        })
    }

    /// Place of an element along the row, m.
    fn place_m(&self, n: usize) -> f64 {
        centred::<f64>(n, N) * self.spacing_m
    }

    /// True time delay of element `n`, s, and phase, rad: the weight is `exp(j (2 pi f t + phi))`.
    #[must_use]
    pub fn weight(&self, n: usize) -> (f64, f64) {
        let [f1, f2] = self.edges_hz;
        let to = |focus: &Focus| longer(self.place_m(n), 1.0 / focus.range_m, focus.sine).0;
        let (a, b) = (to(&self.from), to(&self.to));
        let delay_s = (f2 * b - f1 * a) / (SPEED_OF_LIGHT_M_PER_S * (f2 - f1));
        let phase = core::f64::consts::TAU * f1 * (a / SPEED_OF_LIGHT_M_PER_S - delay_s);
        (delay_s, phase)
    }

    /// Range on which a frequency focuses, m; exact to the second order in the aperture, and for sweeps in one
    /// direction.
    #[must_use]
    pub fn focus_m(&self, frequency_hz: f64) -> f64 {
        let [f1, f2] = self.edges_hz;
        let share = (frequency_hz - f1) / (f2 - f1);
        frequency_hz / (share * f2 / self.to.range_m + (1.0 - share) * f1 / self.from.range_m)
    }

    /// Inverse range over which the focus loses its gain: the outermost elements are half a turn off, 1/m.
    pub(super) fn lobe_per_m(&self, sine: f64) -> f64 {
        let half_m = 0.5 * N as f64 * self.spacing_m;
        SPEED_OF_LIGHT_M_PER_S / (self.edges_hz[0] * half_m * half_m * (1.0 - sine * sine).max(1e-3))
    }

    /// Field over the subcarriers towards a point, of norm-one weights, and its derivative over the inverse range.
    pub(super) fn responses<const ACTIVE: usize>(
        &self,
        q: f64,
        sine: f64,
    ) -> ([Complex<f32>; ACTIVE], [Complex<f32>; ACTIVE]) {
        let (mut field, mut slope) = ([ZERO; ACTIVE], [ZERO; ACTIVE]);
        let [f1, f2] = self.edges_hz;
        let step_hz = (f2 - f1) / (ACTIVE as f64 - 1.0);
        let scale = libm::sqrt(1.0 / N as f64);
        for n in 0..N {
            let (way_m, way_slope) = longer(self.place_m(n), q, sine);
            let (delay_s, phase) = self.weight(n);
            // Turns at the first frequency, and per subcarrier.
            let first = phase / core::f64::consts::TAU + f1 * (delay_s - way_m / SPEED_OF_LIGHT_M_PER_S);
            let step = step_hz * (delay_s - way_m / SPEED_OF_LIGHT_M_PER_S);
            let first = first - libm::floor(first);
            let mut spin = Spin::new(TAU * first as f32, TAU * step as f32);
            let (scale, way_slope) = (scale as f32, (scale * way_slope) as f32);
            for (field, slope) in field.iter_mut().zip(&mut slope) {
                let z = spin.next();
                *field += z * scale;
                *slope += z * way_slope;
            }
        }
        // A way longer by m turns the field by -j 2 pi f m / c.
        let per_m = |k: usize| TAU * ((f1 + k as f64 * step_hz) / SPEED_OF_LIGHT_M_PER_S) as f32;
        for (k, slope) in slope.iter_mut().enumerate() {
            *slope = Complex::new(slope.im, -slope.re) * per_m(k);
        }
        (field, slope)
    }

    /// Field towards a point at each of `ACTIVE` subcarriers spread over the band, of weights of norm one: at the focus
    /// sqrt(N).
    #[must_use]
    pub fn field<const ACTIVE: usize>(&self, at: Focus) -> [Complex<f32>; ACTIVE] {
        self.responses(1.0 / at.range_m, at.sine).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::phasor;

    const EDGES_HZ: [f64; 2] = [30e9 - 208.0 * 480e3, 30e9 + 207.0 * 480e3];
    const SINE: f64 = 0.3;

    fn sweep<const N: usize>() -> FocusSweep<N> {
        let at = |range_m| Focus { range_m, sine: SINE };
        FocusSweep::new(0.005, at(5.0), at(100.0), EDGES_HZ).expect("sound")
    }

    #[test]
    fn the_longer_way_and_its_slope_are_exact() {
        for (y, q, sine) in [(0.3, 0.1, 0.2), (-0.6, 0.01, -0.7), (0.2, 1e-6, 0.5)] {
            let r: f64 = 1.0 / q;
            let exact = libm::sqrt(r * r + y * y - 2.0 * r * y * sine) - r;
            let (way, slope) = longer(y, q, sine);
            assert!((way - exact).abs() < 1e-9, "{way} {exact}");
            let h = 1e-3 * q;
            let quotient = (longer(y, q + h, sine).0 - longer(y, q - h, sine).0) / (2.0 * h);
            assert!((slope / quotient - 1.0).abs() < 1e-4, "{slope} {quotient}");
        }
    }

    #[test]
    fn the_sum_over_the_elements_is_the_field() {
        let sweep = sweep::<128>();
        let field = sweep.field::<416>(Focus {
            range_m: 37.0,
            sine: 0.25,
        });
        for k in [0, 100, 415] {
            let f = EDGES_HZ[0] + k as f64 * 480e3;
            let sum = (0..128).fold(Complex::new(0.0, 0.0), |sum: Complex<f64>, n| {
                let (delay_s, phase) = sweep.weight(n);
                let y = (n as f64 - 63.5) * 0.005;
                let way = libm::sqrt(37.0 * 37.0 + y * y - 2.0 * 37.0 * y * 0.25) - 37.0;
                let turns = f * (delay_s - way / SPEED_OF_LIGHT_M_PER_S);
                sum + phasor(core::f64::consts::TAU * (turns - libm::floor(turns)) + phase)
            }) / libm::sqrt(128.0);
            assert!(
                (f64::from(field[k].re) - sum.re).abs() < 2e-3
                    && (f64::from(field[k].im) - sum.im).abs() < 2e-3
            );
        }
    }

    #[test]
    fn the_focus_moves_over_the_band_as_the_closed_form_says() {
        let sweep = sweep::<256>();
        for k in [0, 60, 150, 300, 400] {
            let f = EDGES_HZ[0] + k as f64 * 480e3;
            let range_m = sweep.focus_m(f);
            let field = sweep.field::<416>(Focus { range_m, sine: SINE });
            let best = (0..416)
                .max_by(|a, b| field[*a].norm_sqr().total_cmp(&field[*b].norm_sqr()))
                .expect("many");
            // At 5 m the third order of the aperture (a quarter of the range) shows.
            assert!((best as i32 - k).abs() <= 3, "{range_m} m at {best}, not {k}");
            assert!(
                field[k as usize].norm_sqr() > 0.9 * 256.0,
                "{}",
                field[k as usize].norm_sqr()
            );
        }
        assert!(
            (sweep.focus_m(EDGES_HZ[0]) - 5.0).abs() < 1e-9
                && (sweep.focus_m(EDGES_HZ[1]) - 100.0).abs() < 1e-9
        );
    }

    #[test]
    fn impossible_sweeps_are_refused() {
        let at = |range_m, sine| Focus { range_m, sine };
        let make = |from, to, edges| FocusSweep::<64>::new(0.005, from, to, edges);
        assert!(make(at(0.0, 0.0), at(9.0, 0.0), EDGES_HZ).is_none());
        assert!(make(at(5.0, 1.2), at(9.0, 0.0), EDGES_HZ).is_none());
        assert!(make(at(5.0, 0.0), at(9.0, 0.0), [EDGES_HZ[1], EDGES_HZ[0]]).is_none());
    }
}
