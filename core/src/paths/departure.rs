//! Angle of departure from the energies that one path shows in the transmit beams.
//!
//! Beam m sends towards direction q with a known field `b_m(q)`; a path of strength p shows amplitude `p b_m(q)`. The
//! direction is the weighted least-squares fit to the amplitudes of the beams in which the path was found, strength
//! eliminated: beams beside the strongest one interpolate between the codebook's directions (docs/signal-model.md, "Beam squint").
//! Phases carry nothing, the arrays' oscillators are free in every beam. An amplitude's variance is its noise and the
//! square of a gain error; a weak prior on the strongest beam's direction keeps the fit tame when few beams saw the path.

use heapless::Vec;
use nalgebra::{Complex, Vector3};

use crate::array::{Codebook, GmtArrays};
use crate::geometry::{Direction, Gmt};
use crate::signal::phasor;

/// Beams used for one path: the strongest.
/// Capacity: work of a fit.
pub(super) const LOOKS: usize = 24;
/// Standard deviation of the prior around the strongest beam, rad.
/// Derived: 7 degrees, the spacing of the beams.
const PRIOR_RAD: f32 = 0.122;
/// Step of the coarse search (4 on either side), and of the numerical slopes, rad.
/// Numerical: a step of a search that a fit follows.
const COARSE_RAD: f32 = 0.035;
/// Derived: four steps are 8 degrees, the prior's standard deviation.
const COARSE_STEPS: i32 = 4;
/// Additive amplitude error that each pass of the fit allows, relative to the strongest beam. The magnitude of a field has a kink at each
/// null, so the exact cost is full of local minima; wide errors first smooth it.
/// Derived: the last one is what 5 degrees rms of phase error on each of 64 elements leave in a beam.
pub(super) const PASSES: [f32; 3] = [0.15, 0.04, 0.011];
/// Numerical: a difference quotient.
const SLOPE_RAD: f32 = 0.002;
/// Capacity: steps of a descent, which usually ends before.
const ITERATIONS: usize = 12;
/// A step shorter than this ends a descent.
/// Numerical: in the last pass a hundredth of the best standard deviation there is, in those before it little beside what the next one
/// moves.
pub(super) const STILL_RAD: [f32; 3] = [1e-3, 1e-3, 1e-5];
/// Share of the product of its diagonal above which a Hessian's determinant is one.
/// Derived: sums of [`LOOKS`] terms round by 24 x 6e-8 of each product at most.
const LEAST_DETERMINANT: f32 = 3e-6;
/// Sine of half the turn from element to element under which a row's sum is that of equal terms.
/// Numerical: a guard of a division.
const LEAST_SINE: f32 = 1e-4;

/// Where a beam looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    pub(super) face: usize,
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
pub(super) struct Seen {
    cosines: [f32; 2],
    pub(super) element: f32,
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
    #[cfg(test)]
    pub(super) fn new<const ELEVATIONS: usize>(
        codebook: &Codebook<f32, FACES, X, Z, ELEVATIONS>,
        gain_sigma: f32,
    ) -> Self {
        let mut departures = Self::blank(codebook, gain_sigma);
        departures.fill(codebook);
        departures
    }

    /// Beams that nobody has aimed yet, to be aimed where they lie. `gain_sigma`: relative standard deviation of a beam's amplitude beside
    /// noise.
    pub(super) fn blank<const ELEVATIONS: usize>(
        codebook: &Codebook<f32, FACES, X, Z, ELEVATIONS>,
        gain_sigma: f32,
    ) -> Self {
        Self {
            aims: [None; BEAMS],
            arrays: *codebook.arrays(),
            gain_sigma,
        }
    }

    /// Aims the beams of the same codebook.
    pub(super) fn fill<const ELEVATIONS: usize>(
        &mut self,
        codebook: &Codebook<f32, FACES, X, Z, ELEVATIONS>,
    ) {
        for (m, aim) in self.aims.iter_mut().enumerate() {
            *aim = codebook.beam(m).map(|beam| Aim {
                face: beam.face,
                cosines: beam.cosines,
                u: beam.direction(),
            });
        }
    }

    /// What `u` is to each face.
    pub(super) fn faces(&self, u: &Direction<Gmt>) -> [Seen; FACES] {
        self.arrays.faces().each_ref().map(|face| Seen {
            cosines: GmtArrays::<f32, FACES, X, Z>::cosines(face, u),
            element: self.arrays.amplitude(face, u),
        })
    }

    /// A face's normal, the direction of its rows and that of its columns.
    pub(super) fn axes(&self, face: usize) -> Option<[Vector3<f32>; 3]> {
        let face = self.arrays.faces().get(face)?;
        Some([face.normal, face.tangent, face.normal.cross(&face.tangent)])
    }

    /// What the row (axis 0) or the column (1) of a beam's face makes of a path with that cosine.
    pub(super) fn factor(&self, aim: &Aim, axis: usize, cosine: f32) -> f32 {
        let turns = self.arrays.phase_per_element_rad() / core::f32::consts::TAU;
        let away = (cosine - aim.cosines.get(axis).copied().unwrap_or(0.0)) * turns;
        let [value, _] = if axis == 0 {
            row_factor::<X>(away)
        } else {
            row_factor::<Z>(away)
        };
        value
    }

    /// Row and column of a beam towards a direction, each with its slope by a cosine.
    #[inline(always)]
    fn factors(&self, aim: &Aim, seen: &Seen) -> [[f32; 2]; 2] {
        let turns = self.arrays.phase_per_element_rad() / core::f32::consts::TAU;
        let [row, column] = [
            row_factor::<X>((seen.cosines[0] - aim.cosines[0]) * turns),
            row_factor::<Z>((seen.cosines[1] - aim.cosines[1]) * turns),
        ];
        [row, column].map(|[value, slope]| [value, slope * turns])
    }

    /// Fits the direction to a path's looks, strongest first. The second value is the standard deviation along a tangent, rad. Where it is
    /// not near the strongest beam it is sought everywhere, for one of the `searches` that are left.
    pub(super) fn fit(
        &self,
        looks_in: impl Iterator<Item = Look>,
        searches: &mut u8,
    ) -> Option<(Direction<Gmt>, f32)> {
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
        for (pass, (error, still_rad)) in PASSES.into_iter().zip(STILL_RAD).enumerate() {
            let floor = error * strongest * error * strongest;
            for ((_, _, weight), variance) in looks.iter_mut().zip(&variances) {
                *weight = 1.0 / (variance + floor);
            }
            if pass == 0 {
                best = self.coarse(&looks, &best);
            }
            (best, hessian) = self.descend(&looks, best, &start, still_rad);
        }
        let (best, [h11, h12, h22]) = self.reconsider(&mut looks, &variances, (best, hessian), searches)?;
        let variance = mean_variance(h11, h12, h22);
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
    pub(super) fn descend(
        &self,
        looks: &[(Aim, f32, f32)],
        from: Direction<Gmt>,
        start: &Vector3<f32>,
        still_rad: f32,
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
            if step[0].abs().max(step[1].abs()) < still_rad {
                break;
            }
        }
        (best, state.hessian)
    }

    /// Amplitudes of the beams, and the best strength.
    pub(super) fn strength(
        &self,
        looks: &[(Aim, f32, f32)],
        u: &Direction<Gmt>,
        out: &mut [f32; LOOKS],
    ) -> f32 {
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

    pub(super) fn cost(&self, looks: &[(Aim, f32, f32)], u: &Direction<Gmt>, start: &Vector3<f32>) -> f32 {
        let mut fields = [0.0; LOOKS];
        let p = self.strength(looks, u, &mut fields);
        let chi2: f32 = looks
            .iter()
            .zip(&fields)
            .map(|((_, a, w), b)| w * (a - p * b) * (a - p * b))
            .sum();
        chi2 + (u.vector() - start).norm_squared() / (PRIOR_RAD * PRIOR_RAD)
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

/// Mean of the variances along both tangents by a Hessian, rad^2: at most that of the prior, and never infinite. Two looks tell one
/// number, and then the determinant is the difference of two nearly equal products: rounding, of either sign or zero. What
/// the fit says of the other direction is the prior. NaN when an entry is.
fn mean_variance(h11: f32, h12: f32, h22: f32) -> f32 {
    let (sum, product) = (h11 + h22, h11 * h22);
    let determinant = product - h12 * h12;
    if determinant > LEAST_DETERMINANT * product {
        0.5 * sum / determinant
    } else {
        // The larger eigenvalue is the sum, as near as it can be known.
        0.5 * (1.0 / sum + PRIOR_RAD * PRIOR_RAD)
    }
}

/// `sum exp(j 2 pi n t) / sqrt(COUNT)` over a centred row, real, and its slope by `t`.
#[inline(always)]
fn row_factor<const COUNT: usize>(turns: f32) -> [f32; 2] {
    let step = phasor(0.5 * turns);
    let root = libm::sqrtf(COUNT as f32);
    if step.im.abs() < LEAST_SINE {
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
mod tests;
