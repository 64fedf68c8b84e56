//! Which beams are looked at: their power, against the noise that earlier sweeps have shown.
//!
//! Noise is the same in all beams of a sweep, and the power of a block of thousands of samples is known to better than a percent, without any
//! transform. So it tells two things. A beam whose power is the noise's and no more holds no path above what its power could hide;
//! where the sweep's strongest path is far over that, the beam is passed over. And a beam that shows nothing over the noise is
//! quiet: it may hide a path that only a transform finds, 20 dB under the noise of a sample. Quiet beams take turns: a path
//! that hides in one is found within [`TURNS`] sweeps, and a sweep in which nothing is heard costs a third. Beams come strongest
//! first: where none has shown a path yet, one that stands out by less than [`SILENT_SIGMAS`] is most likely noise, and waits for its turn.
//!
//! The noise is learned over whole sweeps before it is used, from the least power of any block. Where signals reach all beams (indoors) that is
//! no noise; the noise of the taps between the paths, which only a transform shows, says so and is taken instead.
//!
//! The learned noise is the least of many sweeps: it never passes over a path. Whether a beam is quiet is asked against the noise of the sweep before, where
//! that is more: the converter's part of the noise goes with the gain, and so with the place, by a few percent, and a beam that is wrongly
//! quiet loses no more than two of three turns.

/// Sweeps in which every quiet beam has its turn.
/// Capacity: work of a sweep.
pub(super) const TURNS: u16 = 3;
/// Standard deviations above the noise up to which a beam is quiet.
/// Derived: one beam of noise in forty is beyond.
const QUIET_SIGMAS: f64 = 2.0;
/// The same as long as the sweep has shown no path, where all beams stand under this rule.
/// Derived: of noise alone one sweep of 72 beams in 400 opens one out of turn.
const SILENT_SIGMAS: f64 = 4.0;
/// Standard deviations by which the power of a beam with a path at the floor may fall short of its mean.
/// Derived: one such beam in 740 falls short by more.
const SHORT_SIGMAS: f64 = 3.0;
/// Standard deviations by which the least of 72 equal powers lies under their mean.
/// Derived: the median of that order statistic. Of the 24 that are transformed in a sweep of noise it would be 1.95.
const LEAST_SIGMAS: f64 = 2.4;
/// Standard deviation of a median, in units of that of a mean.
/// Given: `sqrt(pi / 2)`.
const MEDIAN: f64 = 1.253_314;
/// What the least power may exceed the noise of the taps by.
/// Derived: twice what that is known to.
const SIGNAL_EVERYWHERE: f64 = 1.05;
/// Growth that a sweep allows: a noise that was learned too low, or that rises as the front end warms up, is caught up with by 0.1 % a second.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const GROWTH: f64 = 1.000_5;

/// The noise, and what this sweep adds to it. Powers are those of [`super::Measured::mean_power`].
#[derive(Clone, Debug)]
pub(super) struct Gate {
    /// Relative standard deviation of a block's power.
    spread: f64,
    /// The same of the noise that the taps of a beam show.
    spread_shown: f64,
    /// Mean power of a block of noise, learned.
    noise: Option<f64>,
    /// The same as the last sweep showed it.
    recent: f64,
    /// Least power of a block of this sweep, how many they are, and least noise that a transform showed.
    least: f64,
    beams: u16,
    shown: f64,
    /// Whose turn it is.
    turn: u16,
}

impl Gate {
    /// A gate that knows nothing, for blocks of so many samples, and of so many taps, over all channels.
    pub(super) fn new(samples: usize, taps: usize) -> Self {
        Self {
            spread: 1.0 / libm::sqrt(samples as f64),
            spread_shown: MEDIAN / libm::sqrt(taps as f64),
            noise: None,
            recent: 0.0,
            least: f64::INFINITY,
            beams: 0,
            shown: f64::INFINITY,
            turn: 0,
        }
    }

    /// Whether a beam of this power is worth a look for paths that add `floor` or more to it; zero as long as no path is known.
    pub(super) fn opens(&self, beam: u16, power: f64, floor: f64) -> bool {
        if power < floor {
            return false;
        }
        let Some(noise) = self.noise else { return true };
        let short = SHORT_SIGMAS * self.spread * libm::sqrt(noise * (noise + 2.0 * floor));
        let sigmas = if floor > 0.0 { QUIET_SIGMAS } else { SILENT_SIGMAS };
        let is_quiet = power < noise.max(self.recent) * (1.0 + sigmas * self.spread);
        let has_turn = beam % TURNS == self.turn;
        power >= noise + floor - short && (has_turn || !is_quiet)
    }

    /// Takes the power of a block.
    pub(super) fn measured(&mut self, power: f64) {
        // A block of zeros is none.
        if power > 0.0 {
            self.least = self.least.min(power);
        }
        self.beams = self.beams.saturating_add(1);
    }

    /// Takes the noise of the taps of a beam, as the mean power of a block of such noise.
    pub(super) fn shown(&mut self, noise: f64) {
        if noise > 0.0 {
            self.shown = self.shown.min(noise);
        }
    }

    /// Learns from a sweep of at most `beams` beams, which is over. One that lacks half of them teaches nothing.
    pub(super) fn end_sweep(&mut self, beams: usize) {
        let noise = self.least / (1.0 - LEAST_SIGMAS * self.spread);
        let shown = self.shown / (1.0 - LEAST_SIGMAS * self.spread_shown);
        let noise = if noise > SIGNAL_EVERYWHERE * shown {
            shown
        } else {
            noise
        };
        if usize::from(self.beams) * 2 >= beams && noise.is_finite() {
            self.noise = Some(self.noise.map_or(noise, |before| noise.min(before * GROWTH)));
            self.recent = noise;
        }
        (self.least, self.beams, self.shown) = (f64::INFINITY, 0, f64::INFINITY);
        self.turn = (self.turn + 1) % TURNS;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples and taps of a block.
    const BLOCK: usize = 16_384;
    const TAPS: usize = 13_312;

    /// Noise of one as the taps of a beam show it: to 1.09 %, the least of 72 2.4 of these under it.
    fn shown(beam: i32) -> f64 {
        1.0 + 0.0109 * 0.1 * f64::from(beam % 49 - 24)
    }

    /// A gate after a sweep of noise of power one, with this power in all beams beside it.
    fn learned(everywhere: f64) -> Gate {
        let mut gate = Gate::new(BLOCK, TAPS);
        for beam in 0..72 {
            gate.measured(1.0 + everywhere + 0.005 * f64::from(beam % 9 - 3));
            gate.shown(shown(beam));
        }
        gate.end_sweep(72);
        gate
    }

    #[test]
    fn before_it_knows_the_noise_it_asks_for_the_floor_alone() {
        let gate = Gate::new(BLOCK, TAPS);
        assert!((0..72).all(|beam| gate.opens(beam, 1e-9, 0.0)));
        assert!(!gate.opens(0, 0.5, 0.6) && gate.opens(0, 0.7, 0.6));
    }

    #[test]
    fn quiet_beams_take_turns_and_all_of_them_within_three_sweeps() {
        let mut gate = learned(0.0);
        let mut looked = [0; 72];
        for _ in 0..TURNS {
            for (beam, looked) in (0..).zip(&mut looked) {
                *looked += u32::from(gate.opens(beam, 1.0, 0.0));
                gate.measured(1.0 + 0.005 * (f64::from(beam % 9) - 3.0));
            }
            gate.end_sweep(72);
        }
        assert_eq!(looked, [1; 72]);
        assert!((0..72).all(|beam| gate.opens(beam, 1.04, 0.0)), "these are loud");
    }

    #[test]
    fn a_beam_three_deviations_over_the_noise_waits_for_its_turn_until_the_sweep_has_shown_a_path() {
        let gate = learned(0.0);
        let power = 1.0 + 3.0 / 128.0;
        let opened = |floor| (0..72).filter(|beam| gate.opens(*beam, power, floor)).count();
        assert_eq!([opened(0.0), opened(1e-3)], [24, 72]);
    }

    #[test]
    fn where_the_noise_is_more_than_it_was_beams_are_quiet_from_the_second_sweep_on() {
        let mut gate = learned(0.0);
        let mut opened = |power: f64| {
            let count = (0..72).filter(|beam| gate.opens(*beam, power, 0.0)).count();
            for beam in 0..72 {
                gate.measured(power + 0.005 * f64::from(beam % 9 - 3));
            }
            gate.shown(power);
            gate.end_sweep(72);
            count
        };
        assert_eq!([1.04, 1.04, 1.04, 1.08].map(&mut opened), [72, 24, 24, 72]);
        // And as fast where it is less again.
        assert_eq!([1.0, 1.0].map(&mut opened), [24, 24]);
    }

    #[test]
    fn a_floor_over_the_noise_closes_beams_that_cannot_reach_it() {
        let gate = learned(0.0);
        let opened = |power: f64| (0..72).filter(|beam| gate.opens(*beam, power, 0.1)).count();
        assert_eq!([opened(1.03), opened(1.09), opened(1.2)], [0, 72, 72]);
    }

    #[test]
    fn signals_in_all_beams_are_not_taken_for_noise() {
        let noise = |everywhere| learned(everywhere).noise.expect("learned");
        assert!((noise(0.0) - 1.0).abs() < 0.02, "{}", noise(0.0));
        assert!((noise(3.0) - 1.0).abs() < 0.02, "{}", noise(3.0));
    }

    #[test]
    fn the_least_of_many_medians_is_not_the_noise() {
        // The taps of 72 beams show noise of one, each to a percent; the blocks have 4 % more than that, which is no signal.
        let mut gate = learned(0.0);
        for beam in 0..72 {
            gate.measured(1.04 + 0.005 * f64::from(beam % 9 - 3));
            gate.shown(shown(beam));
        }
        gate.end_sweep(72);
        assert!((gate.recent - 1.04).abs() < 0.01, "{}", gate.recent);
        let opened = (0..72).filter(|beam| gate.opens(*beam, 1.04, 0.0)).count();
        assert_eq!(opened, 24);
    }

    #[test]
    fn a_jammer_leaves_nothing_behind_and_a_warm_front_end_is_followed() {
        let mut gate = learned(0.0);
        let sweeps = |gate: &mut Gate, power: f64, count: usize| {
            for _ in 0..count {
                (0..72).for_each(|_| gate.measured(power));
                gate.shown(power);
                gate.end_sweep(72);
            }
            gate.noise.expect("learned")
        };
        assert!(sweeps(&mut gate, 100.0, 20) < 1.02);
        assert!(sweeps(&mut gate, 1.03, 60) > 1.02);
        // What was lost on the way, or came as zeros, teaches nothing.
        (0..20).for_each(|_| gate.measured(1e-6));
        gate.end_sweep(72);
        assert!(sweeps(&mut gate, 0.0, 1) > 1.02);
    }
}
