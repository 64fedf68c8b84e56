//! What the gains of two pilots tell, and how sure that is.

use super::*;
use crate::array::UavArrays;
use crate::geometry::Direction;
use crate::path::{Path, diagonal_covariance};

/// Path of the sweep that is asked for.
const INDEX: usize = 2;

type Drawn = [Complex<f32>; 4];

/// Draws gains.
struct Draws(u64);

impl Draws {
    fn uniform(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 40) as f32 + 0.5) / (1 << 24) as f32
    }

    /// Noise of variance 1.
    fn noise(&mut self) -> Complex<f32> {
        let radius = libm::sqrtf(-libm::logf(self.uniform()));
        phasor(self.uniform()) * radius
    }
}

fn path() -> EstimatedPath {
    EstimatedPath {
        path: Path {
            c_tau_m: 40.0,
            aoa: Direction::from_vector(Vector3::new(0.6, 0.0, 0.8)).expect("a direction"),
            aod: None,
            covariance: diagonal_covariance(0.1, 0.01),
        },
        beam: 7,
        snr_db: 30.0,
        energy: 1e-12,
        range_rate: None,
    }
}

fn pilots() -> (Pilots<4, 9>, ArrayModel<4, 8>) {
    let waveform = Waveform::default();
    let model = ArrayModel::new(&UavArrays::default(), &waveform);
    (Pilots::new(&waveform), model)
}

/// Gains in standard deviations of their noise.
fn of(gains: Drawn) -> Gains<4> {
    Gains { gains, noise: 1.0 }
}

/// What two pilots tell of a body that does not turn.
fn told(first: Drawn, second: Drawn) -> Option<RangeRate> {
    let (mut pilots, model) = pilots();
    let path = (INDEX, &path());
    let still = Vector3::zeros();
    assert_eq!(pilots.heard(&model, false, path, of(first), &still), None);
    pilots.heard(&model, true, path, of(second), &still)
}

/// Gains of this power in all, with any phases.
fn drawn(power: f32, draws: &mut Draws) -> Drawn {
    core::array::from_fn(|_| phasor(draws.uniform()) * libm::sqrtf(0.25 * power))
}

#[test]
fn a_phase_that_falls_behind_is_a_path_that_grows() {
    let gains = drawn(1e4, &mut Draws(5));
    for turns in [-0.49_f32, -0.2, 0.0, 0.001, 0.3] {
        let rate = told(gains, gains.map(|gain| gain * phasor(turns))).expect("strong");
        assert!((rate.period_m_per_s - 2.5).abs() < 0.2, "{rate:?}");
        assert!(
            (rate.m_per_s + turns * rate.period_m_per_s).abs() < 1e-3,
            "{turns}: {rate:?}"
        );
    }
}

#[test]
fn half_a_pair_tells_nothing() {
    let (mut pilots, model) = pilots();
    let (path, gains, still) = (path(), drawn(1e4, &mut Draws(6)), Vector3::zeros());
    let heard = |pilots: &mut Pilots<4, 9>, again, index| {
        pilots.heard(&model, again, (index, &path), of(gains), &still)
    };
    assert_eq!(heard(&mut pilots, true, INDEX), None);
    assert_eq!(heard(&mut pilots, false, INDEX), None);
    assert_eq!(heard(&mut pilots, true, 3), None, "of another path");
    assert!(heard(&mut pilots, true, INDEX).is_some());
    assert_eq!(heard(&mut pilots, true, INDEX), None, "a first one is used once");
    assert_eq!(heard(&mut pilots, false, INDEX), None);
    pilots.clear();
    assert_eq!(heard(&mut pilots, true, INDEX), None, "of the sweep before");
    assert_eq!(heard(&mut pilots, false, 9), None, "there is no such path");
}

#[test]
fn pilots_of_zeros_tell_nothing() {
    let (gains, zeros) = (drawn(1e4, &mut Draws(7)), [Complex::new(0.0, 0.0); 4]);
    for (first, second) in [(zeros, zeros), (zeros, gains), (gains, zeros)] {
        assert_eq!(told(first, second), None);
    }
    let nothing = [Complex::new(f32::NAN, 0.0); 4];
    assert_eq!(told(gains, nothing), None);
    assert_eq!(told(gains.map(|gain| gain * 1e30), gains), None);
}

#[test]
fn arrays_that_contradict_one_another_tell_nothing() {
    let gains = drawn(1e6, &mut Draws(8));
    let mut turned = gains;
    turned[1] = -turned[1];
    assert_eq!(told(gains, turned), None);
    turned[2] = -turned[2];
    assert_eq!(told(gains, turned), None);
}

#[test]
fn a_second_pilot_that_leaves_more_is_as_loud_as_the_first() {
    // The path has moved since the sweep told where it is: the fit leaves a part of it, and the gains are what they were.
    let (mut pilots, model) = pilots();
    let (path, gains, still) = (path(), drawn(1e6, &mut Draws(11)), Vector3::zeros());
    assert_eq!(
        pilots.heard(&model, false, (INDEX, &path), of(gains), &still),
        None
    );
    let second = Gains { gains, noise: 30.0 };
    let rate = pilots
        .heard(&model, true, (INDEX, &path), second, &still)
        .expect("strong");
    assert!(
        rate.m_per_s.abs() < 1e-6 && rate.sigma_m_per_s < 0.013,
        "{rate:?}"
    );
}

#[test]
fn noise_passes_less_than_once_in_a_hundred_thousand() {
    let mut draws = Draws(9);
    let mut noise = || core::array::from_fn(|_| draws.noise());
    let passed = (0..400_000).filter(|_| told(noise(), noise()).is_some()).count();
    assert!(passed < 4, "{passed}");
}

#[test]
fn the_standard_deviation_is_that_of_the_errors() {
    let mut draws = Draws(10);
    for power in [40.0, 100.0, 400.0] {
        let (mut sum, mut count, draws_of_each) = (0.0, 0, 4000);
        for _ in 0..draws_of_each {
            let gains = drawn(power, &mut draws);
            let [first, second] = [0, 1].map(|_| gains.map(|gain| gain + draws.noise()));
            if let Some(rate) = told(first, second) {
                // Here is noise alone.
                let beside = rate.period_m_per_s * PHASE_RAD / core::f32::consts::TAU;
                let variance = rate.sigma_m_per_s * rate.sigma_m_per_s - beside * beside;
                sum += rate.m_per_s * rate.m_per_s / variance;
                count += 1;
            }
        }
        let ratio = libm::sqrtf(sum / count as f32);
        assert!(count * 100 > draws_of_each * 99, "{power}: {count}");
        assert!(
            (0.8..1.05).contains(&ratio),
            "{power}: errors are {ratio} of what is claimed"
        );
    }
}
