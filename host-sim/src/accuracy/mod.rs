//! Accuracy of path estimation against its physical limit, case by case.
//!
//! Every case draws links, sends them through the channel and the front end of [`crate::channel`] (int16 samples, 12-bit
//! converter, free phase for every array and beam) and runs exactly the estimator that flies. Errors are divided by the
//! Cramer-Rao bound of the same draw ([`crate::crlb`]). Trials are independent streams of one seed: the figures do not
//! depend on the number of threads.

mod loss;
mod over_ground;
mod pairs;
mod range_rates;
mod report;
mod revisit;
mod scenes;
mod single;
mod twin;

pub use loss::{Loss, loss};
pub use over_ground::{Bounce, Corner, bounce, corner};
pub use pairs::{Pairs, pairs};
pub use range_rates::{RangeRates, range_rates};
pub use report::{Case, Report, Target};
pub use revisit::{Revisit, revisit};
pub use scenes::{Departures, Scenes, departures, scenes};
pub use single::{Detection, FalseAlarms, Single, detection, false_alarms, single};
pub use twin::{Fitted, Twin};

use cslam_core::array::Codebook;
use cslam_core::geometry::{Body, Direction, Gmt, Vector3};
use cslam_core::paths::{ElementErrors, EstimatedPath, EstimatorConfig, PathEstimator};

pub use crate::estimate::Mode;

use crate::channel::{ChannelConfig, FrontEndConfig, Impairments, Instant, Ray, Simulator, Sweep};
use crate::crlb::Arrival;
use crate::estimate;
use crate::random::Stream;

/// A path to be estimated.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// Speed of light times delay, m.
    pub c_tau_m: f64,
    /// Angle of arrival.
    pub aoa: Direction<Body, f64>,
    /// Angle of departure.
    pub aod: Direction<Gmt, f64>,
    /// SNR per active subcarrier at an element of gain one, in the beam that favours the path most, dB.
    pub snr_db: f64,
    /// Phase, rad.
    pub phase_rad: f64,
}

impl Truth {
    /// As the bound takes it.
    pub fn arrival(&self) -> Arrival {
        Arrival {
            c_tau_m: self.c_tau_m,
            aoa: self.aoa,
            snr: libm::exp10(self.snr_db / 10.0),
            phase_rad: self.phase_rad,
        }
    }
}

/// Transmitter, channel and front end of the cases: no impairment but free array phases, noise and converter.
pub struct Range {
    simulator: Simulator,
    codebook: Codebook<f64>,
}

impl Range {
    /// A range that sends only `beams` (all when empty).
    pub fn new(beams: &[u16], seed: u64) -> Self {
        Self::with_bits(beams, seed, 12)
    }

    /// The same with a converter of other width, bits. Noise and array phases of a seed stay the same.
    pub fn with_bits(beams: &[u16], seed: u64, adc_bits: u8) -> Self {
        let beams_in_all = Codebook::<f64>::default().len() as u16;
        let dropped = |beam: &u16| !beams.is_empty() && !beams.contains(beam);
        let impairments = Impairments {
            free_array_phase: true,
            dropped_beams: (0..beams_in_all).filter(dropped).collect(),
            ..Impairments::none()
        };
        let front_end = FrontEndConfig {
            adc_bits,
            ..FrontEndConfig::default()
        };
        let config = ChannelConfig {
            front_end,
            impairments,
            ..ChannelConfig::default()
        };
        Self::over(config, seed)
    }

    /// A range over any channel.
    pub fn over(config: ChannelConfig, seed: u64) -> Self {
        Self {
            simulator: Simulator::new(config, seed),
            codebook: Codebook::default(),
        }
    }

    /// Beam that sends most towards a direction, and the magnitude of its field.
    pub fn best_beam(&self, aod: &Direction<Gmt, f64>) -> (u16, f64) {
        (0..self.codebook.len())
            .map(|m| (m as u16, self.codebook.field(m, aod).norm_sqr().sqrt()))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0, 0.0))
    }

    /// The codebook.
    pub fn codebook(&self) -> &Codebook<f64> {
        &self.codebook
    }

    /// Direction at which a beam looks.
    pub fn aim(&self, beam: u16) -> Direction<Gmt, f64> {
        let beam = self
            .codebook
            .beam(usize::from(beam))
            .expect("beam of the codebook");
        Direction::from_vector(beam.direction()).expect("unit")
    }

    /// Sends a sweep over the paths. `index` chooses the noise.
    pub fn hear(&self, truths: &[Truth], index: u32) -> Sweep {
        let rays: Vec<Ray> = truths.iter().map(|truth| self.ray(truth)).collect();
        self.simulator.sweep_rays(&rays, &Instant::at_rest(), index)
    }

    /// Sends a sweep over the paths, estimates, and gives the paths found. `index` chooses the noise.
    pub fn sweep(
        &self,
        truths: &[Truth],
        index: u32,
        estimator: &mut dyn PathEstimator<32, 9>,
    ) -> Vec<EstimatedPath> {
        let mut sweep = self.hear(truths, index);
        for block in sweep.strongest_first() {
            estimator.push_beam(block.view());
        }
        estimator.finish().to_vec()
    }

    /// The same for paths with frequency shifts, Hz, and after it the pilots of a beam.
    fn sweep_with_pilots(
        &self,
        shifted: &[(Truth, f64)],
        index: u32,
        beam: u16,
        estimator: &mut dyn PathEstimator<32, 9>,
    ) -> Vec<EstimatedPath> {
        let ray = |(truth, doppler_hz): &(Truth, f64)| Ray {
            doppler_hz: *doppler_hz,
            ..self.ray(truth)
        };
        let rays: Vec<Ray> = shifted.iter().map(ray).collect();
        let mut sweep = self.simulator.sweep_rays(&rays, &Instant::at_rest(), index);
        for block in sweep.strongest_first() {
            estimator.push_beam(block.view());
        }
        let mut paths = estimator.finish();
        let mut pilots = self
            .simulator
            .pilots_of_rays(&rays, &Instant::at_rest(), index, [beam].into_iter());
        for block in &mut pilots.blocks {
            estimator.push_pilot(block.view(), &Vector3::zeros(), &mut paths);
        }
        paths.to_vec()
    }

    fn ray(&self, truth: &Truth) -> Ray {
        // A waveform of mean power one has 512/416 on each active subcarrier, noise has its variance on all.
        let noise = self.simulator.noise_power_w() * 416.0 / 512.0;
        let (_, field) = self.best_beam(&truth.aod);
        let amplitude =
            (libm::exp10(truth.snr_db / 10.0) * noise).sqrt() / (field * self.simulator.signal_amplitude());
        Ray {
            amplitude: cslam_core::array::phasor(truth.phase_rad) * amplitude,
            across: nalgebra::Complex::ZERO,
            delay_s: truth.c_tau_m / cslam_core::constants::SPEED_OF_LIGHT_M_PER_S,
            arrival: truth.aoa,
            departure: truth.aod,
            doppler_hz: 0.0,
        }
    }
}

/// An estimator of a mode, default configuration.
pub fn estimator(mode: Mode) -> Box<dyn PathEstimator<32, 9>> {
    // The arrays of the range have no error.
    let config = EstimatorConfig {
        element_errors: ElementErrors::Known(0.0),
        ..EstimatorConfig::single_sweeps()
    };
    estimate::estimator(mode, &config)
}

/// A direction uniform over the sphere between two elevations.
pub(crate) fn direction<F: cslam_core::geometry::Frame>(
    stream: &mut Stream,
    elevation_deg: std::ops::Range<f64>,
) -> Direction<F, f64> {
    let [low, high] = [elevation_deg.start, elevation_deg.end].map(|deg| libm::sin(deg.to_radians()));
    let z = low + (high - low) * stream.uniform();
    let azimuth = std::f64::consts::TAU * (stream.uniform() - 0.5);
    Direction::from_zenith_azimuth(libm::acos(z), azimuth).expect("finite")
}

/// Error of an estimate: c tau in m, along the truth's two tangents in rad.
pub(crate) fn error(path: &EstimatedPath, truth: &Truth) -> [f64; 3] {
    let u = path.path.aoa.vector().cast::<f64>();
    error_of(f64::from(path.path.c_tau_m), &u, truth)
}

/// Error of a length in m and a direction, as [`error`].
pub(crate) fn error_of(c_tau_m: f64, u: &Vector3<f64>, truth: &Truth) -> [f64; 3] {
    let (e1, e2) = truth.aoa.tangents();
    [c_tau_m - truth.c_tau_m, e1.dot(u), e2.dot(u)]
}

/// Angle between an estimate's arrival and the truth's, rad.
pub(crate) fn angle_rad(path: &EstimatedPath, truth: &Truth) -> f64 {
    let u = path.path.aoa.vector().cast::<f64>();
    libm::atan2(u.cross(truth.aoa.vector()).norm(), u.dot(truth.aoa.vector()))
}
