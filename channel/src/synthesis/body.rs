//! What the UAV's own body makes of the rays of a link in a sweep: further rays, and rotors that turn.

use std::borrow::Cow;

use nalgebra::Vector3;

use super::C64;
use super::effects::airframe;
use super::effects::rotors::{Crossing, Rotors};
use super::rays::Ray;
use super::simulator::Simulator;

/// The rays that reach the arrays.
pub(super) struct Body<'a, const ARRAYS: usize> {
    /// The rays of the link, then what the body makes of them.
    pub(super) rays: Cow<'a, [Ray]>,
    /// For each ray, the one of the link that it is made of.
    pub(super) origin: Vec<usize>,
    pub(super) rotors: Option<TurningRotors<'a, ARRAYS>>,
}

impl<'a, const ARRAYS: usize> Body<'a, ARRAYS> {
    /// The rays of a link at the arrays.
    pub(super) fn of<const ELEMENTS: usize, const CHANNELS: usize>(
        simulator: &'a Simulator<ARRAYS, ELEMENTS, CHANNELS>,
        rays: &'a [Ray],
    ) -> Self {
        let mut origin: Vec<usize> = (0..rays.len()).collect();
        let mut all = Cow::Borrowed(rays);
        if simulator.config.impairments.airframe.shadow {
            for (place, copy) in airframe::copies(rays) {
                all.to_mut().push(copy);
                origin.push(place);
            }
        }
        let rotors = simulator.rotors.as_ref().map(|rotors| {
            let first = all.len();
            let strongest = strongest(rays);
            if let Some(place) = strongest {
                let scattered = Rotors::scattered(&rays[place]);
                origin.extend(scattered.iter().map(|_| place));
                all.to_mut().extend(scattered);
            }
            let centres_m = simulator.arrays.centres_m();
            let crossing = |ray: &Ray| centres_m.map(|c| Rotors::crossing(ray.arrival.vector(), &c));
            TurningRotors {
                rotors,
                scattered: strongest.map(|place| (first, *rays[place].arrival.vector())),
                crossings: all.iter().map(crossing).collect(),
            }
        });
        Self {
            rays: all,
            origin,
            rotors,
        }
    }
}

/// The rotors in a sweep.
pub(super) struct TurningRotors<'a, const ARRAYS: usize> {
    rotors: &'a Rotors,
    /// Place of the first of the rays that they scatter, one a rotor, and where the wave of these comes from.
    scattered: Option<(usize, Vector3<f64>)>,
    /// Per ray and array, where a rotor is in the way.
    crossings: Vec<[Option<Crossing>; ARRAYS]>,
}

impl<const ARRAYS: usize> TurningRotors<'_, ARRAYS> {
    /// What their tips multiply the rays by that they scatter, at a time since switch-on; none without rays.
    pub(super) fn tips(&self, carrier_hz: f64, time_s: f64) -> Vec<C64> {
        let tips = |(_, from): &(usize, Vector3<f64>)| self.rotors.tips(from, carrier_hz, time_s).to_vec();
        self.scattered.as_ref().map_or_else(Vec::new, tips)
    }

    /// What the rotors multiply a ray by at an array, at a time since switch-on.
    pub(super) fn factor(&self, tips: &[C64], ray: usize, array: usize, time_s: f64) -> C64 {
        if let Some((first, _)) = self.scattered
            && let Some(tip) = ray.checked_sub(first).and_then(|k| tips.get(k))
        {
            return *tip;
        }
        let shade = self.crossings[ray][array]
            .as_ref()
            .map_or(1.0, |crossing| self.rotors.shade(crossing, time_s));
        C64::new(shade, 0.0)
    }
}

/// The ray of the greatest amplitude.
fn strongest(rays: &[Ray]) -> Option<usize> {
    let power = |place: &usize| rays[*place].amplitude.norm_sqr();
    (0..rays.len()).max_by(|a, b| power(a).total_cmp(&power(b)))
}
