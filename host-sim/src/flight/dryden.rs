//! Gusts near the ground: Dryden's spectra with the intensities and scales of MIL-F-8785C at low altitude.
//!
//! White noise through the forming filters sigma sqrt(2 L/V) / (1 + L/V s) along the mean wind, and
//! sigma sqrt(L/V) (1 + sqrt 3 L/V s) / (1 + L/V s)^2 across it and vertically, discretised exactly. V is the speed of the mean wind, which
//! carries the gusts past the UAV: it hovers, as seen from a gust.

use nalgebra::Vector3;

use crate::seeded::Seeded;

const M_PER_FT: f64 = 0.3048;
const M_PER_S_PER_KN: f64 = 1852.0 / 3600.0;
/// Heights between which the formulas hold, ft.
const HEIGHTS_FT: [f64; 2] = [10.0, 1000.0];
/// Height that the wind is told for, ft.
const TOLD_FT: f64 = 20.0;
/// Roughness of the ground, ft (MIL-F-8785C, flight phases near the ground).
const ROUGHNESS_FT: f64 = 0.15;

/// Mean wind and gusts at one height: what the standard makes of the wind at 20 ft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Air {
    /// Speed of the mean wind, m/s.
    pub(super) mean_m_per_s: f64,
    /// Standard deviation of the gusts, m/s: horizontal and vertical.
    pub(super) sigma_m_per_s: [f64; 2],
    /// Length of the gusts, m: horizontal and vertical.
    pub(super) scale_m: [f64; 2],
}

impl Air {
    /// The air at `height_m` above ground in a wind of `w20_kn` at 20 ft.
    pub(super) fn new(w20_kn: f64, height_m: f64) -> Self {
        let h = (height_m / M_PER_FT).clamp(HEIGHTS_FT[0], HEIGHTS_FT[1]);
        let w20 = w20_kn * M_PER_S_PER_KN;
        let shape = 0.177 + 0.000_823 * h;
        let vertical = 0.1 * w20;
        Self {
            mean_m_per_s: w20 * libm::log(h / ROUGHNESS_FT) / libm::log(TOLD_FT / ROUGHNESS_FT),
            sigma_m_per_s: [vertical / libm::pow(shape, 0.4), vertical],
            scale_m: [h / libm::pow(shape, 1.2) * M_PER_FT, h * M_PER_FT],
        }
    }
}

/// Covariance of (x1, x2) with x1' = -a x1 + white, x2' = -a x2 + x1: after `time_s` from zero.
fn covariance(a: f64, time_s: f64) -> [f64; 3] {
    let (two_a, left) = (2.0 * a, libm::exp(-2.0 * a * time_s));
    let x = two_a * time_s;
    // Integrals of s^n exp(-2 a s) over s from 0 to the time.
    [
        (1.0 - left) / two_a,
        (1.0 - left * (1.0 + x)) / (two_a * two_a),
        (2.0 - left * (2.0 + 2.0 * x + x * x)) / (two_a * two_a * two_a),
    ]
}

/// One draw of (x1, x2) from its covariance.
fn draw([p11, p12, p22]: [f64; 3], random: &mut Seeded) -> [f64; 2] {
    let l11 = p11.sqrt();
    let l21 = p12 / l11;
    let l22 = (p22 - l21 * l21).max(0.0).sqrt();
    let (n1, n2) = (random.normal(), random.normal());
    [l11 * n1, l21 * n1 + l22 * n2]
}

/// A forming filter in steps: V/L, what is left of its states after a step, and the covariance of what is added.
#[derive(Clone, Debug)]
struct Forming {
    sigma_m_per_s: f64,
    a: f64,
    step_s: f64,
    kept: f64,
    added: [f64; 3],
    state: [f64; 2],
}

impl Forming {
    fn new(sigma_m_per_s: f64, a: f64, step_s: f64, random: &mut Seeded) -> Self {
        let stationary = [0.5 / a, 0.25 / (a * a), 0.25 / (a * a * a)];
        Self {
            sigma_m_per_s,
            a,
            step_s,
            kept: libm::exp(-a * step_s),
            added: covariance(a, step_s),
            state: draw(stationary, random),
        }
    }

    fn advance(&mut self, random: &mut Seeded) {
        let [x1, x2] = self.state;
        let [n1, n2] = draw(self.added, random);
        self.state = [self.kept * x1 + n1, self.kept * (x2 + self.step_s * x1) + n2];
    }

    /// The gust along the wind.
    fn along(&self) -> f64 {
        self.sigma_m_per_s * (2.0 * self.a).sqrt() * self.state[0]
    }

    /// A gust across the wind: a^2 (1 + sqrt 3 s/a) / (s + a)^2 in partial fractions.
    fn across(&self) -> f64 {
        let root3 = 3.0_f64.sqrt();
        let a = self.a;
        self.sigma_m_per_s / a.sqrt() * (root3 * a * self.state[0] + a * a * (1.0 - root3) * self.state[1])
    }
}

/// Gusts at one place over time.
#[derive(Clone, Debug)]
pub(super) struct Gusts {
    filters: [Forming; 3],
    random: Seeded,
}

impl Gusts {
    /// Gusts of an air with some wind in steps of `step_s`, from their steady state.
    pub(super) fn new(air: &Air, step_s: f64, mut random: Seeded) -> Self {
        let [horizontal, vertical] =
            [0, 1].map(|i| (air.sigma_m_per_s[i], air.mean_m_per_s / air.scale_m[i]));
        Self {
            filters: [horizontal, horizontal, vertical]
                .map(|(sigma, a)| Forming::new(sigma, a, step_s, &mut random)),
            random,
        }
    }

    /// The next gust: along the mean wind, to its left, up; m/s.
    pub(super) fn next(&mut self) -> Vector3<f64> {
        for filter in &mut self.filters {
            filter.advance(&mut self.random);
        }
        let [along, left, up] = &self.filters;
        Vector3::new(along.along(), left.across(), up.across())
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{PI, TAU};

    use super::*;
    use crate::seeded::Source;

    const STEP_S: f64 = 0.05;

    #[test]
    fn the_air_is_that_of_the_standard() {
        let air = Air::new(15.0, 20.0 * M_PER_FT);
        assert!((air.mean_m_per_s - 7.7167).abs() < 1e-3);
        // h = 20 ft: 0.177 + 0.01646 = 0.19346.
        assert!((air.sigma_m_per_s[1] - 0.771_67).abs() < 1e-4);
        assert!(
            (air.sigma_m_per_s[0] - 0.771_67 * 1.929_2).abs() < 1e-3,
            "{air:?}"
        );
        assert!((air.scale_m[0] / M_PER_FT - 143.6).abs() < 0.2, "{air:?}");
        assert!((air.scale_m[1] / M_PER_FT - 20.0).abs() < 1e-9);
        // At 1000 ft the gusts are alike in all directions, which is where the formulas end.
        let high = Air::new(15.0, 5000.0);
        assert!((high.sigma_m_per_s[0] / high.sigma_m_per_s[1] - 1.0).abs() < 1e-4);
        assert!((high.scale_m[0] / high.scale_m[1] - 1.0).abs() < 1e-4);
    }

    /// One-sided power spectral density, m^2/s^2/Hz: the two forms of Dryden.
    fn density(air: &Air, axis: usize, hz: f64) -> f64 {
        let kind = usize::from(axis == 2);
        let (sigma, time_s) = (air.sigma_m_per_s[kind], air.scale_m[kind] / air.mean_m_per_s);
        let x = TAU * hz * time_s;
        let power = sigma * sigma * time_s;
        if axis == 0 {
            4.0 * power / (1.0 + x * x)
        } else {
            2.0 * power * (1.0 + 3.0 * x * x) / ((1.0 + x * x) * (1.0 + x * x))
        }
    }

    #[test]
    fn the_spectra_are_drydens_within_a_decibel() {
        let air = Air::new(15.0, 9.0);
        let mut gusts = Gusts::new(&air, STEP_S, Seeded::new(1, Source::Wind));
        // Welch: 399 segments of 1024 values (51 s), half overlapping, Hann's window.
        let series: Vec<_> = (0..204_800).map(|_| gusts.next()).collect();
        let segment = 1024;
        let window: Vec<f64> = (0..segment)
            .map(|k| libm::sin(PI * (f64::from(k) + 0.5) / f64::from(segment)))
            .map(|s| s * s)
            .collect();
        let norm: f64 = window.iter().map(|w| w * w).sum::<f64>() / STEP_S;
        let starts = (0..series.len() - window.len()).step_by(window.len() / 2);
        let count = starts.clone().count() as f64;
        // A band of five bins around each frequency.
        for centre in [4, 10, 25, 60, 100] {
            let mut power = Vector3::zeros();
            let mut expected = Vector3::zeros();
            for bin in centre - 2..=centre + 2 {
                let hz = f64::from(bin) / (f64::from(segment) * STEP_S);
                expected += Vector3::from_fn(|axis, _| density(&air, axis, hz));
                let turns: Vec<(f64, f64)> = (0..segment)
                    .map(|k| libm::sincos(TAU * f64::from(bin * k % segment) / f64::from(segment)))
                    .collect();
                for start in starts.clone() {
                    let (mut re, mut im) = (Vector3::zeros(), Vector3::zeros());
                    for ((value, w), (sin, cos)) in series[start..].iter().zip(&window).zip(&turns) {
                        re += value * (w * cos);
                        im += value * (w * sin);
                    }
                    power += (re.component_mul(&re) + im.component_mul(&im)) * (2.0 / (norm * count));
                }
            }
            for axis in 0..3 {
                let db = 10.0 * libm::log10(power[axis] / expected[axis]);
                assert!(db.abs() < 1.0, "axis {axis}, bin {centre}: {db} dB");
            }
        }
        let sigma = series
            .iter()
            .fold(Vector3::zeros(), |sum, v| sum + v.component_mul(v))
            .map(|sum: f64| (sum / series.len() as f64).sqrt());
        for axis in 0..3 {
            let expected = air.sigma_m_per_s[usize::from(axis == 2)];
            // 10 000 s are some 650 times the time scale of the horizontal gusts.
            assert!((sigma[axis] / expected - 1.0).abs() < 0.1, "{sigma}");
        }
    }

    #[test]
    fn they_begin_in_their_steady_state() {
        let air = Air::new(15.0, 9.0);
        let mut square = Vector3::zeros();
        for seed in 0..1000 {
            let first = Gusts::new(&air, STEP_S, Seeded::new(seed, Source::Wind)).next();
            square += first.component_mul(&first) / 1000.0;
        }
        for axis in 0..3 {
            let ratio = square[axis].sqrt() / air.sigma_m_per_s[usize::from(axis == 2)];
            assert!((ratio - 1.0).abs() < 0.08, "axis {axis}: {ratio}");
        }
    }
}
