//! Uniform theory of diffraction: the scalars of Kouyoumjian and Pathak (1974), continuous across shadow and reflection
//! boundaries. Time convention `e^{+jwt}`. docs/propagation.md has the formulas.

use core::f64::consts::{FRAC_1_SQRT_2, PI};

use nalgebra::Complex;

/// Below it the power series of the transition function is summed, above it the continued fraction.
const SERIES_BELOW: f64 = 8.0;

/// Where a wave meets an edge, and the wedge behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incidence {
    /// Exterior angle of the wedge over pi, 1 to 2.
    pub(super) n: f64,
    /// Wave number, rad/m.
    pub(super) k_rad_per_m: f64,
    /// Sine of the angle between ray and edge.
    pub(super) sin_beta: f64,
    /// Unfolded length of the way before the edge, m.
    pub(super) before_m: f64,
    /// Unfolded length of the way behind the edge, m.
    pub(super) behind_m: f64,
    /// Angle of the incoming ray about the edge, from face 0 through free space, 0 to n pi, rad.
    pub(super) phi_in_rad: f64,
    /// The same of the outgoing ray, rad.
    pub(super) phi_out_rad: f64,
}

/// How far an argument x, the difference or the sum of the two angles, is from the poles of its cotangents, rad.
///
/// With `e+- = pi +- x`, less the nearest multiple of 2 pi n, `cot((pi +- x)/2n) = cot(e+-/2n)` and `a+-(x) = 2 sin^2(e+-/2)`:
/// near a boundary nothing cancels.
fn boundary_distances(n: f64, x: f64) -> [f64; 2] {
    let period = 2.0 * PI * n;
    [x + PI, PI - x].map(|e| e - period * libm::round(e / period))
}

impl Incidence {
    /// `sqrt(s s' / (s + s'))`, sqrt(m): a scalar is at most half of it, at its boundary.
    fn reach(&self) -> f64 {
        (self.before_m * self.behind_m / (self.before_m + self.behind_m)).sqrt()
    }

    /// Distances from the boundaries of the four scalars, in their order, rad.
    fn boundary_distances_rad(&self) -> [f64; 4] {
        let [d1, d2] = boundary_distances(self.n, self.phi_out_rad - self.phi_in_rad);
        let [d3, d4] = boundary_distances(self.n, self.phi_out_rad + self.phi_in_rad);
        [d1, d2, d3, d4]
    }

    /// The scalars D1 (shadow behind face n), D2 (shadow behind face 0), D3 (reflection off face n) and D4 (reflection off
    /// face 0), sqrt(m).
    pub(super) fn scalars(&self) -> [Complex<f64>; 4] {
        let k = self.k_rad_per_m;
        let distance_m = (self.reach() * self.sin_beta).powi(2);
        let front = Complex::new(-FRAC_1_SQRT_2, FRAC_1_SQRT_2)
            / (2.0 * self.n * (2.0 * PI * k).sqrt() * self.sin_beta);
        self.boundary_distances_rad().map(|e| {
            if e == 0.0 {
                // On the boundary itself: the limit from the side of positive e.
                return Complex::new(-0.5 * self.reach(), 0.0);
            }
            let (sin, cos) = libm::sincos(0.5 * e / self.n);
            let half = libm::sin(0.5 * e);
            front * (cos / sin) * transition(2.0 * k * distance_m * half * half)
        })
    }

    /// No less than the sum of the magnitudes of the four scalars, sqrt(m), without transition function:
    /// `|cot(e/2n)|/2n <= 1/|e|`, `|F(x)| <= min(1, sqrt(pi x))`.
    pub(super) fn bound(&self) -> f64 {
        let boundary = 0.5 * self.reach();
        let far = 1.0 / ((2.0 * PI * self.k_rad_per_m).sqrt() * self.sin_beta);
        self.boundary_distances_rad()
            .iter()
            .map(|e| boundary.min(far / e.abs()))
            .sum()
    }
}

/// Transition function `F(x) = 2j sqrt(x) e^{jx} integral from sqrt(x) to infinity of e^{-jt^2} dt`, x >= 0, to 1e-12.
///
/// Below 8 by `F = sqrt(pi x) e^{j(pi/4 + x)} - 2jx sum_m (2jx)^m/(2m+1)!!`, above by the continued fraction of the
/// complementary error function, `F = 1/(1 + (u/2)/(1 + (2u/2)/(1 + (3u/2)/(1 + ..))))` with `u = 1/(jx)`.
pub(super) fn transition(x: f64) -> Complex<f64> {
    if x < SERIES_BELOW {
        let (mut even, mut odd) = (0.0, 0.0);
        let (mut term, mut m) = (1.0, 0);
        while term > 1e-17 || f64::from(m) < 2.0 * x {
            // Powers of j go round: 1, j, -1, -j.
            let signed = if m % 4 < 2 { term } else { -term };
            if m % 2 == 0 {
                even += signed;
            } else {
                odd += signed;
            }
            m += 1;
            term *= 2.0 * x / f64::from(2 * m + 1);
        }
        let (sin, cos) = libm::sincos(x);
        let root = (0.5 * PI * x).sqrt();
        return Complex::new(
            root * (cos - sin) + 2.0 * x * odd,
            root * (cos + sin) - 2.0 * x * even,
        );
    }
    let steps = if x < 20.0 {
        40
    } else if x < 60.0 {
        20
    } else {
        10
    };
    let mut tail = Complex::new(1.0, 0.0);
    for m in (1..=steps).rev() {
        // 1 + (m/2) (-j/x) / tail
        let scale = 0.5 * f64::from(m) / (x * tail.norm_sqr());
        tail = Complex::new(1.0 - scale * tail.im, -scale * tail.re);
    }
    tail.inv()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transition_function_is_its_integral() {
        // Values by 60-digit sums of the power series.
        let known = [
            (1e-6, [0.001_253_312_885, 0.001_251_315_391]),
            (0.3, [0.571_713_238_301, 0.272_991_546_563]),
            (1.0, [0.809_525_481_747, 0.232_199_390_055]),
            (10.0, [0.993_041_127_012, 0.048_351_495_562]),
        ];
        for (x, [re, im]) in known {
            let error = transition(x) - Complex::new(re, im);
            assert!(error.norm() < 2e-12, "{x}: {error}");
        }
        // d/dx (F e^{-jx} / sqrt x) = -j e^{-jx} / sqrt x: the integral's own derivative, on both sides of every seam.
        let integral = |x: f64| {
            let (sin, cos) = libm::sincos(x);
            transition(x) * Complex::new(cos, -sin) / x.sqrt()
        };
        for x in [
            0.01_f64, 0.5, 3.0, 7.9, 8.1, 15.0, 19.9, 20.1, 40.0, 59.9, 60.1, 500.0,
        ] {
            let h = 1e-3 * x.min(1.0);
            let slope = (integral(x - 2.0 * h) - integral(x - h) * 8.0 + integral(x + h) * 8.0
                - integral(x + 2.0 * h))
                / (12.0 * h);
            let (sin, cos) = libm::sincos(x);
            let expected = Complex::new(-sin, -cos) / x.sqrt();
            assert!(
                (slope - expected).norm() < 1e-8 * expected.norm(),
                "{x}: {slope} {expected}"
            );
        }
        for seam in [8.0, 20.0, 60.0] {
            let jump = transition(seam * (1.0 + 1e-15)) - transition(seam * (1.0 - 1e-15));
            assert!(jump.norm() < 1e-12, "{seam}: {jump}");
        }
        assert!((transition(1e6) - 1.0).norm() < 1e-6);
        assert!((1..4000).all(|i| transition(0.01 * f64::from(i)).norm() <= 1.0));
    }

    #[test]
    fn the_bound_is_one_and_not_idle() {
        let mut tightest = f64::INFINITY;
        for i in 0..4000 {
            let part = |step: f64| (f64::from(i) * step).fract();
            let n = 1.05 + 0.95 * part(0.618);
            let incidence = Incidence {
                n,
                k_rad_per_m: 628.0,
                sin_beta: 0.05 + 0.95 * part(0.271),
                before_m: 1.0 + 80.0 * part(0.377),
                behind_m: 1.0 + 80.0 * part(0.733),
                phi_in_rad: n * PI * part(0.414),
                phi_out_rad: n * PI * part(0.127),
            };
            let sum: f64 = incidence.scalars().iter().map(|d| d.norm()).sum();
            let ratio = incidence.bound() / sum;
            assert!(ratio >= 1.0, "{incidence:?}: {ratio}");
            tightest = tightest.min(ratio);
        }
        assert!(tightest < 1.05, "{tightest}");
    }
}
