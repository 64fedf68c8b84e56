//! Starts of a joint fit: close paths have local optima, and a fit that has run into one leaves more than noise.
//!
//! It is started again from two paths of one delay, from two of one direction, and, where two members ran into each other, from
//! where they came: a path and the slope of another beside it explain nearly as much as the two do, so a fit that comes too near
//! does not find out again, but the way in which its members differ is the way in which the paths do.

use super::cholesky::regular;
use super::fit::Fit;
use super::meter::Meter;
use super::place::Place;
use super::search::Search;
use super::window::{Content, JOINT, Window};

/// Residual of a joint fit beyond noise, in standard deviations, that asks for another start.
/// Derived: one honest fit in 30 000 is beyond.
const RESIDUAL_SIGMAS: f32 = 4.0;
/// Steps of a joint fit.
/// Capacity: work of a fit, which usually ends before.
pub(super) const JOINT_STEPS: usize = 24;
/// Steps of a joint fit from a start that is tried out.
/// Capacity: work of a trial.
const TRIAL_STEPS: usize = 6;
/// Further starts of a joint fit.
/// Capacity: work of a joint fit.
const ATTEMPTS: usize = 3;
/// Half the separation in delay at which two paths of one direction are started, taps.
/// Numerical: a start, from which a fit goes on.
const SPLIT_TAPS: f32 = 0.2;
/// Distance to which two members that ran into each other are put apart.
/// Numerical: half a beam of an array, or a tenth of a tap.
const APART_RAD: f32 = 0.1;
/// Numerical: a start, from which a fit goes on.
const APART_TAPS: f32 = 0.1;
/// Errors of the arrays are none where they leave less than this share of what noise does.
/// Numerical: a fiftieth of the noise moves no fit.
const EXACT: f32 = 0.02;

impl<const A: usize, const E: usize, T: Meter> Search<'_, A, E, T> {
    /// Joint fit from a start; where it leaves more than noise, also from other starts.
    pub(super) fn best<const L: usize, const D: usize, const C: usize>(
        &self,
        window: &Window<C, JOINT>,
        start: [Place; L],
        noise: f32,
    ) -> Fit<L, D, A> {
        let first = self.fit(window, start, noise, JOINT_STEPS);
        self.further(window, &start, first, noise)
    }

    /// The same, beginning from a fit that is there.
    pub(super) fn better<const L: usize, const D: usize, const C: usize>(
        &self,
        window: &Window<C, JOINT>,
        first: Fit<L, D, A>,
        noise: f32,
    ) -> Fit<L, D, A> {
        let further = self.further(window, &first.places, first, noise);
        if regular(&further.hessian) { further } else { first }
    }

    fn further<const L: usize, const D: usize, const C: usize>(
        &self,
        window: &Window<C, JOINT>,
        start: &[Place; L],
        first: Fit<L, D, A>,
        noise: f32,
    ) -> Fit<L, D, A> {
        let mut best = first;
        let content = window.content();
        let most = self.unexplained(&content, noise);
        for attempt in 0..ATTEMPTS {
            if !self.effort.allows_further_starts() {
                break;
            }
            let told_apart = regular(&best.hessian);
            if told_apart && content.energy - best.energy < most {
                break;
            }
            let other = if told_apart {
                self.other_start(window, start, attempt)
            } else {
                apart(&best.places)
            };
            let trial: Fit<L, D, A> = self.fit(window, other, noise, TRIAL_STEPS);
            if trial.energy > best.energy {
                // Only a start that led somewhere better is worth the way to the end.
                let fit: Fit<L, D, A> = self.fit(window, trial.places, noise, JOINT_STEPS);
                best = if fit.energy > trial.energy { fit } else { trial };
            }
        }
        best
    }

    /// Energy that no start explains: that of noise, and what the arrays' errors leave.
    fn unexplained(&self, content: &Content, noise: f32) -> f32 {
        let samples = content.samples as f32;
        // Mean and standard deviation of noise that is oversampled by 1 / occupancy.
        let mean = samples * noise;
        let spread = noise * libm::sqrtf(samples / self.template.occupancy());
        // One draw of the arrays' errors leaves up to twice the mean.
        mean + RESIDUAL_SIGMAS * spread + 2.0 * self.model.calibration_share() * content.energy
    }

    /// Whether errors of the arrays are so small that what a fit leaves beyond noise are paths. Where they are not, the fit that
    /// leaves least is the one that takes them for paths.
    pub(super) fn arrays_are_exact(&self, content: &Content, noise: f32) -> bool {
        self.model.calibration_share() * content.energy <= EXACT * content.samples as f32 * noise
    }

    /// Two paths of one delay by alternating projection, or one direction split in delay; a third stays where it was.
    fn other_start<const L: usize, const C: usize>(
        &self,
        window: &Window<C, JOINT>,
        start: &[Place; L],
        attempt: usize,
    ) -> [Place; L] {
        let Place { delay_taps, u } = start[0];
        let split = |middle: f32| {
            [-SPLIT_TAPS, SPLIT_TAPS].map(|late| Place {
                delay_taps: middle + late,
                u,
            })
        };
        let pair = if attempt == 0 {
            let snapshot = window.snapshot(self.template, delay_taps);
            let pair = self.grid.strongest_pair::<E, C>(self.model, &snapshot);
            pair.map(|u| Place { delay_taps, u })
        } else if attempt == 1 {
            split(delay_taps)
        } else {
            // Two of opposite phase show as two lobes on either side.
            split(0.5 * (delay_taps + start[L - 1].delay_taps))
        };
        core::array::from_fn(|i| pair.get(i).copied().unwrap_or(start[i]))
    }
}

/// Places of which the two that lie closest together are put apart, along the way from one to the other.
fn apart<const L: usize>(places: &[Place; L]) -> [Place; L] {
    let mut apart = *places;
    let mut least = f32::INFINITY;
    for i in 0..L {
        for k in i + 1..L {
            let (a, b) = (&places[i], &places[k]);
            let taps = 0.5 * (a.delay_taps - b.delay_taps);
            let u = (a.u - b.u) * 0.5;
            // In units of what it shall be.
            let distance = libm::hypotf(2.0 * taps / APART_TAPS, 2.0 * u.norm() / APART_RAD);
            if distance < least && distance > 0.0 {
                least = distance;
                let (middle_taps, middle) = (0.5 * (a.delay_taps + b.delay_taps), (a.u + b.u) * 0.5);
                let put = |way: f32| {
                    let u = middle + u * (way / distance);
                    Place {
                        delay_taps: middle_taps + taps * (way / distance),
                        u: u / u.norm(),
                    }
                };
                apart = *places;
                apart[i] = put(1.0);
                apart[k] = put(-1.0);
            }
        }
    }
    apart
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn at(delay_taps: f32, azimuth_rad: f32) -> Place {
        Place {
            delay_taps,
            u: Vector3::new(libm::cosf(azimuth_rad), libm::sinf(azimuth_rad), 0.0),
        }
    }

    #[test]
    fn the_two_closest_are_put_apart_the_way_they_differ() {
        let start = [at(0.0, 0.0), at(0.5, 0.3), at(0.502, 0.302)];
        let [first, second, third] = apart(&start);
        assert_eq!(first, start[0]);
        let taps = third.delay_taps - second.delay_taps;
        let angle = libm::atan2f(third.u.y, third.u.x) - libm::atan2f(second.u.y, second.u.x);
        assert!(taps > 0.0 && (angle / taps - 1.0).abs() < 1e-2, "{taps} {angle}");
        let distance = libm::hypotf(taps / APART_TAPS, angle / APART_RAD);
        assert!((distance - 1.0).abs() < 1e-2, "{distance}");
        assert!(
            (0.5 * (second.delay_taps + third.delay_taps) - 0.501).abs() < 1e-6,
            "about their middle"
        );
    }

    #[test]
    fn places_that_coincide_stay() {
        let start = [at(0.0, 0.0); 2];
        assert_eq!(apart(&start), start);
    }
}
