//! Departures that no beam looks at.
//!
//! Above and below its beams the GMT is heard through their sidelobes. The strongest beam then says little about the
//! direction, and a fit around it ends where sidelobes happen to match: 0.5 rad off, sure of 3 mrad. But sidelobes are known as
//! well as beams, so the same amplitudes tell the direction when it is sought over the whole half space of the face. It is
//! sought there when the fit around the strongest beam leaves more over than errors explain; where two directions then
//! explain the amplitudes about equally well, none is given.

use heapless::Vec;

use super::departure::{Aim, Departures, LOOKS, PASSES, STILL_RAD};
use crate::geometry::{Direction, Gmt};

/// Chi-square a degree of freedom above which a fit is not believed. An honest one has 1.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const MOST_CHI2: f32 = 2.0;
/// Looks from which on a chi-square tells anything.
/// Derived: two parameters and a strength are fitted.
const LEAST_LOOKS: usize = 6;
/// Step of the search in both cosines of the face.
/// Derived: half of the lobes' half width, which is the same everywhere in cosines.
const STEP: f32 = 0.07;
/// Cells along the row (79 degrees to either side of the face) and up the column (57 degrees down, 66 up), and which one is zero.
/// Derived: the face's field of view over the step: cells, and which one is zero.
const ROW: [usize; 2] = [29, 14];
/// Derived: the field of view over the step.
const COLUMN: [usize; 2] = [26, 12];
/// Looks that the search compares: the strongest of the face.
/// Capacity: work of the search.
const SEARCHED: usize = 12;
/// Places that are fitted, and how far they are apart, rad.
/// Capacity: work of the fits.
const PLACES: usize = 6;
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const APART_RAD: f32 = 0.2;
/// Log-likelihood, doubled, by which the best place must lead the next: when it is the one around the strongest beam, and
/// when it is not.
/// Derived: odds of 20 to 1, and of 22 000 to 1.
const LEADS: [f32; 2] = [6.0, 20.0];

/// Where to look closer, each with its cost.
type Places = Vec<(Direction<Gmt>, f32), PLACES>;

/// A place and how well it explains the looks.
#[derive(Clone, Copy, Debug)]
struct Place {
    direction: Direction<Gmt>,
    hessian: [f32; 3],
    /// Twice the negative log-likelihood, up to a constant.
    score: f32,
    /// Sum of weighted squared errors.
    chi2: f32,
}

impl<const BEAMS: usize, const FACES: usize, const X: usize, const Z: usize> Departures<BEAMS, FACES, X, Z> {
    /// Looks again, everywhere, when a fit is not to be believed, and one of the `searches` is left. `looks` hold beam, amplitude and weight, `variances` what the
    /// amplitudes scatter by themselves. The direction with its Hessian; `None` when no single one explains the looks.
    pub(super) fn reconsider(
        &self,
        looks: &mut [(Aim, f32, f32)],
        variances: &[f32],
        (found, hessian): (Direction<Gmt>, [f32; 3]),
        searches: &mut u8,
    ) -> Option<(Direction<Gmt>, [f32; 3])> {
        if looks.len() < LEAST_LOOKS {
            return Some((found, hessian));
        }
        let freedom = looks.len().saturating_sub(3) as f32;
        let near = self.place(looks, variances, found, hessian);
        if near.chi2 <= MOST_CHI2 * freedom {
            return Some((found, hessian));
        }
        *searches = searches.checked_sub(1)?;
        let mut best = near;
        let mut next: Option<Place> = None;
        for (start, _) in self.search(looks, variances) {
            let mut direction = start;
            let mut hessian = [0.0; 3];
            for (error, still_rad) in PASSES.into_iter().zip(STILL_RAD) {
                self.weigh(looks, variances, &direction, error);
                (direction, hessian) = self.descend(looks, direction, start.vector(), still_rad);
            }
            let place = self.place(looks, variances, direction, hessian);
            let other = if place.score < best.score {
                core::mem::replace(&mut best, place)
            } else {
                place
            };
            let apart = other.direction.angle_to_rad(&best.direction) > APART_RAD;
            if apart && next.is_none_or(|next| other.score < next.score) {
                next = Some(other);
            }
        }
        let stayed = near.direction.angle_to_rad(&best.direction) <= APART_RAD;
        let lead = if stayed { LEADS[0] } else { LEADS[1] };
        let leads = next.is_none_or(|next| {
            next.direction.angle_to_rad(&best.direction) <= APART_RAD || next.score - best.score > lead
        });
        // What is still left over widens what is claimed.
        let excess = (best.chi2 / freedom).max(1.0);
        (leads && excess < 2.0 * MOST_CHI2).then(|| (best.direction, best.hessian.map(|h| h / excess)))
    }

    /// Sets the weights for a path that leaves towards `u`: what element errors leave in a beam is a share of what a beam
    /// that looked there would show.
    fn weigh(&self, looks: &mut [(Aim, f32, f32)], variances: &[f32], u: &Direction<Gmt>, error: f32) {
        let floor = error * self.full(looks, u);
        for ((_, _, weight), variance) in looks.iter_mut().zip(variances) {
            *weight = 1.0 / (variance + floor * floor);
        }
    }

    /// Amplitude that a beam towards `u` would show, at least that of the strongest look.
    fn full(&self, looks: &[(Aim, f32, f32)], u: &Direction<Gmt>) -> f32 {
        let mut fields = [0.0; LOOKS];
        let strength = self.strength(looks, u, &mut fields);
        let element = self
            .faces(u)
            .iter()
            .fold(0.0, |most: f32, seen| most.max(seen.element));
        let strongest = looks.first().map_or(0.0, |look| look.1);
        (strength * element * libm::sqrtf((X * Z) as f32)).max(strongest)
    }

    /// How well a direction explains the looks, with the weights of the last pass for it.
    fn place(
        &self,
        looks: &mut [(Aim, f32, f32)],
        variances: &[f32],
        direction: Direction<Gmt>,
        hessian: [f32; 3],
    ) -> Place {
        let error = PASSES.last().copied().unwrap_or(0.0);
        self.weigh(looks, variances, &direction, error);
        // At its own place the prior says nothing.
        let chi2 = self.cost(looks, &direction, direction.vector());
        let spread: f32 = looks.iter().map(|look| libm::logf(look.2)).sum();
        Place {
            direction,
            hessian,
            score: chi2 - spread,
            chi2,
        }
    }

    /// The best places of the half space before the strongest look's face. A beam's field is a product of what the row makes of one
    /// cosine and the column of the other, so the fields of all cells are few numbers; the element's pattern is one strength to
    /// all looks of a face.
    fn search(&self, looks: &[(Aim, f32, f32)], variances: &[f32]) -> Places {
        let mut places = Places::new();
        let (Some(first), Some(error)) = (looks.first(), PASSES.first()) else {
            return places;
        };
        let (face, floor) = (first.0.face, error * first.1 * error * first.1);
        let Some(axes) = self.axes(face) else {
            return places;
        };
        let mut searched: Vec<Searched, SEARCHED> = Vec::new();
        for ((aim, amplitude, _), variance) in looks.iter().zip(variances) {
            if aim.face == face {
                let full = searched.push(Searched {
                    amplitude: *amplitude,
                    weight: 1.0 / (variance + floor),
                    row: core::array::from_fn(|cell| self.factor(aim, 0, cosine(cell, ROW))),
                    column: core::array::from_fn(|cell| self.factor(aim, 1, cosine(cell, COLUMN))),
                });
                if full.is_err() {
                    break;
                }
            }
        }
        let all: f32 = searched
            .iter()
            .map(|s| s.weight * s.amplitude * s.amplitude)
            .sum();
        for i in 0..ROW[0] {
            for j in 0..COLUMN[0] {
                let (x, z) = (cosine(i, ROW), cosine(j, COLUMN));
                let ahead = 1.0 - x * x - z * z;
                if ahead <= 0.0 {
                    continue;
                }
                let (mut ab, mut bb) = (0.0, 0.0);
                for look in &searched {
                    if let (Some(row), Some(column)) = (look.row.get(i), look.column.get(j)) {
                        let field = (row * column).abs();
                        ab += look.weight * look.amplitude * field;
                        bb += look.weight * field * field;
                    }
                }
                let cost = if bb > 0.0 { all - ab * ab / bb } else { all };
                // Most cells are worse than every place that is kept.
                if places.is_full() && places.iter().all(|place| cost >= place.1) {
                    continue;
                }
                let [normal, along, up] = axes;
                if let Ok(u) = Direction::from_vector(normal * libm::sqrtf(ahead) + along * x + up * z) {
                    keep(&mut places, u, cost);
                }
            }
        }
        places
    }
}

/// A look and the fields that cells would show in its beam: those of the row times those of the column.
struct Searched {
    amplitude: f32,
    weight: f32,
    row: [f32; ROW[0]],
    column: [f32; COLUMN[0]],
}

fn cosine(cell: usize, [_, zero]: [usize; 2]) -> f32 {
    (cell as f32 - zero as f32) * STEP
}

/// Keeps the best places that are apart.
fn keep(places: &mut Places, u: Direction<Gmt>, cost: f32) {
    if let Some(near) = places
        .iter_mut()
        .find(|place| place.0.angle_to_rad(&u) < APART_RAD)
    {
        if cost < near.1 {
            *near = (u, cost);
        }
    } else if places.push((u, cost)).is_err()
        && let Some(worst) = places.iter_mut().max_by(|a, b| a.1.total_cmp(&b.1))
        && cost < worst.1
    {
        *worst = (u, cost);
    }
}

#[cfg(test)]
mod tests {
    use super::super::departure::Look;
    use super::*;
    use crate::array::Codebook;

    type Default72 = Departures<72, 3, 8, 8>;

    /// Looks within 34 dB of the strongest, each amplitude with an error of the size that element errors leave in a beam.
    fn looks(codebook: &Codebook<f64>, u: &Direction<Gmt, f64>, seed: u32) -> Vec<Look, 72> {
        let mut state = seed;
        let mut normal = || {
            let mut sum = -6.0_f64;
            for _ in 0..12 {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                sum += f64::from(state >> 8) / 16_777_216.0;
            }
            sum
        };
        let peak = codebook
            .arrays()
            .faces()
            .iter()
            .map(|face| 8.0 * codebook.arrays().amplitude(face, u))
            .fold(0.0, f64::max);
        let mut looks: Vec<Look, 72> = (0..72)
            .map(|m| {
                let field = libm::sqrt(codebook.field(m, u).norm_sqr());
                Look {
                    beam: m as u16,
                    amplitude: ((field * (1.0 + 0.01 * normal()) + 0.011 * peak * normal()).abs()) as f32,
                    variance: 1e-4,
                }
            })
            .collect();
        looks.sort_unstable_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        let least = 0.02 * looks[0].amplitude;
        looks.into_iter().filter(|look| look.amplitude > least).collect()
    }

    /// Of a path that leaves far below the beams the direction is sought everywhere, once for each search that is left, and not given without.
    #[test]
    fn a_search_of_all_directions_is_spent_and_without_one_nothing_is_guessed() {
        let codebook = Codebook::<f64>::default();
        let departures = Default72::new(&Codebook::<f32>::default(), 0.035);
        let fit = |elevation_deg: f64, searches: &mut u8| {
            let zenith = core::f64::consts::FRAC_PI_2 - elevation_deg.to_radians();
            let truth = Direction::<Gmt, f64>::from_zenith_azimuth(zenith, 0.3).expect("angles");
            let looks = looks(&codebook, &truth, 3);
            departures.fit(looks.iter().copied(), searches).is_some()
        };
        let mut searches = 1;
        assert!(fit(10.0, &mut searches) && searches == 1, "a beam looks there");
        let _ = fit(-40.0, &mut searches);
        assert_eq!(searches, 0);
        assert!(!fit(-40.0, &mut searches) && searches == 0);
        assert!(fit(10.0, &mut searches));
    }

    /// Directions below, among and above the beams, one seed each: how many are found, are refused, are wrong and do not say
    /// so. Below and above, three elevations of beams leave most of them open.
    #[test]
    fn departures_beside_all_beams_are_found_or_refused() {
        let codebook = Codebook::<f64>::default();
        let departures = Default72::new(&Codebook::<f32>::default(), 0.035);
        for (low_deg, high_deg, least_found) in [(-50.0, -15.0, 20), (-8.0, 28.0, 185), (32.0, 55.0, 50)] {
            let (mut found, mut refused, mut wrong) = (0, 0, 0);
            for k in 0..200_u32 {
                let share = (0.414_214 * f64::from(k)).fract();
                let elevation = f64::to_radians(low_deg + (high_deg - low_deg) * share);
                let azimuth = -3.1 + 6.2 * (0.618_034 * f64::from(k)).fract();
                let zenith = core::f64::consts::FRAC_PI_2 - elevation;
                let truth = Direction::<Gmt, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
                let looks = looks(&codebook, &truth, k + 1);
                match departures.fit(looks.iter().copied(), &mut 1) {
                    None => refused += 1,
                    Some((u, sigma_rad)) => {
                        let off = u.vector().cast::<f64>().cross(truth.vector()).norm();
                        if off < 5.0 * f64::from(sigma_rad) + 0.002 {
                            found += 1;
                        } else {
                            wrong += 1;
                        }
                    }
                }
            }
            assert!(
                found >= least_found && wrong <= 16,
                "{low_deg} to {high_deg}: {found} found, {refused} refused, {wrong} wrong"
            );
        }
    }
}
