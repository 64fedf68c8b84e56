//! Two paths of a joint fit that are four: what two walls reflect, and that once more off the ground.
//!
//! A low UAV hears each wall twice, centimetres and a few degrees apart, and two walls at one distance as four paths in a tap or two. A
//! beam that hears them weakly shows a pair, which is the best that its noise allows. One that hears them well is to find the others one
//! after the other, each where those before leave most; but what four paths leave beside three shows nowhere near the fourth, and
//! a fit that begins there ends with members of opposite gains, each many times as strong as what they explain together. Where
//! the ground makes the difference it is known which way two paths of one wall lie apart: one above and earlier, one below and later.
//! From there the fit of four goes straight to where they are.

use super::beam::Search;
use super::fit::{Fit, Place};
use super::group::{is_sound, without};
use super::meter::Meter;
use super::starts::TRIAL_STEPS;
use super::window::{Content, JOINT, Window};
use nalgebra::Vector3;

/// How far from the one that was taken for both the two are started: upwards in body axes, rad, and in delay. The fit finds how far they
/// are; this is right for a UAV some metres up and a wall some tens of metres away.
const ABOVE_RAD: f32 = 0.03;
const EARLIER_TAPS: f32 = 0.05;
/// Two walls that may show as one pair are nearer than this in delay, taps, and further apart than this sideways, rad.
const NEAR_TAPS: f32 = 1.0;
const ACROSS_RAD: f32 = 0.05;
/// A trial that leaves more than so many times what noise does is not followed.
const PROMISING: f32 = 4.0;
/// Steps in which three of the four are given the chance to explain as much.
const NEEDED_STEPS: usize = 2;
/// Errors of the arrays must leave less than this share of what noise does where a pair is split: four paths may pass for anything.
const BY_ARRAYS: f32 = 0.001;

/// The two that a path may be: above and earlier, below and later.
fn halves(place: &Place) -> [Place; 2] {
    [1.0, -1.0].map(|way| {
        let u = place.u + Vector3::z() * (ABOVE_RAD * way);
        Place {
            delay_taps: place.delay_taps - EARLIER_TAPS * way,
            u: u / u.norm(),
        }
    })
}

/// Whether a pair may be two walls: in one tap, and not one above the other as a wall and its bounce are.
pub(super) fn are_two_walls([first, second]: &[Place; 2]) -> bool {
    let across = (first.u - second.u).xy().norm();
    (first.delay_taps - second.delay_taps).abs() < NEAR_TAPS && across > ACROSS_RAD
}

impl<const A: usize, const E: usize, T: Meter> Search<'_, A, E, T> {
    /// Whether errors of the arrays are so small that a pair may be split.
    pub(super) fn may_split(&self, content: &Content, noise: f32) -> bool {
        self.arrays_leave(BY_ARRAYS, content, noise)
    }

    /// Joint fit of four paths from a pair of which each is split in two. None unless the four leave no more than noise and each is
    /// worth it. Asked before, because it is the cheaper: [`are_two_walls`], [`Self::may_split`], and that there is room.
    pub(super) fn both_split<const C: usize>(
        &self,
        window: &Window<C, JOINT>,
        content: &Content,
        pair: &[Place; 2],
        noise: f32,
    ) -> Option<Fit<4, 12, A>> {
        let most = self.unexplained(content, noise);
        let [[a, b], [c, d]] = [halves(&pair[0]), halves(&pair[1])];
        let trial: Fit<4, 12, A> = self.fit(window, [a, b, c, d], noise, TRIAL_STEPS);
        if content.energy - trial.energy > PROMISING * most {
            return None;
        }
        let four: Fit<4, 12, A> = self.fit(window, trial.places, noise, self.joint_steps());
        let settled = content.energy - four.energy <= most && is_sound(&four);
        let needed = |idle: usize| {
            let three = self.explained(window, &without(&four.places, idle), NEEDED_STEPS, noise);
            four.energy - three > self.worth_of_member(noise, three)
        };
        (settled && (0..4).all(needed)).then_some(four)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_halves_lie_about_the_path_one_above_and_earlier() {
        let place = Place {
            delay_taps: 0.4,
            u: Vector3::new(0.6, 0.8, 0.0),
        };
        let [above, below] = halves(&place);
        assert!(
            above.u.z > 0.02 && above.delay_taps < place.delay_taps,
            "{above:?}"
        );
        assert!(
            (above.u + below.u - place.u * 2.0).norm() < 2e-3,
            "{above:?} {below:?}"
        );
        assert!((above.delay_taps + below.delay_taps - 0.8).abs() < 1e-6);
        assert!((above.u.norm() - 1.0).abs() < 1e-6 && (below.u.norm() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_wall_and_its_bounce_are_not_split() {
        let at = |delay_taps: f32, u: Vector3<f32>| Place {
            delay_taps,
            u: u.normalize(),
        };
        let wall = at(0.4, Vector3::new(1.0, 0.0, 0.0));
        assert!(!are_two_walls(&[wall, at(0.5, Vector3::new(1.0, 0.0, -0.06))]));
        assert!(are_two_walls(&[wall, at(0.5, Vector3::new(1.0, 0.2, 0.0))]));
        assert!(
            !are_two_walls(&[wall, at(1.6, Vector3::new(1.0, 0.2, 0.0))]),
            "a tap later"
        );
    }
}
