//! What the front end says of the beams of a sweep, held against what they are. Path estimation does not rely on it: powers that are wrong,
//! or another order, only make a sweep dearer, and are counted.

use super::Counters;
use super::counters::count;
use crate::front_end::Powers;

/// Powers that differ by less are the same: rounding, and what a front end that measures before its decimation sees.
const SAME: f32 = 0.01;

/// The powers of the sweep in hand.
#[derive(Clone, Debug, Default)]
pub(super) struct Announced {
    powers: Option<Powers>,
    /// Power of the beam before.
    before: Option<f32>,
}

impl Announced {
    /// Another sweep begins. One that had beams, but no powers, is counted.
    pub(super) fn begin(&mut self, counters: &mut Counters) {
        if self.powers.is_none() && self.before.is_some() {
            count(&mut counters.powers_missing);
        }
        *self = Self::default();
    }

    /// Takes the powers of the sweep in hand.
    pub(super) fn take(&mut self, powers: &Powers) {
        self.powers = Some(*powers);
    }

    /// A beam has come, and is of this power.
    pub(super) fn heard(&mut self, beam: u16, power: f32, counters: &mut Counters) {
        let announced = self.powers.as_ref().and_then(|all| all.get(usize::from(beam)));
        // A number that is none agrees with nothing.
        let agrees = |told: f32| (told - power).abs() <= SAME * told.abs().max(power);
        if announced.is_some_and(|told| !agrees(*told)) {
            count(&mut counters.powers_contradicted);
        }
        if self.before.is_some_and(|before| power * (1.0 - SAME) > before) {
            count(&mut counters.beams_unordered);
        }
        self.before = Some(power);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front_end::BEAMS;

    /// Counters after a sweep of beams 0, 1, 2 of these powers, of which `told` was announced.
    fn heard(told: Option<f32>, powers: [f32; 3]) -> [u32; 3] {
        let (mut counters, mut announced) = (Counters::default(), Announced::default());
        announced.begin(&mut counters);
        if let Some(told) = told {
            announced.take(&[told; BEAMS as usize]);
        }
        for (beam, power) in (0..).zip(powers) {
            announced.heard(beam, power, &mut counters);
        }
        announced.begin(&mut counters);
        [
            counters.powers_missing,
            counters.powers_contradicted,
            counters.beams_unordered,
        ]
    }

    #[test]
    fn what_is_said_and_what_comes_are_compared() {
        assert_eq!(heard(Some(2.0), [2.0, 2.01, 1.99]), [0, 0, 0]);
        assert_eq!(heard(Some(2.0), [3.0, 2.0, 1.0]), [0, 2, 0]);
        assert_eq!(heard(Some(0.0), [3.0, 2.0, 0.0]), [0, 2, 0]);
        assert_eq!(heard(Some(f32::NAN), [3.0, 2.0, 1.0]), [0, 3, 0]);
        assert_eq!(heard(None, [1.0, 2.0, 3.0]), [1, 0, 2]);
    }
}
