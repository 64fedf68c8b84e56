//! Angle of departure from the energies that one path shows in the transmit beams.
//!
//! Beam m sends towards direction q with a known field `b_m(q)`; a path of strength p shows amplitude `p b_m(q)`. The
//! direction is the weighted least-squares fit to the amplitudes of the beams in which the path was found, strength
//! eliminated: beams beside the strongest one interpolate between the codebook's directions (signal.md section 6).
//! Phases carry nothing, the arrays' oscillators are free in every beam. An amplitude's variance is its noise and the
//! square of a gain error; a weak prior on the strongest beam's direction keeps the fit tame when few beams saw the path.

use heapless::Vec;
use nalgebra::{Complex, Vector3};

use super::phase::phasor;
use crate::array::{Codebook, GmtArrays};
use crate::geometry::{Direction, Gmt};

/// Beams used for one path: the strongest.
const LOOKS: usize = 24;
/// Standard deviation of the prior around the strongest beam, rad: 7 degrees, the spacing of the beams.
const PRIOR_RAD: f32 = 0.122;
/// Step of the coarse search (4 on either side), and of the numerical slopes, rad.
const COARSE_RAD: f32 = 0.035;
const COARSE_STEPS: i32 = 4;
/// Additive amplitude error that each pass of the fit allows, relative to the strongest beam. The magnitude of a field has a
/// kink at each null, so the exact cost is full of local minima; wide errors first smooth it. The last one is what 5
/// degrees rms of phase error on each of 64 elements leave in a beam.
const PASSES: [f32; 3] = [0.15, 0.04, 0.011];
const SLOPE_RAD: f32 = 0.002;
const ITERATIONS: usize = 12;

/// Where a beam looks.
#[derive(Clone, Copy, Debug)]
struct Aim {
    face: usize,
    cosines: [f32; 2],
    u: Vector3<f32>,
}

/// Transmit beams as the fit needs them: `BEAMS` directions and the patterns of `FACES` arrays of `X` x `Z` elements.
#[derive(Clone, Debug)]
pub(super) struct Departures<const BEAMS: usize, const FACES: usize, const X: usize, const Z: usize> {
    aims: [Option<Aim>; BEAMS],
    arrays: GmtArrays<f32, FACES, X, Z>,
    /// Relative standard deviation of a beam's amplitude.
    gain_sigma: f32,
}

/// What a direction is to a face: its cosines, and the amplitude of an element.
#[derive(Clone, Copy, Debug)]
struct Seen {
    cosines: [f32; 2],
    element: f32,
}

/// Amplitude of a path in one beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub(super) beam: u16,
    pub(super) amplitude: f32,
    /// Variance of the amplitude by noise.
    pub(super) variance: f32,
}

/// Cost and derivatives of the fit at one direction.
struct Cost {
    cost: f32,
    gradient: [f32; 2],
    hessian: [f32; 3],
}

impl<const BEAMS: usize, const FACES: usize, const X: usize, const Z: usize> Departures<BEAMS, FACES, X, Z> {
    /// `gain_sigma`: relative standard deviation of a beam's amplitude beside noise.
    pub(super) fn new<const ELEVATIONS: usize>(
        codebook: &Codebook<f32, FACES, X, Z, ELEVATIONS>,
        gain_sigma: f32,
    ) -> Self {
        Self {
            aims: core::array::from_fn(|m| {
                codebook.beam(m).map(|beam| Aim {
                    face: beam.face,
                    cosines: beam.cosines,
                    u: beam.direction(),
                })
            }),
            arrays: *codebook.arrays(),
            gain_sigma,
        }
    }

    /// What `u` is to each face.
    fn faces(&self, u: &Direction<Gmt>) -> [Seen; FACES] {
        self.arrays.faces().each_ref().map(|face| Seen {
            cosines: GmtArrays::<f32, FACES, X, Z>::cosines(face, u),
            element: self.arrays.amplitude(face, u),
        })
    }

    /// Row and column of a beam towards a direction, each with its slope by a cosine.
    fn factors(&self, aim: &Aim, seen: &Seen) -> [[f32; 2]; 2] {
        let turns = self.arrays.phase_per_element_rad() / core::f32::consts::TAU;
        let [row, column] = [
            row_factor::<X>((seen.cosines[0] - aim.cosines[0]) * turns),
            row_factor::<Z>((seen.cosines[1] - aim.cosines[1]) * turns),
        ];
        [row, column].map(|[value, slope]| [value, slope * turns])
    }

    /// Fits the direction to a path's looks, strongest first. The second value is the standard deviation along a tangent, rad.
    pub(super) fn fit(&self, looks_in: impl Iterator<Item = Look>) -> Option<(Direction<Gmt>, f32)> {
        let mut looks: Vec<(Aim, f32, f32), LOOKS> = Vec::new();
        let mut variances: Vec<f32, LOOKS> = Vec::new();
        for look in looks_in.take(LOOKS) {
            if let Some(Some(aim)) = self.aims.get(usize::from(look.beam)) {
                let gain = self.gain_sigma * look.amplitude;
                let _ = looks.push((*aim, look.amplitude, 0.0));
                let _ = variances.push(look.variance + gain * gain);
            }
        }
        let (first, strongest, _) = *looks.first()?;
        let start = first.u;
        let mut best = Direction::from_vector(start).ok()?;
        let mut hessian = [0.0; 3];
        for (pass, error) in PASSES.into_iter().enumerate() {
            let floor = error * strongest * error * strongest;
            for ((_, _, weight), variance) in looks.iter_mut().zip(&variances) {
                *weight = 1.0 / (variance + floor);
            }
            if pass == 0 {
                best = self.coarse(&looks, &best);
            }
            (best, hessian) = self.descend(&looks, best, &start);
        }
        let [h11, h12, h22] = hessian;
        let variance = 0.5 * (h11 + h22) / (h11 * h22 - h12 * h12);
        (variance > 0.0).then(|| (best, libm::sqrtf(variance)))
    }

    /// Best of a grid around a direction.
    fn coarse(&self, looks: &[(Aim, f32, f32)], start: &Direction<Gmt>) -> Direction<Gmt> {
        let (e1, e2) = start.tangents();
        let (mut best, mut least) = (*start, f32::INFINITY);
        for a in -COARSE_STEPS..=COARSE_STEPS {
            for b in -COARSE_STEPS..=COARSE_STEPS {
                let away = (e1 * a as f32 + e2 * b as f32) * COARSE_RAD;
                if let Ok(u) = Direction::from_vector(start.vector() + away) {
                    let cost = self.cost(looks, &u, start.vector());
                    if cost < least {
                        (best, least) = (u, cost);
                    }
                }
            }
        }
        best
    }

    /// Damped Gauss-Newton descent. Gives the Hessian of the end too.
    fn descend(
        &self,
        looks: &[(Aim, f32, f32)],
        from: Direction<Gmt>,
        start: &Vector3<f32>,
    ) -> (Direction<Gmt>, [f32; 3]) {
        let mut best = from;
        let mut damping = 1e-3;
        let mut state = self.expand(looks, &best, start);
        for _ in 0..ITERATIONS {
            let [h11, h12, h22] = state.hessian;
            let (a, b) = (h11 * (1.0 + damping), h22 * (1.0 + damping));
            let determinant = a * b - h12 * h12;
            let [g1, g2] = state.gradient;
            let step = [
                (b * g1 - h12 * g2) / determinant,
                (a * g2 - h12 * g1) / determinant,
            ];
            let (e1, e2) = best.tangents();
            let Ok(next) = Direction::from_vector(best.vector() + e1 * step[0] + e2 * step[1]) else {
                break;
            };
            let candidate = self.expand(looks, &next, start);
            if candidate.cost < state.cost {
                (best, state) = (next, candidate);
                damping *= 0.2;
            } else {
                damping *= 10.0;
            }
            if step[0].abs().max(step[1].abs()) < 1e-6 {
                break;
            }
        }
        (best, state.hessian)
    }

    /// Amplitudes of the beams, and the best strength.
    fn strength(&self, looks: &[(Aim, f32, f32)], u: &Direction<Gmt>, out: &mut [f32; LOOKS]) -> f32 {
        let faces = self.faces(u);
        let (mut ab, mut bb) = (0.0, 0.0);
        for ((aim, amplitude, weight), b) in looks.iter().zip(out.iter_mut()) {
            *b = faces.get(aim.face).map_or(0.0, |seen| {
                let [[row, _], [column, _]] = self.factors(aim, seen);
                (row * column).abs() * seen.element
            });
            ab += weight * amplitude * *b;
            bb += weight * *b * *b;
        }
        if bb > 0.0 { ab / bb } else { 0.0 }
    }

    fn cost(&self, looks: &[(Aim, f32, f32)], u: &Direction<Gmt>, start: &Vector3<f32>) -> f32 {
        let mut fields = [0.0; LOOKS];
        let p = self.strength(looks, u, &mut fields);
        let misfit: f32 = looks
            .iter()
            .zip(&fields)
            .map(|((_, a, w), b)| w * (a - p * b) * (a - p * b))
            .sum();
        misfit + (u.vector() - start).norm_squared() / (PRIOR_RAD * PRIOR_RAD)
    }

    /// Slopes of the beams' amplitudes along a tangent `e` of `u`: array factors by their derivative, the element by a
    /// difference.
    fn slopes(
        &self,
        looks: &[(Aim, f32, f32)],
        u: &Direction<Gmt>,
        e: &Vector3<f32>,
        strength: f32,
    ) -> [f32; LOOKS] {
        let faces = self.faces(u);
        let moved =
            [SLOPE_RAD, -SLOPE_RAD].map(|side| Direction::from_vector(u.vector() + e * side).unwrap_or(*u));
        let along = self.arrays.faces().each_ref().map(|face| {
            let [ahead, behind] = moved.map(|u| self.arrays.amplitude(face, &u));
            ([face.tangent.dot(e), e.z], (ahead - behind) / (2.0 * SLOPE_RAD))
        });
        let mut out = [0.0; LOOKS];
        for ((aim, ..), slope) in looks.iter().zip(&mut out) {
            if let (Some(seen), Some((cosines, element))) = (faces.get(aim.face), along.get(aim.face)) {
                let [[row, by_row], [column, by_column]] = self.factors(aim, seen);
                let turned = by_row * cosines[0] * column + row * by_column * cosines[1];
                let field = row * column;
                let sign = if field < 0.0 { -1.0 } else { 1.0 };
                *slope = strength * sign * (turned * seen.element + field * element);
            }
        }
        out
    }

    /// Cost, half its negative gradient and its Gauss-Newton Hessian along the tangents of `u`.
    fn expand(&self, looks: &[(Aim, f32, f32)], u: &Direction<Gmt>, start: &Vector3<f32>) -> Cost {
        let mut fields = [0.0; LOOKS];
        let p = self.strength(looks, u, &mut fields);
        let (e1, e2) = u.tangents();
        let mut slopes = [e1, e2].map(|e| self.slopes(looks, u, &e, p));
        // The strength is eliminated: slopes lose their part along the fields.
        let norm: f32 = looks.iter().zip(&fields).map(|((_, _, w), b)| w * b * b).sum();
        for slope in &mut slopes {
            let along: f32 = looks
                .iter()
                .zip(&fields)
                .zip(slope.iter())
                .map(|(((_, _, w), b), s)| w * b * s)
                .sum();
            let share = if norm > 0.0 { along / norm } else { 0.0 };
            for (s, b) in slope.iter_mut().zip(&fields) {
                *s -= share * b;
            }
        }
        let prior = 1.0 / (PRIOR_RAD * PRIOR_RAD);
        let away = u.vector() - start;
        let mut out = Cost {
            cost: prior * away.norm_squared(),
            gradient: [-prior * away.dot(&e1), -prior * away.dot(&e2)],
            hessian: [prior, 0.0, prior],
        };
        let [s1, s2] = &slopes;
        for ((((_, a, w), b), s1), s2) in looks.iter().zip(&fields).zip(s1).zip(s2) {
            let error = a - p * b;
            out.cost += w * error * error;
            out.gradient[0] += w * s1 * error;
            out.gradient[1] += w * s2 * error;
            out.hessian[0] += w * s1 * s1;
            out.hessian[1] += w * s1 * s2;
            out.hessian[2] += w * s2 * s2;
        }
        out
    }
}

/// `sum exp(j 2 pi n t) / sqrt(COUNT)` over a centred row, real, and its slope by `t`.
fn row_factor<const COUNT: usize>(turns: f32) -> [f32; 2] {
    let step = phasor(0.5 * turns);
    let root = libm::sqrtf(COUNT as f32);
    if step.im.abs() < 1e-4 {
        // Near the peak (and its repetitions a turn away, where even rows change sign, which an amplitude does not see).
        return [root, 0.0];
    }
    let whole = power(step, COUNT);
    let value = whole.im / (step.im * root);
    // By the quotient rule, x = pi t: (sin(N x) / sin x)' = (N cos(N x) - sin(N x) cos x / sin x) / sin x.
    let slope = (COUNT as f32 * whole.re / root - value * step.re) / step.im;
    [value, core::f32::consts::PI * slope]
}

/// `z^n` by squaring.
fn power(z: Complex<f32>, n: usize) -> Complex<f32> {
    let (mut out, mut square, mut rest) = (Complex::new(1.0, 0.0), z, n);
    while rest > 0 {
        if rest & 1 == 1 {
            out *= square;
        }
        square *= square;
        rest >>= 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    type Default72 = Departures<72, 3, 8, 8>;

    /// Amplitudes of the beams above a share of the strongest, by the codebook's own field.
    fn looks(codebook: &Codebook<f64>, u: &Direction<Gmt, f64>, share: f64) -> Vec<Look, 72> {
        let amplitude = |m| {
            let field: Complex<f64> = codebook.field(m, u);
            libm::sqrt(field.norm_sqr())
        };
        let strongest = (0..72).map(amplitude).fold(0.0, f64::max);
        let mut looks: Vec<Look, 72> = (0..72)
            .filter(|m| amplitude(*m) > share * strongest)
            .map(|m| Look {
                beam: m as u16,
                amplitude: amplitude(m) as f32,
                variance: 1e-6,
            })
            .collect();
        looks.sort_unstable_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        looks
    }

    #[test]
    fn direction_comes_back_from_exact_amplitudes() {
        let codebook = Codebook::<f64>::default();
        let departures = Default72::new(&Codebook::<f32>::default(), 0.06);
        for k in 0..300 {
            let azimuth = -3.1 + 6.2 * (0.618_034 * f64::from(k)).fract();
            let elevation = 0.44 * (0.414_214 * f64::from(k)).fract();
            let truth =
                Direction::<Gmt, f64>::from_zenith_azimuth(core::f64::consts::FRAC_PI_2 - elevation, azimuth)
                    .expect("angles");
            let looks = looks(&codebook, &truth, 0.03);
            let (found, sigma_rad) = departures.fit(looks.iter().copied()).expect("looks");
            let off = found
                .vector()
                .cast::<f64>()
                .cross(truth.vector())
                .norm()
                .to_degrees();
            assert!(
                off < 0.1,
                "{off} deg off at azimuth {azimuth}, elevation {elevation}"
            );
            assert!(sigma_rad > 0.0 && sigma_rad < 0.01);
        }
    }

    #[test]
    fn single_look_is_the_beam_and_says_how_little_it_knows() {
        let codebook = Codebook::<f32>::default();
        let departures = Default72::new(&codebook, 0.06);
        let look = Look {
            beam: 30,
            amplitude: 1.0,
            variance: 1e-4,
        };
        let (found, sigma_rad) = departures.fit([look].into_iter()).expect("a look");
        let beam = codebook.beam(30).expect("beam").direction();
        assert!((found.vector() - beam).norm() < 1e-3);
        assert!((sigma_rad - PRIOR_RAD).abs() < 0.01, "{sigma_rad}");
        assert!(departures.fit(core::iter::empty()).is_none());
        assert!(
            departures.fit([Look { beam: 72, ..look }].into_iter()).is_none(),
            "no such beam"
        );
    }

    /// Amplitudes with noise and gain errors of the stated size: the direction errs as much as it says.
    #[test]
    fn error_is_what_the_fit_says() {
        let codebook = Codebook::<f64>::default();
        let mut state = 5_u32;
        let mut normal = || {
            let mut sum = -6.0_f32;
            for _ in 0..12 {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                sum += (state >> 8) as f32 / 16_777_216.0;
            }
            sum
        };
        let departures = Default72::new(&Codebook::<f32>::default(), 0.06);
        let (mut squares, mut sigmas, trials) = (0.0, 0.0, 150);
        for k in 0..trials {
            let azimuth = -3.1 + 6.2 * (0.618_034 * f64::from(k)).fract();
            let elevation = 0.05 + 0.33 * (0.414_214 * f64::from(k)).fract();
            let truth =
                Direction::<Gmt, f64>::from_zenith_azimuth(core::f64::consts::FRAC_PI_2 - elevation, azimuth)
                    .expect("angles");
            let mut looks = looks(&codebook, &truth, 0.1);
            let noise = 0.01 * looks[0].amplitude;
            for look in &mut looks {
                look.amplitude += look.amplitude * 0.06 * normal() + noise * normal();
                look.variance = noise * noise;
            }
            looks.sort_unstable_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
            let (found, sigma_rad) = departures.fit(looks.iter().copied()).expect("looks");
            let off = found.vector().cast::<f64>().cross(truth.vector()).norm();
            squares += 0.5 * (off / f64::from(sigma_rad)).powi(2);
            sigmas += f64::from(sigma_rad).to_degrees();
        }
        let (honest, sigma_deg) = (squares / f64::from(trials), sigmas / f64::from(trials));
        assert!((0.6..1.4).contains(&honest), "{honest}, sigma {sigma_deg} deg");
        assert!(sigma_deg < 0.4, "{sigma_deg}");
    }

    #[test]
    fn heavier_beams_decide() {
        let codebook = Codebook::<f64>::default();
        let departures = Default72::new(&Codebook::<f32>::default(), 0.0);
        let truth = Direction::<Gmt, f64>::from_zenith_azimuth(1.45, 0.2).expect("angles");
        let mut looks = looks(&codebook, &truth, 0.2);
        // One beam lies by 30 %, and says so.
        looks[1].amplitude *= 1.3;
        looks[1].variance = 100.0;
        let (found, _) = departures.fit(looks.iter().copied()).expect("looks");
        let off = found
            .vector()
            .cast::<f64>()
            .cross(truth.vector())
            .norm()
            .to_degrees();
        assert!(off < 0.1, "{off} deg");
        // Taken at its word it pulls.
        looks[1].variance = 1e-6;
        let (pulled, _) = departures.fit(looks.iter().copied()).expect("looks");
        let off = pulled
            .vector()
            .cast::<f64>()
            .cross(truth.vector())
            .norm()
            .to_degrees();
        assert!(off > 0.3, "{off} deg");
    }

    /// Where the amplitudes fit, the Gauss-Newton Hessian is the curvature of the cost, strength eliminated: the standard
    /// deviation comes from it.
    #[test]
    fn hessian_is_the_curvature_of_the_cost() {
        let codebook = Codebook::<f64>::default();
        let departures = Default72::new(&Codebook::<f32>::default(), 0.0);
        for (zenith, azimuth) in [(1.45, 0.2), (1.25, 0.6), (1.5, -2.0)] {
            let truth = Direction::<Gmt, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
            let u = Direction::<Gmt>::from_vector(truth.vector().cast()).expect("unit");
            // Three beams: the strength they leave open matters.
            let looks: Vec<(Aim, f32, f32), LOOKS> = looks(&codebook, &truth, 0.1)
                .iter()
                .take(3)
                .filter_map(|look| Some((departures.aims[usize::from(look.beam)]?, look.amplitude, 1e4)))
                .collect();
            let state = departures.expand(&looks, &u, u.vector());
            let (e1, e2) = u.tangents();
            let step = 2e-3;
            let cost = |a: f32, b: f32| {
                let moved = Direction::from_vector(u.vector() + (e1 * a + e2 * b) * step).expect("unit");
                departures.cost(&looks, &moved, u.vector())
            };
            let curvature =
                |a: f32, b: f32| (cost(a, b) + cost(-a, -b) - 2.0 * state.cost) / (2.0 * step * step);
            let [h11, h12, h22] = state.hessian;
            for (measured, expected) in [
                (curvature(1.0, 0.0), h11),
                (curvature(0.0, 1.0), h22),
                (curvature(1.0, 1.0), h11 + 2.0 * h12 + h22),
            ] {
                assert!((measured / expected - 1.0).abs() < 0.05, "{measured} {expected}");
            }
        }
    }
}
