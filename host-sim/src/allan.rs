//! Overlapping Allan deviation: how noise averages out with time.
//!
//! Average a signal over intervals of length tau and ask how much one average differs from the next. White noise falls
//! as tau^-1/2, a random walk of the bias rises as tau^1/2, and between the two lies the floor called bias instability.
//! Definitions of IEEE Std 952 and, for the estimator, of NIST Special Publication 1065.

/// 0.664 = sqrt(2 ln 2 / pi): Allan deviation of flicker noise over its coefficient B of IEEE Std 952.
pub const FLICKER_FLOOR: f64 = 0.664_282_535_263_171_7;

/// A running sum of a signal, from which the Allan deviation at any averaging time follows.
#[derive(Clone, Debug)]
pub struct Allan {
    /// `sum[k]` is the sum of the first k samples, of the signal less its first value: the Allan deviation does not
    /// see a constant, and a small sum keeps its digits.
    sum: Vec<f64>,
    interval_s: f64,
}

impl Allan {
    /// Sums a signal sampled every `interval_s` seconds.
    pub fn new(samples: impl IntoIterator<Item = f64>, interval_s: f64) -> Self {
        let mut sum = vec![0.0];
        let (mut total, mut first) = (0.0, None);
        for sample in samples {
            total += sample - *first.get_or_insert(sample);
            sum.push(total);
        }
        Self { sum, interval_s }
    }

    /// Overlapping Allan deviation at the averaging time of `factor` samples, in the unit of the signal.
    ///
    /// sigma^2 = mean over k of `(S[k + 2m] - 2 S[k + m] + S[k])^2 / (2 m^2)`, NIST SP 1065 equation 11. `None` when
    /// `factor` is zero or the signal is shorter than two averaging times.
    pub fn deviation(&self, factor: usize) -> Option<f64> {
        let span = factor.checked_mul(2)?;
        if factor == 0 || span >= self.sum.len() {
            return None;
        }
        let (mut squares, mut count) = (0.0, 0u64);
        for ((near, middle), far) in self.sum.iter().zip(&self.sum[factor..]).zip(&self.sum[span..]) {
            let difference = far - 2.0 * middle + near;
            squares += difference * difference;
            count += 1;
        }
        let averages = factor as f64;
        Some((squares / (2.0 * averages * averages * count as f64)).sqrt())
    }

    /// Averaging times in samples, about `per_decade` a decade, up to a quarter of the record: beyond that fewer than
    /// four averages are compared.
    pub fn factors(&self, per_decade: u32) -> Vec<usize> {
        let last = self.sum.len() / 4;
        let mut factors = Vec::new();
        for step in 0.. {
            let factor = (libm::pow(10.0, f64::from(step) / f64::from(per_decade.max(1))) + 0.5) as usize;
            if factor > last {
                break;
            }
            if factors.last() != Some(&factor) {
                factors.push(factor);
            }
        }
        factors
    }

    /// Averaging time of `factor` samples, s.
    pub fn tau_s(&self, factor: usize) -> f64 {
        factor as f64 * self.interval_s
    }
}

/// White noise, bias instability and random walk read off a curve of Allan deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Allan deviation of the white noise at tau = 1 s: the signal's unit per root hertz.
    pub white: f64,
    /// Level of the flicker floor: the signal's unit.
    pub instability: f64,
    /// Coefficient K of the random walk of the bias, sigma = K sqrt(tau / 3): the signal's unit per root second.
    pub walk: f64,
}

impl Figures {
    /// Allan deviation that the three together have at `tau_s`.
    pub fn deviation(&self, tau_s: f64) -> f64 {
        let white = self.white * self.white / tau_s;
        let walk = self.walk * self.walk * tau_s / 3.0;
        (white + self.instability * self.instability + walk).sqrt()
    }

    /// Least-squares fit of the three variances to a curve of (tau in s, deviation).
    ///
    /// Residuals are relative to the measured variance and weighted by 1 / tau, since a long averaging time leaves few
    /// averages to compare. A variance that would come out negative is set to zero and the rest fitted again.
    pub fn fit(curve: &[(f64, f64)]) -> Self {
        let mut active = [true; 3];
        loop {
            let mut normal = nalgebra::Matrix3::<f64>::zeros();
            let mut right = nalgebra::Vector3::<f64>::zeros();
            for &(tau_s, deviation) in curve {
                let variance = deviation * deviation;
                let terms = nalgebra::Vector3::new(1.0 / tau_s, 1.0, tau_s / 3.0) / variance;
                let terms = terms.zip_map(&nalgebra::Vector3::from(active), |t, on| if on { t } else { 0.0 });
                normal += terms * terms.transpose() / tau_s;
                right += terms / tau_s;
            }
            for (i, on) in active.iter().enumerate() {
                if !on {
                    normal[(i, i)] = 1.0;
                }
            }
            let scale = normal.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
            let scaled = nalgebra::Matrix3::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j]);
            let solution = scaled
                .lu()
                .solve(&right.component_mul(&scale))
                .unwrap_or_default();
            let solution = solution.component_mul(&scale);
            match (0..3).filter(|&i| active[i]).find(|&i| solution[i] < 0.0) {
                Some(negative) => active[negative] = false,
                None => {
                    return Self {
                        white: solution[0].sqrt(),
                        instability: solution[1].sqrt(),
                        walk: solution[2].sqrt(),
                    };
                }
            }
        }
    }
}

/// Root mean square over several alike axes of their Allan deviations at one averaging time.
pub fn pooled(axes: &[Allan], factor: usize) -> Option<f64> {
    let squares: Option<f64> = axes
        .iter()
        .map(|axis| axis.deviation(factor).map(|d| d * d))
        .sum();
    (!axes.is_empty()).then_some(())?;
    squares.map(|sum| (sum / axes.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The 1000-point test set of NIST SP 1065, section 12.4.
    fn nist() -> Allan {
        let mut state: u64 = 1_234_567_890;
        let samples = (0..1000).map(move |_| {
            let value = state as f64 / 2_147_483_647.0;
            state = state * 16_807 % 2_147_483_647;
            value
        });
        Allan::new(samples, 1.0)
    }

    #[test]
    fn agrees_with_the_published_test_set() {
        for (factor, published) in [(1, 2.922_319e-1), (10, 9.159_953e-2), (100, 3.241_343e-2)] {
            let deviation = nist().deviation(factor).expect("long enough");
            assert!(
                (deviation / published - 1.0).abs() < 2e-7,
                "{factor}: {deviation}"
            );
        }
    }

    #[test]
    fn a_ramp_has_its_closed_form() {
        // Slope D: Allan deviation D tau / sqrt 2, whatever constant it stands on.
        let ramp = Allan::new((0..1000).map(|k| 1e6 + 0.25 * f64::from(k) * 0.01), 0.01);
        for factor in [1, 7, 300] {
            let expected = 0.25 * ramp.tau_s(factor) / core::f64::consts::SQRT_2;
            let deviation = ramp.deviation(factor).expect("long enough");
            assert!((deviation / expected - 1.0).abs() < 1e-6, "{factor}");
        }
    }

    #[test]
    fn too_long_an_average_is_refused() {
        assert!(nist().deviation(500).is_some());
        assert_eq!(nist().deviation(501), None);
        assert_eq!(nist().deviation(0), None);
        assert_eq!(pooled(&[], 1), None);
        let factors = nist().factors(3);
        assert_eq!(factors, [1, 2, 5, 10, 22, 46, 100, 215]);
    }

    #[test]
    fn the_fit_returns_what_made_the_curve() {
        for figures in [
            Figures {
                white: 2.8e-3,
                instability: 1.4e-3,
                walk: 0.0,
            },
            Figures {
                white: 70.0,
                instability: 30.0,
                walk: 20.0,
            },
            Figures {
                white: 1.0,
                instability: 0.0,
                walk: 0.0,
            },
        ] {
            let curve: Vec<_> = (0..40)
                .map(|k| 1e-2 * libm::pow(10.0, f64::from(k) / 8.0))
                .map(|tau| (tau, figures.deviation(tau)))
                .collect();
            let fit = Figures::fit(&curve);
            assert!((fit.white / figures.white - 1.0).abs() < 1e-6, "{fit:?}");
            assert!(
                (fit.instability - figures.instability).abs() < 1e-4 * figures.white,
                "{fit:?}"
            );
            assert!((fit.walk - figures.walk).abs() < 1e-4 * figures.white, "{fit:?}");
        }
    }
}
