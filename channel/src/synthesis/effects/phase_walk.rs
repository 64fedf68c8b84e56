//! White frequency noise of the crystals behind both ends: between a beam's two pilots the carrier's phase walks.
//!
//! Crystals of 38.4 MHz with -135 dBc/Hz at 1 kHz have -77 dBc/Hz at 30 GHz: white frequency noise of 0.06 Hz^2/Hz each, which walks by
//! `2 pi sqrt(0.06)` = 1.5 rad in a root second with both. What is faster than 8 kHz is [`super::phase_noise`], an oscillator's own.

use cslam_core::signal::Waveform;

use crate::random::Stream;

/// Phase in the first and in the second pilot of each beam since the first one of all, rad: one walk for all arrays, whose oscillators have one
/// reference.
pub(crate) fn pilots(rad_per_root_s: f64, beams: usize, period_s: f64, draws: &mut Stream) -> [Vec<f64>; 2] {
    let mut phase_rad = 0.0;
    let mut walk = |time_s: f64| {
        phase_rad += rad_per_root_s * time_s.max(0.0).sqrt() * draws.normal();
        phase_rad
    };
    let sent_s = period_s * beams as f64;
    let first = (0..beams).map(|_| walk(period_s)).collect();
    let _waiting = walk(Waveform::PILOT_INTERVAL_S - sent_s);
    [first, (0..beams).map(|_| walk(period_s)).collect()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_phase_walks_as_long_as_two_pilots_are_apart() {
        let (flights, mut apart, mut near) = (4000, 0.0, 0.0);
        for seed in 0..flights {
            let [first, second] = pilots(1.5, 72, 4.17e-6, &mut Stream::new(seed, 1));
            apart += (second[20] - first[20]).powi(2) / flights as f64;
            near += (first[30] - first[20]).powi(2) / flights as f64;
        }
        assert!((apart / (1.5 * 1.5 * 4e-3) - 1.0).abs() < 0.07, "{apart}");
        assert!((near / (1.5 * 1.5 * 41.7e-6) - 1.0).abs() < 0.07, "{near}");
    }
}
