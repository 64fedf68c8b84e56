//! Phases and delays that follow the temperature of the UAV's electronics.

use super::slow::SlowProcess;
use crate::synthesis::Impairments;
use crate::synthesis::effects::Draw;

/// Warm-up: the last rise, K, and its time constant, s.
const RISE_K: f64 = 15.0;
const WARM_UP_S: f64 = 180.0;
/// What wind and load add: K rms, and for how long it is alike, s.
const RESTLESS_K: f64 = 0.5;
const RESTLESS_S: f64 = 60.0;

/// Sensitivities of a device, and its temperature over time.
#[derive(Clone, Debug)]
pub(crate) struct Drift<const ARRAYS: usize, const ELEMENTS: usize> {
    /// Phase of each element, rad/K.
    phase_rad_per_k: [[f64; ELEMENTS]; ARRAYS],
    /// Delay of each array, s/K.
    delay_s_per_k: [f64; ARRAYS],
    restless_k: SlowProcess,
}

impl<const ARRAYS: usize, const ELEMENTS: usize> Drift<ARRAYS, ELEMENTS> {
    /// Draws a device; none when it has no drift.
    pub(crate) fn draw(impairments: &Impairments, seed: u64) -> Option<Self> {
        let set = &impairments.uav_arrays;
        let (phase, delay) = (set.phase_drift_rms_deg_per_k, set.delay_drift_rms_ps_per_k);
        if phase == 0.0 && delay == 0.0 {
            return None;
        }
        let mut stream = Draw::Drift.stream(seed);
        let mut draw = |rms: f64| rms * stream.normal();
        Some(Self {
            phase_rad_per_k: std::array::from_fn(|_| std::array::from_fn(|_| draw(phase.to_radians()))),
            delay_s_per_k: std::array::from_fn(|_| draw(delay * 1e-12)),
            restless_k: SlowProcess::gauss_markov(
                RESTLESS_K,
                RESTLESS_S,
                &mut Draw::Temperature.stream(seed),
            ),
        })
    }

    /// Temperature over that of the calibration, K, at a time since switch-on.
    fn warmth_k(&self, time_s: f64) -> f64 {
        RISE_K * (1.0 - libm::exp(-time_s / WARM_UP_S)) + self.restless_k.at(time_s)
    }

    /// Phase of each element, rad, and delay of each array, s, at a time since switch-on.
    pub(crate) fn at(&self, time_s: f64) -> ([[f64; ELEMENTS]; ARRAYS], [f64; ARRAYS]) {
        let warmth_k = self.warmth_k(time_s);
        (
            self.phase_rad_per_k.map(|array| array.map(|c| c * warmth_k)),
            self.delay_s_per_k.map(|c| c * warmth_k),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthesis::UavArrayErrors;

    fn impairments(phase: f64, delay: f64) -> Impairments {
        Impairments {
            uav_arrays: UavArrayErrors {
                phase_drift_rms_deg_per_k: phase,
                delay_drift_rms_ps_per_k: delay,
                ..UavArrayErrors::default()
            },
            ..Impairments::none()
        }
    }

    #[test]
    fn the_device_warms_up_by_15_k_with_half_a_kelvin_of_restlessness() {
        let (draws, mut mean, mut square) = (2000, [0.0; 3], 0.0);
        for seed in 0..draws {
            let drift = Drift::<4, 8>::draw(&impairments(0.05, 0.0), seed).expect("drifts");
            for (mean, time_s) in mean.iter_mut().zip([0.0, 180.0, 3600.0]) {
                *mean += drift.warmth_k(time_s) / draws as f64;
            }
            square += drift.warmth_k(0.0).powi(2) / draws as f64;
        }
        let expected = [0.0, 15.0 * (1.0 - libm::exp(-1.0)), 15.0];
        for (mean, expected) in mean.iter().zip(expected) {
            assert!((mean - expected).abs() < 0.05, "{mean} {expected}");
        }
        assert!((square.sqrt() - 0.5).abs() < 0.03, "{}", square.sqrt());
    }

    #[test]
    fn phases_and_delays_are_their_sensitivity_times_the_temperature() {
        let (draws, mut square) = (200, [0.0; 2]);
        for seed in 0..draws {
            let drift = Drift::<4, 8>::draw(&impairments(0.05, 1.0), seed).expect("drifts");
            let warmth_k = drift.warmth_k(500.0);
            let (phases, delays) = drift.at(500.0);
            let sum = |x: &mut dyn Iterator<Item = f64>| x.map(|x| (x / warmth_k).powi(2)).sum::<f64>();
            square[0] += sum(&mut phases.iter().flatten().copied()) / (32.0 * draws as f64);
            square[1] += sum(&mut delays.iter().copied()) / (4.0 * draws as f64);
        }
        let [phase, delay] = [square[0].sqrt().to_degrees(), square[1].sqrt() * 1e12];
        assert!(
            (phase - 0.05).abs() < 0.002 && (delay - 1.0).abs() < 0.08,
            "{phase} {delay}"
        );
        assert!(Drift::<4, 8>::draw(&impairments(0.0, 0.0), 1).is_none());
    }
}
