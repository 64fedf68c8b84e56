//! Gains of paths in samples that are made here.

use nalgebra::Vector3;

use super::*;
use crate::array::UavArrays;
use crate::geometry::Direction;
use crate::numeric::gather;
use crate::path::{Path, diagonal_covariance};
use crate::signal::Waveform;

type Samples = [Channel; 32];

fn path(c_tau_m: f32, towards: Vector3<f32>) -> EstimatedPath {
    EstimatedPath {
        path: Path {
            c_tau_m,
            aoa: Direction::from_vector(towards).expect("a direction"),
            aod: None,
            covariance: diagonal_covariance(0.01, 0.01),
        },
        beam: 3,
        snr_db: 20.0,
        energy: 1e-12,
        range_rate: None,
    }
}

struct Bench {
    waveform: Waveform,
    model: ArrayModel<4, 8>,
    template: Template,
    correlator: Correlator,
}

impl Bench {
    fn new() -> Self {
        let waveform = Waveform::default();
        Self {
            model: ArrayModel::new(&UavArrays::default(), &waveform),
            template: Template::new(&waveform),
            correlator: Correlator::new(&waveform),
            waveform,
        }
    }

    /// Samples in which each path has its gain, the same at all arrays, LSB; and noise.
    fn samples(
        &self,
        paths: &[(EstimatedPath, Complex<f32>)],
        mut noise: impl FnMut() -> Complex<f32>,
    ) -> Samples {
        let mut sums = [[Complex::new(0.0, 0.0); SAMPLES]; 32];
        for (path, gain) in paths {
            let u = path.path.aoa.vector();
            for (array, (step, lead)) in self.model.arrays().enumerate() {
                let delay = path.path.c_tau_m / self.model.metres_per_tap() - lead.dot(u);
                let wave: Vec<_, SAMPLES> = gather((0..SAMPLES).map(|n| {
                    let turned = |i: usize| {
                        let turns = self.waveform.offset(i) as f32 * (n as f32 - delay) / SAMPLES as f32;
                        self.waveform.symbol::<f32>(i) * phasor(turns - libm::roundf(turns))
                    };
                    (0..self.waveform.active).map(turned).sum::<Complex<f32>>() * *gain
                        / libm::sqrtf(self.waveform.active as f32)
                }));
                for (i, s) in steering::<8>(step.dot(u)).iter().enumerate() {
                    for (sum, x) in sums[8 * array + i].iter_mut().zip(&wave) {
                        *sum += s * x;
                    }
                }
            }
        }
        core::array::from_fn(|channel| {
            core::array::from_fn(|n| {
                let x = sums[channel][n] + noise();
                Iq::new(libm::roundf(x.re) as i16, libm::roundf(x.im) as i16)
            })
        })
    }

    fn gains(&self, samples: &Samples, paths: &[EstimatedPath], index: usize) -> Gains<4> {
        let reading = Reading {
            model: &self.model,
            template: &self.template,
            correlator: &self.correlator,
            samples,
        };
        reading.gains(index, paths, &mut Workspace::new())
    }
}

/// Turns from one pilot's gains to the other's.
fn turned(first: &Gains<4>, second: &Gains<4>) -> f32 {
    let pairs = first.gains.iter().zip(&second.gains);
    let sum: Complex<f32> = pairs.map(|(first, second)| second * first.conj()).sum();
    libm::atan2f(sum.im, sum.re) / core::f32::consts::TAU
}

#[test]
fn a_path_keeps_its_phase_beside_one_as_strong_that_turns_the_other_way() {
    let bench = Bench::new();
    let one = path(60.0, Vector3::new(0.7, 0.7, 0.1));
    for other in [
        path(60.3, Vector3::new(-0.5, 0.8, -0.3)),
        path(64.0, Vector3::new(0.72, 0.66, 0.2)),
    ] {
        let pilot = |turns: [f32; 2]| {
            let [own, beside] = turns.map(|turns| phasor(turns) * 300.0);
            let samples = bench.samples(&[(one, own), (other, beside)], || Complex::new(0.0, 0.0));
            bench.gains(&samples, &[one, other], 0)
        };
        let told = turned(&pilot([0.2, 0.45]), &pilot([0.3, 0.25]));
        assert!((told - 0.1).abs() < 0.01, "{told} turns beside {other:?}");
    }
}

#[test]
fn what_is_left_is_the_noise_of_a_gain() {
    let bench = Bench::new();
    let one = path(60.0, Vector3::new(0.7, 0.7, 0.1));
    let mut state = 7_u64;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ((state >> 40) as f32 + 0.5) / (1 << 24) as f32
    };
    let mut noise = || phasor(uniform()) * libm::sqrtf(-libm::logf(uniform())) * 400.0;
    let (mut claimed, mut true_sum) = (0.0, 0.0);
    let mut mean = [Complex::new(0.0, 0.0); 4];
    const DRAWS: usize = 40;
    let mut drawn: Vec<Gains<4>, DRAWS> = Vec::new();
    for _ in 0..DRAWS {
        let samples = bench.samples(&[(one, Complex::new(300.0, 0.0))], &mut noise);
        let gains = bench.gains(&samples, &[one], 0);
        claimed += gains.noise / DRAWS as f32;
        for (mean, gain) in mean.iter_mut().zip(&gains.gains) {
            *mean += gain / DRAWS as f32;
        }
        assert!(drawn.push(gains).is_ok());
    }
    for gains in &drawn {
        let off = gains
            .gains
            .iter()
            .zip(&mean)
            .map(|(gain, mean)| (gain - mean).norm_sqr());
        true_sum += off.sum::<f32>() / (4 * (DRAWS - 1)) as f32;
    }
    let ratio = claimed / true_sum;
    assert!((0.8..1.25).contains(&ratio), "claimed over true variance {ratio}");
}

#[test]
fn others_that_leave_nothing_cost_no_null() {
    let bench = Bench::new();
    let samples = [[Iq::ZERO; SAMPLES]; 32];
    let reading = Reading {
        model: &bench.model,
        template: &bench.template,
        correlator: &bench.correlator,
        samples: &samples,
    };
    let strong = path(60.0, Vector3::new(0.7, 0.7, 0.1));
    let weak = EstimatedPath {
        energy: 1e-16,
        ..path(61.0, Vector3::new(-0.7, 0.7, 0.1))
    };
    assert!(reading.disturbing(0, &strong, &[strong, weak]).is_empty());
    let both = [strong, weak];
    let disturbed = reading.disturbing(1, &weak, &both);
    assert!(disturbed.len() == 1 && disturbed[0].0 > 1e3, "{disturbed:?}");
    // The three that leave most, most first.
    let beside = |energy| EstimatedPath {
        energy,
        ..path(61.0, Vector3::new(-0.7, 0.7, 0.1))
    };
    let many = [1e-12, 2e-12, 9e-12, 3e-12, 1e-12, 4e-12].map(beside);
    let most = reading.disturbing(0, &many[0], &many);
    let energies: Vec<f32, 3> = gather(most.iter().map(|(_, other)| other.energy));
    assert_eq!(energies, [9e-12, 4e-12, 3e-12]);
    // All zeros: no gain, and no noise either.
    let gains = bench.gains(&samples, &[strong], 0);
    assert!(gains.noise == 0.0 && gains.power() == 0.0);
}
