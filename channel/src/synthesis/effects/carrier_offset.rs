//! Offset of the UAV's oscillator against the GMT's: its carrier and its sampling clock come from the same crystal.

use super::Draw;
use super::slow::SlowProcess;
use crate::synthesis::Oscillators;

/// For how long the rate of the wander is alike, s.
const WANDER_S: f64 = 20.0;

/// The offset over a flight.
#[derive(Clone, Debug)]
pub(crate) struct CarrierOffset {
    constant_hz: f64,
    wander_hz: SlowProcess,
}

impl CarrierOffset {
    /// Draws a flight's offset; none when there is none.
    pub(crate) fn draw(set: &Oscillators, seed: u64) -> Option<Self> {
        if set.offset_rms_hz == 0.0 && set.wander_rms_hz_per_s == 0.0 {
            return None;
        }
        let mut stream = Draw::CarrierOffset.stream(seed);
        Some(Self {
            constant_hz: set.offset_rms_hz * stream.normal(),
            wander_hz: SlowProcess::smooth(set.wander_rms_hz_per_s * WANDER_S, WANDER_S, &mut stream),
        })
    }

    /// Offset of the received carrier at a time since switch-on, Hz: the GMT's frequency less the UAV's.
    pub(crate) fn at(&self, time_s: f64) -> f64 {
        self.constant_hz + self.wander_hz.at(time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_and_wander_have_their_rms() {
        let set = Oscillators {
            offset_rms_hz: 9e3,
            wander_rms_hz_per_s: 50.0,
            ..Oscillators::default()
        };
        let (draws, mut square, mut rate) = (2000, 0.0, 0.0);
        for seed in 0..draws {
            let offset = CarrierOffset::draw(&set, seed).expect("an offset");
            square += offset.constant_hz.powi(2) / draws as f64;
            rate += ((offset.at(60.1) - offset.at(60.0)) / 0.1).powi(2) / draws as f64;
        }
        assert!((square.sqrt() / 9e3 - 1.0).abs() < 0.06, "{}", square.sqrt());
        assert!((rate.sqrt() / 50.0 - 1.0).abs() < 0.06, "{}", rate.sqrt());
        assert!(CarrierOffset::draw(&Oscillators::default(), 1).is_none());
    }
}
