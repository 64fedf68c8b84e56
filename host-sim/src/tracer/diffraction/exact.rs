//! Exact and independent solutions that the diffracted field is judged by.

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use nalgebra::Complex;

type C64 = Complex<f64>;

/// `e^{jx}`.
pub(super) fn phasor(x: f64) -> C64 {
    let (sin, cos) = libm::sincos(x);
    Complex::new(cos, sin)
}

/// Field of a plane wave of unit amplitude about a conducting wedge of exterior angle n pi, at `kr` from its edge: the series
/// `(2/n) sum e_m j^{m/n} J_{m/n}(kr) [cos(m(phi - phi')/n) -+ cos(m(phi + phi')/n)]`, soft (the field along the edge
/// vanishes on the faces) or hard. `n` is 3/2 or 2, so that the orders are multiples of 2/3 or 1/2.
pub(super) fn conducting_wedge(n: f64, kr: f64, phi_in: f64, phi_out: f64, soft: bool) -> C64 {
    // Orders m/n fall into few families of whole steps.
    let (families, step) = if n == 1.5 { (3, 2) } else { (2, 1) };
    let bessel: Vec<Vec<f64>> = (0..families)
        .map(|i| bessel_from(f64::from(i) / f64::from(families), kr))
        .collect();
    let mut sum = Complex::new(0.0, 0.0);
    for m in 0_u32.. {
        let (whole, family) = ((m * step / families) as usize, (m * step % families) as usize);
        let Some(value) = bessel[family].get(whole) else {
            break;
        };
        let order = f64::from(m) / n;
        let [direct, mirrored] = [phi_out - phi_in, phi_out + phi_in].map(|x| libm::cos(order * x));
        let modes = if soft {
            direct - mirrored
        } else {
            direct + mirrored
        };
        let weight = if m == 0 { 0.5 } else { 1.0 };
        sum += phasor(order * FRAC_PI_2) * (weight * value * modes);
    }
    sum * (2.0 / n)
}

/// `J_{a+i}(x)` for i = 0, 1, .. until they vanish, a in 0..1: Miller's downward recurrence, put to scale by
/// `sum over i of (a + 2i) Gamma(a + i)/i! J_{a+2i}(x) = (x/2)^a`.
fn bessel_from(a: f64, x: f64) -> Vec<f64> {
    let top = (x + 80.0) as usize;
    let mut values = vec![0.0; top + 2];
    values[top] = 1e-250;
    for i in (1..=top).rev() {
        values[i - 1] = 2.0 * (a + i as f64) / x * values[i] - values[i + 1];
    }
    let mut weight = if a == 0.0 { 1.0 } else { libm::tgamma(a + 1.0) };
    let mut sum = weight * values[0];
    for i in 1..top / 2 {
        let i_f = i as f64;
        // (a + 2i) Gamma(a + i)/i! from Gamma(a + i)/i! of the step before.
        weight = if i == 1 {
            libm::tgamma(a + 1.0)
        } else {
            weight * (a + i_f - 1.0) / i_f
        };
        sum += (a + 2.0 * i_f) * weight * values[2 * i];
    }
    let scale = libm::pow(0.5 * x, a) / sum;
    values.iter().map(|v| v * scale).collect()
}

/// Field behind a half-plane over that without it, `(1 + j)/2 integral from nu to infinity of e^{-j pi t^2/2} dt`, on a path
/// of integration where nothing oscillates.
pub(super) fn knife_edge(nu: f64) -> C64 {
    let turn = phasor(-FRAC_PI_4);
    let steps = 4000;
    let width = 8.0 / f64::from(steps);
    let mut sum = Complex::new(0.0, 0.0);
    for i in 0..=steps {
        let u = f64::from(i) * width;
        let t = turn * u + nu;
        let weight = match i {
            0 => 1.0,
            i if i == steps => 1.0,
            i if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let exponent = Complex::new(0.0, -FRAC_PI_2) * t * t;
        sum += phasor(exponent.im) * libm::exp(exponent.re) * weight;
    }
    sum * turn * (width / 3.0) * Complex::new(0.5, 0.5)
}

/// Maliuzhinets' function of a right-angled wedge (exterior 3 pi/2), in its closed form.
fn maliuzhinets(alpha: C64) -> C64 {
    let cos = |z: C64| (exp_j(z) + exp_j(-z)) * 0.5;
    cos((alpha - PI) / 6.0) * cos((alpha + PI) / 6.0) / cos(alpha / 6.0) * (4.0 / 3.0)
}

/// `e^{jz}` of a complex argument.
fn exp_j(z: C64) -> C64 {
    phasor(z.re) * libm::exp(-z.im)
}

/// Angle whose sine is s, complex, `-j ln(js + sqrt(1 - s^2))`.
fn arcsin(s: C64) -> C64 {
    let j = Complex::new(0.0, 1.0);
    let root = super::super::surface::sqrt(Complex::new(1.0, 0.0) - s * s);
    let inside = j * s + root;
    let log = Complex::new(libm::log(inside.norm()), libm::atan2(inside.im, inside.re));
    -j * log
}

/// Diffraction coefficient, `sqrt(r) e^{jkr}` times the diffracted field of a plane wave of unit amplitude, of a right-angled
/// impedance wedge with the same face on both sides. Along one face the field has the reflection coefficient
/// `(sin(angle) - s)/(sin(angle) + s)`, where `s` is `sine`. Angles from one face.
pub(super) fn impedance_wedge(k: f64, sine: C64, phi_in: f64, phi_out: f64) -> C64 {
    // From the middle of free space.
    let half = 0.75 * PI;
    let (from, to) = (phi_in - half, phi_out - half);
    let theta = arcsin(sine);
    let psi = |alpha: C64| {
        let shifted = |by: f64, sign: f64| maliuzhinets(alpha + by + theta * sign);
        shifted(half + FRAC_PI_2, -1.0)
            * shifted(half - FRAC_PI_2, 1.0)
            * shifted(-half - FRAC_PI_2, 1.0)
            * shifted(-half + FRAC_PI_2, -1.0)
    };
    let nu = PI / (2.0 * half);
    let source = |alpha: f64| {
        let pole = nu * libm::cos(nu * from) / (libm::sin(nu * alpha) - libm::sin(nu * from));
        psi(Complex::new(alpha, 0.0)) / psi(Complex::new(from, 0.0)) * pole
    };
    // Steepest descent through the saddles at -+pi.
    phasor(-FRAC_PI_4) / (TAU * k).sqrt() * (source(to - PI) - source(to + PI))
}

mod tests {
    use super::*;

    #[test]
    fn bessel_functions_of_fractional_order_are_right() {
        // J_0(2), J_1(2), and J_{1/2}(x) = sqrt(2/(pi x)) sin x.
        let whole = bessel_from(0.0, 2.0);
        assert!((whole[0] - libm::j0(2.0)).abs() < 1e-14 && (whole[1] - libm::j1(2.0)).abs() < 1e-14);
        for x in [0.7, 5.0, 60.0] {
            let half = bessel_from(0.5, x);
            let scale = (2.0 / (PI * x)).sqrt();
            assert!((half[0] - scale * x.sin()).abs() < 1e-13, "{x}");
            assert!((half[1] - scale * (x.sin() / x - x.cos())).abs() < 1e-13, "{x}");
        }
    }

    #[test]
    fn the_closed_forms_fulfil_their_equations() {
        assert!((knife_edge(0.0) - 0.5).norm() < 1e-12);
        for nu in [0.3, 1.0, 2.0] {
            // What one half-plane keeps back the other lets through, and the derivative is the integrand.
            assert!((knife_edge(nu) + knife_edge(-nu) - 1.0).norm() < 1e-10, "{nu}");
            let slope = (knife_edge(nu + 1e-4) - knife_edge(nu - 1e-4)) / 2e-4;
            let integrand = -phasor(-FRAC_PI_2 * nu * nu) * Complex::new(0.5, 0.5);
            assert!((slope - integrand).norm() < 1e-6, "{nu}");
        }
        // psi(a + 2 half)/psi(a - 2 half) = cot(a/2 + pi/4), the equation that defines it.
        for alpha in [Complex::new(0.3, 0.0), Complex::new(-1.0, 0.7)] {
            let ratio = maliuzhinets(alpha + 1.5 * PI) / maliuzhinets(alpha - 1.5 * PI);
            let quarter = alpha * 0.5 + FRAC_PI_4;
            let (plus, minus) = (exp_j(quarter), exp_j(-quarter));
            let cot = Complex::new(0.0, 1.0) * (plus + minus) / (plus - minus);
            assert!((ratio - cot).norm() < 1e-12, "{ratio} {cot}");
        }
        let s = Complex::new(3.9, -0.4);
        let theta = arcsin(s);
        let sine = (exp_j(theta) - exp_j(-theta)) / Complex::new(0.0, 2.0);
        assert!((sine - s).norm() < 1e-12);
    }
}
